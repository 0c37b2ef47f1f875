//! The command line of Runelight: everything between people and the renderers.

pub mod metrics;
pub mod output;
pub mod picture;
pub mod tonemap;
