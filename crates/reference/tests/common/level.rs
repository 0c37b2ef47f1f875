//! Real levels, where there are any.
#![allow(dead_code, reason = "each test binary uses its own part")]

use bsp::{Bsp, Limits, Warnings, entity, lmp::Palette, pak::PakFile};
use scene::Scene;
use scene::import::{Assets, ImportOptions, Level, import};
use std::path::PathBuf;
use std::sync::Arc;

/// The archives of a game directory, later ones over earlier ones.
pub struct Paks(Vec<PakFile>);

impl Assets for Paks {
    fn file(&self, path: &str) -> Option<Vec<u8>> {
        let mut newest_first = self.0.iter().rev();
        newest_first.find_map(|pak| pak.read(pak.directory().find(path)?).ok())
    }

    fn texture(&self, _name: &str) -> Option<bsp::miptex::MipTex> {
        None
    }
}

impl Paks {
    /// The test data's game directory, or why there is none.
    pub fn open() -> Result<Self, String> {
        let data = std::env::var_os("RUNELIGHT_TEST_DATA").map_or_else(
            || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data")),
            PathBuf::from,
        );
        let mut paks = Vec::new();
        for name in ["id1/pak0.pak", "id1/pak1.pak"] {
            let path = data.join(name);
            let pak = PakFile::open(&path, &Limits::default(), &mut Warnings::new());
            paks.push(pak.map_err(|error| format!("{}: {error}", path.display()))?);
        }
        Ok(Self(paks))
    }

    /// Imports the level `maps/<name>.bsp`.
    pub fn level(&self, name: &str) -> Result<Arc<Scene>, Box<dyn std::error::Error>> {
        let limits = Limits::default();
        let mut warnings = Warnings::new();
        let file = |path: &str| {
            self.file(path)
                .ok_or_else(|| format!("{path} is not there"))
        };
        let palette = Palette::parse(&file("gfx/palette.lmp")?)?;
        let level = Bsp::parse(&file(&format!("maps/{name}.bsp"))?, &limits, &mut warnings)?;
        let entities = entity::parse(&level.entity_text, &limits, &mut warnings)?;
        let scene = import(
            &Level {
                name,
                bsp: &level,
                entities: &entities,
                palette: &palette,
                assets: self,
                warnings: &warnings,
            },
            &ImportOptions::default(),
        )?;
        Ok(Arc::new(scene))
    }
}
