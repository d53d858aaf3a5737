//! Vocabularies: named pointers of one space, drawn once from a seed and then frozen.

use std::collections::HashMap;
use std::marker::PhantomData;
use std::sync::Arc;

use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

use super::algebra::{Algebra, Hrr, Workspace, dot, normalize};
use super::error::{VocabError, nearest_name};
use super::expr::{self, Expr};
use super::pointer::PointerValue;
use crate::sim::{AsPointer, PointerRef, Real, Seed, Space, VocabTag};

/// Greatest number of vectors drawn for one name. If none of them keeps the similarity ceiling, the ceiling counts as
/// unreachable.
const MAX_ATTEMPTS: u64 = 20_000;

/// Draws a random unit vector of `dim` components, uniformly on the sphere.
///
/// The components are independent normal numbers, scaled to norm 1. The result depends only on `dim` (any number)
/// and `seed`.
pub fn random_pointer(dim: usize, seed: Seed) -> Vec<Real> {
    draw_pointer(dim, &mut seed.rng())
}

/// Draws a random unit vector from `rng`: `dim` normal numbers in single precision, scaled to norm 1.
pub(crate) fn draw_pointer<R: Rng>(dim: usize, rng: &mut R) -> Vec<Real> {
    let mut vector: Vec<Real> = (0..dim).map(|_| rng.sample(StandardNormal)).collect();
    normalize(&mut vector);
    vector
}

enum Entry {
    Random,
    Unitary,
    Given(Vec<Real>),
    Defined(String),
}

/// Collects the names and settings of a [`Vocabulary`]; [`build`](VocabularyBuilder::build) then draws the pointers.
///
/// ```
/// use symbolt::sim::{Seed, VocabTag};
/// use symbolt::spa::{VocabularyBuilder, cosine};
///
/// struct Things;
/// impl VocabTag for Things { const NAME: &'static str = "things"; }
///
/// let vocabulary = VocabularyBuilder::<Things>::new(256, Seed::new(1))
///     .pointers(["NUT", "BOLT"])
///     .unitary("ROLE")
///     .define("FRAME", "ROLE * (NUT + 0.5 * BOLT)")
///     .build()?;
/// let back = vocabulary.parse("FRAME * ~ROLE")?;
/// assert!((cosine(&back, &vocabulary.parse("NUT + 0.5 * BOLT")?) - 1.0).abs() < 1e-4);
/// assert!(vocabulary.parse("NIT").is_err());
/// # Ok::<(), symbolt::spa::VocabError>(())
/// ```
pub struct VocabularyBuilder<V: VocabTag> {
    dim: usize,
    seed: Seed,
    algebra: Arc<dyn Algebra>,
    ceiling: Option<Real>,
    entries: Vec<(String, Entry)>,
    tag: PhantomData<fn() -> V>,
}

impl<V: VocabTag> VocabularyBuilder<V> {
    /// Starts a vocabulary of `dim` dimensions, with holographic reduced representations ([`Hrr`]) and a similarity
    /// ceiling of 0.1. [`build`](Self::build) checks `dim`.
    pub fn new(dim: usize, seed: Seed) -> Self {
        Self {
            dim,
            seed,
            algebra: Arc::new(Hrr),
            ceiling: Some(0.1),
            entries: Vec::new(),
            tag: PhantomData,
        }
    }

    /// Sets the algebra. The default is [`Hrr`].
    pub fn algebra(mut self, algebra: Arc<dyn Algebra>) -> Self {
        self.algebra = algebra;
        self
    }

    /// Sets the similarity ceiling (default 0.1): the greatest magnitude of the dot product between a random pointer
    /// and any pointer added before it. It must be above 0 and at most 1; [`build`](Self::build) checks it.
    pub fn max_similarity(mut self, ceiling: Real) -> Self {
        self.ceiling = Some(ceiling);
        self
    }

    /// Removes the similarity ceiling: the first vector drawn for a name is taken.
    pub fn any_similarity(mut self) -> Self {
        self.ceiling = None;
        self
    }

    /// Adds a random unit vector called `name`.
    ///
    /// A name is an upper-case letter followed by letters, digits and `_`. [`build`](Self::build) checks it.
    pub fn pointer(mut self, name: impl Into<String>) -> Self {
        self.entries.push((name.into(), Entry::Random));
        self
    }

    /// Adds a random unit vector for each name.
    pub fn pointers<N: Into<String>>(mut self, names: impl IntoIterator<Item = N>) -> Self {
        self.entries.extend(names.into_iter().map(|n| (n.into(), Entry::Random)));
        self
    }

    /// Adds a random unitary vector called `name`. Unbinding a unitary vector is exact, so it is a good role.
    pub fn unitary(mut self, name: impl Into<String>) -> Self {
        self.entries.push((name.into(), Entry::Unitary));
        self
    }

