//! Tasks: recordings, learned domains, planners, plans in PDDL, scenes, and files that are refused; and the studies of them.

// Tests may stop at the first surprise, and so may their helpers.
#![allow(clippy::unwrap_used, clippy::expect_used)]

#[cfg(feature = "mcap")]
#[path = "../support/bags.rs"]
mod bags;
#[path = "../support/beside.rs"]
mod beside;
#[path = "../support/propositional.rs"]
mod propositional;
#[path = "../support/streams.rs"]
mod streams;
#[path = "../support/strips.rs"]
mod strips;
#[path = "../support/tally.rs"]
mod tally;

mod adl;
mod alike_and_apart;
mod alternatives;
mod attempts;
mod attributes;
mod both_searches;
mod catalogue;
mod doubt;
mod events;
mod fixtures_and_heaps;
mod found_and_layered;
mod goal_set_races;
mod goal_sets;
mod goal_sets_in_scenes;
mod ground;
mod hostile;
mod imports;
#[cfg(feature = "hdf5")]
mod imports_of_arrays;
#[cfg(feature = "mcap")]
mod imports_of_bags;
mod input;
mod kinematics;
mod learn_model;
mod missing_looks;
mod modes;
mod moving;
mod names;
mod nobody_prepared;
mod pddl;
mod pddl_of_learned_domains;
mod pddl_of_strangers;
mod placing;
mod planner;
mod poses_and_states;
mod problem_folders;
mod problems;
mod relational;
mod relational_files;
mod relational_tasks;
mod resting;
mod scale;
mod scene;
mod seated;
mod second_task;
mod sensed;
mod sensing;
mod settings_and_outlines;
mod several_places;
mod stack_planner;
mod stacks_and_rows;
mod statistics;
mod strangers;
mod strangers_benches;
mod synthetic;
mod task_files;
mod teaching;
mod traces;
mod trials;
mod unseen;
mod useless_operators;
mod worlds;
