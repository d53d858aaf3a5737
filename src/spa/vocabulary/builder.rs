//! Collects the names and settings of a vocabulary and draws its pointers.

use std::collections::HashMap;
use std::marker::PhantomData;
use std::sync::Arc;

use super::room::Room;
use super::{Content, Vocabulary, check_vector, random_pointer};
use crate::sim::{AsPointer, Fingerprint, Real, Seed, VocabTag};
use crate::spa::algebra::{Algebra, Hrr, Workspace, dot, normalize};
use crate::spa::error::VocabError;
use crate::spa::expr;
use crate::spa::frame::tight_frame;

/// Greatest number of vectors drawn for one name. If none of them keeps the similarity ceiling, the ceiling counts as
/// unreachable.
pub(super) const MAX_ATTEMPTS: u64 = 20_000;

enum Entry {
    Random,
    Unitary,
    Given(Vec<Real>),
    Defined(String),
    /// A random unit vector at right angles to the first so many pointers of the same call.
    Orthonormal(usize),
    /// A row of a tight frame: the frame, and the row in it.
    Framed(usize, usize),
}

/// A tight frame: for each row the name of the role that is unbound from it, if any.
#[derive(Default)]
struct Frame {
    roles: Vec<Option<String>>,
    /// Name of the first pointer, from which the seed is derived.
    first: String,
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
    recipe: Recipe,
    tag: PhantomData<fn() -> V>,
}

/// What a builder collects, whatever the tag: the code that draws is compiled once.
struct Recipe {
    dim: usize,
    seed: Seed,
    algebra: Arc<dyn Algebra>,
    ceiling: Option<Real>,
    best_of: Option<u64>,
    entries: Vec<(String, Entry)>,
    frames: Vec<Frame>,
    /// Identity of the space and the pointers of the vocabulary that grows.
    base: Option<(u64, Content)>,
}

impl<V: VocabTag> VocabularyBuilder<V> {
    /// Starts a vocabulary of `dim` dimensions, with holographic reduced representations ([`Hrr`]) and a similarity
    /// ceiling of 0.1. [`build`](Self::build) checks `dim`.
    pub fn new(dim: usize, seed: Seed) -> Self {
        let recipe = Recipe {
            dim,
            seed,
            algebra: Arc::new(Hrr),
            ceiling: Some(0.1),
            best_of: None,
            entries: Vec::new(),
            frames: Vec::new(),
            base: None,
        };
        Self { recipe, tag: PhantomData }
    }

    /// Starts with the pointers, algebra, seed and ceiling of a vocabulary, and keeps its space.
    pub(super) fn from_base(id: u64, content: &Content) -> Self {
        let base = Some((id, content.clone()));
        let algebra = content.algebra.clone();
        let (ceiling, best_of) = (content.ceiling, content.best_of);
        let (dim, seed, tag) = (content.dim, content.seed, PhantomData);
        let (entries, frames) = (Vec::new(), Vec::new());
        let recipe = Recipe { dim, seed, algebra, ceiling, best_of, entries, frames, base };
        Self { recipe, tag }
    }

    /// Sets the algebra. The default is [`Hrr`].
    pub fn algebra(mut self, algebra: impl Algebra + 'static) -> Self {
        self.recipe.algebra = Arc::new(algebra);
        self
    }

    /// Sets the similarity ceiling (default 0.1): the greatest magnitude of the dot product between a random pointer
    /// and any pointer added before it. It must be above 0 and at most 1; [`build`](Self::build) checks it.
    pub fn max_similarity(mut self, ceiling: Real) -> Self {
        self.recipe.ceiling = Some(ceiling);
        self
    }

    /// Removes the similarity ceiling: the first vector drawn for a name is taken.
    pub fn any_similarity(mut self) -> Self {
        self.recipe.ceiling = None;
        self
    }

