//! Suns, domes and the brightness of the sky's picture.

use crate::common::{palette, room, scene_of};
use glam::Vec3;
use scene::Scene;
use scene::import::{DOME_RADIANCE, ImportOptions, LightMode, MAX_SKY_SCALE, SUN_RADIUS_DEG};
use scene::material::srgb_to_linear;
use scene::sky::SkyKind;
use std::f32::consts::PI;

/// The room with a window in its ceiling.
fn open_room(texture: &str) -> mapc::Map {
    let mut map = room();
    map.brush_box([64.0, 64.0, 240.0], [192.0, 192.0, 256.0], texture);
    map
}

fn imported(map: &mapc::Map) -> Scene {
    scene_of(map, &ImportOptions::default())
}

fn near(a: Vec3, b: Vec3, what: &str) {
    let off = (a - b).abs().max_element();
    assert!(
        off <= 1e-4 * b.abs().max_element(),
        "{what}: {a} is not {b}"
    );
}

#[test]
fn suns_have_direction_size_and_strength() {
    let mut map = open_room("sky1");
    map.world_key("_sunlight", "256");
    map.world_key("_sun_mangle", "45 -30 0");
    map.world_key("sunlight_color", "255 128 0");
    map.world_key("_sun2", "128");
    map.world_key("_sun2_mangle", "0 -60 0");
    map.world_key("_sunlight_penumbra", "20");
    map.entity(
        "info_null",
        &[("targetname", "below"), ("origin", "100 100 40")],
    );
    let entity = [
        ("origin", "100 100 140"),
        ("_sun", "1"),
        ("light", "50"),
        ("target", "below"),
    ];
    map.entity("light", &entity);
    map.entity(
        "light",
        &[
            ("_sunlight2", "1"),
            ("light", "300"),
            ("color", "1 0.5 0.25"),
        ],
    );
    let scene = imported(&map);
    assert!(scene.lights.is_empty() && scene.features.suns);
    let [first, second, entity] = scene.sky.suns[..] else {
        panic!("{:?}", scene.sky.suns);
    };
    // To the sun, not along its light.
    let half = 0.5f32.sqrt();
    let up = Vec3::new(-half * 0.75f32.sqrt(), -half * 0.75f32.sqrt(), 0.5);
    near(first.direction, up, "direction");
    near(
        second.direction,
        Vec3::new(-0.5, 0.0, 0.75f32.sqrt()),
        "second",
    );
    near(entity.direction, Vec3::Z, "entity");
    let strong = Vec3::new(1.0, 128.0 / 255.0, 0.0);
    near(
        first.irradiance(),
        PI / 128.0 * 0.5 * 256.0 * strong,
        "strength",
    );
    near(second.irradiance(), Vec3::splat(PI / 2.0), "second");
    near(
        entity.irradiance(),
        Vec3::splat(50.0 * PI / 256.0),
        "entity",
    );
    let cap = |degrees: f32| 1.0 - f64::from(degrees).to_radians().cos();
    for (sun, degrees) in [(first, 10.0), (second, 10.0), (entity, SUN_RADIUS_DEG)] {
        let ratio = f64::from(sun.one_minus_cos) / cap(degrees);
        assert!((ratio - 1.0).abs() < 1e-5, "{ratio} at {degrees}");
    }
    // What comes in through the window, 128 by 128 units and 16 deep; two of its sides let light in.
    let area = 128.0 * 128.0 * up.z + 128.0 * 16.0 * -(up.x + up.y);
    let weight = area * scene::material::luminance(first.irradiance().into()) / PI;
    assert!((first.weight / weight - 1.0).abs() < 1e-4);
    // The dome of the entity.
    let upper = mean_of_sky1() * scene.sky.scale[0];
    near(
        upper,
        300.0 * DOME_RADIANCE * Vec3::new(1.0, 0.5, 0.25),
        "dome",
    );
    // A sun is no texture.
    let options = ImportOptions {
        lights: LightMode::Textures,
        ..ImportOptions::default()
    };
    assert!(scene_of(&map, &options).sky.suns.is_empty());
    // Without a window there is none to be seen.
    let mut dark = room();
    dark.world_key("_sunlight", "256");
    assert!(imported(&dark).sky.suns.is_empty());
}

