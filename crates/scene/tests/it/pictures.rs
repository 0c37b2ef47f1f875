//! Textures, liquids, fences, skies and time.

use crate::common::{WHITE, compile, room, scene_of};
use scene::import::ImportOptions;
use scene::sky::SkyKind;
use scene::{Material, MaterialId, Scene};

fn material<'a>(scene: &'a Scene, name: &str) -> &'a Material {
    let found = scene.materials.iter().find(|m| m.name == name);
    found.unwrap_or_else(|| panic!("no material {name}"))
}

#[test]
fn a_liquid_surface_is_one_surface_with_two_sides() {
    let mut map = room();
    map.brush_box([0.0, 0.0, 0.0], [512.0, 256.0, 64.0], "*water");
    map.brush_box([0.0, 256.0, 0.0], [512.0, 512.0, 64.0], "*lava1");
    let level = compile(&map);
    let liquid = |i: usize| {
        level.bsp.textures[i]
            .as_ref()
            .is_some_and(|t| t.name.starts_with('*'))
    };
    let in_file = level
        .bsp
        .drawable_faces(0)
        .filter(|(_, f)| level.bsp.face_texture(f).is_some_and(liquid))
        .count();
    let scene = scene_of(&map, &ImportOptions::default());
    let mut faces: Vec<u32> = scene.meshes[0]
        .triangles
        .iter()
        .filter(|t| scene.materials[t.material.0 as usize].warped)
        .map(|t| t.face)
        .collect();
    faces.dedup();
    assert!(
        in_file >= 4 && faces.len() * 2 == in_file,
        "{} of {in_file}",
        faces.len()
    );
    let (water, lava) = (material(&scene, "*water"), material(&scene, "*lava1"));
    assert!(water.two_sided && lava.two_sided && water.emission.is_none());
    assert_eq!(lava.emission, Some(lava.base));
    // Both sides of what one texel emits: index 200 is a grey of (200/255) encoded.
    let radiance = scene::material::srgb_to_linear(200) as f32 * lava.emission_scale;
    assert!((lava.emission_weight / (2.0 * radiance) - 1.0).abs() < 1e-4);
    assert_eq!(scene.report.open_edges, 0);
    assert!(scene.report.sealed);
    for t in &scene.meshes[0].triangles {
        if scene.materials[t.material.0 as usize].warped {
            // World units, close to the first tiles.
            assert!(t.uv.iter().flatten().all(|c| (0.0..=640.0).contains(c)));
        }
    }
}

#[test]
fn fences_have_holes_stand_last_and_holes_do_not_emit() {
    let mut map = room();
    map.texture(mapc::Texture::from_fn("{grate", 32, 32, |x, _| match x {
        0..8 => 255,
        8..16 => WHITE,
        _ => 100,
    }));
    map.brush_entity(
        "func_wall",
        &[],
        vec![mapc::Brush::cuboid(
            [64.0; 3],
            [128.0, 72.0, 128.0],
            ["{grate"; 6],
        )],
    );
    let scene = scene_of(&map, &ImportOptions::default());
    let fence = material(&scene, "{grate");
    assert!(fence.alpha_tested && !fence.two_sided && scene.features.fences);
    let mesh = &scene.meshes[0];
    let tested = |t: &scene::Triangle| scene.materials[t.material.0 as usize].alpha_tested;
    assert!(mesh.first_see_through < mesh.triangles.len());
    assert!(!mesh.triangles[..mesh.first_see_through].iter().any(tested));
    assert!(mesh.triangles[mesh.first_see_through..].iter().all(tested));
    let base = &scene.textures[fence.base.0 as usize];
    assert_eq!(base.rgba[0..8].iter().map(|t| t[3]).max(), Some(0));
    // The colour of a hole is that of a neighbour, not the palette's last.
    assert!(base.rgba[0..8].iter().all(|t| t[0] == 255 || t[0] == 100));
    let emission = &scene.textures[fence.emission.expect("bright bars").0 as usize];
    assert!(emission.rgba[0..8].iter().all(|t| t[..3] == [0; 3]));
    let expected = fence.emission_scale * 8.0 / 32.0;
    assert!((fence.emission_weight / expected - 1.0).abs() < 1e-4);
}

