//! What the integration tests share: small scenes, levels, both renderers, statistics.

pub mod devices;
pub mod levels;
pub mod light_modes;
pub mod moving;
pub mod scenes;
pub mod stats;

pub use gallery::builder;
