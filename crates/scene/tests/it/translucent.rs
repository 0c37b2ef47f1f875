//! Liquids and entities that light passes through.

use crate::common::{room, scene_of};
use glam::Vec3;
use scene::Scene;
use scene::import::{CLEARNESS, GLASS_IOR, ImportOptions, LIQUID_IOR, WATER_DEPTH};

/// Water up to a height of 64, lava beside it, and a pane of the wall's texture above both.
fn pool(world: &[(&str, &str)]) -> Scene {
    let mut map = room();
    for (key, value) in world {
        map.world_key(key, value);
    }
    map.brush_box([0.0, 0.0, 0.0], [512.0, 256.0, 64.0], "*water");
    map.brush_box([0.0, 256.0, 0.0], [512.0, 512.0, 64.0], "*lava1");
    let pane = mapc::Brush::cuboid([100., 100., 150.], [200., 104., 200.], ["wall"; 6]);
    map.brush_entity("func_wall", &[("alpha", "0.4")], vec![pane]);
    scene_of(&map, &ImportOptions::default())
}

fn named<'a>(scene: &'a Scene, name: &'a str) -> impl Iterator<Item = &'a scene::Material> {
    scene.materials.iter().filter(move |m| m.name == name)
}

#[test]
fn liquids_are_as_clear_as_worldspawn_says_and_face_outwards() {
    let scene = pool(&[("_wateralpha", "0.6"), ("lavaalpha", "1")]);
    assert!(scene.features.translucent);
    let (water, lava) = (
        named(&scene, "*water").next().expect("water"),
        named(&scene, "*lava1").next().expect("lava"),
    );
    assert_eq!((water.finish.alpha, lava.finish.alpha), (0.6, 1.0));
    assert_eq!(water.finish.ior, LIQUID_IOR);
    // The test's water is grey: nothing but the loss of clear water.
    let left = (-water.finish.absorption * WATER_DEPTH).exp();
    assert!((left - CLEARNESS).abs().max_element() < 1e-5, "{left}");
    for mesh in &scene.meshes {
        for (i, t) in mesh.triangles.iter().enumerate() {
            let material = &scene.materials[t.material.0 as usize];
            assert_eq!(material.is_see_through(), i >= mesh.first_see_through);
            if material.name == "*water" {
                let [a, b, c] = t.vertices.map(|v| mesh.positions[v as usize]);
                // Up, or towards the lava: out of the water. The triangle is wound like its normal.
                assert!(t.normal == Vec3::Z || t.normal == Vec3::Y, "{}", t.normal);
                assert!((b - a).cross(c - a).dot(t.normal) > 0.0);
            }
        }
    }
    let medium = |x, y, z| {
        scene
            .media
            .at(Vec3::new(x, y, z))
            .map(|m| &scene.materials[m.0 as usize])
    };
    assert_eq!(
        medium(50., 50., 30.).map(|m| m.name.as_str()),
        Some("*water")
    );
    assert!(medium(50., 50., 100.).is_none() && medium(50., 400., 30.).is_none());
}

#[test]
fn liquids_without_a_key_of_their_own_follow_the_water_and_shine_less() {
    let opaque = pool(&[]);
    let scene = pool(&[("wateralpha", "0.25"), ("slimealpha", "0")]);
    let lava = |s: &Scene| named(s, "*lava1").next().expect("lava").clone();
    let (before, after) = (lava(&opaque), lava(&scene));
    assert_eq!(after.finish.alpha, 0.25);
    assert_eq!(after.emission_scale, 0.25 * before.emission_scale);
    assert!(scene.media.at(Vec3::new(50., 400., 30.)).is_some());
    assert!(opaque.media.nodes.is_empty());
    assert!(named(&opaque, "*water").all(|m| !m.is_see_through()));
}

#[test]
fn entities_are_as_clear_as_they_say_and_the_same_texture_elsewhere_is_not() {
    let scene = pool(&[]);
    assert!(scene.features.translucent, "the pane");
    let alphas: Vec<f32> = named(&scene, "wall").map(|m| m.finish.alpha).collect();
    assert_eq!(alphas, [1.0, 0.4]);
    let pane = &named(&scene, "wall").nth(1).expect("a pane").finish;
    assert_eq!(
        (pane.ior, pane.tint, pane.absorption),
        (GLASS_IOR, Vec3::ONE, Vec3::ZERO)
    );
}