#[test]
fn the_sky_has_two_layers_and_shines_with_their_mean() {
    let mut map = room();
    map.brush_box([64.0, 64.0, 240.0], [192.0, 192.0, 256.0], "sky1");
    let scene = scene_of(&map, &ImportOptions::default());
    let SkyKind::Scrolling { back, front } = scene.sky.kind else {
        panic!("{:?}", scene.sky);
    };
    let [back, front] = [back, front].map(|id| &scene.textures[id.0 as usize]);
    assert!(back.rgba.iter().all(|t| *t == [80, 80, 80, 255]));
    assert_eq!(front.rgba[0], [120, 120, 120, 255]);
    assert_eq!(front.rgba[128 * 40][3], 0);
    let [b, f] = [80, 120].map(|c| scene::material::srgb_to_linear(c) as f32);
    let mean = 0.25 * f + 0.75 * b;
    let weight = material(&scene, "sky1").emission_weight;
    assert!((weight / mean - 1.0).abs() < 1e-4, "{weight} {mean}");
}

#[test]
fn a_black_sky_that_nobody_asks_for_light_stays_black() {
    let mut map = room();
    map.texture(mapc::Texture::solid("sky_void", 256, 128, 0));
    map.brush_box([64.0, 64.0, 240.0], [192.0, 192.0, 256.0], "sky_void");
    let scene = scene_of(&map, &ImportOptions::default());
    assert!(matches!(scene.sky.kind, SkyKind::Scrolling { .. }));
    assert!(scene.emitters.list.is_empty());
    let dark = |w: &String| w.contains("nothing shines");
    assert!(scene.report.warnings.iter().any(dark));
}

#[test]
fn animated_textures_show_the_frame_of_the_moment() {
    let mut map = room();
    for (frame, index) in [(0, 10), (1, 20), (2, 30), (3, 40)] {
        map.texture(mapc::Texture::solid(&format!("+{frame}x"), 16, 16, index));
    }
    map.brush_box([0.0; 3], [32.0, 32.0, 32.0], "+0x");
    let shown = |time| {
        let options = ImportOptions {
            time,
            ..ImportOptions::default()
        };
        let scene = scene_of(&map, &options);
        let base = material(&scene, "+0x").base;
        scene.textures[base.0 as usize].rgba[0][0]
    };
    assert_eq!([shown(0.0), shown(0.39), shown(0.81)], [10, 20, 10]);
}

#[test]
fn scenes_of_frames_have_all_frames_of_animated_textures() {
    let mut map = room();
    for (frame, index) in [(0, 10), (1, 20), (2, WHITE)] {
        map.texture(mapc::Texture::solid(&format!("+{frame}x"), 16, 16, index));
    }
    // A face may name any of them, and the last one shines.
    map.texture(mapc::Texture::solid("+ax", 16, 16, 50));
    map.brush_box([0.0; 3], [32.0, 32.0, 32.0], "+1x");
    let options = ImportOptions {
        frames: true,
        ..ImportOptions::default()
    };
    let scene = scene_of(&map, &options);
    let id = (0..)
        .zip(&scene.materials)
        .find_map(|(i, m)| (!m.frames.is_empty()).then_some(i))
        .expect("an animated material");
    let shown = |time| -> MaterialId { scene.looks(time)[id] };
    let frames = &scene.materials[id].frames;
    for (time, turn) in [(0.0, 0), (0.39, 1), (0.41, 2), (0.6, 0)] {
        assert_eq!(shown(time), frames[turn], "{time}");
    }
    let grey = |turn: usize| {
        let base = scene.materials[frames[turn].0 as usize].base;
        scene.textures[base.0 as usize].rgba[0][0]
    };
    assert_eq!([grey(0), grey(1)], [10, 20]);
    let of = |i: usize| &scene.materials[frames[i].0 as usize];
    assert!(of(0).emission.is_none() && of(2).emission.is_some());
    assert!(of(0).emission_weight > 0.0);
    assert_eq!(of(0).emission_weight, of(2).emission_weight);
    // All of its faces are lights, whichever frame they show.
    let triangles = &scene.meshes[0].triangles;
    let on_it = triangles
        .iter()
        .filter(|t| t.material.0 as usize == id)
        .count();
    assert!(on_it > 0 && scene.emitters.sources.len() >= on_it);
}

#[test]
fn a_missing_texture_is_a_checkerboard_and_is_told_of() {
    let mut map = room();
    map.brush_box([0.0; 3], [32.0, 32.0, 32.0], "nowhere");
    let scene = scene_of(&map, &ImportOptions::default());
    assert!(
        scene
            .report
            .warnings
            .iter()
            .any(|w| w.contains("checkerboard"))
    );
    let stand_in = scene.textures.iter().find(|t| t.name.contains("missing"));
    let colors = &stand_in.expect("a stand-in").rgba;
    assert_ne!(colors[0], colors[16]);
}