#[test]
fn cells_that_see_the_window_list_the_sun() {
    let mut map = open_room("sky1");
    map.brush_box([400.0, 64.0, 0.0], [416.0, 448.0, 256.0], "wall");
    map.entity("light", &[("origin", "460 400 100")]);
    map.world_key("_sunlight", "256");
    let scene = imported(&map);
    let sun = scene.emitters.alias.len() as u32 - 1;
    let lists = |emitter| {
        scene
            .cells
            .entries
            .iter()
            .filter(|e| e.emitter == emitter)
            .count()
    };
    assert!(lists(sun) > 0);
    // Straight down it does not come far from the window, as the lamp's light does.
    assert!(
        lists(sun) < lists(sun - 1),
        "{} of {}",
        lists(sun),
        lists(sun - 1)
    );
}

fn mean_of_sky1() -> Vec3 {
    let [b, f] = [80, 120].map(|c| srgb_to_linear(c) as f32);
    Vec3::splat(0.25 * f + 0.75 * b)
}

#[test]
fn each_half_of_the_sky_is_as_bright_as_its_dome_and_never_darker_than_its_picture() {
    let mut map = open_room("sky1");
    map.world_key("_sunlight2", "200");
    map.world_key("_sunlight2_color", "1 0.5 0.01");
    map.world_key("_sunlight3", "100");
    map.world_key("_sunlight", "300");
    let scene = imported(&map);
    let asked = Vec3::new(200.0, 100.0, 2.0) * DOME_RADIANCE;
    let [upper, lower] = scene.sky.scale.map(|s| s * mean_of_sky1());
    near(upper, asked.max(mean_of_sky1()), "upper");
    near(lower, Vec3::splat(100.0 * DOME_RADIANCE), "lower");
    let weight = scene
        .materials
        .iter()
        .map(|m| m.emission_weight)
        .fold(0.0, f32::max);
    let brighter = scene::material::luminance(upper.into());
    assert!(
        (weight / brighter - 1.0).abs() < 1e-4,
        "{weight} {brighter}"
    );
    assert!(
        scene
            .sky
            .scale
            .iter()
            .all(|s| s.max_element() <= MAX_SKY_SCALE)
    );
}

#[test]
fn a_black_sky_that_is_asked_for_light_is_plain() {
    let mut map = open_room("sky_void");
    map.texture(mapc::Texture::solid("sky_void", 256, 128, 0));
    map.world_key("_sunlight2", "100");
    map.world_key("_sunlight3", "50");
    let scene = imported(&map);
    assert_eq!(scene.sky.kind, SkyKind::Flat(Vec3::ONE));
    near(
        scene.sky.scale[0],
        Vec3::splat(100.0 * DOME_RADIANCE),
        "upper",
    );
    near(
        scene.sky.scale[1],
        Vec3::splat(50.0 * DOME_RADIANCE),
        "lower",
    );
    let told = scene.report.warnings.iter().any(|w| w.contains("is black"));
    assert!(told, "{:?}", scene.report.warnings);
    // A sun alone does not ask for that.
    let mut map = open_room("sky_void");
    map.texture(mapc::Texture::solid("sky_void", 256, 128, 0));
    map.world_key("_sunlight", "100");
    let scene = imported(&map);
    assert!(matches!(scene.sky.kind, SkyKind::Scrolling { .. }));
    assert_eq!(scene.emitters.alias.len(), 1);
}

/// An uncompressed TGA of one colour, 2 by 2 texels.
fn tga([r, g, b]: [u8; 3]) -> Vec<u8> {
    let mut file = vec![0; 18];
    (file[2], file[12], file[14], file[16]) = (2, 2, 2, 24);
    file.extend([b, g, r].repeat(4));
    file
}

fn with_files(map: &mapc::Map, files: &[(&str, Vec<u8>)]) -> Scene {
    in_sky(None, map, files)
}

