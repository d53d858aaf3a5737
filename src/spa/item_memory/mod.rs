//! The item memory behind large cleanups: finds the stored vector most similar to a query.
//!
//! # Method
//!
//! The memory keeps every vector (item) twice: in single precision, and quantised to 89 steps. A search quantises the
//! query to 93 steps and screens all items with integer dot products. The quantised items take a quarter of the
//! memory, and one instruction does four times the arithmetic. The exact similarity of an item is computed only if the
//! item can still be the best: its screened similarity plus a bound on the quantisation error must reach the best
//! exact similarity so far.
//!
//! Let `m` be an item, `q` the query, and `m^` and `q^` their quantised forms. Then
//! `q.m = q^.m^ + q^.(m - m^) + (q - q^).m`, so the quantisation error is at most
//! `|q^| |m - m^| + |q - q^| |m|` (Cauchy-Schwarz inequality). The search therefore always finds the exact answer.
//!
//! # Cost
//!
//! Memory traffic limits the speed of a single query. The query reads one byte per component, and takes a quarter to a
//! third of the time of reading the single-precision copy. Integer multiply-adds limit the speed of a batch of
//! queries. A batch is twice as fast as a single-precision matrix product (bench `memory`).

mod kernel;

pub(crate) use kernel::dots;
use kernel::{GROUP, Hit, LINE, Line, OFFSET, QUERY_MAX, ROW_MAX, RowFacts, Screening};

use super::algebra::norm;
use super::error::{VocabError, check_rows};
use crate::sim::Real;

/// A stored vector that a search found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Match {
    /// Index of the vector.
    pub index: usize,
    /// Dot product of the vector with the query, in single precision.
    pub similarity: Real,
}

/// A store of vectors that finds the one most similar to a query, by the dot product.
///
/// A search screens quantised copies of all vectors with integer arithmetic. It computes the exact similarity only of
/// vectors that can still be the best, so its answer is always exact. A single query takes a quarter to a third of the
/// time of reading all vectors in single precision. In a batch, each query is several times faster still.
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
    /// Number of lines of code per row.
    lines: usize,
    facts: Vec<RowFacts>,
}

/// A quantised query.
struct Screen {
    code: Vec<Line>,
    /// Part of every integer dot product that comes from the offset of the rows.
    bias: i32,
    step: Real,
    /// Upper bound on the norm of the quantised query.
    norm: Real,
    /// Norm of the quantisation error.
    rest: Real,
    /// Allowance for rounding in the exact similarities.
    rounding: Real,
}

/// Greatest number of dimensions for which integer dot products fit 32 bits: 89 x 46 x 500,000 < 2^31.
const MAX_DIM: usize = 500_000;

impl ItemMemory {
    /// Stores `rows`, a row-major matrix with `dim` numbers per vector (1 to 500,000). `rows` may be empty.
    ///
    /// Makes two passes over the rows. The quantised copy takes a quarter of the memory of the rows.
    ///
    /// # Errors
    /// [`VocabError::BadVector`] if `dim` is out of range, `rows` is not a whole number of vectors, or a component is
    /// not finite.
    pub fn new(rows: Vec<Real>, dim: usize) -> Result<Self, VocabError> {
        if dim > MAX_DIM {
            let reason = format!("{dim} dimensions per vector; expected 1 to {MAX_DIM}");
            return Err(VocabError::BadVector { name: "item memory".into(), reason });
        }
        check_rows("item memory", "vector", &rows, dim)?;
        let lines = dim.div_ceil(LINE);
        let mut codes = vec![Line::filled(OFFSET as i8); rows.len() / dim * lines];
        let mut facts = Vec::with_capacity(rows.len() / dim);
        for (row, code) in rows.chunks_exact(dim).zip(codes.chunks_exact_mut(lines)) {
            let quantised = quantise(row, Real::from(ROW_MAX), |at, value| {
                code[at / LINE].0[at % LINE] = (value + OFFSET) as i8;
            });
            facts.push(RowFacts { step: quantised.step, norm: norm(row), rest: quantised.rest });
        }
        Ok(Self { dim, rows, codes, lines, facts })
    }

