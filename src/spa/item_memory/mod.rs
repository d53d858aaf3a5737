//! The item memory behind large cleanups: which of many stored vectors is most like a query?
//!
//! Every stored vector is kept twice: in single precision, and quantised to 7 bits. A query is
//! quantised to 6 bits, and integer dot products with the small copies (a quarter of the memory
//! traffic, four times the arithmetic per instruction) screen the items: an item is looked at in full
//! only if its screened similarity, plus a bound on the quantisation error, exceeds the best
//! exact similarity found so far. With `m` an item, `q` the query and hats for the quantised,
//! `q.m = q^.m^ + q^.(m - m^) + (q - q^).m`, so the error is at most
//! `|q^| |m - m^| + |q - q^| |m|` (Cauchy and Schwarz). The answer is therefore the exact one, always.
//!
//! Costs: a single query reads one byte a component and is bound by memory, several times faster than the
//! single-precision copy could be read; a batch is bound by integer multiply-adds, about three times
//! faster than a single-precision matrix product (`memory` in the benches).

mod kernel;

pub(crate) use kernel::dots;
use kernel::{GROUP, LINE, Line};

use super::error::VocabError;
use crate::sim::Real;

/// A stored vector found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Match {
    /// Its row.
    pub index: usize,
    /// Its dot product with the query, in single precision.
    pub similarity: Real,
}

/// Stored vectors that can be asked for the one most like a query.
///
/// ```
/// use symbolt::sim::Seed;
/// use symbolt::spa::{ItemMemory, random_pointer};
///
/// let rows: Vec<f32> = (0..1000).flat_map(|i| random_pointer(256, Seed::new(i))).collect();
/// let memory = ItemMemory::new(rows, 256)?;
/// let found = memory.best(&random_pointer(256, Seed::new(7))).expect("the memory is not empty");
/// assert_eq!(found.index, 7);
/// # Ok::<(), symbolt::spa::VocabError>(())
/// ```
#[derive(Debug, Clone)]
pub struct ItemMemory {
    dim: usize,
    /// Row-major, `len x dim`.
    rows: Vec<Real>,
    codes: Vec<Line>,
    /// Lines of code a row.
    lines: usize,
    facts: Vec<RowFacts>,
}

/// What the screening needs to know of a row.
#[derive(Debug, Clone, Copy)]
struct RowFacts {
    /// Value of one step of the code.
    step: Real,
    /// Length of the row.
    norm: Real,
    /// Length of what the code leaves out.
    rest: Real,
}

/// A query, quantised.
struct Screen {
    code: Vec<Line>,
    /// What the rows' offset adds to every integer dot product.
    bias: i32,
    step: Real,
    /// Length of the quantised query.
    norm: Real,
    /// Length of what the code leaves out.
    rest: Real,
    /// Allowance for rounding in the exact similarities.
    rounding: Real,
}

/// Greatest magnitude in a row's code.
const ROW_MOST: Real = 63.0;
/// Greatest magnitude in a query's code.
const QUERY_MOST: Real = 31.0;
/// Greatest dimension whose integer dot products fit 32 bits: 127 x 31 x 500,000 < 2^31.
const MOST_DIM: usize = 500_000;
/// What is added to a row's code so that it is never negative.
const OFFSET: i16 = 64;

impl ItemMemory {
    /// Stores `rows`, row-major with `dim` numbers each. Costs two passes over them and a quarter
    /// more memory.
    ///
    /// # Errors
    /// [`VocabError::BadVector`] if `dim` is zero, the rows are no whole number of vectors, or a
    /// value is not finite.
    pub fn new(rows: Vec<Real>, dim: usize) -> Result<Self, VocabError> {
        let bad = |reason: String| VocabError::BadVector { name: "item memory".into(), reason };
        if dim > MOST_DIM {
            return Err(bad(format!("{dim} dimensions; at most {MOST_DIM} can be screened")));
        }
        if dim == 0 || !rows.len().is_multiple_of(dim) {
            return Err(bad(format!(
                "{} numbers are no whole number of vectors of {dim} dimensions",
                rows.len()
            )));
        }
        if let Some(at) = rows.iter().position(|v| !v.is_finite()) {
            return Err(bad(format!(
                "component {} of vector {} is {}",
                at % dim,
                at / dim,
                rows[at]
            )));
        }
        let lines = dim.div_ceil(LINE);
        let mut codes = vec![Line::filled(OFFSET as i8); rows.len() / dim * lines];
        let mut facts = Vec::with_capacity(rows.len() / dim);
        for (row, code) in rows.chunks_exact(dim).zip(codes.chunks_exact_mut(lines)) {
            let quantised = quantise(row, ROW_MOST, |at, value| {
                code[at / LINE].0[at % LINE] = (value + OFFSET) as i8;
            });
            facts.push(RowFacts { step: quantised.step, norm: length(row), rest: quantised.rest });
        }
        Ok(Self { dim, rows, codes, lines, facts })
    }