    /// Draws at most `draws` vectors for a name, at least one. If none of them keeps the ceiling, the one is taken whose
    /// greatest similarity to the pointers before it is least. A vocabulary of any size can then be built.
    ///
    /// ```
    /// # use symbolt::prelude::*;
    /// # struct Things;
    /// # impl VocabTag for Things { const NAME: &'static str = "things"; }
    /// let names = || (0..100).map(|n| format!("N{n}"));
    /// let new = || VocabularyBuilder::<Things>::new(32, Seed::new(1)).pointers(names());
    /// assert!(new().build().is_err());
    /// assert_eq!(new().or_best_of(100).build()?.len(), 100);
    /// # Ok::<(), symbolt::spa::VocabError>(())
    /// ```
    pub fn or_best_of(mut self, draws: u64) -> Self {
        self.recipe.best_of = Some(draws.max(1));
        self
    }

    /// Adds a random unit vector called `name`.
    ///
    /// A name is an upper-case letter followed by letters, digits and `_`. [`build`](Self::build) checks it.
    pub fn pointer(mut self, name: impl Into<String>) -> Self {
        self.recipe.entries.push((name.into(), Entry::Random));
        self
    }

    /// Adds a random unit vector for each name.
    pub fn pointers<N: Into<String>>(mut self, names: impl IntoIterator<Item = N>) -> Self {
        self.recipe.entries.extend(names.into_iter().map(|n| (n.into(), Entry::Random)));
        self
    }

    /// Adds a random unitary vector called `name`. Unbinding a unitary vector is exact, so it is a good role.
    pub fn unitary(mut self, name: impl Into<String>) -> Self {
        self.recipe.entries.push((name.into(), Entry::Unitary));
        self
    }

    /// Adds a random unit vector for each name, all at right angles to each other. The similarity ceiling does not apply
    /// to them. More names than dimensions are an error of [`build`](Self::build).
    pub fn orthonormal<N: Into<String>>(mut self, names: impl IntoIterator<Item = N>) -> Self {
        let numbered = names.into_iter().enumerate();
        self.recipe
            .entries
            .extend(numbered.map(|(index, name)| (name.into(), Entry::Orthonormal(index))));
        self
    }

    /// Adds a unit vector for each name, all of which form a tight frame: the mean square of their similarities is as
    /// small as possible (Welch 1974), `(1 - D / N) / D` for N names instead of `1 / D`. Up to D names are at right angles to
    /// each other. The similarity ceiling does not apply to them. [`build`](Self::build) takes two seconds for 1,250
    /// names in 500 dimensions.
    pub fn frame<N: Into<String>>(self, names: impl IntoIterator<Item = N>) -> Self {
        self.framed(names.into_iter().map(|name| (name.into(), None)))
    }

    /// Adds a unit vector for each name, so that the names of all groups bound to the roles of their groups,
    /// `NAME * ROLE`, form a tight frame as in [`frame`](Self::frame). The roles are unitary and added before;
    /// [`build`](Self::build) checks it.
    ///
    /// A memory of objects with several properties compares bound pointers, so these should disturb each other little.
    pub fn bound_frame<N: Into<String>>(
        self,
        groups: impl IntoIterator<Item = (impl Into<String>, impl IntoIterator<Item = N>)>,
    ) -> Self {
        let groups = groups.into_iter().map(|(role, names)| (role.into(), names));
        self.framed(groups.flat_map(|(role, names)| {
            names.into_iter().map(move |name| (name.into(), Some(role.clone())))
        }))
    }

    fn framed(mut self, rows: impl Iterator<Item = (String, Option<String>)>) -> Self {
        let (number, mut frame) = (self.recipe.frames.len(), Frame::default());
        for (row, (name, role)) in rows.enumerate() {
            if row == 0 {
                frame.first.clone_from(&name);
            }
            self.recipe.entries.push((name, Entry::Framed(number, row)));
            frame.roles.push(role);
        }
        self.recipe.frames.push(frame);
        self
    }

