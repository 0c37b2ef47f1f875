//! What point entities show: models and sprites of our own writing, and the real ones.

use crate::common::{WHITE, compile, for_each_level, palette, room};
use glam::Vec3;
use mapc::{
    Map, Model, ModelFrame, ModelPose, ModelSkin, ModelSkinVertex, Sprite, SpriteFrame,
    SpritePicture,
};
use scene::import::{
    Cast, CastList, CastModel, ImportOptions, LightMode, Lighting, import, import_cast,
};
use scene::mesh::SeenBy;
use scene::{Camera, Instance, Scene};

/// A pyramid that points forward (+X) and has its base 24 units below its origin, one frame for each
/// height; the skins are the palette indices given.
pub fn model(heights: &[f64], skins: &[u8], flags: u32, group: bool) -> Vec<u8> {
    let pose = |&z: &f64| ModelPose {
        name: "pose".to_owned(),
        positions: vec![
            [16.0, 0.0, -24.0],
            [-8.0, 8.0, -24.0],
            [-8.0, -8.0, -24.0],
            [0.0, 0.0, z],
        ],
    };
    let frames = if group {
        let parts = heights.iter().zip(1..);
        vec![ModelFrame::Group(
            parts.map(|(z, i)| (i as f32 * 0.1, pose(z))).collect(),
        )]
    } else {
        heights
            .iter()
            .map(|z| ModelFrame::Single(pose(z)))
            .collect()
    };
    let at = |s, t| ModelSkinVertex {
        on_seam: false,
        at: [s, t],
    };
    Model {
        skin_size: [16, 16],
        skins: skins
            .iter()
            .map(|&i| ModelSkin::Single(vec![i; 256]))
            .collect(),
        skin_vertices: vec![at(0, 0), at(12, 0), at(0, 12), at(12, 12)],
        triangles: [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]]
            .map(|t| (true, t))
            .to_vec(),
        frames,
        flags,
        random_start: false,
    }
    .write()
}

pub fn globe() -> Vec<u8> {
    let picture = SpritePicture {
        origin: [-8, 8],
        size: [16, 16],
        pixels: (0..256).map(|i| if i < 16 { 255 } else { WHITE }).collect(),
    };
    Sprite {
        kind: 2,
        frames: vec![SpriteFrame::Single(picture)],
        random_start: false,
    }
    .write()
}

fn files(path: &str) -> Option<Vec<u8>> {
    Some(match path {
        "progs/soldier.mdl" => model(
            &[8.0, 16.0, 24.0, 32.0, 24.0, 16.0, 8.0, 0.0],
            &[90],
            0,
            false,
        ),
        "progs/player.mdl" => model(&[0.0], &[20], 0, false),
        "progs/armor.mdl" => model(&[0.0], &[60, 70, 80], 8, false),
        "progs/flame.mdl" => model(&[0.0, 8.0], &[WHITE], 0, true),
        "progs/eye.mdl" => model(&[0.0], &[WHITE], 0, false),
        "progs/s_light.spr" => globe(),
        "progs/bad.mdl" => b"IDPO\x06\0\0\0".to_vec(),
        _ => return None,
    })
}

fn scene_with(entities: &[(&str, &[(&str, &str)])], options: &ImportOptions) -> Scene {
    let mut map: Map = room();
    for (class, keys) in entities {
        map.entity(class, keys);
    }
    import(&compile(&map), &palette(), &files, options).expect("a scene")
}

fn last(scene: &Scene) -> &Instance {
    scene.instances.last().expect("an instance")
}

/// Corners of an instance's mesh, world space.
fn corners(scene: &Scene, instance: &Instance) -> Vec<Vec3> {
    let place = |p: &Vec3| instance.transform.transform_point3(*p);
    scene.meshes[instance.mesh]
        .positions
        .iter()
        .map(place)
        .collect()
}

