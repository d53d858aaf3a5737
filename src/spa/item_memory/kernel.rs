//! The inner loops of the item memory: integer screening and single-precision dot products.
//!
//! Screening uses AVX2 if the processor has it. This is the crate's only `unsafe` code. The portable loop is four times
//! slower, because compilers do not find the multiply-add of unsigned and signed bytes.
#![allow(unsafe_code)]

use multiversion::multiversion;

use crate::sim::Real;

/// Number of codes in a line.
pub(super) const LINE: usize = 128;

/// Number of queries screened together against one row. Their sums and one line of the row fit the sixteen registers
/// of AVX2, and their totals fit one register.
pub(super) const GROUP: usize = 8;

/// Greatest magnitude in a row's code.
///
/// `ROW_MAX` and [`QUERY_MAX`] are chosen together. Four sums of two products must fit 16 bits; among the pairs that
/// allow this, these have the least sum of quantisation errors.
pub(super) const ROW_MAX: i16 = 44;
/// Greatest magnitude in a query's code.
pub(super) const QUERY_MAX: i16 = 46;
/// Number added to a row's code, so that it is never negative.
pub(super) const OFFSET: i16 = 45;

/// A line of codes. The alignment keeps every load within one cache line.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(super) struct Line(pub [i8; LINE]);

impl Line {
    pub fn filled(value: i8) -> Self {
        Self([value; LINE])
    }
}

/// The properties of a row that screening needs.
#[derive(Debug, Clone, Copy)]
pub(super) struct RowFacts {
    /// Value of one step of the code.
    pub step: Real,
    /// Norm of the row.
    pub norm: Real,
    /// Norm of the quantisation error.
    pub rest: Real,
}

/// A group of queries under screening, one lane per query. Lanes without a query never hit.
#[derive(Debug, Clone, Copy)]
#[repr(align(32))]
pub(super) struct Screening {
    /// Part of the integer dot product that comes from the offset of the rows.
    pub bias: [i32; GROUP],
    /// Value of one step of the code.
    pub step: [Real; GROUP],
    /// Upper bound on the norm of the quantised query.
    pub norm: [Real; GROUP],
    /// Norm of the query's quantisation error, plus an allowance for rounding.
    pub rest: [Real; GROUP],
    /// Least similarity that a row must be able to reach to be a hit.
    pub best: [Real; GROUP],
}

impl Default for Screening {
    fn default() -> Self {
        Self {
            bias: [0; GROUP],
            step: [0.0; GROUP],
            norm: [0.0; GROUP],
            rest: [0.0; GROUP],
            best: [Real::INFINITY; GROUP],
        }
    }
}

/// A row that may be similar enough to at least one query of a group.
pub(super) struct Hit<'a> {
    /// Index of the row in the block.
    pub row: usize,
    /// Bit mask of the queries that the row hits.
    pub queries: u32,
    /// For each query, an upper bound on the row's similarity.
    pub reach: [Real; GROUP],
    /// The screening, so that a visitor can raise `best` for later rows.
    pub screening: &'a mut Screening,
}

/// Factor that covers rounding in the bound itself.
const BOUND_SLACK: Real = 1.001;

/// Screens every row of a block for `Q` queries, 1 or [`GROUP`].
///
/// `codes` holds `queries.len()` lines per row, with values from 1 to `ROW_MAX + OFFSET`. `queries` holds one entry
/// per line of a row: that line of every query, with magnitudes up to `QUERY_MAX`. `visit` gets every row whose
/// screened similarity plus its error bound reaches `screening.best`.
pub(super) fn screen_block<const Q: usize>(
    codes: &[Line],
    facts: &[RowFacts],
    queries: &[[Line; Q]],
    screening: &mut Screening,
    visit: &mut impl FnMut(Hit<'_>),
) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2, as just checked; the function needs no other feature.
        unsafe { avx2::screen_block(codes, facts, queries, screening, visit) };
        return;
    }
    screen_block_portable(codes, facts, queries, screening, visit);
}

