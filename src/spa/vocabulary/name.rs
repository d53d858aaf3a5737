//! Names of pointers as constants of the program.

use std::fmt;
use std::marker::PhantomData;

use crate::sim::VocabTag;

/// The name of a pointer of `V`, as a constant. [`vocabulary!`](crate::vocabulary) declares them.
///
/// A name is an operand of [expressions](crate::spa::flow). When the graph is built, it is looked up in the vocabulary
/// of the expression's ports.
pub struct Name<V: VocabTag> {
    name: &'static str,
    tag: PhantomData<fn() -> V>,
}

impl<V: VocabTag> Name<V> {
    /// Makes a name. [`vocabulary!`](crate::vocabulary) calls this.
    pub const fn new(name: &'static str) -> Self {
        Self { name, tag: PhantomData }
    }

    /// Returns the name.
    pub const fn as_str(self) -> &'static str {
        self.name
    }
}

impl<V: VocabTag> Clone for Name<V> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<V: VocabTag> Copy for Name<V> {}

impl<V: VocabTag> fmt::Debug for Name<V> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

impl<V: VocabTag> From<Name<V>> for String {
    fn from(name: Name<V>) -> Self {
        name.name.into()
    }
}

/// Declares the tag of a vocabulary and its names as constants, so that a misspelt name does not compile.
///
/// `Tag::vocabulary(dimensions, seed)` draws a pointer for each name. `Tag::NAMES` lists the names;
/// [`VocabularyBuilder::pointers`](crate::spa::VocabularyBuilder::pointers) takes them.
///
/// ```
/// use symbolt::prelude::*;
///
/// symbolt::vocabulary!(pub Parts = "parts": NUT, JIG, ROLE);
///
/// let parts = Parts::vocabulary(64, Seed::new(1))?;
/// let mut graph = GraphBuilder::new();
/// let seen = graph.add("seen", State::new(&parts));
/// let filler = graph.add("filler", State::new(&parts));
/// graph.route(&seen * !Parts::ROLE >> &filler);
/// graph.route(Parts::NUT * Parts::ROLE >> &seen);
/// graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1))?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// ```compile_fail
/// use symbolt::prelude::*;
///
/// symbolt::vocabulary!(pub Parts = "parts": NUT, JIG, ROLE);
///
/// let parts = Parts::vocabulary(64, Seed::new(1))?;
/// let mut graph = GraphBuilder::new();
/// let seen = graph.add("seen", State::new(&parts));
/// let filler = graph.add("filler", State::new(&parts));
/// graph.route(&seen * !Parts::ROLL >> &filler);
/// graph.route(Parts::NUT * Parts::ROLE >> &seen);
/// graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1))?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[macro_export]
macro_rules! vocabulary {
    ($(#[$meta:meta])* $visibility:vis $tag:ident = $label:literal: $($name:ident),+ $(,)?) => {
        $(#[$meta])*
        #[doc = concat!("The vocabulary `", $label, "`.")]
        #[derive(Debug, Clone, Copy)]
        $visibility struct $tag;

        impl $crate::sim::VocabTag for $tag {
            const NAME: &'static str = $label;
        }

        #[allow(dead_code)]
        impl $tag {
            $(
                #[doc = concat!("The pointer `", stringify!($name), "`.")]
                $visibility const $name: $crate::spa::Name<$tag> =
                    $crate::spa::Name::new(stringify!($name));
            )+

            /// All names, in the order of their declaration.
            $visibility const NAMES: [&'static str; [$(stringify!($name)),+].len()] =
                [$(stringify!($name)),+];

            /// Draws a pointer for each name, in `dimensions` dimensions, as
            /// `VocabularyBuilder` does.
            ///
            /// # Errors
            /// As `VocabularyBuilder::build`.
            $visibility fn vocabulary(
                dimensions: usize,
                seed: $crate::sim::Seed,
            ) -> ::std::result::Result<$crate::spa::Vocabulary<$tag>, $crate::spa::VocabError> {
                $crate::spa::VocabularyBuilder::new(dimensions, seed).pointers(Self::NAMES).build()
            }
        }
    };
}