#[test]
fn monsters_fall_to_the_floor_face_their_way_and_play_their_idle_animation() {
    let keys: &[(&str, &str)] = &[("origin", "200 200 60"), ("angle", "90")];
    let at = |time| {
        let options = ImportOptions {
            time,
            ..ImportOptions::default()
        };
        scene_with(&[("monster_army", keys)], &options)
    };
    let scene = at(0.0);
    assert_eq!(scene.instances.len(), 2);
    let p = corners(&scene, last(&scene));
    // Hull 1 stands on the floor: its origin is 24 units up, and a trace stops a little before it.
    assert!(
        (p[0] - Vec3::new(200.0, 216.0, 0.05)).length() < 0.2,
        "{}",
        p[0]
    );
    assert_eq!(scene.report.models, [("progs/soldier.mdl".to_owned(), 1)]);
    // Its top moves by 80 units a second, one way and then the other.
    let top = |scene: &Scene| corners(scene, last(scene))[3].z;
    let heights: Vec<f32> = [0.0, 0.05, 0.1].map(|t| top(&at(t))).to_vec();
    let rise = heights[1] - heights[0];
    assert!((rise.abs() - 4.0).abs() < 0.5, "{heights:?}");
    assert!(
        (heights[2] - heights[0] - 2.0 * rise).abs() < 0.1,
        "{heights:?}"
    );
    // All of it looks outwards.
    let mesh = &scene.meshes[last(&scene).mesh];
    let centre = mesh.positions.iter().sum::<Vec3>() / 4.0;
    for t in &mesh.triangles {
        let a = mesh.positions[t.vertices[0] as usize];
        assert!(t.normal.dot(a - centre) > 0.0);
        assert!((t.normal.length() - 1.0).abs() < 1e-5);
    }
}

#[test]
fn skins_and_turning_items() {
    let options = ImportOptions {
        time: 0.9,
        ..ImportOptions::default()
    };
    let scene = scene_with(&[("item_armor2", &[("origin", "100 100 40")])], &options);
    let instance = last(&scene);
    let mesh = &scene.meshes[instance.mesh];
    let material = &scene.materials[mesh.triangles[0].material.0 as usize];
    let texture = &scene.textures[material.base.0 as usize];
    assert_eq!(texture.rgba[0], [70, 70, 70, 255]);
    // At 100 degrees a second it has turned by a right angle.
    let forward = instance.transform.transform_vector3(Vec3::X);
    assert!((forward - Vec3::Y).length() < 1e-5, "{forward}");
    assert_eq!(instance.seen_by, SeenBy::ALL);
}

#[test]
fn a_torch_is_one_lamp() {
    let torch: &[(&str, &str)] = &[("origin", "100 100 100"), ("light", "200")];
    let entities = [("light_torch_small_walltorch", torch)];
    let of = |lights| {
        let options = ImportOptions {
            lights,
            ..ImportOptions::default()
        };
        scene_with(&entities, &options)
    };
    for lights in [LightMode::Auto, LightMode::All, LightMode::Entities] {
        let scene = of(lights);
        assert_eq!(scene.lights.len(), 1, "{lights:?}");
        // It is inside the flame, which does not make it smaller.
        assert_eq!(scene.lights[0].radius, scene::import::LIGHT_RADIUS);
        assert_eq!(last(&scene).seen_by, SeenBy::CAMERA);
        assert!(scene.emitters.list.is_empty(), "{lights:?}");
        let mesh = &scene.meshes[last(&scene).mesh];
        let material = &scene.materials[mesh.triangles[0].material.0 as usize];
        assert!(material.emission.is_some());
        assert!(scene.features.masks && !scene.features.poses && !scene.features.skins);
    }
    let scene = of(LightMode::Textures);
    assert_eq!(scene.lights.len(), 0);
    assert_eq!(last(&scene).seen_by, SeenBy::ALL);
    assert!(!scene.emitters.list.is_empty());
}