    /// Returns the number of stored vectors.
    pub fn len(&self) -> usize {
        self.facts.len()
    }

    /// Returns whether the memory is empty.
    pub fn is_empty(&self) -> bool {
        self.facts.is_empty()
    }

    /// Returns the number of components of a vector.
    pub fn dim(&self) -> usize {
        self.dim
    }

    /// Returns stored vector number `index`, counted from 0, or `None` if there are fewer vectors.
    pub fn row(&self, index: usize) -> Option<&[Real]> {
        self.rows.get(index * self.dim..(index + 1) * self.dim)
    }

    /// Writes the dot products of `query` with all stored vectors to `out`, without screening. Does not allocate.
    ///
    /// # Panics
    /// If `query` does not have `dim` components, or `out` does not have one number per stored vector.
    pub fn similarities_into(&self, query: &[Real], out: &mut [Real]) {
        assert!(
            query.len() == self.dim && out.len() == self.len(),
            "expected a query of {} components and room for {} similarities",
            self.dim,
            self.len()
        );
        dots(&self.rows, query, out);
    }

    /// Finds the stored vector with the greatest dot product with `query`. Of several equal vectors it finds the
    /// first.
    ///
    /// Returns `None` if the memory is empty or a component of `query` is not finite. Costs O(len x dim) byte
    /// operations and a few exact dot products. Allocates.
    ///
    /// # Panics
    /// If `query` does not have `dim` components.
    pub fn best(&self, query: &[Real]) -> Option<Match> {
        self.search::<1>(&[query]).pop().flatten()
    }

    /// Finds the [`best`](Self::best) stored vector for each of many queries, several times faster than one call per
    /// query.
    ///
    /// `queries` is row-major, with `dim` numbers per query. The result has one entry per query.
    ///
    /// # Panics
    /// If `queries` is not a whole number of vectors of `dim` components.
    pub fn best_batch(&self, queries: &[Real]) -> Vec<Option<Match>> {
        assert!(
            queries.len().is_multiple_of(self.dim),
            "expected whole queries of {} components",
            self.dim
        );
        let queries: Vec<&[Real]> = queries.chunks_exact(self.dim).collect();
        self.search::<GROUP>(&queries)
    }

