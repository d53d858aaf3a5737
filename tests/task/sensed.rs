//! Everything that the robot does goes by what it senses.
