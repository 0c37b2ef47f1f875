//! Pictures that replace textures, and materials by name.

use crate::common::{WHITE, compile, palette, room, scene_of};
use scene::import::rules::Rules;
use scene::import::{ImportOptions, import};
use scene::{Material, Scene, Texture};

/// A top-down TGA with alpha.
fn tga(width: u16, texels: &[[u8; 4]]) -> Vec<u8> {
    let height = texels.len() as u16 / width;
    let mut file = vec![0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    file.extend(width.to_le_bytes());
    file.extend(height.to_le_bytes());
    file.extend([32, 0x28]);
    file.extend(texels.iter().flat_map(|&[r, g, b, a]| [b, g, r, a]));
    file
}

fn with_files(map: &mapc::Map, files: &[(&str, Vec<u8>)], options: &ImportOptions) -> Scene {
    let read = |path: &str| {
        let found = files.iter().find(|(name, _)| *name == path);
        found.map(|(_, bytes)| bytes.clone())
    };
    import(&compile(map), &palette(), &read, options).expect("a scene")
}

fn material<'a>(scene: &'a Scene, name: &str) -> &'a Material {
    let found = scene.materials.iter().find(|m| m.name == name);
    found.unwrap_or_else(|| panic!("no material {name}"))
}

fn base<'a>(scene: &'a Scene, name: &str) -> &'a Texture {
    &scene.textures[material(scene, name).base.0 as usize]
}

const RED: [u8; 4] = [255, 0, 0, 255];
const BLUE: [u8; 4] = [0, 0, 255, 255];
const NONE: [u8; 4] = [0, 0, 0, 0];

/// Largest texture coordinate on a material, in tiles.
fn tiles(scene: &Scene, name: &str) -> f32 {
    let width = base(scene, name).width as f32;
    let uvs = scene.meshes[0]
        .triangles
        .iter()
        .filter(|t| scene.materials[t.material.0 as usize].name == name);
    uvs.flat_map(|t| t.uv)
        .map(|[u, _]| u / width)
        .fold(0.0, f32::max)
}

#[test]
fn pictures_replace_textures_and_fit_whatever_their_size() {
    let plain = scene_of(&room(), &ImportOptions::default());
    let files = [
        ("textures/wall.tga", tga(1, &[BLUE])),
        // The level's own folder comes first. 128 texels stand for 64.
        ("textures/test/wall.tga", tga(128, &[RED; 128 * 128])),
        ("textures/wall_norm.tga", tga(2, &[[128, 128, 255, 255]; 4])),
        (
            "textures/lamp_luma.tga",
            tga(2, &[RED, [9, 9, 9, 255], NONE, BLUE]),
        ),
        ("textures/#water.tga", tga(1, &[RED])),
    ];
    let mut map = room();
    map.brush_box([0.0, 0.0, 0.0], [512.0, 256.0, 64.0], "*water");
    map.brush_box([100.0, 400.0, 100.0], [164.0, 464.0, 132.0], "lamp");
    let scene = with_files(&map, &files, &ImportOptions::default());
    let wall = base(&scene, "wall");
    assert!((wall.width, wall.height) == (128, 128) && wall.rgba[77] == RED);
    assert!((tiles(&scene, "wall") - tiles(&plain, "wall")).abs() < 1e-3);
    // All pictures of a surface have one size.
    let normals = material(&scene, "wall").finish.normals.expect("normals");
    assert_eq!(
        scene.textures[normals.0 as usize].rgba,
        [[128, 128, 255, 255]; 128 * 128]
    );
    assert!(scene.features.normal_maps);
    let lamp = material(&scene, "lamp");
    let glow = &scene.textures[lamp.emission.expect("a glow").0 as usize];
    assert_eq!(
        (glow.width, glow.height),
        (64, 64),
        "as fine as the texture"
    );
    let corners = [0, 63, 64 * 63, 64 * 64 - 1].map(|i| glow.rgba[i]);
    let black = [0, 0, 0, 255];
    assert_eq!(corners, [RED, black, black, BLUE]);
    assert_eq!(base(&scene, "*water").rgba, [RED]);
    let replaced: Vec<&str> = scene
        .report
        .replaced
        .iter()
        .map(|(t, _)| t.as_str())
        .collect();
    assert_eq!(replaced, ["*water", "wall"]);

    let off = ImportOptions {
        replacements: false,
        ..ImportOptions::default()
    };
    let scene = with_files(&map, &files, &off);
    assert!(base(&scene, "wall").width == 64 && scene.report.replaced.is_empty());
}