    /// How many vectors are stored.
    pub fn len(&self) -> usize {
        self.facts.len()
    }

    /// Whether none is stored.
    pub fn is_empty(&self) -> bool {
        self.facts.is_empty()
    }

    /// Numbers a vector.
    pub fn dim(&self) -> usize {
        self.dim
    }

    /// The stored vector `index`.
    pub fn row(&self, index: usize) -> Option<&[Real]> {
        self.rows.get(index * self.dim..(index + 1) * self.dim)
    }

    /// The dot products of `query` with all stored vectors, into `out`.
    ///
    /// # Panics
    /// If `query` has not `dim` components or `out` not one number a stored vector.
    pub fn similarities_into(&self, query: &[Real], out: &mut [Real]) {
        assert!(query.len() == self.dim && out.len() == self.len(), "lengths fit the memory");
        dots(&self.rows, query, out);
    }

    /// The stored vector with the greatest dot product with `query`, of equal ones the first.
    /// `None` if nothing is stored or a component is not finite.
    ///
    /// # Panics
    /// If `query` has not `dim` components.
    pub fn best(&self, query: &[Real]) -> Option<Match> {
        self.best_of(&[query]).pop().flatten()
    }

    /// [`best`](Self::best) for many queries, `dim` numbers each, several times faster than one by
    /// one.
    ///
    /// # Panics
    /// If `queries` is no whole number of vectors of `dim` components.
    pub fn best_batch(&self, queries: &[Real]) -> Vec<Option<Match>> {
        assert!(queries.len().is_multiple_of(self.dim), "queries are whole vectors");
        let queries: Vec<&[Real]> = queries.chunks_exact(self.dim).collect();
        self.best_of(&queries)
    }

    fn best_of(&self, queries: &[&[Real]]) -> Vec<Option<Match>> {
        /// Rows whose codes stay in the first-level cache while the queries pass over them.
        const BLOCK_BYTES: usize = 16 * 1024;
        let screens: Vec<Option<Screen>> = queries.iter().map(|q| self.screen(q)).collect();
        let mut best: Vec<Option<Match>> = vec![None; queries.len()];
        let block_rows = (BLOCK_BYTES / (self.lines * LINE)).max(1);
        let usable: Vec<usize> =
            (0..queries.len()).filter(|q| screens[*q].is_some() && !self.is_empty()).collect();
        for block in 0..self.len().div_ceil(block_rows) {
            let first = block * block_rows;
            let last = (first + block_rows).min(self.len());
            let codes = &self.codes[first * self.lines..last * self.lines];
            for group in usable.chunks(GROUP) {
                // A short group repeats its last query; the copies' results are not looked at.
                let pick = |i: usize| screens[group[i.min(group.len() - 1)]].as_ref();
                let mut lanes = Lanes::default();
                let mut packed: [&[Line]; GROUP] = [&[]; GROUP];
                for lane in 0..GROUP {
                    let Some(screen) = pick(lane) else { continue };
                    packed[lane] = &screen.code;
                    lanes.load(lane, screen, best[group[lane.min(group.len() - 1)]]);
                }
                let mut visit = |at: usize, sums: [i32; GROUP]| {
                    let row = first + at;
                    let hits = lanes.exceed(&sums, &self.facts[row]);
                    if hits != [false; GROUP] {
                        for (lane, query) in group.iter().enumerate() {
                            if hits[lane] {
                                let found = self.look(row, queries[*query]);
                                if best[*query].is_none_or(|b| found.similarity > b.similarity) {
                                    best[*query] = Some(found);
                                    lanes.best[lane] = found.similarity;
                                }
                            }
                        }
                    }
                };
                kernel::screen_block(codes, self.lines, packed, &mut visit);
            }
        }
        best
    }

