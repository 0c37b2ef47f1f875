//! What the integration tests share: small scenes, levels, both renderers, statistics.

pub mod builder;
pub mod devices;
pub mod levels;
pub mod scenes;
pub mod stats;
