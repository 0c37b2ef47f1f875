//! What the tests share: a palette, levels from maps, the real levels.

use bsp::lmp::Palette;
use bsp::miptex::Animation;
use bsp::styles::LightStyles;
use bsp::{Bsp, Level, Limits, SearchPath, Warnings, entity};
use scene::Scene;
use scene::import::{ImportOptions, import};
use std::path::PathBuf;

/// Index of a fullbright white.
pub const WHITE: u8 = 254;
/// Index of a fullbright colour too dark to emit at the default threshold.
pub const DIM: u8 = 224;

/// Greys; of the fullbright part the last but one is white, the rest dark.
pub fn palette() -> Palette {
    let mut colors = [[0; 3]; 256];
    for (i, color) in colors.iter_mut().enumerate() {
        *color = match i {
            0..224 => [i as u8; 3],
            254 => [255; 3],
            _ => [60; 3],
        };
    }
    Palette(colors)
}

/// A level from the bytes of a file.
pub fn level_from(bytes: &[u8]) -> Level {
    let limits = Limits::default();
    let mut warnings = Warnings::new();
    let bsp = Bsp::parse(bytes, &limits, &mut warnings).expect("a level");
    let entities = entity::parse(&bsp.entity_text, &limits, &mut warnings).expect("entities");
    Level {
        name: "test".to_owned(),
        origin: "memory".to_owned(),
        light: bsp.own_light_samples(),
        animation: Animation::new(&bsp.textures, &mut warnings),
        styles: LightStyles::at_start(&entities),
        entities,
        companions: Vec::new(),
        warnings,
        bsp,
    }
}

/// A room of 512 by 512 by 256 units from the origin on, with the usual textures.
pub fn room() -> mapc::Map {
    let mut map = mapc::Map::new();
    for (name, index) in [
        ("wall", 100),
        ("lamp", WHITE),
        ("dimlamp", DIM),
        ("*water", 50),
    ] {
        map.texture(mapc::Texture::solid(name, 64, 64, index));
    }
    map.texture(mapc::Texture::solid("*lava1", 64, 64, 200));
    map.texture(mapc::Texture::from_fn("sky1", 256, 128, |x, y| match x {
        128.. => 80,
        _ if y < 32 => 120,
        _ => 0,
    }));
    map.room([0.0; 3], [512.0, 512.0, 256.0], 16.0, "wall");
    map.entity(
        "info_player_start",
        &[("origin", "256 256 32"), ("angle", "90")],
    );
    map
}

/// The level a map compiles to.
pub fn compile(map: &mapc::Map) -> Level {
    let out = mapc::compile(map, &mapc::Options::default()).expect("a map");
    level_from(&out.bytes)
}

/// The scene of a map.
pub fn scene_of(map: &mapc::Map, options: &ImportOptions) -> Scene {
    import(&compile(map), &palette(), &|_| None, options).expect("a scene")
}

/// Folder of the real levels, or `None` with a line that says so.
pub fn data() -> Option<PathBuf> {
    let dir = std::env::var_os("RUNELIGHT_TEST_DATA").map_or_else(
        || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data")),
        PathBuf::from,
    );
    if dir.join("id1/pak0.pak").is_file() {
        return Some(dir);
    }
    println!("SKIPPED: no test data in {}", dir.display());
    None
}

/// Calls `f` with every real level that can be read, its scene, and its palette's search path.
pub fn for_each_level(mut f: impl FnMut(&Level, &Scene)) {
    let Some(dir) = data() else { return };
    let limits = Limits::default();
    let search = SearchPath::builder()
        .basedir(&dir)
        .build()
        .expect("search path");
    let palette = search.read("gfx/palette.lmp").expect("palette").bytes;
    let palette = Palette::parse(&palette).expect("palette");
    let files = |path: &str| search.read_optional(path).ok().flatten().map(|f| f.bytes);
    let mut names = search.list("maps/");
    names.retain(|n| n.ends_with(".bsp") && !n.starts_with("maps/b_"));
    let loose = std::fs::read_dir(dir.join("loose/bsp")).expect("loose levels");
    let mut loose: Vec<PathBuf> = loose.map(|e| e.expect("entry").path()).collect();
    loose.retain(|p| p.extension().is_some_and(|e| e == "bsp"));
    loose.sort();
    names.extend(loose.iter().map(|p| p.display().to_string()));
    let mut count = 0;
    for name in names {
        let Ok(level) = Level::load(&search, &name, &limits) else {
            assert!(
                name.ends_with("_hl.bsp") || name.ends_with("_q2.bsp"),
                "{name} can't be read"
            );
            continue;
        };
        let scene = import(&level, &palette, &files, &ImportOptions::default()).expect("a scene");
        f(&level, &scene);
        count += 1;
    }
    assert!(count >= 30, "only {count} levels");
}

/// Numbers in 0..1 that are the same in every run (xorshift64*, Vigna 2016).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.next() * n as f64) as usize
    }
}
