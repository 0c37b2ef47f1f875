//! Levels to test on: the bundled one, and real ones.

use bsp::lmp::Palette;
use bsp::{Level, Limits, SearchPath};
use runelight::bundled;
use scene::Scene;
use scene::import::{ImportOptions, LightMode, import};
use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Folder of the test data: `RUNELIGHT_TEST_DATA`, else `shared/data` beside the project.
#[must_use]
pub fn data() -> PathBuf {
    std::env::var_os("RUNELIGHT_TEST_DATA").map_or_else(
        || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data")),
        PathBuf::from,
    )
}

/// The Quake directory of the test data. Without test data says `SKIPPED` and why, and returns
/// `None`.
///
/// # Panics
/// When there is test data that can't be read.
#[must_use]
pub fn game() -> Option<SearchPath> {
    let data = data();
    if !data.join("id1").is_dir() {
        println!("SKIPPED: no test data in {}", data.display());
        return None;
    }
    Some(open(&data).unwrap_or_else(|e| panic!("{}: {e}", data.display())))
}

/// Opens a Quake directory.
///
/// # Errors
/// When it can't be read.
pub fn open(basedir: &Path) -> Result<SearchPath, Box<dyn Error>> {
    Ok(SearchPath::builder().basedir(basedir).build()?)
}

/// Loads and imports a level: a name in the Quake directory, or a file.
///
/// # Errors
/// When it is not there, or not a level.
pub fn load(
    game: &SearchPath,
    name: &str,
    lights: LightMode,
) -> Result<Arc<Scene>, Box<dyn Error>> {
    let options = ImportOptions {
        lights,
        ..ImportOptions::default()
    };
    load_with(game, name, &options)
}

/// Like [`load`], with all options.
///
/// # Errors
/// When it is not there, or not a level.
pub fn load_with(
    game: &SearchPath,
    name: &str,
    options: &ImportOptions,
) -> Result<Arc<Scene>, Box<dyn Error>> {
    let level = Level::load(game, name, &Limits::default())?;
    let palette = Palette::parse(&game.read("gfx/palette.lmp")?.bytes)?;
    let files = |path: &str| game.read_optional(path).ok().flatten().map(|f| f.bytes);
    Ok(Arc::new(import(&level, &palette, &files, options)?))
}

/// The bundled level.
///
/// # Panics
/// When it can't be read.
#[must_use]
pub fn sample(lights: LightMode) -> Arc<Scene> {
    let search = SearchPath::builder()
        .built_in(bundled::FILES)
        .build()
        .expect("the bundled files");
    load(&search, "maps/sample.bsp", lights).expect("a scene")
}