    /// Every stored vector whose dot product with `query` is at least `level`, in order of rows.
    ///
    /// # Panics
    /// If `query` has not `dim` components.
    pub fn above(&self, query: &[Real], level: Real) -> Vec<Match> {
        let mut found = Vec::new();
        let Some(screen) = self.screen(query) else { return found };
        let mut lanes = Lanes::default();
        lanes.load(0, &screen, Some(Match { index: 0, similarity: level }));
        let mut packed: [&[Line]; GROUP] = [&[]; GROUP];
        packed.fill(&screen.code);
        kernel::screen_block(&self.codes, self.lines, packed, &mut |row, sums| {
            if lanes.exceed(&sums, &self.facts[row])[0] {
                let exact = self.look(row, query);
                if exact.similarity >= level {
                    found.push(exact);
                }
            }
        });
        found
    }

    fn look(&self, row: usize, query: &[Real]) -> Match {
        let mut similarity = [0.0];
        dots(&self.rows[row * self.dim..(row + 1) * self.dim], query, &mut similarity);
        Match { index: row, similarity: similarity[0] }
    }

    /// Quantises a query; `None` if a component is not finite.
    fn screen(&self, query: &[Real]) -> Option<Screen> {
        assert!(query.len() == self.dim, "a query has as many components as the memory");
        if query.iter().any(|v| !v.is_finite()) {
            return None;
        }
        let mut code = vec![Line::filled(0); self.lines];
        let mut sum = 0i32;
        let quantised = quantise(query, QUERY_MOST, |at, value| {
            code[at / LINE].0[at % LINE] = value as i8;
            sum += i32::from(value);
        });
        let full = length(query);
        Some(Screen {
            code,
            bias: i32::from(OFFSET) * sum,
            step: quantised.step,
            norm: full + quantised.rest,
            rest: quantised.rest,
            // Rounding of the exact products: 32 running sums of D / 32 terms each, then their sum.
            rounding: full * ((self.dim / 32 + 40) as Real) * 2.0 * Real::EPSILON,
        })
    }
}

/// What the screening of one group of queries keeps at hand, one lane a query.
#[derive(Default)]
struct Lanes {
    bias: [i32; GROUP],
    step: [Real; GROUP],
    norm: [Real; GROUP],
    rest: [Real; GROUP],
    best: [Real; GROUP],
}

impl Lanes {
    fn load(&mut self, lane: usize, screen: &Screen, best: Option<Match>) {
        self.bias[lane] = screen.bias;
        self.step[lane] = screen.step;
        self.norm[lane] = screen.norm;
        self.rest[lane] = screen.rest + screen.rounding;
        self.best[lane] = best.map_or(Real::NEG_INFINITY, |b| b.similarity);
    }

    /// For which queries the row may be at least as good as the best so far.
    #[inline]
    fn exceed(&self, sums: &[i32; GROUP], row: &RowFacts) -> [bool; GROUP] {
        let mut hits = [false; GROUP];
        for lane in 0..GROUP {
            let screened = (sums[lane] - self.bias[lane]) as Real * (self.step[lane] * row.step);
            let bound = self.norm[lane] * row.rest + self.rest[lane] * row.norm;
            hits[lane] = screened + bound * 1.001 >= self.best[lane];
        }
        hits
    }
}

struct Quantised {
    step: Real,
    rest: Real,
}

/// Rounds `values` to whole steps of at most `most` in magnitude.
fn quantise(values: &[Real], most: Real, mut put: impl FnMut(usize, i16)) -> Quantised {
    let peak = values.iter().fold(0.0, |peak: Real, v| peak.max(v.abs()));
    let step = if peak > 0.0 { (peak / most).max(Real::MIN_POSITIVE) } else { 1.0 };
    let mut rest = 0.0;
    for (at, value) in values.iter().enumerate() {
        let code = (value / step).round().clamp(-most, most);
        put(at, code as i16);
        let left = f64::from(*value) - f64::from(code) * f64::from(step);
        rest += left * left;
    }
    Quantised { step, rest: rest.sqrt() as Real * 1.000_001 }
}

