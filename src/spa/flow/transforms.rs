//! What operands can do besides the operators: scalar products, and fixed linear maps between kinds.

use std::ops::Range;

use super::expression::{Flow, IntoFlow, Level, Source};
use super::kinds::FlowKind;
use super::lower::{Lowerer, Sum};
use crate::sim::{Pointer, PointerRef, Real, Scalar, Space, Vector, VocabTag};
use crate::spa::algebra::LinearMap;
use crate::spa::modules::{Rows, Slice, Sparse, Spread};
use crate::spa::vocabulary::Vocabulary;

/// Greatest number of components that a slice can reach.
const MOST_COMPONENTS: usize = 1 << 24;

/// What operands can do besides the operators.
pub trait FlowExt: IntoFlow + Sized {
    /// Returns the scalar product with another pointer of the same vocabulary.
    fn dot<V: VocabTag>(self, other: impl IntoFlow<Kind = Pointer<V>>) -> Flow<Scalar>
    where
        Self: IntoFlow<Kind = Pointer<V>>,
    {
        let (a, b) = (self.into_flow(), other.into_flow());
        let text = format!("dot({}, {})", a.text, b.text);
        let leaves = a.leaves.times(&b.leaves);
        Flow::new(text, Level::Atom, (Vec::new(), leaves), move |cx, _| {
            let Some(space) = a.shape(cx.scope).or_else(|| b.shape(cx.scope)) else {
                cx.refuse("the scalar product of two constants; expected an output on one side");
                return Sum::zero();
            };
            let (a, b) = ((a.lower)(cx, &space), (b.lower)(cx, &space));
            cx.dot(&space, a, b)
        })
    }

    /// Returns the product of a matrix, given by its rows, with the value: one component per row. Each row has one number
    /// per component of the value; anything else is a fault when the graph is built.
    ///
    /// ```
    /// use symbolt::prelude::*;
    ///
    /// let mut graph = GraphBuilder::new();
    /// let position = graph.add("position", Constant::vector(&[1.0, 2.0]));
    /// let turned = graph.add("turned", Add::vector(2));
    /// graph.route(position.transform([[0.0, -1.0], [1.0, 0.0]]) >> &turned);
    /// let height = graph.add("height", Add::scalar());
    /// graph.route(0.5 * position.component(1) >> &height);
    /// let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), SimDuration::from_millis(1))?;
    /// assert_eq!(*sim.value(&turned.output), [-2.0, 1.0]);
    /// assert_eq!(*sim.value(&height.output), [1.0]);
    /// # Ok::<(), symbolt::sim::SimError>(())
    /// ```
    fn transform(self, rows: impl IntoIterator<Item: AsRef<[Real]>>) -> Flow<Vector> {
        by_matrix(self.into_flow(), rows)
    }

    /// Returns the product of a sparse matrix of `rows` rows with the value. `entries` are row, column and weight, in any
    /// order; weights for the same place add up. Costs one multiplication per entry. A row or column beyond the matrix, or
    /// a weight that is not finite, is a fault when the graph is built.
    ///
    /// ```
    /// use symbolt::prelude::*;
    ///
    /// let mut graph = GraphBuilder::new();
    /// let pair = graph.add("pair", Constant::vector(&[1.0, 2.0]));
    /// let out = graph.add("out", Add::vector(3));
    /// graph.route(pair.transform_sparse(3, [(2, 0, 5.0), (0, 1, 0.5)]) >> &out);
    /// let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), SimDuration::from_millis(1))?;
    /// assert_eq!(*sim.value(&out.output), [1.0, 0.0, 5.0]);
    /// # Ok::<(), symbolt::sim::SimError>(())
    /// ```
    fn transform_sparse(
        self,
        rows: usize,
        entries: impl IntoIterator<Item = (usize, usize, Real)>,
    ) -> Flow<Vector> {
        by_sparse(self.into_flow(), rows, entries)
    }

