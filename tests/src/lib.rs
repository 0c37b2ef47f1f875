//! What the integration tests share: small scenes, real levels, both renderers, statistics.

#[path = "../../crates/reference/tests/common/mod.rs"]
pub mod builder;
pub mod devices;
pub mod levels;
pub mod stats;