#[test]
fn flames_without_an_entity_of_their_own_yield_to_a_light_beside_them() {
    let flame: &[(&str, &str)] = &[("origin", "100 100 100"), ("model", "progs/flame.mdl")];
    let near: &[(&str, &str)] = &[("origin", "100 100 110")];
    let far: &[(&str, &str)] = &[("origin", "300 300 110")];
    for (light, seen_by) in [(near, SeenBy::CAMERA), (far, SeenBy::ALL)] {
        let entities = [("misc_model", flame), ("light", light)];
        let scene = scene_with(&entities, &ImportOptions::default());
        assert_eq!(last(&scene).seen_by, seen_by);
        assert_eq!(scene.lights.len(), 1);
        assert_eq!(scene.emitters.list.is_empty(), seen_by == SeenBy::CAMERA);
    }
    // Bright texels of what is no flame shine as on walls.
    let eye: &[(&str, &str)] = &[("origin", "100 100 100"), ("model", "progs/eye.mdl")];
    let scene = scene_with(
        &[("misc_model", eye), ("light", near)],
        &ImportOptions::default(),
    );
    assert_eq!(last(&scene).seen_by, SeenBy::ALL);
    assert!(!scene.emitters.list.is_empty());
}

#[test]
fn groups_play_by_the_level_s_time() {
    let torch: &[(&str, &str)] = &[("origin", "100 100 100")];
    let top = |time| {
        let options = ImportOptions {
            time,
            ..ImportOptions::default()
        };
        let scene = scene_with(&[("light_torch_small_walltorch", torch)], &options);
        corners(&scene, last(&scene))[3].z
    };
    // Flames are never blended.
    for (time, height) in [(0.0, 100.0), (0.09, 100.0), (0.11, 108.0), (0.21, 100.0)] {
        assert!((top(time) - height).abs() < 0.1, "{time}: {}", top(time));
    }
}

#[test]
fn sprites_turn_to_the_camera() {
    let keys: &[(&str, &str)] = &[("origin", "100 100 100")];
    let mut scene = scene_with(&[("light_globe", keys)], &ImportOptions::default());
    let normal = |scene: &Scene| last(scene).transform.transform_vector3(Vec3::Z);
    // The player's start looks along +Y.
    assert!((normal(&scene) - Vec3::NEG_Y).length() < 1e-5);
    let camera = Camera {
        yaw_deg: 180.0,
        ..scene.cameras[0].clone()
    };
    scene.turn_sprites(&camera);
    assert!((normal(&scene) - Vec3::X).length() < 1e-5);
    let instance = last(&scene);
    assert_eq!(instance.seen_by, SeenBy::CAMERA);
    let mesh = &scene.meshes[instance.mesh];
    assert_eq!((mesh.triangles.len(), mesh.first_see_through), (2, 0));
    let material = &scene.materials[mesh.triangles[0].material.0 as usize];
    assert!(material.alpha_tested);
    let [base, emission] =
        [material.base, material.emission.expect("light")].map(|t| &scene.textures[t.0 as usize]);
    assert_eq!((base.rgba[0][3], base.rgba[255]), (0, [0, 0, 0, 255]));
    assert_eq!(
        (emission.rgba[0], emission.rgba[255]),
        ([0, 0, 0, 255], [255; 4])
    );
    assert_eq!(scene.lights.len(), 1);
}

#[test]
fn what_is_missing_or_broken_is_told_once_and_the_rest_is_shown() {
    let entities = [
        ("monster_dog", &[("origin", "100 100 40")][..]),
        ("monster_dog", &[("origin", "200 100 40")]),
        ("item_key1", &[("origin", "100 200 40")]),
        ("x", &[("model", "progs/bad.mdl")]),
        ("item_armor1", &[("origin", "100 300 40")]),
    ];
    let scene = scene_with(&entities, &ImportOptions::default());
    assert_eq!(scene.instances.len(), 2);
    let warnings = scene.report.warnings.join("\n");
    assert!(
        warnings.contains("2 models are not shown")
            && warnings.contains("progs/dog.mdl, progs/w_s_key.mdl"),
        "{warnings}"
    );
    assert!(warnings.contains("progs/bad.mdl: MDL header"), "{warnings}");
    let options = ImportOptions {
        inhabitants: false,
        ..ImportOptions::default()
    };
    let scene = scene_with(&entities, &options);
    assert_eq!(scene.instances.len(), 1);
    assert!(!scene.report.warnings.join("\n").contains("models"));
}

