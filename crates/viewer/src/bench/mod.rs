//! Speed against error, measured.
//!
//! ```text
//! plan -> view: measure -> reference -> evaluate, bias -> result -> report, csv, plot, baseline
//! ```
//!
//! [`plan`] says what is measured, [`view`] does it for one level and camera, [`result`] is what
//! `bench.json` holds and all outputs are made from.

pub mod baseline;
pub mod bias;
pub mod csv;
pub mod equal_time;
pub mod evaluate;
pub mod hard;
pub mod identity;
mod machine;
pub mod measure;
pub mod plan;
pub mod plot;
pub mod reference;
pub mod report;
pub mod result;
pub mod stats;
pub mod view;
pub mod watch;
