//! The bundled level: its built files are those its source gives, and it is a sound level.

use std::fs;
use std::path::PathBuf;

use qbsp::{BspData, BspParseInput, BspParseSettings};

use crate::check;
use crate::reader::Bsp;

fn asset(name: &str) -> Vec<u8> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../../assets/sample")
        .join(name);
    fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

fn map_text() -> String {
    String::from_utf8(asset("sample.map")).unwrap()
}

#[test]
fn the_built_files_are_up_to_date() {
    let built = mapc::sample::build(&map_text()).unwrap();
    assert_eq!(built.warnings, Vec::<String>::new());
    let stale = "run `cargo xtask sample`";
    assert!(
        built.bytes == asset("sample.bsp"),
        "sample.bsp is stale: {stale}"
    );
    assert!(
        mapc::sample::palette() == asset("palette.lmp"),
        "palette.lmp is stale: {stale}"
    );
    assert!(
        mapc::sample::demo(&map_text()).unwrap() == asset("sample.dem"),
        "sample.dem is stale: {stale}"
    );
    for (name, bytes) in mapc::sample::models() {
        assert!(bytes == asset(name), "{name} is stale: {stale}");
    }
}

#[test]
fn the_level_is_closed_and_holds_what_it_promises() {
    let bytes = asset("sample.bsp");
    let bsp = Bsp::new(&bytes);
    check::closed(&bsp);
    check::winding(&bsp);
    check::marks(&bsp);
    check::visibility(&bsp, [0.0, -512.0, -96.0], [1312.0, 608.0, 512.0], 20_000);
    let triangles: usize = bsp.faces().iter().map(|f| f.vertices.len() - 2).sum();
    assert!(
        (2_000..15_000).contains(&triangles),
        "{triangles} triangles"
    );
    let names = bsp.texture_names();
    for name in [
        "sky_day",
        "*lava",
        "*water",
        "{grate",
        "+0lamp",
        "+3lamp",
        "lamp_small",
    ] {
        assert!(names.iter().any(|n| n == name), "{name} is missing");
    }
    let entities = bsp.entities();
    for class in [
        "info_player_start",
        "info_intermission",
        "func_door",
        "func_plat",
        "light",
        "light_torch_small_walltorch",
        "item_sigil",
        "monster_scarab",
    ] {
        assert!(
            entities.contains(&format!("\"classname\" \"{class}\"")),
            "{class} is missing"
        );
    }
}

#[test]
fn another_reader_agrees() {
    let bytes = asset("sample.bsp");
    let input = BspParseInput {
        bsp: &bytes,
        lit: None,
        settings: BspParseSettings::default(),
    };
    let data = BspData::parse(input).unwrap();
    let bsp = Bsp::new(&bytes);
    assert_eq!(data.faces.len(), bsp.faces().len());
    assert_eq!(data.models.len(), bsp.models().len());
    assert_eq!(data.leaves.len(), bsp.leafs().len());
    assert_eq!(data.textures.len(), bsp.texture_names().len());
}

#[test]
fn the_palette_has_quakes_structure_and_fences_have_holes_only_where_they_may() {
    let palette = mapc::sample::palette();
    assert_eq!(palette.len(), 768);
    let luma = |i: usize| {
        let c: Vec<u32> = palette[3 * i..3 * i + 3]
            .iter()
            .map(|v| u32::from(*v))
            .collect();
        2 * c[0] + 7 * c[1] + c[2]
    };
    for row in 0..15 {
        for i in 1..16 {
            let (a, b) = (luma(row * 16 + i - 1), luma(row * 16 + i));
            let darker = (8..14).contains(&row);
            assert!(if darker { a > b } else { a < b }, "row {row} at {i}");
        }
    }
    for t in mapc::sample::textures() {
        let holes = t.pixels.contains(&255);
        assert_eq!(holes, t.name.starts_with('{'), "{}", t.name);
    }
    // The dark room's lamp: 8 by 8 texels that shine.
    let lamp = mapc::sample::textures()
        .into_iter()
        .find(|t| t.name == "lamp_small")
        .unwrap();
    assert_eq!(lamp.pixels.iter().filter(|p| **p >= 224).count(), 64);
}