    /// Adds a given pointer unchanged. [`PointerRef::from_raw`](crate::sim::PointerRef::from_raw) makes a pointer from
    /// numbers. [`build`](Self::build)
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
        self.recipe.entries.push((name.into(), Entry::Given(value.as_pointer().to_vec())));
        self
    }

    /// Adds the value of an expression over the names added before, for example `ROLE * NUT`. The value is not
    /// normalised. [`build`](Self::build) checks the expression.
    pub fn define(mut self, name: impl Into<String>, expression: impl Into<String>) -> Self {
        self.recipe.entries.push((name.into(), Entry::Defined(expression.into())));
        self
    }

    /// Draws all pointers, in the order in which their names were added.
    ///
    /// The vectors drawn for a name depend on the seed, the tag of the vocabulary, the dimension and the name. `build`
    /// takes the first vector within the similarity ceiling, so the result also depends on the names added before.
    /// Costs O(names^2 D) for D dimensions, and many times that if the ceiling is tight. If the random pointers are so many
    /// that their chance to keep the ceiling is below 10^-9, fewer vectors are drawn, so that the error comes soon.
    ///
    /// # Errors
    /// - [`VocabError::Dimension`] if the algebra cannot use the dimension;
    /// - [`VocabError::Ceiling`] if the ceiling is not above 0 and at most 1;
    /// - [`VocabError::TooSimilar`] if 20,000 draws for a name do not meet the ceiling, without
    ///   [`or_best_of`](Self::or_best_of);
    /// - [`VocabError::BadName`] or [`VocabError::Duplicate`] if a name is invalid or repeated;
    /// - [`VocabError::BadVector`] if a given or computed vector has the wrong length or is not finite;
    /// - [`VocabError::Syntax`] or [`VocabError::Unknown`] if an expression cannot be evaluated.
    pub fn build(self) -> Result<Vocabulary<V>, VocabError> {
        let (id, content) = self.recipe.build(V::NAME)?;
        Ok(Vocabulary::of(id, content))
    }
}

impl Recipe {
    /// Draws the pointers of the vocabulary `tag`. Also returns the id of its space.
    fn build(self, tag: &str) -> Result<(u64, Content), VocabError> {
        self.algebra.check_dim(self.dim)?;
        if let Some(ceiling) = self.ceiling
            && !(ceiling > 0.0 && ceiling <= 1.0)
        {
            return Err(VocabError::Ceiling { ceiling });
        }
        if let Some((_, base)) = &self.base
            && base.algebra.name() != self.algebra.name()
        {
            let (keeps, other) = (base.algebra.name(), self.algebra.name());
            let reason =
                format!("a grown vocabulary keeps its algebra {keeps}; it cannot have {other}");
            return Err(VocabError::BadVector { name: tag.into(), reason });
        }
        let names: Vec<&str> = self.entries.iter().map(|(n, _)| n.as_str()).collect();
        let identity =
            format!("{}\0{}\0{}\0{}", tag, self.dim, self.algebra.name(), names.join("\0"));
        let (id, mut content) = self.base.map_or_else(
            || {
                let content = Content {
                    algebra: self.algebra,
                    dim: self.dim,
                    seed: self.seed,
                    ceiling: self.ceiling,
                    best_of: self.best_of,
                    names: Vec::new(),
                    index: HashMap::new(),
                    vectors: Vec::new(),
                };
                (None, content)
            },
            |(id, content)| (Some(id), content),
        );
        (content.ceiling, content.best_of) = (self.ceiling, self.best_of);
        let random =
            |(_, entry): &&(String, Entry)| matches!(entry, Entry::Random | Entry::Unitary);
        let random = self.entries.iter().filter(random).count();
        let most = match (self.ceiling, self.best_of) {
            (None, _) => 1,
            (_, Some(draws)) => draws,
            (Some(ceiling), None) => Room::of(self.dim, ceiling).attempts(random),
        };
        let mut work = content.algebra.scratch(self.dim);
        // Each frame is drawn as a whole with its first pointer.
        let mut frames: Vec<Vec<Real>> = vec![Vec::new(); self.frames.len()];
        for (name, entry) in self.entries {
            if !expr::is_name(&name) {
                return Err(VocabError::BadName { name });
            }
            if content.index.contains_key(&name) {
                return Err(VocabError::Duplicate { name });
            }
            let vector = match entry {
                Entry::Random => content.draw(tag, &name, false, most, &mut work)?,
                Entry::Unitary => content.draw(tag, &name, true, most, &mut work)?,
                Entry::Orthonormal(before) => content.orthonormal(tag, &name, before)?,
                Entry::Framed(frame, row) => {
                    let Frame { roles, first } = &self.frames[frame];
                    if frames[frame].is_empty() {
                        let own = self.seed.derive(tag, first).derive_index("frame", 0);
                        frames[frame] = tight_frame(roles.len(), self.dim, &mut own.rng());
                    }
                    let row_of = &frames[frame][row * self.dim..(row + 1) * self.dim];
                    match &roles[row] {
                        None => row_of.to_vec(),
                        Some(role) => content.without_role(tag, row_of, role, &mut work)?,
                    }
                }
                Entry::Given(values) => check_vector(&name, values, self.dim)?,
                Entry::Defined(text) => content.parse(tag, &text)?,
            };
            content.push(name, &vector);
        }
        // Vocabularies of the same names and seed may have other vectors: given, unitary, or drawn under another ceiling.
        let id = id.unwrap_or_else(|| {
            let mut hash = Fingerprint::default();
            hash.text(&identity).reals(&content.vectors);
            self.seed.derive_index("space", hash.value()).value()
        });
        Ok((id, content))
    }
}