/// The scene with another sky than the level asks for.
fn in_sky(skybox: Option<&str>, map: &mapc::Map, files: &[(&str, Vec<u8>)]) -> Scene {
    let files = |path: &str| {
        let found = files.iter().find(|(name, _)| *name == path);
        found.map(|(_, bytes)| bytes.clone())
    };
    let options = ImportOptions {
        skybox: skybox.map(str::to_owned),
        ..ImportOptions::default()
    };
    scene::import::import(&crate::common::compile(map), &palette(), &files, &options)
        .expect("a scene")
}

#[test]
fn skyboxes_take_the_place_of_the_level_s_sky() {
    let mut map = open_room("sky1");
    map.world_key("_sky", "night_");
    map.world_key("_sunlight3", "200");
    let colors = [10, 20, 30, 40, 250, 60].map(|grey| [grey, grey, 2 * (grey / 2)]);
    let names = ["rt", "bk", "lf", "ft", "up", "dn"].map(|s| format!("gfx/env/night_{s}.tga"));
    let mut files: Vec<(&str, Vec<u8>)> = (names.iter())
        .zip(colors)
        .map(|(name, color)| (name.as_str(), tga(color)))
        .collect();
    let scene = with_files(&map, &files);
    let SkyKind::Box(first) = scene.sky.kind else {
        panic!("{:?}", scene.sky);
    };
    for (i, color) in colors.into_iter().enumerate() {
        let side = &scene.textures[first.0 as usize + i];
        assert_eq!(
            (side.width, side.rgba[3]),
            (2, [color[0], color[1], color[2], 255])
        );
    }
    assert!(!scene.report.warnings.iter().any(|w| w.contains("skybox")));
    // From the ground one sees the zenith's side, of 55 % of the cosine-weighted hemisphere.
    let linear = |grey: u8| srgb_to_linear(grey) as f32;
    let top = 4.0 / PI * 0.5f32.sqrt() * 0.5f32.sqrt().atan();
    assert!((top - 0.5541).abs() < 1e-4);
    let around = [10, 20, 30, 40].map(linear).iter().sum::<f32>() / 4.0;
    let upper = top * linear(250) + (1.0 - top) * around;
    let lower = top * linear(60) + (1.0 - top) * around;
    let asked = 200.0 * DOME_RADIANCE;
    assert_eq!(scene.sky.scale[0], Vec3::ONE);
    assert!((scene.sky.scale[1].x * lower / asked - 1.0).abs() < 1e-3);
    let weight = scene
        .materials
        .iter()
        .map(|m| m.emission_weight)
        .fold(0.0, f32::max);
    assert!((weight / asked.max(upper) - 1.0).abs() < 1e-3, "{weight}");

    // Another name stands for the level's.
    let plain = in_sky(Some(""), &map, &files);
    assert!(matches!(plain.sky.kind, SkyKind::Scrolling { .. }));
    let plain = open_room("sky1");
    let named = in_sky(Some("night_"), &plain, &files);
    assert!(matches!(named.sky.kind, SkyKind::Box(_)));

    // A side that is missing, and one that is broken, are black.
    files.remove(4);
    files[0].1.truncate(20);
    let scene = with_files(&map, &files);
    let SkyKind::Box(first) = scene.sky.kind else {
        panic!("{:?}", scene.sky);
    };
    for side in [0, 4] {
        assert_eq!(
            scene.textures[first.0 as usize + side].rgba,
            [[0, 0, 0, 255]]
        );
    }
    let told = |text| {
        scene
            .report
            .warnings
            .iter()
            .any(|w: &String| w.contains(text))
    };
    assert!(
        told("lacks sides, which are black: up"),
        "{:?}",
        scene.report.warnings
    );
    assert!(told("night_rt.tga"), "{:?}", scene.report.warnings);

    // Without any, the level's own sky is there.
    let scene = with_files(&map, &[]);
    assert!(matches!(scene.sky.kind, SkyKind::Scrolling { .. }));
    assert!(
        scene
            .report
            .warnings
            .iter()
            .any(|w| w.contains("no picture of the skybox"))
    );
}
