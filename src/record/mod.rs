//! What a run of any graph leaves: tables, charts, arrays, drawings and pages.
//!
//! | to | use |
//! |---|---|
//! | tabulate or draw a recorded output | [`TimeSeries`], from [`Samples::series`](crate::sim::Samples::series) |
//! | write everything that was recorded for numpy, or as CSV | [`Recordings`], from [`Simulator::recordings`](crate::sim::Simulator::recordings) |
//! | write the recordings of a long run to disk while it goes on | [`RecordingFiles`]; [`RowFiles`] for numbers of your own |
//! | draw curves, such as the tuning curves of neurons | [`Curves`] |
//! | draw a graph's modules | [`Graph::to_svg`](crate::sim::Graph::to_svg) |
//! | make a page of a run | [`RunPage`] |
//!
//! The engine knows none of this: charts, archives and pages are made here from what a simulator recorded.

mod curves;
mod drawing;
mod page;
mod recordings;
mod series;
pub(crate) mod shell;
mod stream;

pub use curves::Curves;
pub use page::RunPage;
pub use recordings::Recordings;
pub use series::TimeSeries;
pub(crate) use series::{COLOURS, csv_field};
pub use stream::{RecordingFiles, RowFiles};