impl Content {
    /// Draws up to `most` vectors for a name, until one keeps the ceiling.
    fn draw(
        &self,
        tag: &str,
        name: &str,
        unitary: bool,
        most: u64,
        work: &mut Workspace,
    ) -> Result<Vec<Real>, VocabError> {
        let own = self.seed.derive(tag, name);
        let attempts = if self.names.is_empty() { 1 } else { most };
        let (mut best, mut nearest, mut kept) = (Real::INFINITY, 0, None);
        for attempt in 0..attempts {
            let mut vector = random_pointer(self.dim, own.derive_index("pointer", attempt));
            if unitary {
                self.algebra.make_unitary(&mut vector, work);
            }
            let Some(ceiling) = self.ceiling else { return Ok(vector) };
            let (mut worst, mut whose) = (0.0, 0);
            for (index, other) in self.vectors.chunks_exact(self.dim).enumerate() {
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
                kept = self.best_of.is_some().then_some(vector);
            }
        }
        if let Some(vector) = kept {
            return Ok(vector);
        }
        let ceiling = self.ceiling.unwrap_or(1.0);
        Err(VocabError::TooSimilar {
            name: name.into(),
            dim: self.dim,
            ceiling,
            room: Room::of(self.dim, ceiling).pointers(),
            others: self.names.len(),
            attempts: attempts as usize,
            best,
            nearest: self.names.get(nearest).cloned().unwrap_or_default(),
        })
    }

    /// Returns the vector that is `bound` once it is bound to a unitary role.
    fn without_role(
        &self,
        tag: &str,
        bound: &[Real],
        role: &str,
        work: &mut Workspace,
    ) -> Result<Vec<Real>, VocabError> {
        let role_of = self.row(self.position(tag, role)?);
        let (mut inverse, mut vector, mut back) =
            (vec![0.0; self.dim], vec![0.0; self.dim], vec![0.0; self.dim]);
        self.algebra.inverse_into(role_of, &mut inverse);
        self.algebra.bind_into(bound, &inverse, &mut vector, work);
        self.algebra.bind_into(&vector, role_of, &mut back, work);
        let off = back.iter().zip(bound).map(|(a, b)| (a - b).abs()).fold(0.0, Real::max);
        if off > 1e-3 {
            let reason = "it is the role of a frame; expected a unitary pointer".into();
            return Err(VocabError::BadVector { name: role.into(), reason });
        }
        Ok(vector)
    }

    /// Draws a unit vector at right angles to the last `before` pointers.
    fn orthonormal(&self, tag: &str, name: &str, before: usize) -> Result<Vec<Real>, VocabError> {
        if before >= self.dim {
            let reason = format!(
                "{} pointers cannot all be at right angles in {} dimensions",
                before + 1,
                self.dim
            );
            return Err(VocabError::BadVector { name: name.into(), reason });
        }
        let own = self.seed.derive(tag, name).derive_index("pointer", 0);
        let mut vector = random_pointer(self.dim, own);
        let others = &self.vectors[self.vectors.len() - before * self.dim..];
        // Twice, because one pass leaves the rounding errors of the first projections.
        for _ in 0..2 {
            for other in others.chunks_exact(self.dim) {
                let share = dot(&vector, other);
                vector.iter_mut().zip(other).for_each(|(v, o)| *v -= share * o);
            }
            normalize(&mut vector);
        }
        Ok(vector)
    }
}