#[test]
fn other_light_shows_them_too() {
    let entities = [
        ("monster_army", &[("origin", "200 200 60")][..]),
        ("light_globe", &[("origin", "100 100 100")]),
    ];
    for lighting in Lighting::ALL {
        let options = ImportOptions {
            lighting,
            ..ImportOptions::default()
        };
        let scene = scene_with(&entities, &options);
        assert_eq!(scene.instances.len(), 3);
        if let Some(baked) = &scene.baked {
            let sizes = scene.meshes.iter().map(|m| m.triangles.len());
            assert!(baked.meshes.iter().map(Vec::len).eq(sizes));
        }
        // The compilers' light knows no models.
        let casts = scene.instances[1].seen_by.others();
        assert_eq!(casts, lighting != Lighting::Compiler, "{lighting:?}");
    }
}

#[test]
fn many_poses_are_bounded() {
    let keys: Vec<[(&str, String); 3]> = (0..2000)
        .map(|i| {
            [
                (
                    "origin",
                    format!("{} {} 40", 20 + i % 40 * 10, 20 + i / 40 * 9),
                ),
                ("model", "progs/soldier.mdl".to_owned()),
                ("frame", (i % 8).to_string()),
            ]
        })
        .collect();
    let mut map = room();
    for keys in &keys {
        let keys: Vec<(&str, &str)> = keys.iter().map(|(k, v)| (*k, v.as_str())).collect();
        map.entity("misc_model", &keys);
    }
    let scene = import(
        &compile(&map),
        &palette(),
        &files,
        &ImportOptions::default(),
    );
    let scene = scene.expect("a scene");
    // Entities that show the same share a mesh.
    assert_eq!((scene.instances.len(), scene.meshes.len()), (2001, 9));
}

#[test]
fn a_demo_s_models_become_meshes_that_frames_place() {
    let mut map = room();
    map.brush_entity(
        "func_wall",
        &[],
        vec![mapc::Brush::cuboid(
            [64.0, 64.0, 0.0],
            [128.0, 128.0, 32.0],
            ["wall"; 6],
        )],
    );
    map.entity("monster_army", &[("origin", "200 200 60")]);
    let names = [
        "",
        "maps/test.bsp",
        "*1",
        "*2",
        "progs/soldier.mdl",
        "progs/s_light.spr",
        "progs/flame.mdl",
        "progs/player.mdl",
        "progs/none.mdl",
    ]
    .map(str::to_owned);
    let list = CastList {
        models: &names,
        colours: &[[4, 13]],
        faded: &[],
        fog: false,
    };
    let options = ImportOptions::default();
    let (scene, cast) =
        import_cast(&compile(&map), &palette(), &files, &options, list).expect("a cast");
    assert_eq!(scene.instances.len(), 1);
    assert!(matches!(cast.models["maps/test.bsp"], CastModel::Level));
    assert!(!cast.models.contains_key("*2") && !cast.models.contains_key("progs/none.mdl"));
    let CastModel::Brush { meshes, .. } = cast.models["*1"] else {
        panic!("no brush model");
    };
    assert_eq!(meshes[0], meshes[1]);
    let CastModel::Alias {
        mesh,
        model,
        seen_by,
        ..
    } = &cast.models["progs/soldier.mdl"]
    else {
        panic!("no alias model");
    };
    assert_eq!(
        (scene.meshes[*mesh].poses.len(), *seen_by),
        (8, SeenBy::ALL)
    );
    let mut frame = scene.as_frame(&scene.cameras[0], 0.0);
    frame.instances.push(Instance {
        pose: model.between(1, 2, 0.5, 0.0),
        material: Some(model.skin(0, 0.0)),
        seen_by: *seen_by,
        ..Instance::new(*mesh, glam::Affine3A::IDENTITY, "monster_army")
    });
    let top = scene.meshes[*mesh].posed(frame.instances[1].pose)[3].z;
    assert!((top - 20.0).abs() < 0.2, "{top}");
    let CastModel::Sprite { meshes, model } = &cast.models["progs/s_light.spr"] else {
        panic!("no sprite");
    };
    let quad = meshes[model.quad(0, 0.0, 0.0)].expect("a quad");
    frame.instances.push(Instance {
        seen_by: SeenBy::CAMERA,
        ..Instance::new(quad, glam::Affine3A::IDENTITY, "sprite")
    });
    frame.check(&scene).expect("a good frame");
    // The flame's light is that of an entity, and the camera alone sees it.
    let CastModel::Alias { seen_by, .. } = &cast.models["progs/flame.mdl"] else {
        panic!("no flame");
    };
    assert_eq!(*seen_by, SeenBy::CAMERA);
    // Shirts change, and their mesh knows the skin.
    let CastModel::Alias { mesh, .. } = &cast.models["progs/player.mdl"] else {
        panic!("no player");
    };
    let shirt = cast
        .coloured("progs/player.mdl", 0, [4, 13])
        .expect("a skin");
    assert!(scene.meshes[*mesh].skins.contains(&shirt));
    let base = scene.materials[shirt.0 as usize].base.0 as usize;
    assert_eq!(scene.textures[base].rgba[0], [68, 68, 68, 255]);
    // Particles show the palette.
    let particles = &scene.materials[cast.palette.0 as usize];
    let shown = &scene.textures[particles.emission.expect("colours").0 as usize];
    let [u, v] = Cast::palette_uv(0x6f);
    assert_eq!(
        shown.rgba[v as usize * 16 + u as usize],
        [0x6f, 0x6f, 0x6f, 255]
    );
}

