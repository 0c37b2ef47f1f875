//! Real levels.

use bsp::lmp::Palette;
use bsp::{Level, Limits, SearchPath};
use scene::Scene;
use scene::import::{ImportOptions, import as import_level};
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

/// Loads and imports a level of the Quake directory `data`.
///
/// # Errors
/// When it is not there, or not a level.
pub fn load_from(data: &Path, name: &str) -> Result<Arc<Scene>, Box<dyn Error>> {
    let search = SearchPath::builder().basedir(data).build()?;
    let level = Level::load(&search, name, &Limits::default())?;
    let palette = Palette::parse(&search.read("gfx/palette.lmp")?.bytes)?;
    let files = |path: &str| search.read_optional(path).ok().flatten().map(|f| f.bytes);
    Ok(Arc::new(import_level(&level, &palette, &files, &ImportOptions::default())?))
}

/// Imports a level of the test data. Without test data says `SKIPPED` and why, and returns `None`.
///
/// # Panics
/// When there is test data and the level can't be imported.
#[must_use]
pub fn import(name: &str) -> Option<Arc<Scene>> {
    let data = data();
    if !data.join("id1").is_dir() {
        println!("SKIPPED: no test data in {}", data.display());
        return None;
    }
    Some(load_from(&data, name).unwrap_or_else(|e| panic!("{name}: {e}")))
}
