//! What a run of any graph leaves: tables, charts, arrays, drawings and pages.

pub(super) mod drawing;
pub(super) mod page;
pub(super) mod recordings;
pub(super) mod series;
