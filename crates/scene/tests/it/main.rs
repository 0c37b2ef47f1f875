//! The import, on generated levels and on real ones.

mod common;
mod geometry;
mod inhabitants;
mod lamps;
mod levels;
mod materials;
mod pictures;
mod playback;
mod poses;
mod replaced;
mod skies;
mod timeline;
mod translucent;
