//! Real levels, where there are any.
#![allow(dead_code, reason = "each test binary uses its own part")]

use bsp::{Level, Limits, SearchPath, lmp::Palette};
use scene::Scene;
use scene::import::{ImportOptions, import};
use std::path::PathBuf;
use std::sync::Arc;

/// The test data's game directory, or why there is none.
pub fn game() -> Result<SearchPath, String> {
    let data = std::env::var_os("RUNELIGHT_TEST_DATA").map_or_else(
        || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data")),
        PathBuf::from,
    );
    if !data.join("id1").is_dir() {
        return Err(format!("no game directory id1 in {}", data.display()));
    }
    (SearchPath::builder().basedir(&data).build()).map_err(|error| error.to_string())
}

/// Imports a level of `game`.
pub fn load(game: &SearchPath, name: &str) -> Result<Arc<Scene>, Box<dyn std::error::Error>> {
    let level = Level::load(game, name, &Limits::default())?;
    let palette = Palette::parse(&game.read("gfx/palette.lmp")?.bytes)?;
    let files = |path: &str| game.read_optional(path).ok().flatten().map(|f| f.bytes);
    let scene = import(&level, &palette, &files, &ImportOptions::default())?;
    Ok(Arc::new(scene))
}