#[test]
fn every_real_model_joins_a_cast() {
    let Some(dir) = crate::common::data() else {
        return;
    };
    let search = bsp::SearchPath::builder()
        .basedir(&dir)
        .build()
        .expect("search path");
    let palette = search.read("gfx/palette.lmp").expect("palette").bytes;
    let palette = bsp::lmp::Palette::parse(&palette).expect("palette");
    let files = |path: &str| search.read_optional(path).ok().flatten().map(|f| f.bytes);
    let level = bsp::Level::load(&search, "start", &bsp::Limits::default()).expect("a level");
    let mut models = search.list("progs/");
    models.retain(|n| n.ends_with(".mdl") || n.ends_with(".spr"));
    models.extend((0..level.bsp.models.len()).map(|n| format!("*{n}")));
    let list = CastList {
        models: &models,
        colours: &[],
        faded: &[],
        fog: false,
    };
    let options = ImportOptions::default();
    let (scene, cast) = import_cast(&level, &palette, &files, &options, list).expect("a cast");
    let missing: Vec<&String> = models
        .iter()
        .filter(|n| !cast.models.contains_key(*n) && *n != "*0")
        .collect();
    println!(
        "{} models, {} meshes, not there: {missing:?}",
        models.len(),
        scene.meshes.len()
    );
    assert!(missing.iter().all(|n| n.starts_with('*')), "{missing:?}");
    for model in cast.models.values() {
        if let CastModel::Alias { mesh, model, .. } = model {
            let mesh = &scene.meshes[*mesh];
            for frame in 0..model.frames.len() {
                let pose = model.pose(frame, 0.25);
                assert!((pose.from.max(pose.to) as usize) < mesh.poses.len().max(1));
            }
        }
    }
}

#[test]
fn real_levels_show_all_they_have() {
    let (mut shown, mut levels) = (0, 0);
    for_each_level(|level, scene| {
        let count: usize = scene.report.models.iter().map(|(_, n)| n).sum();
        shown += count;
        levels += usize::from(count > 0);
        for instance in &scene.instances {
            assert!(instance.transform.is_finite(), "{}", level.name);
        }
        for mesh in &scene.meshes[1..] {
            assert!(
                mesh.positions.iter().all(|p| p.is_finite()),
                "{}",
                mesh.name
            );
        }
        let missing = scene
            .report
            .warnings
            .iter()
            .find(|w| w.contains("not shown"));
        if let Some(missing) = missing {
            println!("{}: {missing}", level.name);
        }
    });
    println!("{shown} models in {levels} levels");
}