#[test]
fn replaced_fences_keep_their_holes_and_a_broken_picture_is_told_of() {
    let mut map = room();
    map.texture(mapc::Texture::from_fn("{bars", 64, 64, |x, _| {
        if x < 32 { 255 } else { WHITE }
    }));
    map.brush_box([100.0, 100.0, 0.0], [164.0, 116.0, 64.0], "{bars");
    let holes = |files: &[(&str, Vec<u8>)]| {
        let scene = with_files(&map, files, &ImportOptions::default());
        let alpha: Vec<bool> = base(&scene, "{bars")
            .rgba
            .iter()
            .map(|t| t[3] != 0)
            .collect();
        assert!(
            base(&scene, "{bars")
                .rgba
                .iter()
                .all(|t| t[..3] != [9, 9, 9] || t[3] != 0)
        );
        (alpha, scene)
    };
    // Its own alpha; without one, the level's holes. What is in a hole has the colour beside it.
    let nine = [9, 9, 9, 0];
    let (own, scene) = holes(&[("textures/{bars.tga", tga(2, &[RED, nine, nine, RED]))]);
    assert_eq!(own.len(), 64 * 64, "as fine as the fullbright texels");
    assert!(own[0] && !own[63] && own[64 * 64 - 1]);
    assert_eq!(base(&scene, "{bars").rgba[63], [255, 0, 0, 0]);
    let emission = material(&scene, "{bars").emission.expect("fullbright bars");
    let black = |i: usize| scene.textures[emission.0 as usize].rgba[i][..3] == [0; 3];
    assert!(black(63) && !black(64 * 64 - 1), "holes do not shine");
    let (levels, _) = holes(&[("textures/{bars.tga", tga(2, &[RED; 4]))]);
    assert!(!levels[0] && levels[63]);
    let (_, scene) = holes(&[("textures/{bars.tga", b"no picture".to_vec())]);
    assert_eq!(base(&scene, "{bars").width, 64);
    let told = |w: &String| w.starts_with("textures/{bars.tga: TGA header: found 10 bytes");
    assert!(
        scene.report.warnings.iter().any(told),
        "{:?}",
        scene.report.warnings
    );
}

#[test]
fn materials_say_what_surfaces_are_made_of() {
    let rules = r##"
        [[material]]
        texture = ["wall", "lamp"]
        kind = "metal"
        roughness = 0.25
        roughness_image = "textures/rough.tga"
        [[material]]
        texture = "lamp"
        kind = "glass"
        alpha = 0.2
        tint = [1, 0.5, 0]
        emission = 3
        emission_color = [1, 0, 0]
        [[material]]
        texture = "dim*"
        kind = "liquid"
        [[material]]
        texture = "#water"
        absorption = [0.5, 0.25, 0]
        alpha = 0.5
    "##;
    let options = ImportOptions {
        materials: Rules::parse("test.toml", rules).expect("rules"),
        ..ImportOptions::default()
    };
    let mut map = room();
    map.brush_box([0.0, 0.0, 0.0], [512.0, 256.0, 64.0], "*water");
    map.brush_box([100.0, 400.0, 100.0], [164.0, 464.0, 132.0], "lamp");
    map.brush_box([300.0, 400.0, 100.0], [364.0, 464.0, 132.0], "dimlamp");
    let rough = tga(1, &[[200, 0, 0, 255]]);
    let scene = with_files(&map, &[("textures/rough.tga", rough)], &options);
    assert!(scene.features.gloss && scene.features.translucent);
    let gloss = material(&scene, "wall").finish.gloss.expect("metal");
    assert_eq!((gloss.roughness, gloss.metallic), (0.25, 1.0));
    let picture = gloss.roughness_map.expect("a picture");
    assert!(
        scene.textures[picture.0 as usize]
            .rgba
            .iter()
            .all(|t| t[0] == 200)
    );
    let lamp = material(&scene, "lamp");
    assert_eq!((lamp.finish.alpha, lamp.finish.gloss), (0.2, None));
    assert_eq!(lamp.finish.tint.to_array(), [1.0, 0.5, 0.0]);
    assert!((lamp.emission_scale - options.emission_scale * 0.2 * 3.0).abs() < 1e-6);
    let glow = &scene.textures[lamp.emission.expect("a glow").0 as usize];
    assert!(glow.rgba.iter().all(|t| *t == RED));
    let dim = material(&scene, "dimlamp");
    assert!(dim.warped && dim.two_sided);
    let water = &material(&scene, "*water").finish;
    assert_eq!(
        (water.alpha, water.absorption.to_array()),
        (0.5, [0.5, 0.25, 0.0])
    );
    let (texture, entries) = &scene.report.ruled[2];
    assert!(texture == "lamp" && entries.len() == 2 && entries[0] == "test.toml:2 lamp");
}

#[test]
fn the_shipped_materials_can_be_read_and_speak_of_common_names() {
    let text = include_str!("../../../../assets/materials/default.toml");
    let rules = Rules::parse("default", text).expect("the shipped materials");
    use scene::import::rules::Kind;
    assert_eq!(rules.of("metal5_2").made_of, Some(Kind::Metal));
    assert_eq!(rules.of("+0basebtn").made_of, Some(Kind::Gloss));
    assert_eq!(rules.of("*04water1").alpha, Some(0.35));
    assert_eq!(rules.of("tlight02").emission, Some(1.0));
    assert!(rules.of("wizwood1_2").entries.is_empty());
    assert!(rules.of("*lava1").alpha.is_none());
}
