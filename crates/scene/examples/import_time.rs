//! Times reading and importing levels of a game directory, and says what came out.
//!
//! `cargo run --release -p scene --example import_time [DATA_DIR] [NAME_PART]`

use bsp::{Level, Limits, SearchPath, lmp::Palette};
use scene::import::{ImportOptions, import};
use std::path::{Path, PathBuf};
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let data: PathBuf = args.next().map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"),
        PathBuf::from,
    );
    let part = args.next().unwrap_or_default();
    let limits = Limits::default();
    let search = SearchPath::builder().basedir(&data).build()?;
    let palette = Palette::parse(&search.read("gfx/palette.lmp")?.bytes)?;
    let files = |path: &str| search.read_optional(path).ok().flatten().map(|f| f.bytes);

    let mut names: Vec<String> = search.list("maps/");
    names.retain(|n| n.ends_with(".bsp") && !n.starts_with("maps/b_"));
    if let Ok(loose) = std::fs::read_dir(data.join("loose/bsp")) {
        let mut loose: Vec<PathBuf> = loose.filter_map(|e| Some(e.ok()?.path())).collect();
        loose.sort();
        names.extend(
            loose
                .iter()
                .filter(|p| p.extension().is_some_and(|e| e == "bsp"))
                .map(|p| p.display().to_string()),
        );
    }
    println!(
        "{:18} {:>6} {:>6} {:>6} {:>7} {:>5} {:>5} {:>5} {:>6} {:>5} {:>7} {:>4} {:>5} {:>4}",
        "level",
        "load",
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
    for name in names.iter().filter(|n| n.contains(&part)) {
        let start = Instant::now();
        let level = match Level::load(&search, name, &limits) {
            Ok(level) => level,
            Err(error) => {
                println!("{error}");
                continue;
            }
        };
        let load = start.elapsed();
        let start = Instant::now();
        let scene = import(&level, &palette, &files, &ImportOptions::default())?;
        let took = start.elapsed();
        let r = &scene.report;
        println!(
            "{:18} {:>4}ms {:>4}ms {:>6} {:>7} {:>5} {:>5} {:>5} {:>6} {:>5} {:>7} {:>4} {:>5} {:>4}",
            scene.name,
            load.as_millis(),
            took.as_millis(),
            r.faces,
            scene.triangle_count(),
            r.faces_left_out,
            scene.instances.len(),
            r.open_edges,
            r.t_junctions_split,
            r.sealed,
            scene.emitters.list.len(),
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