    /// Finds the best row for each query, screening `Q` queries at a time.
    fn search<const Q: usize>(&self, queries: &[&[Real]]) -> Vec<Option<Match>> {
        /// Size of a block of codes, which stays in the first-level cache while all queries pass over it.
        const BLOCK_BYTES: usize = 16 * 1024;
        let screens: Vec<Option<Screen>> = queries.iter().map(|q| self.screen(q)).collect();
        let mut found: Vec<Search> = vec![Search::default(); queries.len()];
        let usable: Vec<usize> = (0..queries.len()).filter(|q| screens[*q].is_some()).collect();
        let mut groups: Vec<Group<'_, Q>> =
            usable.chunks(Q).map(|members| Group::new(members, &screens, self.lines)).collect();
        let block_rows = (BLOCK_BYTES / (self.lines * LINE)).max(1);
        for first in (0..self.len()).step_by(block_rows) {
            let last = (first + block_rows).min(self.len());
            let codes = &self.codes[first * self.lines..last * self.lines];
            let facts = &self.facts[first..last];
            for Group { members, screening, codes: packed } in &mut groups {
                let mut visit = |hit: Hit<'_>| {
                    for (lane, query) in members.iter().enumerate() {
                        if hit.queries >> lane & 1 == 0 {
                            continue;
                        }
                        let (row, reach) = (first + hit.row, hit.reach[lane]);
                        let search = &mut found[*query];
                        if reach > search.highest {
                            // This row has the greatest upper bound so far. Its exact similarity rules out other rows.
                            search.highest = reach;
                            search.take(self.look(row, queries[*query]));
                            hit.screening.best[lane] =
                                search.best.map_or(Real::NEG_INFINITY, |b| b.similarity);
                        } else {
                            search.later.push((row, reach));
                        }
                    }
                };
                kernel::screen_block(codes, facts, packed, screening, &mut visit);
            }
        }
        for (search, query) in found.iter_mut().zip(queries) {
            for (row, reach) in std::mem::take(&mut search.later) {
                // By now a better row has ruled out most postponed rows.
                if search.best.is_none_or(|b| reach >= b.similarity) {
                    search.take(self.look(row, query));
                }
            }
        }
        found.into_iter().map(|s| s.best).collect()
    }

    fn look(&self, row: usize, query: &[Real]) -> Match {
        let mut similarity = [0.0];
        dots(&self.rows[row * self.dim..(row + 1) * self.dim], query, &mut similarity);
        Match { index: row, similarity: similarity[0] }
    }

    /// Quantises a query; `None` if a component is not finite.
    fn screen(&self, query: &[Real]) -> Option<Screen> {
        let (found, dim) = (query.len(), self.dim);
        assert!(found == dim, "the query has {found} components; expected {dim}");
        if query.iter().any(|v| !v.is_finite()) {
            return None;
        }
        let mut code = vec![Line::filled(0); self.lines];
        let mut sum = 0i32;
        let quantised = quantise(query, Real::from(QUERY_MAX), |at, value| {
            code[at / LINE].0[at % LINE] = value as i8;
            sum += i32::from(value);
        });
        let full = norm(query);
        Some(Screen {
            code,
            bias: i32::from(OFFSET) * sum,
            step: quantised.step,
            norm: full + quantised.rest,
            rest: quantised.rest,
            // Bounds the rounding of exact products: 32 running sums of D / 32 terms each, then their sum.
            rounding: full * ((self.dim / 32 + 40) as Real) * 2.0 * Real::EPSILON,
        })
    }
}

/// The search for one query's best item.
#[derive(Clone)]
struct Search {
    best: Option<Match>,
    /// Greatest upper bound so far.
    highest: Real,
    /// Postponed rows with their upper bounds.
    later: Vec<(usize, Real)>,
}

impl Default for Search {
    fn default() -> Self {
        Self { best: None, highest: Real::NEG_INFINITY, later: Vec::new() }
    }
}

impl Search {
    /// Takes a row if it is better than the best so far, or equal to it and earlier in the memory.
    fn take(&mut self, found: Match) {
        let better = self.best.is_none_or(|best| {
            found.similarity > best.similarity
                || (found.similarity == best.similarity && found.index < best.index)
        });
        if better {
            self.best = Some(found);
        }
    }
}

/// Queries that are screened together.
struct Group<'q, const Q: usize> {
    /// Indices of the queries.
    members: &'q [usize],
    screening: Screening,
    /// Codes of all queries, line by line.
    codes: Vec<[Line; Q]>,
}

impl<'q, const Q: usize> Group<'q, Q> {
    fn new(members: &'q [usize], screens: &[Option<Screen>], lines: usize) -> Self {
        let mut screening = Screening::default();
        let mut codes = vec![[Line::filled(0); Q]; lines];
        for (lane, screen) in members.iter().filter_map(|q| screens[*q].as_ref()).enumerate() {
            for (to, from) in codes.iter_mut().zip(&screen.code) {
                to[lane] = *from;
            }
            screening.bias[lane] = screen.bias;
            screening.step[lane] = screen.step;
            screening.norm[lane] = screen.norm;
            screening.rest[lane] = screen.rest + screen.rounding;
            screening.best[lane] = Real::NEG_INFINITY;
        }
        Self { members, screening, codes }
    }
}

struct Quantised {
    step: Real,
    rest: Real,
}

/// Quantises `values` to whole numbers of steps, at most `most` in magnitude. Calls `put` with each index and number.
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
