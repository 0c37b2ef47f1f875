//! The bundled sample level: its palette, textures, models and sprites, drawn by code, the compiled file made
//! from them and the text of `assets/sample/sample.map`, and a demo that was never played.

mod demo;
mod models;
mod noise;
mod palette;
mod shape;
mod sprites;
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

/// The models and sprites of the sample level and its demo: paths in a game directory, and files.
#[must_use]
pub fn models() -> Vec<(&'static str, Vec<u8>)> {
    let models = models::models().into_iter();
    let sprites = sprites::sprites().into_iter();
    models
        .map(|(name, model)| (name, model.write()))
        .chain(sprites.map(|(name, sprite)| (name, sprite.write())))
        .collect()
}

/// The demo that plays in the sample level, whose map's text is given.
///
/// # Errors
/// As [`parse_map`].
pub fn demo(map_text: &str) -> Result<Vec<u8>, CompileError> {
    demo::demo(map_text)
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