    /// Adds a given pointer unchanged. [`PointerRef::from_raw`] makes a pointer from numbers. [`build`](Self::build)
    /// checks that there is one finite number per dimension.
    ///
    /// ```
    /// # use symbolt::sim::{PointerRef, Seed, VocabTag};
    /// # use symbolt::spa::VocabularyBuilder;
    /// # struct Parts;
    /// # impl VocabTag for Parts { const NAME: &'static str = "parts"; }
    /// # struct Actions;
    /// # impl VocabTag for Actions { const NAME: &'static str = "actions"; }
    /// let parts = VocabularyBuilder::<Parts>::new(64, Seed::new(1)).pointer("NUT").build()?;
    /// let actions = VocabularyBuilder::<Actions>::new(64, Seed::new(1)).pointer("GRASP").build()?;
    /// let more = VocabularyBuilder::<Parts>::new(64, Seed::new(2))
    ///     .vector("X", &parts.get("NUT")?)
    ///     .vector("ZERO", &PointerRef::<Parts>::from_raw(&[0.0; 64]))
    ///     .build()?;
    /// assert_eq!(more.get("X")?.to_vec(), parts.get("NUT")?.to_vec());
    /// assert_eq!(actions.len(), 1);
    /// # Ok::<(), symbolt::spa::VocabError>(())
    /// ```
    ///
    /// A pointer of another vocabulary does not compile:
    ///
    /// ```compile_fail
    /// # use symbolt::sim::{PointerRef, Seed, VocabTag};
    /// # use symbolt::spa::VocabularyBuilder;
    /// # struct Parts;
    /// # impl VocabTag for Parts { const NAME: &'static str = "parts"; }
    /// # struct Actions;
    /// # impl VocabTag for Actions { const NAME: &'static str = "actions"; }
    /// let parts = VocabularyBuilder::<Parts>::new(64, Seed::new(1)).pointer("NUT").build()?;
    /// let actions = VocabularyBuilder::<Actions>::new(64, Seed::new(1)).pointer("GRASP").build()?;
    /// let more = VocabularyBuilder::<Parts>::new(64, Seed::new(2))
    ///     .vector("X", &actions.get("GRASP")?)
    ///     .vector("ZERO", &PointerRef::<Parts>::from_raw(&[0.0; 64]))
    ///     .build()?;
    /// # Ok::<(), symbolt::spa::VocabError>(())
    /// ```
    pub fn vector(mut self, name: impl Into<String>, value: &impl AsPointer<V>) -> Self {
        self.entries.push((name.into(), Entry::Given(value.as_pointer().to_vec())));
        self
    }

    /// Adds the value of an expression over the names added before, for example `ROLE * NUT`. The value is not
    /// normalised. [`build`](Self::build) checks the expression.
    pub fn define(mut self, name: impl Into<String>, expression: impl Into<String>) -> Self {
        self.entries.push((name.into(), Entry::Defined(expression.into())));
        self
    }

    /// Draws all pointers, in the order in which their names were added.
    ///
    /// The vectors drawn for a name depend on the seed, the tag of the vocabulary, the dimension and the name. `build`
    /// takes the first vector within the similarity ceiling, so the result also depends on the names added before.
    /// Costs O(names^2 D) for D dimensions, and many times that if the ceiling is tight.
    ///
    /// # Errors
    /// - [`VocabError::Dimension`] if the algebra cannot use the dimension;
    /// - [`VocabError::Ceiling`] if the ceiling is not above 0 and at most 1;
    /// - [`VocabError::TooSimilar`] if 20,000 draws for a name do not meet the ceiling;
    /// - [`VocabError::BadName`] or [`VocabError::Duplicate`] if a name is invalid or repeated;
    /// - [`VocabError::BadVector`] if a given or computed vector has the wrong length or is not finite;
    /// - [`VocabError::Syntax`] or [`VocabError::Unknown`] if an expression cannot be evaluated.
    pub fn build(self) -> Result<Vocabulary<V>, VocabError> {
        self.algebra.check_dim(self.dim)?;
        if let Some(ceiling) = self.ceiling
            && !(ceiling > 0.0 && ceiling <= 1.0)
        {
            return Err(VocabError::Ceiling { ceiling });
        }
        let names: Vec<&str> = self.entries.iter().map(|(n, _)| n.as_str()).collect();
        let identity =
            format!("{}\0{}\0{}\0{}", V::NAME, self.dim, self.algebra.name(), names.join("\0"));
        let id = self.seed.derive(&identity, "space").value();
        let label = format!(
            "the vocabulary `{}` (D = {}, {}, seed {}, {} names)",
            V::NAME,
            self.dim,
            self.algebra.name(),
            self.seed,
            names.len()
        );
        let mut vocabulary = Vocabulary {
            space: Space::new(id, self.dim, label).with_attached(self.algebra.clone()),
            algebra: self.algebra,
            names: Vec::new(),
            index: HashMap::new(),
            vectors: Vec::new(),
            tag: PhantomData,
        };
        let mut work = vocabulary.algebra.scratch(self.dim);
        for (name, entry) in self.entries {
            if !expr::is_name(&name) {
                return Err(VocabError::BadName { name });
            }
            if vocabulary.index.contains_key(&name) {
                return Err(VocabError::Duplicate { name });
            }
            let vector = match entry {
                Entry::Random => {
                    vocabulary.draw(&name, false, self.seed, self.ceiling, &mut work)?
                }
                Entry::Unitary => {
                    vocabulary.draw(&name, true, self.seed, self.ceiling, &mut work)?
                }
                Entry::Given(values) => check_vector(&name, values, self.dim)?,
                Entry::Defined(text) => vocabulary.parse(&text)?.into_values(),
            };
            vocabulary.index.insert(name.clone(), vocabulary.names.len());
            vocabulary.names.push(name);
            vocabulary.vectors.extend_from_slice(&vector);
        }
        Ok(vocabulary)
    }
}