fn screen_block_portable<const Q: usize>(
    codes: &[Line],
    facts: &[RowFacts],
    queries: &[[Line; Q]],
    screening: &mut Screening,
    visit: &mut impl FnMut(Hit<'_>),
) {
    for (at, (row, fact)) in codes.chunks_exact(queries.len()).zip(facts).enumerate() {
        let (mut hits, mut reach) = (0, [0.0; GROUP]);
        for lane in 0..Q {
            let pairs = row.iter().zip(queries).flat_map(|(r, q)| r.0.iter().zip(&q[lane].0));
            let sum: i32 = pairs.map(|(r, q)| i32::from(*r) * i32::from(*q)).sum();
            let s = &*screening;
            let screened = (sum - s.bias[lane]) as Real * (s.step[lane] * fact.step);
            let bound = s.norm[lane] * fact.rest + s.rest[lane] * fact.norm;
            reach[lane] = screened + bound * BOUND_SLACK;
            hits |= u32::from(reach[lane] >= s.best[lane]) << lane;
        }
        if hits != 0 {
            visit(Hit { row: at, queries: hits, reach, screening });
        }
    }
}

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use std::arch::x86_64::*;

    use super::{
        BOUND_SLACK, GROUP, Hit, LINE, Line, OFFSET, QUERY_MAX, ROW_MAX, RowFacts, Screening,
    };
    use crate::sim::Real;

    #[target_feature(enable = "avx2")]
    fn quarter(line: &Line, at: usize) -> __m256i {
        let part: &[i8; 32] = &line.0.as_chunks::<32>().0[at];
        // SAFETY: `part` refers to 32 bytes, as many as the unaligned load reads.
        unsafe { _mm256_loadu_si256(part.as_ptr().cast()) }
    }

    #[target_feature(enable = "avx2")]
    fn reals(lanes: &[Real; GROUP]) -> __m256 {
        // SAFETY: `lanes` refers to eight numbers, as many as the unaligned load reads.
        unsafe { _mm256_loadu_ps(lanes.as_ptr()) }
    }

    /// Returns the sum of each register, one per lane.
    #[target_feature(enable = "avx2")]
    fn totals<const Q: usize>(sums: [__m256i; Q]) -> __m256i {
        let zero = _mm256_setzero_si256();
        let sum = |i: usize| if i < Q { sums[i] } else { zero };
        let four = |i: usize| {
            let pairs = _mm256_hadd_epi32(sum(i), sum(i + 1));
            let fours = _mm256_hadd_epi32(pairs, _mm256_hadd_epi32(sum(i + 2), sum(i + 3)));
            let high = _mm256_extracti128_si256::<1>(fours);
            _mm_add_epi32(_mm256_castsi256_si128(fours), high)
        };
        _mm256_inserti128_si256::<1>(_mm256_castsi128_si256(four(0)), four(4))
    }

    #[target_feature(enable = "avx2")]
    pub(super) fn screen_block<const Q: usize>(
        codes: &[Line],
        facts: &[RowFacts],
        queries: &[[Line; Q]],
        screening: &mut Screening,
        visit: &mut impl FnMut(Hit<'_>),
    ) {
        // Four sums of two products must fit 16 bits.
        const {
            let most = 8 * (ROW_MAX + OFFSET) as i32 * QUERY_MAX as i32;
            assert!(LINE == 128 && most <= i16::MAX as i32);
        }
        let ones = _mm256_set1_epi16(1);
        // SAFETY: `bias` has eight 32-bit integers, as many as the unaligned load reads.
        let bias = unsafe { _mm256_loadu_si256(screening.bias.as_ptr().cast()) };
        let (step, norm) = (reals(&screening.step), reals(&screening.norm));
        let (rest, slack) = (reals(&screening.rest), _mm256_set1_ps(BOUND_SLACK));
        for (at, (row, fact)) in codes.chunks_exact(queries.len()).zip(facts).enumerate() {
            let mut sums = [_mm256_setzero_si256(); Q];
            for (line, query) in row.iter().zip(queries) {
                let r = [quarter(line, 0), quarter(line, 1), quarter(line, 2), quarter(line, 3)];
                for (sum, q) in sums.iter_mut().zip(query) {
                    let low = _mm256_add_epi16(
                        _mm256_maddubs_epi16(r[0], quarter(q, 0)),
                        _mm256_maddubs_epi16(r[1], quarter(q, 1)),
                    );
                    let high = _mm256_add_epi16(
                        _mm256_maddubs_epi16(r[2], quarter(q, 2)),
                        _mm256_maddubs_epi16(r[3], quarter(q, 3)),
                    );
                    let products = _mm256_madd_epi16(_mm256_add_epi16(low, high), ones);
                    *sum = _mm256_add_epi32(*sum, products);
                }
            }
            let steps = _mm256_mul_ps(step, _mm256_set1_ps(fact.step));
            let exact = _mm256_cvtepi32_ps(_mm256_sub_epi32(totals(sums), bias));
            let bound = _mm256_add_ps(
                _mm256_mul_ps(norm, _mm256_set1_ps(fact.rest)),
                _mm256_mul_ps(rest, _mm256_set1_ps(fact.norm)),
            );
            let reach = _mm256_add_ps(_mm256_mul_ps(exact, steps), _mm256_mul_ps(bound, slack));
            let hit = _mm256_cmp_ps::<_CMP_GE_OQ>(reach, reals(&screening.best));
            let hits = _mm256_movemask_ps(hit) as u32 & ((1 << Q) - 1);
            if hits != 0 {
                let mut lanes = [0.0; GROUP];
                // SAFETY: `lanes` has eight numbers, as many as the unaligned store writes.
                unsafe { _mm256_storeu_ps(lanes.as_mut_ptr(), reach) };
                visit(Hit { row: at, queries: hits, reach: lanes, screening });
            }
        }
    }
}

/// Writes the dot products of `query` with every row of `rows` to `out`, in single precision.
///
/// Thirty-two running sums without fused multiply-adds make the bits independent of the width of the processor's
/// registers.
#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1"))]
pub(crate) fn dots(rows: &[Real], query: &[Real], out: &mut [Real]) {
    const LANES: usize = 32;
    let (q_chunks, q_tail) = query.as_chunks::<LANES>();
    for (row, out) in rows.chunks_exact(query.len()).zip(out) {
        let (chunks, tail) = row.as_chunks::<LANES>();
        let mut sums = [0.0; LANES];
        for (r, q) in chunks.iter().zip(q_chunks) {
            for lane in 0..LANES {
                sums[lane] += r[lane] * q[lane];
            }
        }
        let rest: Real = tail.iter().zip(q_tail).map(|(r, q)| r * q).sum();
        *out = sums.iter().sum::<Real>() + rest;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compare<const Q: usize>(limit: Real) -> u32 {
        let (lines, most) = (3, (ROW_MAX + OFFSET) as i8);
        let mut codes = vec![Line::filled(most); 4 * lines];
        codes[1].0[5] = 1;
        for (i, code) in codes[2 * lines..].iter_mut().flat_map(|l| &mut l.0).enumerate() {
            *code = (i * 37 % most as usize + 1) as i8;
        }
        let facts: Vec<RowFacts> = (0..4)
            .map(|i| RowFacts { step: 0.5 + i as Real, norm: 2.0, rest: 0.25 * i as Real })
            .collect();
        let code = |query: usize, at: usize| match query {
            0 => QUERY_MAX as i8,
            1 => -QUERY_MAX as i8,
            _ => ((at * query) % 93) as i8 - 46,
        };
        let queries: Vec<[Line; Q]> = (0..lines)
            .map(|l| std::array::from_fn(|q| Line(std::array::from_fn(|i| code(q, l * LINE + i)))))
            .collect();
        let mut start = Screening { best: [limit; GROUP], ..Screening::default() };
        for lane in 0..GROUP {
            start.bias[lane] = lane as i32 * 1000 - 3000;
            start.step[lane] = 0.1 + lane as Real;
            start.norm[lane] = 1.0 + lane as Real;
            start.rest[lane] = 0.125;
        }
        let mut seen: [Vec<(usize, u32, Vec<u32>)>; 2] = [Vec::new(), Vec::new()];
        for (portable, seen) in seen.iter_mut().enumerate() {
            let mut screening = start;
            let mut visit = |hit: Hit<'_>| {
                hit.screening.best[0] += 1.0;
                seen.push((
                    hit.row,
                    hit.queries,
                    hit.reach[..Q].iter().map(|r| r.to_bits()).collect(),
                ));
            };
            if portable == 1 {
                screen_block_portable(&codes, &facts, &queries, &mut screening, &mut visit);
            } else {
                screen_block(&codes, &facts, &queries, &mut screening, &mut visit);
            }
        }
        assert_eq!(seen[0], seen[1], "{Q} {limit}");
        seen[0].iter().map(|(_, hits, _)| hits.count_ones()).sum()
    }

    #[test]
    fn the_vector_form_agrees_with_the_portable_one_at_the_extremes() {
        let (mut one, mut many) = (0, 0);
        for limit in [-1e6, -1e4, 0.0, 1e3, 1e4, 1e6] {
            one += compare::<1>(limit);
            many += compare::<GROUP>(limit);
        }
        assert!(one > 4 && one < 24 && many > 20 && many < 6 * 4 * GROUP as u32, "{one} {many}");
    }
}
