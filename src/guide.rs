//! Guides. Each is one program, an example of the repository, and shows what the program prints.
//!
//! | for | guide |
//! |---|---|
//! | modellers of neurons | [`nef`]: ensembles, attractors and learned connections |
//! | modellers of cognition | [`expressions`]: models as expressions and rules; [`planner_graph`]: a planner graph in code; [`timing`]: when each step of a plan is reached; [`ablation`]: what a part contributes |
//! | engineers | [`own_module`]: your own module, node or world; [`live`]: runs that are changed, taken back and branched |
//! | roboticists | [`own_task`]: your own task from recordings; `task_file`: a task in a file; `scene`: other sizes, places and motors (feature `physics`) |

/// A module that shows a file of `docs`. Its links come first and replace those of the file, which lead to other files.
macro_rules! guide {
    ($name:ident, $file:literal) => {
        #[doc = concat!(
                    "[build profiles]: crate#build-profiles\n[timing]: crate::guide::timing\n",
                    "[ablation]: crate::guide::ablation\n\n",
                    include_str!($file),
                )]
        pub mod $name {}
    };
}

guide!(ablation, "../docs/ablation.md");
guide!(expressions, "../docs/expressions.md");
guide!(live, "../docs/live.md");
guide!(nef, "../docs/nef.md");
guide!(own_module, "../docs/own_module.md");
guide!(own_task, "../docs/own_task.md");
guide!(planner_graph, "../docs/planner_graph.md");
#[cfg(feature = "physics")]
guide!(scene, "../docs/scene.md");
#[cfg(feature = "physics")]
guide!(task_file, "../docs/task_file.md");
guide!(timing, "../docs/timing.md");