fn check_vector(name: &str, values: Vec<Real>, dim: usize) -> Result<Vec<Real>, VocabError> {
    let reason = if values.len() != dim {
        format!("the vector has {} components; expected {dim}", values.len())
    } else if let Some(at) = values.iter().position(|v| !v.is_finite()) {
        format!("component {at} is {}; expected a finite number", values[at])
    } else {
        return Ok(values);
    };
    Err(VocabError::BadVector { name: name.into(), reason })
}

/// Named pointers of one space. Neither names nor pointers change after [`VocabularyBuilder::build`].
pub struct Vocabulary<V: VocabTag> {
    space: Space<V>,
    algebra: Arc<dyn Algebra>,
    names: Vec<String>,
    index: HashMap<String, usize>,
    /// Row-major, one row per name.
    vectors: Vec<Real>,
    tag: PhantomData<fn() -> V>,
}

impl<V: VocabTag> std::fmt::Debug for Vocabulary<V> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Vocabulary({})", self.space)
    }
}

impl<V: VocabTag> Vocabulary<V> {
    /// Returns the space of the pointers. Ports for these pointers are declared with it.
    pub fn space(&self) -> &Space<V> {
        &self.space
    }

    /// Returns the number of dimensions.
    pub fn dim(&self) -> usize {
        self.space.width()
    }

    /// Returns the number of names.
    pub fn len(&self) -> usize {
        self.names.len()
    }

    /// Returns whether there are no names.
    pub fn is_empty(&self) -> bool {
        self.names.is_empty()
    }

    /// Returns the names, in the order in which they were added.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Returns the algebra.
    pub fn algebra(&self) -> &Arc<dyn Algebra> {
        &self.algebra
    }

    /// Returns all vectors as a row-major matrix, one row of `dim` numbers per name, in the order of
    /// [`names`](Self::names).
    pub fn matrix(&self) -> &[Real] {
        &self.vectors
    }

