//! Times reading and importing every level of the test data, and says what came out.
//!
//! `cargo run --release -p scene --example import_time [DATA_DIR] [NAME_PART]`

use bsp::{Bsp, Limits, Warnings, entity, lmp::Palette, pak::PakFile};
use scene::import::{Assets, ImportOptions, Level, import};
use std::path::{Path, PathBuf};
use std::time::Instant;

struct Paks(Vec<PakFile>);

impl Assets for Paks {
    fn file(&self, path: &str) -> Option<Vec<u8>> {
        self.0
            .iter()
            .rev()
            .find_map(|pak| pak.read(pak.directory().find(path)?).ok())
    }
    fn texture(&self, _name: &str) -> Option<bsp::miptex::MipTex> {
        None
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let data: PathBuf = args.next().map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"),
        PathBuf::from,
    );
    let part = args.next().unwrap_or_default();
    let limits = Limits::default();
    let mut paks = Vec::new();
    for name in ["id1/pak0.pak", "id1/pak1.pak"] {
        paks.push(PakFile::open(
            &data.join(name),
            &limits,
            &mut Warnings::new(),
        )?);
    }
    let mut levels: Vec<(String, Vec<u8>)> = Vec::new();
    for pak in &paks {
        for entry in pak.directory().entries() {
            if entry.name.ends_with(".bsp") && !entry.name.starts_with("maps/b_") {
                levels.push((entry.name.clone(), pak.read(entry)?));
            }
        }
    }
    let mut loose: Vec<PathBuf> = std::fs::read_dir(data.join("loose/bsp"))?
        .filter_map(|e| Some(e.ok()?.path()))
        .filter(|p| p.extension().is_some_and(|e| e == "bsp"))
        .collect();
    loose.sort();
    for path in loose {
        levels.push((path.display().to_string(), std::fs::read(&path)?));
    }
    let assets = Paks(paks);
    let palette = Palette::parse(&assets.file("gfx/palette.lmp").ok_or("no palette")?)?;
    let name = |n: &str| n.rsplit('/').next().unwrap_or(n).to_owned();
    println!(
        "{:22} {:>6} {:>6} {:>6} {:>7} {:>5} {:>5} {:>5} {:>6} {:>5} {:>7} {:>4} {:>5} {:>4}",
        "level",
        "read",
        "import",
        "faces",
        "tris",
        "left",
        "insts",
        "open",
        "tjunc",
        "seal",
        "emitris",
        "lamp",
        "texel",
        "cams"
    );
    for (path, bytes) in levels {
        if !path.contains(&part) {
            continue;
        }
        let start = Instant::now();
        let mut warnings = Warnings::new();
        let level = match Bsp::parse(&bytes, &limits, &mut warnings) {
            Ok(level) => level,
            Err(error) => {
                println!("{:22} {error}", name(&path));
                continue;
            }
        };
        let entities = entity::parse(&level.entity_text, &limits, &mut warnings)?;
        let read = start.elapsed();
        let start = Instant::now();
        let scene = import(
            &Level {
                name: &name(&path),
                bsp: &level,
                entities: &entities,
                palette: &palette,
                assets: &assets,
                warnings: &warnings,
            },
            &ImportOptions::default(),
        )?;
        let took = start.elapsed();
        let r = &scene.report;
        println!(
            "{:22} {:>4}ms {:>4}ms {:>6} {:>7} {:>5} {:>5} {:>5} {:>6} {:>5} {:>7} {:>4} {:>5} {:>4}",
            scene.name,
            read.as_millis(),
            took.as_millis(),
            r.faces,
            scene.triangle_count(),
            r.faces_left_out,
            scene.instances.len(),
            r.open_edges,
            r.t_junctions_split,
            r.sealed,
            scene.emitters.triangles.len(),
            scene.lights.len(),
            r.emissive_texels,
            scene.cameras.len(),
        );
        if !part.is_empty() {
            for warning in &r.warnings {
                println!("    {warning}");
            }
        }
    }
    Ok(())
}
