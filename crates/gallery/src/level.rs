//! Levels of the gallery: brushes compiled by `mapc`, read by `bsp`, imported by `scene`.

use bsp::lmp::Palette;
use bsp::{Level, Limits, SearchPath};
use mapc::{Brush, Map, Texture};
use scene::Scene;
use scene::import::{ImportOptions, LightMode, import};
use scene::material::srgb_to_linear;
use std::sync::Arc;

/// sRGB byte of the texture `glow`, which emits and reflects alike.
pub const GLOW: u8 = 188;
/// sRGB byte of the texture `wall`, which only reflects.
pub const WALL: u8 = 150;
/// sRGB byte of the texture `lamp`, which emits and reflects alike.
pub const LAMP: u8 = 230;

/// Share of light that a surface of this sRGB byte reflects. A fullbright texel of it emits a
/// radiance of the same number: the import's scale of emission is 1 here.
#[must_use]
pub fn linear(byte: u8) -> f64 {
    srgb_to_linear(byte)
}

/// Palette index of a fullbright grey.
const GLOW_INDEX: u8 = 254;
const LAMP_INDEX: u8 = 253;
const WALL_INDEX: u8 = 100;
const SKY_INDEX: u8 = 101;

fn palette() -> Palette {
    let mut colors = [[0; 3]; 256];
    for (index, grey) in [
        (WALL_INDEX, WALL),
        (SKY_INDEX, 255),
        (GLOW_INDEX, GLOW),
        (LAMP_INDEX, LAMP),
    ] {
        colors[usize::from(index)] = [grey; 3];
    }
    Palette(colors)
}

/// A map with the gallery's textures `wall`, `glow`, `lamp` and `sky`, and no brush yet.
#[must_use]
pub fn map() -> Map {
    let mut map = Map::new();
    map.texture(Texture::solid("wall", 64, 64, WALL_INDEX));
    map.texture(Texture::solid("glow", 64, 64, GLOW_INDEX));
    map.texture(Texture::solid("lamp", 64, 64, LAMP_INDEX));
    map.texture(Texture::solid("sky", 256, 128, SKY_INDEX));
    map
}

/// A room of 512 by 512 by 256 units from the origin on, all of one texture, with a player.
#[must_use]
pub fn room(texture: &str) -> Map {
    let mut map = map();
    map.room([0.0; 3], [512.0, 512.0, 256.0], 16.0, texture);
    map.entity("info_player_start", &[("origin", "256 256 32")]);
    map
}

/// The bytes of a map's level; leaks are let pass.
///
/// # Panics
/// When the map can't be compiled.
#[must_use]
pub fn compile(map: &Map) -> Vec<u8> {
    let options = mapc::Options {
        allow_leaks: true,
        ..mapc::Options::default()
    };
    mapc::compile(map, &options)
        .expect("a map that compiles")
        .bytes
}

/// The scene of a level's bytes, lit by its surfaces alone, or by its entities alone.
///
/// # Panics
/// When it can't be read or imported.
#[must_use]
pub fn import_bytes(bytes: Vec<u8>, lights: LightMode) -> Arc<Scene> {
    let search = SearchPath::builder().build().expect("an empty search path");
    let level = Level::from_bytes(&search, "gallery", bytes, &Limits::default());
    let options = ImportOptions {
        emission_scale: 1.0,
        threshold: 0.1,
        lights,
        ..ImportOptions::default()
    };
    let scene = import(&level.expect("a level"), &palette(), &|_| None, &options);
    Arc::new(scene.expect("a scene"))
}

/// The scene of a map, lit by its surfaces.
///
/// # Panics
/// When the map can't be compiled or imported.
#[must_use]
pub fn scene_of(map: &Map) -> Arc<Scene> {
    import_bytes(compile(map), LightMode::Textures)
}

/// A box of one texture.
#[must_use]
pub fn block(mins: [f64; 3], maxs: [f64; 3], texture: &str) -> Brush {
    Brush::cuboid(mins, maxs, [texture; 6])
}
