//! Readers for the files of Quake and its relatives: PAK and WAD archives, palettes and pictures,
//! BSP 29, 2PSB and BSP2 levels with their `BSPX`, `.lit`, `.vis` and `.ent` companions, entity
//! text, alias models, what stands for those (MD3, MD5), sprites, demos, and the search path that finds them.
//!
//! Every reader takes bytes and [`Limits`] and doubts all it reads: arithmetic is checked, an
//! index is compared with its table before it is kept, and no allocation is made that the bytes at
//! hand do not justify. What stops a file is a [`FormatError`], one sentence naming file, part,
//! index, byte offset, what was found and what is allowed. What a renderer can live with is
//! repaired or left out and counted in [`Warnings`].
//!
//! The types keep id Software's vocabulary and Quake's space: right-handed, Z up, one unit about
//! an inch. Nothing here knows of rendering.
#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(clippy::indexing_slicing, clippy::unwrap_used, clippy::expect_used)
)]

pub mod bsp;
mod cycle;
pub mod dem;
pub mod entity;
mod error;
pub mod level;
pub mod lmp;
pub mod md3;
pub mod md5;
pub mod mdl;
pub mod miptex;
pub mod pak;
pub mod picture;
pub mod posed;
mod reader;
pub mod search;
mod sniff;
pub mod spr;
pub mod styles;
pub mod wad;

pub use bsp::Bsp;
pub use cycle::Cycle;
pub use error::{ErrorKind, FormatError, Limits, Warning, WarningKind, Warnings};
pub use level::Level;
pub use search::{BuiltIn, LoadError, SearchPath};
pub use sniff::{FileKind, sniff};
