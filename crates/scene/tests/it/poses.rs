//! Brush entities where the game code puts them, and what wins where faces coincide.

use crate::common::{compile, room, scene_of};
use glam::Vec3;
use mapc::Brush;
use scene::import::{ENTITY_GROWTH, ImportOptions, Lighting};
use scene::{Scene, SeenBy};

fn block(mins: [f64; 3], maxs: [f64; 3]) -> Vec<Brush> {
    vec![Brush::cuboid(mins, maxs, ["wall"; 6])]
}

/// How far the only instance besides the world was moved.
fn moved(scene: &Scene) -> Vec3 {
    let [_, instance] = &scene.instances[..] else {
        panic!("{} instances", scene.instances.len());
    };
    let positions = &scene.meshes[instance.mesh].positions;
    let lo = positions.iter().copied().fold(Vec3::INFINITY, Vec3::min);
    let hi = positions
        .iter()
        .copied()
        .fold(Vec3::NEG_INFINITY, Vec3::max);
    let centre = (lo + hi) / 2.0;
    instance.transform.transform_point3(centre) - centre
}

fn pose_of(
    class: &str,
    keys: &[(&str, &str)],
    mins: [f64; 3],
    maxs: [f64; 3],
    others: &[(&str, &[(&str, &str)])],
) -> Vec3 {
    let mut map = room();
    map.brush_entity(class, keys, block(mins, maxs));
    for (class, keys) in others {
        map.entity(class, keys);
    }
    let level = compile(&map);
    // The rows below reckon with the bounds as compilers write them.
    let bounds = |c: [f32; 3]| c.map(f64::from);
    let model = &level.bsp.models[1];
    assert_eq!((bounds(model.mins), bounds(model.maxs)), (mins, maxs));
    moved(&scene_of(&map, &ImportOptions::default()))
}

#[test]
fn doors_plats_and_trains_stand_where_the_game_puts_them() {
    let near = |a: Vec3, b: [f32; 3]| {
        assert!((a - Vec3::from(b)).length() < 1e-4, "{a} instead of {b:?}");
    };
    let (lo, hi) = ([64.0, 64.0, 64.0], [128.0, 80.0, 192.0]);
    near(
        pose_of("func_door", &[("spawnflags", "1")], lo, hi, &[]),
        [58.0, 0.0, 0.0],
    );
    near(pose_of("func_door", &[], lo, hi, &[]), [0.0; 3]);
    let up = [("spawnflags", "1"), ("angle", "-1"), ("lip", "20")];
    near(pose_of("func_door", &up, lo, hi, &[]), [0.0, 0.0, 110.0]);
    near(pose_of("func_plat", &[], lo, hi, &[]), [0.0, 0.0, -122.0]);
    near(
        pose_of("func_plat", &[("height", "40")], lo, hi, &[]),
        [0.0, 0.0, -40.0],
    );
    near(
        pose_of("func_plat", &[("targetname", "p")], lo, hi, &[]),
        [0.0; 3],
    );
    let corner: &[(&str, &[(&str, &str)])] =
        &[("path_corner", &[("targetname", "c"), ("origin", "8 8 8")])];
    near(
        pose_of(
            "func_train",
            &[("target", "c")],
            [0.0; 3],
            [32.0; 3],
            corner,
        ),
        [9.0; 3],
    );
    near(
        pose_of("func_button", &[("angle", "90")], lo, hi, &[]),
        [0.0; 3],
    );
}

#[test]
fn triggers_tools_and_gates_are_not_drawn() {
    let mut map = room();
    map.texture(mapc::Texture::solid("trigger", 16, 16, 1));
    let before = scene_of(&map, &ImportOptions::default());
    let at = |x: f64| block([x, 64.0, 64.0], [x + 16.0, 80.0, 80.0]);
    map.brush_entity("trigger_once", &[], at(64.0));
    map.brush_entity("func_episodegate", &[], at(96.0));
    map.brush_entity("func_wall", &[("spawnflags", "512")], at(128.0));
    map.brush_entity("func_door", &[("alpha", "-1")], at(160.0));
    let tool = Brush::cuboid([192.0, 64.0, 64.0], [208.0, 80.0, 80.0], ["trigger"; 6]);
    map.brush_entity("func_door", &[], vec![tool]);
    let after = scene_of(&map, &ImportOptions::default());
    assert_eq!(after.triangle_count(), before.triangle_count());
    assert_eq!(after.report.faces_left_out, 5 * 6);
    let gates = ImportOptions {
        show_episode_gates: true,
        ..ImportOptions::default()
    };
    let gated = scene_of(&map, &gates).triangle_count();
    assert_eq!(gated, before.triangle_count() + 12);
}

