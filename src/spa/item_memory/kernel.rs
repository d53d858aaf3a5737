//! The inner loops of the item memory: integer screening and single-precision dot products.
//!
//! The screening runs on AVX2 where the processor has it. That is the crate's only `unsafe` code;
//! written portably the same loop is four times slower, because compilers do not find the
//! multiply-add of unsigned and signed bytes.
#![allow(unsafe_code)]

use multiversion::multiversion;

use crate::sim::Real;

/// Codes in a line.
pub(super) const LINE: usize = 128;

/// Queries screened together against one row: their sums and one line of the row fit the sixteen
/// registers of AVX2.
pub(super) const GROUP: usize = 6;

/// A line of codes, aligned so that no load crosses a cache line.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(super) struct Line(pub [i8; LINE]);

impl Line {
    pub fn filled(value: i8) -> Self {
        Self([value; LINE])
    }
}

/// Integer dot products of every row of a block with a group of queries.
///
/// `codes` holds `lines` lines a row, values 1 to 127; each query has `lines` lines, values -31 to
/// 31. `visit` gets the row's place in the block and its sums.
pub(super) fn screen_block(
    codes: &[Line],
    lines: usize,
    queries: [&[Line]; GROUP],
    visit: &mut impl FnMut(usize, [i32; GROUP]),
) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the processor was just found to have AVX2, the only feature the function asks for.
        unsafe { avx2::screen_block(codes, lines, queries, visit) };
        return;
    }
    screen_block_portable(codes, lines, queries, visit);
}

fn screen_block_portable(
    codes: &[Line],
    lines: usize,
    queries: [&[Line]; GROUP],
    visit: &mut impl FnMut(usize, [i32; GROUP]),
) {
    for (at, row) in codes.chunks_exact(lines).enumerate() {
        let sums = queries.map(|query| {
            let pairs = row.iter().zip(query).flat_map(|(r, q)| r.0.iter().zip(&q.0));
            pairs.map(|(r, q)| i32::from(*r) * i32::from(*q)).sum()
        });
        visit(at, sums);
    }
}

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use std::arch::x86_64::*;

    use super::{GROUP, LINE, Line};

    #[target_feature(enable = "avx2")]
    fn quarter(line: &Line, at: usize) -> __m256i {
        let part: &[i8; 32] = &line.0.as_chunks::<32>().0[at];
        // SAFETY: `part` is a reference to 32 bytes, which is what an unaligned load reads.
        unsafe { _mm256_loadu_si256(part.as_ptr().cast()) }
    }

    #[target_feature(enable = "avx2")]
    fn total(sums: __m256i) -> i32 {
        let half = _mm_add_epi32(_mm256_castsi256_si128(sums), _mm256_extracti128_si256::<1>(sums));
        let pair = _mm_add_epi32(half, _mm_shuffle_epi32::<0b01_00_11_10>(half));
        _mm_cvtsi128_si32(_mm_add_epi32(pair, _mm_shuffle_epi32::<0b10_11_00_01>(pair)))
    }

    #[target_feature(enable = "avx2")]
    pub(super) fn screen_block(
        codes: &[Line],
        lines: usize,
        queries: [&[Line]; GROUP],
        visit: &mut impl FnMut(usize, [i32; GROUP]),
    ) {
        // Four products of pairs are added in 16 bits: at most 4 x 2 x 127 x 31 = 31496 < 32768.
        const { assert!(LINE == 128) };
        let ones = _mm256_set1_epi16(1);
        let queries = queries.map(|q| &q[..lines]);
        for (at, row) in codes.chunks_exact(lines).enumerate() {
            let mut sums = [_mm256_setzero_si256(); GROUP];
            for (j, line) in row.iter().enumerate() {
                let r = [quarter(line, 0), quarter(line, 1), quarter(line, 2), quarter(line, 3)];
                for (sum, query) in sums.iter_mut().zip(&queries) {
                    let q = &query[j];
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
            let mut out = [0; GROUP];
            for (total_of, sum) in out.iter_mut().zip(sums) {
                *total_of = total(sum);
            }
            visit(at, out);
        }
    }
}

/// Dot products of `query` with every row of `rows`, in single precision.
///
/// Thirty-two running sums without fused operations: the bits do not depend on the width of the
/// processor's registers.
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

    #[test]
    fn the_vector_form_agrees_with_the_portable_one_at_the_extremes() {
        let lines = 3;
        let mut codes = vec![Line::filled(127); 2 * lines];
        codes[1].0[5] = 1;
        let mut query = vec![Line::filled(31); lines];
        query[2] = Line::filled(-31);
        query[0].0[127] = 7;
        let mut queries: [&[Line]; GROUP] = [&[]; GROUP];
        queries.fill(&query);
        let (mut fast, mut slow) = (Vec::new(), Vec::new());
        screen_block(&codes, lines, queries, &mut |at, sums| fast.push((at, sums)));
        screen_block_portable(&codes, lines, queries, &mut |at, sums| slow.push((at, sums)));
        assert_eq!(fast.len(), 2);
        assert_ne!(fast[0].1[0], 0);
        assert_eq!(fast, slow);
    }
}
