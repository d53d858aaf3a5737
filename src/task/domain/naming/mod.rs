//! Names of learned things: a symbol for machines and a sentence for people.
//!
//! A **symbol** is an identifier such as `DRAWER_OPEN`. A **sentence** is lower case and has no full stop: that of a state
//! is a statement, "a drawer is open"; that of an action is an order, "open a drawer".
//!
//! Both are made from what is known of a state, and say no more than that: its kind, its frame, how it came about and where
//! its places lie. They do not depend on the order in which states were found, so that two recordings of one task give the
//! same names. [`RelationalDomain::words`](super::RelationalDomain::words) holds the sentences, and a person can change
//! both.
//!
//! | file | makes |
//! |---|---|
//! | `nouns` | nouns for kinds, names for objects, parts of symbols |
//! | `states` | symbols and sentences of states and actions |
//! | `statement` | variants of a sentence: of one object, of several, of none |
//! | `words` | sentences for conditions, side effects and goals |

mod nouns;
mod statement;
mod states;
mod words;

pub(crate) use nouns::{a, noun, object_names, upper};
pub(crate) use statement::{Statement, with_object};
pub(crate) use states::{Names, action_symbol, landmarks, name_all, symbol_in_world};

#[cfg(test)]
#[path = "../../../../tests/unit/domain_naming.rs"]
mod tests;
