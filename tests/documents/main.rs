//! What the README, the guides, the examples and the list of mistakes say, against what the program does.

mod docs;
mod examples;
mod guides;
mod mistakes;
mod models;
