//! A sequence: steps through named pointers, one step for each pulse.

use super::{AssociativeMemory, GoalBuffer};
use crate::neurons::SelectRule;
use crate::sim::{Add, In, Module, Out, Pointer, Scalar, Scope, SimDuration, Stimulus, VocabTag};
use crate::spa::error::VocabError;
use crate::spa::flow::Routes;
use crate::spa::vocabulary::Vocabulary;

/// Time for which the first pointer is shown to the memory.
const START: SimDuration = SimDuration::from_millis(60);

/// Steps through a list of pointers: from each to the next when `next` rises to 1, and stays until it rises again.
///
/// Two goal buffers take turns, as in a flip-flop: while `next` is 0, one stores the successor of the other's pointer;
/// while it is 1, the other takes it over. Pulses and the time between them need about 60 ms each in every mode. The first
/// pointer is stored in the first 60 ms, during which `next` must be 0. At its end the sequence stays, or begins again.
/// An associative memory finds the successors, so errors do not add up from step to step.
///
/// With positions as pointers, a sequence reads a list such as [`Vocabulary::list`] makes, item by item.
///
/// ```
/// use symbolt::prelude::*;
/// use symbolt::sim::Signal;
/// use symbolt::spa::Sequence;
///
/// symbolt::vocabulary!(Steps = "steps": TAKE, MOVE, PUT);
///
/// let steps = Steps::vocabulary(128, Seed::new(1))?;
/// let mut graph = GraphBuilder::new();
/// // 1 for the second half of every 200 ms.
/// let clock = graph.add("clock", Signal::scalar(|t| f32::from(u8::from(t % 0.2 >= 0.1))));
/// let sequence = graph.add("sequence", Sequence::new(&steps, Steps::NAMES)?);
/// graph.route(&clock >> &sequence.next);
/// let probe = graph.probe(&sequence.output, ProbeSpec::default());
/// let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), SimDuration::from_millis(500))?;
/// let shown = steps.similarities(sim.samples(&probe), Steps::NAMES)?;
/// assert_eq!(shown.best(0.1).map(|(name, _)| name), Some("TAKE"));
/// assert_eq!(shown.best(0.2).map(|(name, _)| name), Some("MOVE"));
/// assert_eq!(shown.best(0.5).map(|(name, _)| name), Some("PUT"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Sequence<V: VocabTag> {
    vocabulary: Vocabulary<V>,
    first: String,
    successors: Vec<(String, String)>,
}

/// Ports of a [`Sequence`].
pub struct SequencePorts<V: VocabTag> {
    /// Clock: 1 makes a step and 0 prepares the next one. Adds any number of connections.
    pub next: In<Scalar>,
    /// Current pointer.
    pub output: Out<Pointer<V>>,
}

impl<V: VocabTag> Sequence<V> {
    /// Makes a sequence of the named pointers, which stays at the last one.
    ///
    /// # Errors
    /// [`VocabError::Unknown`] if the vocabulary does not have a name; [`VocabError::Duplicate`] if a name appears twice,
    /// because it then has two successors; [`VocabError::BadVector`] if there are no names.
    pub fn new<'n>(
        vocabulary: &Vocabulary<V>,
        names: impl IntoIterator<Item = &'n str>,
    ) -> Result<Self, VocabError> {
        let names: Vec<&str> = names.into_iter().collect();
        for (index, name) in names.iter().enumerate() {
            vocabulary.position(name)?;
            if names[..index].contains(name) {
                return Err(VocabError::Duplicate { name: (*name).into() });
            }
        }
        let (Some(first), Some(last)) = (names.first(), names.last()) else {
            let reason = "the sequence has no names; expected at least one".into();
            return Err(VocabError::BadVector { name: "sequence".into(), reason });
        };
        let after = names[1..].iter().chain([last]);
        let pairs = names.iter().zip(after);
        let successors = pairs.map(|(name, next)| ((*name).into(), (*next).into())).collect();
        Ok(Self { vocabulary: vocabulary.clone(), first: (*first).into(), successors })
    }

    /// Begins again after the last pointer.
    pub fn repeated(mut self) -> Self {
        if let Some((_, next)) = self.successors.last_mut() {
            next.clone_from(&self.first);
        }
        self
    }
}

impl<V: VocabTag> Module for Sequence<V> {
    type Ports = SequencePorts<V>;

    fn expand(self, scope: &mut Scope<'_>) -> SequencePorts<V> {
        let vocabulary = &self.vocabulary;
        let pairs = self.successors.iter().map(|(name, next)| (name.as_str(), next.as_str()));
        let rule = SelectRule::WinnerTakeAll { level: 0.5 };
        let successor = AssociativeMemory::new(vocabulary, vocabulary, pairs, rule);
        let first = vocabulary.get(&self.first).map(|pointer| pointer.to_vec());
        let [current, upcoming] =
            ["current", "upcoming"].map(|name| scope.add(name, GoalBuffer::new(vocabulary)));
        let next = scope.add("next", Add::scalar());
        // `new` has checked the names, so this never refuses.
        match (successor, first) {
            (Ok(successor), Ok(first)) => {
                let successor = scope.add("successor", successor);
                let first = crate::sim::PointerRef::from_raw(&first);
                let shown = Stimulus::pointer(vocabulary.space(), &first).silent_from(START);
                let shown = scope.add("first", shown);
                let start = scope.add("start", Stimulus::scalar(1.0).from(START, &[0.0]));
                scope.route(&current >> &successor);
                scope.route(&successor >> &upcoming);
                scope.route(1.0 - &next - &start >> &upcoming.open);
                scope.route(&upcoming + &shown >> &current);
                scope.route(&next + &start >> &current.open);
            }
            (Err(error), _) | (_, Err(error)) => scope.refuse(error.to_string()),
        }
        SequencePorts {
            next: scope.input("next", next.input),
            output: scope.output("output", current.output),
        }
    }
}
