//! One level with every kind of light and surface at once: what each renderer does with one of them
//! it must also do beside the others.

use bsp::lmp::Palette;
use bsp::{Level, Limits, SearchPath};
use gallery::builder::camera;
use glam::Vec3;
use mapc::{Brush, Map, Texture};
use runelight_tests::builder::settings;
use runelight_tests::devices::{Device, render};
use runelight_tests::stats::ZTest;
use scene::import::{ImportOptions, import};
use scene::render::{Estimator, Settings};
use scene::{Camera, Scene};
use std::sync::{Arc, LazyLock};

/// Height of the water, world units.
const WATER: f64 = 96.0;
/// Level time at which styles 1 and 2 burn neither fully nor not at all, and the sky has moved.
const TIME: f32 = 1.3;

fn palette() -> Palette {
    Palette(std::array::from_fn(|i| match i as u8 {
        1 => [150, 130, 110],
        2 => [90, 100, 130],
        3 => [100, 150, 160],
        4 => [60, 90, 110],
        5 => [130, 150, 220],
        6 => [220, 200, 190],
        // From 224 on they are fullbright.
        250 => [255, 220, 160],
        251 => [180, 220, 255],
        _ => [0; 3],
    }))
}

/// A hall under the sky, half of it dry, half under water; a lamp on a wall and one on the bottom, a
/// grate that stands in the water and out of it.
fn map() -> Map {
    let mut map = Map::new();
    map.texture(Texture::from_fn("wall", 64, 64, |x, y| {
        1 + u8::from((x / 16 + y / 16) % 2 == 1)
    }));
    // A bright rectangle with a dark cross, and a smaller one of another colour.
    map.texture(Texture::from_fn("lamp", 32, 32, |x, y| match (x, y) {
        (10 | 11, _) | (_, 7) => 1,
        (4..20, 4..12) => 250,
        (24..30, 20..30) => 251,
        _ => 2,
    }));
    map.texture(Texture::from_fn("{grate", 32, 32, |x, y| {
        if x % 16 < 4 || y % 16 < 4 { 1 } else { 255 }
    }));
    map.texture(Texture::from_fn("*water", 64, 64, |x, y| {
        3 + u8::from((x ^ y) & 8 != 0)
    }));
    // Left the front layer with its holes, right the one behind it.
    map.texture(Texture::from_fn("sky1", 256, 128, |x, y| match x {
        128.. => 5,
        _ if (x / 32 + y / 32) % 2 == 0 => 6,
        _ => 0,
    }));
    for (key, value) in [
        ("wateralpha", "0.4"),
        ("_sunlight", "200"),
        ("_sun_mangle", "50 -60 0"),
        ("_sunlight_penumbra", "8"),
    ] {
        map.world_key(key, value);
    }
    let walls = ["wall", "wall", "wall", "lamp", "wall", "sky1"];
    map.room_faces([0.0; 3], [512.0, 384.0, 288.0], 16.0, walls);
    map.brush_box([0.0; 3], [160.0, 384.0, 128.0], "wall");
    map.brush_box([160.0, 0.0, 0.0], [512.0, 384.0, WATER], "*water");
    map.brush_box([400.0, 100.0, 0.0], [464.0, 164.0, 24.0], "lamp");
    let grate = Brush::cuboid([300.0, 140.0, 32.0], [304.0, 300.0, 176.0], ["{grate"; 6]);
    map.brush_entity("func_wall", &[], vec![grate]);
    map.entity("info_player_start", &[("origin", "80 80 160")]);
    for (origin, keys) in [
        ("80 300 220", &[("light", "150")][..]),
        ("240 200 200", &[("light", "200"), ("style", "2")]),
        ("360 80 40", &[("light", "180"), ("style", "1")]),
        (
            "220 100 240",
            &[("light", "400"), ("mangle", "40 -70 0"), ("angle", "60")],
        ),
    ] {
        map.entity("light", &[&[("origin", origin)], keys].concat());
    }
    map
}

fn level() -> Arc<Scene> {
    static LEVEL: LazyLock<Arc<Scene>> = LazyLock::new(|| {
        let bytes = mapc::compile(&map(), &mapc::Options::default())
            .expect("a map")
            .bytes;
        let search = SearchPath::builder().build().expect("an empty search path");
        let level = Level::from_bytes(&search, "everything", bytes, &Limits::default());
        let options = ImportOptions {
            time: TIME,
            ..ImportOptions::default()
        };
        let scene = import(&level.expect("a level"), &palette(), &|_| None, &options);
        Arc::new(scene.expect("a scene"))
    });
    LEVEL.clone()
}

#[test]
fn the_level_has_everything() {
    let scene = level();
    let f = scene.features;
    assert!(
        f.sky && f.suns && f.liquids && f.translucent && f.fences,
        "{f:?}"
    );
    assert!(
        f.emissive_surfaces && f.point_lights && f.spotlights,
        "{f:?}"
    );
    assert!(matches!(
        scene.sky.kind,
        scene::sky::SkyKind::Scrolling { .. }
    ));
    assert!(scene.report.sealed && !scene.cells.cells.is_empty());
    assert_eq!((scene.lights.len(), scene.sky.suns.len()), (4, 1));
    let mut styles: Vec<u16> = scene.lights.iter().map(|l| l.style).collect();
    styles.sort_unstable();
    assert_eq!(styles, [0, 0, 1, 2]);
    // The two rectangles of the lamp's texture.
    let rectangles: Vec<usize> = (scene.emitters.maps.iter())
        .map(|m| m.rectangles.len())
        .collect();
    assert_eq!(rectangles, [2]);
}

fn check_devices(name: &str, view: Camera) {
    let scene = level();
    let films = Device::ALL.map(|device| {
        let settings = Settings {
            width: 32,
            height: 18,
            time: TIME,
            seed: device as u64,
            ..settings(view.clone(), 32, Estimator::Mis, 5)
        };
        render(device, &scene, &settings, 512)
    });
    ZTest::new(&films[0], &films[1]).assert(&format!("everything {name}, Vulkan against CPU"));
}

#[test]
fn the_devices_agree_on_everything_seen_from_the_shore() {
    check_devices(
        "above water",
        camera(Vec3::new(60.0, 60.0, 210.0), 22.0, 30.0, 95.0),
    );
}

#[test]
fn the_devices_agree_on_everything_seen_from_below() {
    let eye = Vec3::new(200.0, 60.0, 40.0);
    assert!(level().media.at(eye).is_some());
    check_devices("under water", camera(eye, -14.0, 40.0, 95.0));
}