    /// Returns a vector of `width` components that has the value's components from component `at` on, and zeros elsewhere:
    /// so a route reaches some components of an input. A value that does not fit is a fault when the graph is built.
    ///
    /// ```
    /// use symbolt::prelude::*;
    ///
    /// let mut graph = GraphBuilder::new();
    /// let (one, two) = (graph.add("one", Constant::scalar(1.0)), graph.add("two", Constant::scalar(2.0)));
    /// let both = graph.add("both", Add::vector(2));
    /// graph.route(one.embed(0, 2) >> &both);
    /// graph.route(two.embed(1, 2) >> &both);
    /// let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), SimDuration::from_millis(1))?;
    /// assert_eq!(*sim.value(&both.output), [1.0, 2.0]);
    /// # Ok::<(), symbolt::sim::SimError>(())
    /// ```
    fn embed(self, at: usize, width: usize) -> Flow<Vector> {
        embedded(self.into_flow(), at, width)
    }

    /// Returns the components in `range`. A range beyond the value, or an empty one, is a fault when the graph is built.
    fn slice(self, range: Range<usize>) -> Flow<Vector> {
        sliced(self.into_flow(), range)
    }

    /// Returns component number `index`, counted from 0. A component that the value does not have is a fault when the
    /// graph is built.
    fn component(self, index: usize) -> Flow<Scalar> {
        component_of(self.into_flow(), index)
    }

    /// Returns the same numbers as a pointer of `vocabulary`. Another number of dimensions is a fault when the graph is
    /// built.
    fn reinterpret<V: VocabTag>(self, vocabulary: &Vocabulary<V>) -> Flow<Pointer<V>> {
        as_pointer(self.into_flow(), vocabulary.space())
    }

    /// Returns the pointer translated into another vocabulary: the map of [`Vocabulary::translation`], fitted to the
    /// names that both have. If there are none, this is a fault when the graph is built.
    fn translate<V: VocabTag, W: VocabTag>(self, to: &Vocabulary<W>) -> Flow<Pointer<W>>
    where
        Self: IntoFlow<Kind = Pointer<V>>,
    {
        translated(self.into_flow(), to)
    }
}

impl<T: Chained> FlowExt for T {}

/// Operands that have [`FlowExt`]: all but outputs by value, so that a method leaves an output where it is.
#[doc(hidden)]
pub trait Chained: IntoFlow {}

impl Chained for Real {}
impl<const N: usize> Chained for [Real; N] {}
impl<V: VocabTag> Chained for &PointerRef<'_, V> {}