fn length(values: &[Real]) -> Real {
    values.iter().map(|v| f64::from(*v) * f64::from(*v)).sum::<f64>().sqrt() as Real
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::Seed;
    use crate::spa::random_pointer;

    fn memory(items: u64, dim: usize) -> ItemMemory {
        let rows = (0..items).flat_map(|i| random_pointer(dim, Seed::new(i))).collect();
        match ItemMemory::new(rows, dim) {
            Ok(memory) => memory,
            Err(error) => panic!("{error}"),
        }
    }

    fn brute_force(memory: &ItemMemory, query: &[Real]) -> Option<usize> {
        let mut all = vec![0.0; memory.len()];
        memory.similarities_into(query, &mut all);
        (0..all.len()).max_by(|a, b| all[*a].total_cmp(&all[*b]).then(b.cmp(a)))
    }

    #[test]
    fn the_screened_answer_is_the_exact_one() {
        let mut checked = 0;
        for (items, dim) in [(1, 2), (7, 3), (500, 64), (999, 127), (400, 128), (300, 257)] {
            let memory = memory(items, dim);
            let mut queries = Vec::new();
            for i in 0..50 {
                // Nonsense, noisy items, huge and tiny ones.
                let noise = random_pointer(dim, Seed::new(90_000 + i));
                let item = memory.row(i as usize % memory.len()).unwrap_or(&noise);
                let scale = [1.0, 1e-20, 1e15][i as usize % 3];
                let mix = [0.0, 0.5, 3.0][i as usize / 17];
                queries.extend(item.iter().zip(&noise).map(|(x, n)| scale * (mix * x + n)));
            }
            let batch = memory.best_batch(&queries);
            for (query, found) in queries.chunks_exact(dim).zip(&batch) {
                let single = memory.best(query);
                assert_eq!(single, *found);
                assert_eq!(found.map(|f| f.index), brute_force(&memory, query));
                checked += 1;
            }
        }
        assert_eq!(checked, 300);
    }

    #[test]
    fn of_equal_items_the_first_is_found() {
        let one = random_pointer(100, Seed::new(1));
        let other = random_pointer(100, Seed::new(2));
        let rows = [&other[..], &one[..], &one[..]].concat();
        let memory = ItemMemory::new(rows, 100);
        assert_eq!(memory.map(|m| m.best(&one).map(|f| f.index)), Ok(Some(1)));
    }

    #[test]
    fn all_items_above_a_level_are_found() {
        let memory = memory(400, 96);
        let query = random_pointer(96, Seed::new(77));
        let mut all = vec![0.0; 400];
        memory.similarities_into(&query, &mut all);
        let expected: Vec<usize> = (0..400).filter(|i| all[*i] >= 0.1).collect();
        let found: Vec<usize> = memory.above(&query, 0.1).iter().map(|m| m.index).collect();
        assert!(expected.len() > 10, "{}", expected.len());
        assert_eq!(found, expected);
    }

    #[test]
    fn a_query_that_is_no_number_finds_nothing() {
        let memory = memory(10, 16);
        let mut query = random_pointer(16, Seed::new(1));
        query[3] = Real::NAN;
        assert_eq!(memory.best(&query), None);
        assert!(ItemMemory::new(query, 16).is_err());
        assert!(ItemMemory::new(vec![0.0; 5], 2).is_err());
        assert_eq!(ItemMemory::new(Vec::new(), 2).map(|m| m.best(&[1.0, 0.0])), Ok(None));
    }

    #[test]
    fn zero_vectors_are_harmless() {
        let memory = ItemMemory::new(vec![0.0; 12], 4);
        assert_eq!(
            memory.map(|m| m.best(&[0.0; 4])),
            Ok(Some(Match { index: 0, similarity: 0.0 }))
        );
    }
}