#[test]
fn an_entity_lies_before_the_world_face_it_shares_a_plane_with() {
    // A panel let into the floor: its top is coplanar with the floor around.
    for class in ["func_wall", "func_door"] {
        let mut map = room();
        map.brush_entity(class, &[], block([64.0, 64.0, 0.0], [128.0, 128.0, 32.0]));
        let scene = scene_of(&map, &ImportOptions::default());
        let merged = scene.instances.len() == 1;
        assert_eq!(merged, class == "func_wall");
        let instance = scene.instances.last().expect("an instance");
        let mesh = &scene.meshes[instance.mesh];
        let entity: Vec<Vec3> = mesh
            .triangles
            .iter()
            .flat_map(|t| t.vertices)
            .map(|v| {
                instance
                    .transform
                    .transform_point3(mesh.positions[v as usize])
            })
            .filter(|p| p.x > 63.0 && p.x < 129.0 && p.y > 63.0 && p.y < 129.0 && p.z < 33.0)
            .collect();
        let lo = entity.iter().copied().fold(Vec3::INFINITY, Vec3::min);
        let hi = entity.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
        let g = ENTITY_GROWTH;
        assert!(
            (lo - Vec3::new(64.0 - g, 64.0 - g, -g)).length() < 1e-4,
            "{lo}"
        );
        assert!(
            (hi - Vec3::new(128.0 + g, 128.0 + g, 32.0 + g)).length() < 1e-4,
            "{hi}"
        );
    }
}

#[test]
fn item_boxes_fall_to_the_floor_and_are_missed_once() {
    let mut map = room();
    map.entity("item_health", &[("origin", "100 100 80")]);
    map.entity(
        "item_shells",
        &[("origin", "200 100 80"), ("spawnflags", "1")],
    );
    let without = scene_of(&map, &ImportOptions::default());
    assert_eq!(without.instances.len(), 1);
    let told = (without.report.warnings.iter()).filter(|w| w.contains("2 models are not shown"));
    assert_eq!(told.count(), 1);

    // Any brush model serves as a box: here a level of its own.
    let mut model = mapc::Map::new();
    model.texture(mapc::Texture::solid("box", 16, 16, 40));
    model.brush_box([0.0; 3], [32.0, 32.0, 24.0], "box");
    let options = mapc::Options {
        allow_leaks: true,
        ..mapc::Options::default()
    };
    let bytes = mapc::compile(&model, &options).expect("a model").bytes;
    let files = |path: &str| (path == "maps/b_bh25.bsp").then(|| bytes.clone());
    let level = compile(&map);
    let palette = crate::common::palette();
    let scene = scene::import::import(&level, &palette, &files, &ImportOptions::default())
        .expect("a scene");
    let [_, item] = &scene.instances[..] else {
        panic!("{} instances", scene.instances.len());
    };
    assert_eq!(item.name, "item_health");
    let corner = item.transform.transform_point3(Vec3::ZERO);
    assert!(
        (corner - Vec3::new(100.0, 100.0, 0.0)).abs().max_element() < 0.1,
        "{corner}"
    );
    assert_eq!(item.seen_by, SeenBy::ALL);
    // Light compilers do not know it.
    let scene = scene::import::import(&level, &palette, &files, &compiler()).expect("a scene");
    assert_eq!(scene.instances[1].seen_by, SeenBy::CAMERA);
}

fn compiler() -> ImportOptions {
    ImportOptions {
        lighting: Lighting::Compiler,
        ..ImportOptions::default()
    }
}

#[test]
fn brush_models_cast_shadows_for_compilers_where_they_say_so() {
    for (class, key, casts) in [
        ("func_wall", None, false),
        ("func_wall", Some("_shadow"), true),
        ("func_door", None, false),
        ("func_door", Some("shadow"), true),
        ("func_door", Some("_shadowworldonly"), true),
        ("func_door", Some("_shadowself"), false),
    ] {
        let mut map = room();
        let keys: Vec<_> = key.into_iter().map(|k| (k, "1")).collect();
        map.brush_entity(class, &keys, block([64.0; 3], [96.0; 3]));
        let alone = |options: &ImportOptions| {
            let scene = scene_of(&map, options);
            let all = scene.instances.iter().map(|i| i.seen_by);
            assert_eq!(scene.features.masks, all.clone().any(|s| s != SeenBy::ALL));
            all.filter(|s| *s == SeenBy::CAMERA).count()
        };
        let what = format!("{class} {key:?}");
        assert_eq!(alone(&compiler()), usize::from(!casts), "{what}");
        assert_eq!(alone(&ImportOptions::default()), 0, "{what}");
    }
}