/// Makes the expression of a linear map of another expression. `map` gets the width of its input, and refuses a wrong
/// one with a reason.
fn mapped<A: FlowKind, B: FlowKind>(
    inner: Flow<A>,
    (text, name): (String, &'static str),
    shape: Option<B::Shape>,
    map: impl Fn(&A::Shape, &B::Shape) -> Result<Box<dyn LinearMap>, String> + 'static,
) -> Flow<B> {
    let sources = shape.into_iter().map(Source::Shape).collect();
    let leaves = inner.leaves.clone();
    Flow::new(text, Level::Atom, (sources, leaves), move |cx: &mut Lowerer<'_, '_>, to| {
        let Some(from) = inner.shape(cx.scope) else {
            cx.refuse("the map of a constant; expected an output");
            return Sum::zero();
        };
        let map = match map(&from, to) {
            Ok(map) => map,
            Err(reason) => {
                cx.refuse(&reason);
                return Sum::zero();
            }
        };
        let sum = (inner.lower)(cx, &from);
        let specs = (A::specs(&from).0, B::specs(to).1);
        let value = cx.one(&from, sum);
        Sum::output(&cx.linear(name, &value, specs, map))
    })
}

fn by_matrix<A: FlowKind>(
    inner: Flow<A>,
    rows: impl IntoIterator<Item: AsRef<[Real]>>,
) -> Flow<Vector> {
    let text = format!("transform({})", inner.text);
    let rows: Vec<Vec<Real>> = rows.into_iter().map(|row| row.as_ref().to_vec()).collect();
    mapped(inner, (text, "transform"), Some(rows.len()), move |from, _| {
        let width = A::width(from);
        if rows.is_empty() {
            return Err("the matrix has no rows; expected at least one".into());
        }
        if let Some((at, row)) = rows.iter().enumerate().find(|(_, row)| row.len() != width) {
            let columns = row.len();
            return Err(format!(
                "row {at} of the matrix has {columns} columns; expected {width}, as many as the value has components"
            ));
        }
        if let Some(wrong) = rows.iter().flatten().find(|value| !value.is_finite()) {
            return Err(format!("the matrix has the number {wrong}; expected finite numbers"));
        }
        Ok(Box::new(Rows { matrix: rows.concat(), dim: width }))
    })
}

fn by_sparse<A: FlowKind>(
    inner: Flow<A>,
    rows: usize,
    entries: impl IntoIterator<Item = (usize, usize, Real)>,
) -> Flow<Vector> {
    let text = format!("transform({})", inner.text);
    let entries: Vec<_> = entries.into_iter().collect();
    let shape = rows.clamp(1, MOST_COMPONENTS);
    mapped(inner, (text, "transform"), Some(shape), move |from, _| {
        let width = A::width(from);
        if !(1..=MOST_COMPONENTS).contains(&rows) {
            return Err(format!("{rows} rows; expected 1 to {MOST_COMPONENTS}"));
        }
        for (row, column, weight) in &entries {
            if *row >= rows || *column >= width {
                return Err(format!(
                    "a weight in row {row} and column {column}; expected rows below {rows} and columns below {width}"
                ));
            }
            if !weight.is_finite() {
                return Err(format!("the matrix has the number {weight}; expected finite numbers"));
            }
        }
        let weights: Vec<_> = entries.iter().map(|(row, column, w)| (*column, *row, *w)).collect();
        Ok(Box::new(Sparse::new(width, rows, &weights)))
    })
}

fn embedded<A: FlowKind>(inner: Flow<A>, at: usize, width: usize) -> Flow<Vector> {
    let text = format!("{} at {at}", inner.within(Level::Atom));
    let shape = width.clamp(1, MOST_COMPONENTS);
    mapped(inner, (text, "embed"), Some(shape), move |from, _| {
        let has = A::width(from);
        if width > MOST_COMPONENTS || at.checked_add(has).is_none_or(|end| end > width) {
            return Err(format!(
                "{has} components from component {at} on; expected them within 0..{width}"
            ));
        }
        let weights: Vec<_> = (0..has).map(|column| (column, at + column, 1.0)).collect();
        Ok(Box::new(Sparse::new(has, width, &weights)))
    })
}

fn sliced<A: FlowKind>(inner: Flow<A>, range: Range<usize>) -> Flow<Vector> {
    let Range { start, end } = range;
    let text = format!("{}[{start}..{end}]", inner.within(Level::Atom));
    // The width of a range that will be refused must not matter.
    let shape = if range.end <= MOST_COMPONENTS { range.len().max(1) } else { 1 };
    mapped(inner, (text, "slice"), Some(shape), move |from, _| {
        let width = A::width(from);
        if range.is_empty() || range.end > width {
            return Err(format!(
                "there are no components {start}..{end}; expected a range that is not empty, within 0..{width}"
            ));
        }
        Ok(Box::new(Slice { from: width, range: range.clone() }))
    })
}

fn component_of<A: FlowKind>(inner: Flow<A>, index: usize) -> Flow<Scalar> {
    let text = format!("{}[{index}]", inner.within(Level::Atom));
    mapped(inner, (text, "component"), None, move |from, ()| {
        let width = A::width(from);
        if index >= width {
            let last = width.saturating_sub(1);
            return Err(format!("there is no component {index}; expected 0 to {last}"));
        }
        Ok(Box::new(Slice { from: width, range: index..index + 1 }))
    })
}

fn as_pointer<A: FlowKind, V: VocabTag>(inner: Flow<A>, space: &Space<V>) -> Flow<Pointer<V>> {
    let text = format!("reinterpret({})", inner.text);
    mapped(inner, (text, "reinterpret"), Some(space.clone()), |from, to: &Space<V>| {
        let (has, wants) = (A::width(from), to.width());
        if has != wants {
            return Err(format!("a value of {has} components; expected {wants}, those of {to}"));
        }
        Ok(Box::new(Spread { from: has, to: wants, factor: 1.0 }))
    })
}

fn translated<V: VocabTag, W: VocabTag>(
    inner: Flow<Pointer<V>>,
    to: &Vocabulary<W>,
) -> Flow<Pointer<W>> {
    let text = format!("translate({})", inner.text);
    let own = to.clone();
    mapped(inner, (text, "translate"), Some(to.space().clone()), move |from, _| {
        own.translation_from(from).map_err(|error| error.to_string())
    })
}
