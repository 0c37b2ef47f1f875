//! The bundled sample level: its palette and textures, drawn by code, and the compiled file made
//! from them and the text of `assets/sample/sample.map`.

mod noise;
mod palette;
mod textures;

use crate::{CompileError, Options, Output, compile, parse_map};

/// The 768 bytes of the sample level's `palette.lmp`.
#[must_use]
pub fn palette() -> Vec<u8> {
    palette::palette()
}

/// The sample level's textures, as indices into [`palette()`].
#[must_use]
pub fn textures() -> Vec<crate::Texture> {
    textures::textures()
}

/// Compiles the sample level from the text of its map.
///
/// # Errors
/// As [`parse_map`] and [`compile`]: the text is wrong, or the level leaks.
pub fn build(map_text: &str) -> Result<Output, CompileError> {
    let mut map = parse_map(map_text)?;
    map.textures = textures();
    compile(&map, &Options::default())
}