    /// Returns the pointer of name number `index`, counted from 0. Returns `None` if there are fewer names.
    pub fn vector(&self, index: usize) -> Option<PointerRef<'_, V>> {
        let dim = self.dim();
        self.vectors.get(index * dim..(index + 1) * dim).map(PointerRef::from_raw)
    }

    /// Returns the pointer called `name`.
    ///
    /// # Errors
    /// [`VocabError::Unknown`] if there is no such name; the error lists all names.
    pub fn get(&self, name: &str) -> Result<PointerRef<'_, V>, VocabError> {
        let index = self.position(name)?;
        let dim = self.dim();
        Ok(PointerRef::from_raw(&self.vectors[index * dim..(index + 1) * dim]))
    }

    /// Returns the index of `name` in [`names`](Self::names).
    ///
    /// # Errors
    /// [`VocabError::Unknown`] if there is no such name; the error lists all names.
    pub fn position(&self, name: &str) -> Result<usize, VocabError> {
        self.index.get(name).copied().ok_or_else(|| VocabError::Unknown {
            vocabulary: V::NAME.into(),
            name: name.into(),
            nearest: nearest_name(name, self.names.iter().map(String::as_str)),
            choices: self.names.clone(),
        })
    }

    /// Evaluates an expression such as `PRECONDITION * (NUT_IN_JIG + BOLT_IN_JIG)`.
    ///
    /// `+` and `-` add and subtract. `*` binds two pointers or scales a pointer by a number. `~` inverts, a leading
    /// `-` negates, and parentheses group. The value is not normalised. Allocates.
    ///
    /// # Errors
    /// - [`VocabError::Syntax`] if the text is not an expression with at least one name; the error shows the position;
    /// - [`VocabError::Unknown`] if a name is not in the vocabulary;
    /// - [`VocabError::BadVector`] if the value is not finite.
    pub fn parse(&self, text: &str) -> Result<PointerValue<V>, VocabError> {
        let expr = expr::parse(text)?;
        let mut work = self.algebra.scratch(self.dim());
        match self.evaluate(&expr, text, &mut work)? {
            Value::Vector(values) => Ok(PointerValue::new(
                check_vector(text, values, self.dim())?,
                text.trim().to_owned(),
            )),
            Value::Number(_) => Err(VocabError::Syntax {
                text: text.into(),
                at: 0,
                problem: "a number".into(),
                expected: "an expression with at least one name",
            }),
        }
    }

    fn draw(
        &self,
        name: &str,
        unitary: bool,
        seed: Seed,
        ceiling: Option<Real>,
        work: &mut Workspace,
    ) -> Result<Vec<Real>, VocabError> {
        let own = seed.derive(V::NAME, name);
        let attempts = if ceiling.is_some() && !self.is_empty() { MAX_ATTEMPTS } else { 1 };
        let (mut best, mut nearest) = (Real::INFINITY, 0);
        for attempt in 0..attempts {
            let mut vector = random_pointer(self.dim(), own.derive_index("pointer", attempt));
            if unitary {
                self.algebra.make_unitary(&mut vector, work);
            }
            let Some(ceiling) = ceiling else { return Ok(vector) };
            let (mut worst, mut whose) = (0.0, 0);
            for (index, other) in self.vectors.chunks_exact(self.dim()).enumerate() {
                let similarity = dot(&vector, other).abs();
                if similarity > worst {
                    (worst, whose) = (similarity, index);
                }
                if worst > ceiling && worst >= best {
                    break;
                }
            }
            if worst <= ceiling {
                return Ok(vector);
            }
            if worst < best {
                (best, nearest) = (worst, whose);
            }
        }
        Err(VocabError::TooSimilar {
            name: name.into(),
            dim: self.dim(),
            ceiling: ceiling.unwrap_or(1.0),
            others: self.len(),
            attempts: attempts as usize,
            best,
            nearest: self.names.get(nearest).cloned().unwrap_or_default(),
        })
    }

    fn evaluate(&self, expr: &Expr, text: &str, work: &mut Workspace) -> Result<Value, VocabError> {
        let syntax = |at: usize, problem: &str, expected: &'static str| VocabError::Syntax {
            text: text.into(),
            at,
            problem: problem.into(),
            expected,
        };
        Ok(match expr {
            Expr::Number(value) => Value::Number(*value),
            Expr::Name { name, .. } => Value::Vector(self.get(name)?.to_vec()),
            Expr::Negate(inner) => match self.evaluate(inner, text, work)? {
                Value::Number(value) => Value::Number(-value),
                Value::Vector(mut values) => {
                    values.iter_mut().for_each(|v| *v = -*v);
                    Value::Vector(values)
                }
            },
            Expr::Invert(inner, at) => match self.evaluate(inner, text, work)? {
                Value::Number(_) => return Err(syntax(*at, "`~` before a number", "a pointer")),
                Value::Vector(values) => {
                    let mut inverse = vec![0.0; values.len()];
                    self.algebra.inverse_into(&values, &mut inverse);
                    Value::Vector(inverse)
                }
            },
            Expr::Add(left, right, at) | Expr::Subtract(left, right, at) => {
                let sign = if matches!(expr, Expr::Add(..)) { 1.0 } else { -1.0 };
                match (self.evaluate(left, text, work)?, self.evaluate(right, text, work)?) {
                    (Value::Number(a), Value::Number(b)) => Value::Number(a + f64::from(sign) * b),
                    (Value::Vector(mut a), Value::Vector(b)) => {
                        a.iter_mut().zip(&b).for_each(|(x, y)| *x += sign * y);
                        Value::Vector(a)
                    }
                    _ => {
                        let problem = "a sum of a number and a pointer";
                        return Err(syntax(*at, problem, "pointers on both sides"));
                    }
                }
            }
            Expr::Times(left, right) => {
                match (self.evaluate(left, text, work)?, self.evaluate(right, text, work)?) {
                    (Value::Number(a), Value::Number(b)) => Value::Number(a * b),
                    (Value::Number(k), Value::Vector(mut values))
                    | (Value::Vector(mut values), Value::Number(k)) => {
                        values.iter_mut().for_each(|v| *v *= k as Real);
                        Value::Vector(values)
                    }
                    (Value::Vector(a), Value::Vector(b)) => {
                        let mut bound = vec![0.0; a.len()];
                        self.algebra.bind_into(&a, &b, &mut bound, work);
                        Value::Vector(bound)
                    }
                }
            }
        })
    }
}

enum Value {
    Number(f64),
    Vector(Vec<Real>),
}
