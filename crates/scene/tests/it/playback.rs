//! States of demos as frames: who is placed where, what gives light, and who sees it.

use crate::common::{compile, data, palette, room};
use crate::inhabitants::{globe, model};
use bsp::dem::Demo;
use bsp::lmp::Palette;
use bsp::{Level, Limits, SearchPath, Warnings};
use glam::Vec3;
use mapc::Brush;
use mapc::demo::{Client, DemoWriter, Dialect, Entity};
use scene::import::{Cast, CastModel, FogKeys, ImportOptions, import_cast};
use scene::mesh::SeenBy;
use scene::playback::{Eye, Parts, frame};
use scene::timeline::{Options, Timeline, Unseen};
use scene::{Camera, Frame, Scene};

const MODELS: [&str; 7] = [
    "maps/test.bsp",
    "*1",
    "progs/player.mdl",
    "progs/v_shot.mdl",
    "progs/bolt.mdl",
    "progs/s_light.spr",
    "progs/absent.mdl",
];
const PLAYER_EYE: Eye = Eye::Player {
    fov_deg: 90.0,
    lens: None,
};

/// A stage with a door, on which a player shoots.
struct Stage {
    timeline: Timeline,
    scene: Scene,
    cast: Cast,
}

fn stage() -> Stage {
    stage_of(&ImportOptions::default())
}

fn stage_of(options: &ImportOptions) -> Stage {
    let mut w = DemoWriter::new(
        Dialect {
            protocol: 666,
            ..Dialect::QUAKE
        },
        -1,
    );
    w.server_info("title", 2, &MODELS, &[])
        .set_view(1)
        .signon(1);
    w.raw(&[17, 0, 0x4d, 17, 1, 0x12]); // the players' colours
    w.spawn_static(&Entity {
        model: 6,
        origin: [100.0, 400.0, 64.0],
        ..Entity::default()
    });
    w.light_style(3, "z").signon(3);
    w.end_block([0.0; 3]);
    let at = |model, origin| Entity {
        model,
        origin,
        ..Entity::default()
    };
    for i in 0..5_u16 {
        let me = Entity {
            colormap: 1,
            effects: if i == 3 { 2 } else { 0 },
            ..at(3, [256.0, 256.0, 40.0])
        };
        let other = Entity {
            colormap: 2,
            frame: i % 2,
            effects: 8,
            alpha: 128,
            ..at(3, [256.0, 400.0, 40.0])
        };
        let door = Entity {
            frame: 1,
            ..at(2, [0.0, 0.0, f32::from(i)])
        };
        let all = [(1, me), (2, other), (5, door), (6, at(7, [200.0; 3]))];
        w.frame(10.0 + f32::from(i) / 10.0, &all);
        w.client(&Client {
            weapon: 4,
            ..Client::default()
        });
        if i == 3 {
            w.fog(51, [255, 0, 51], 0);
        }
        if i == 2 {
            w.beam(5, 1, [0.0; 3], [256.0, 456.0, 40.0]);
            w.particles([256.0, 300.0, 60.0], [0; 3], 20, 73);
        }
        w.end_block([0.0, 90.0, 0.0]);
    }
    let mut warnings = Warnings::new();
    let bytes = w.finish();
    let demo = Demo::parse(&bytes, &Limits::default(), &mut warnings).expect("a demo");
    let timeline = Timeline::new(&demo, &|_| None, &mut warnings);

    let mut map = room();
    let (lo, hi) = ([64.0, 64.0, 0.0], [96.0, 96.0, 64.0]);
    let panel = |texture: &str| vec![Brush::cuboid(lo, hi, [texture; 6])];
    map.brush_entity("func_wall", &[], panel("wall"));
    // Entities of the level are not placed: the demo says what is there.
    map.entity("monster_army", &[("origin", "128 128 64")]);
    let level = compile(&map);
    let files = |name: &str| match name {
        "progs/player.mdl" => Some(model(&[8.0, 16.0], &[20], 0, false)),
        "progs/v_shot.mdl" => Some(model(&[8.0], &[100], 0, false)),
        "progs/bolt.mdl" => Some(model(&[8.0], &[100], 0, false)),
        "progs/s_light.spr" => Some(globe()),
        _ => None,
    };
    let parts = Parts::of(&timeline, 0);
    assert_eq!(parts.colours, [[1, 2], [4, 13]]);
    let (scene, cast) =
        import_cast(&level, &palette(), &files, options, parts.list()).expect("a stage");
    Stage {
        timeline,
        scene,
        cast,
    }
}

impl Stage {
    fn at(&self, t: f64, eye: &Eye) -> Frame {
        let state = self
            .timeline
            .state_at(t, &Options::default())
            .expect("a state");
        let level = &self.timeline.levels()[state.level];
        let frame = frame(&state, level, &self.scene, &self.cast, eye);
        frame.check(&self.scene).expect("a frame");
        frame
    }
}

/// Files of what a frame shows besides the world, with who sees each.
fn shown(frame: &Frame) -> Vec<(&str, SeenBy)> {
    let moving = frame.instances.iter().skip(1);
    moving.map(|i| (i.name.as_str(), i.seen_by)).collect()
}

#[test]
fn frames_show_what_the_demo_says_to_whom_it_concerns() {
    let stage = stage();
    let (player, door) = (MODELS[2], MODELS[1]);
    let (weapon, globe) = (MODELS[3], MODELS[5]);
    let frame = stage.at(0.05, &PLAYER_EYE);
    // The player sees itself in mirrors only; whoever glows is lit by others; globes are pictures.
    let expected = [
        (globe, SeenBy::CAMERA),
        (player, SeenBy::OTHERS),
        (player, SeenBy::CAMERA),
        (door, SeenBy::ALL),
        (weapon, SeenBy::CAMERA),
    ];
    assert_eq!(shown(&frame), expected);
    assert_eq!(frame.lights.len(), 1);
    assert_eq!(frame.instances[4].transform.translation.z.round(), 0.0);
    // Another camera sees the player and no weapon.
    let eye = Eye::Free(Camera {
        name: "free".to_owned(),
        position: Vec3::new(30.0, 30.0, 100.0),
        pitch_deg: 0.0,
        yaw_deg: 45.0,
        roll_deg: 0.0,
        fov_deg: 60.0,
        lens: None,
    });
    let free = stage.at(0.05, &eye);
    assert_eq!(shown(&free)[1], (player, SeenBy::ALL));
    assert!(shown(&free).iter().all(|(file, _)| *file != weapon));
    assert_eq!(free.camera.yaw_deg, 45.0);
    // Players wear their own colours: index 20 is in the shirt's row.
    let shirt = |i: usize| {
        let material = frame.instances[i].material.expect("a skin");
        let base = stage.scene.materials[material.0 as usize].base;
        stage.scene.textures[base.0 as usize].rgba[0][0]
    };
    assert_eq!((shirt(2), shirt(3)), (4 * 16 + 4, 16 + 4));
    // One of them is half there.
    let coverage = |i: usize| {
        let material = frame.instances[i].material.expect("a skin");
        stage.scene.materials[material.0 as usize].finish.alpha
    };
    assert_eq!(coverage(2), 1.0);
    assert!((coverage(3) - 0.5).abs() < 0.01);
    // Its frames follow each other.
    let pose = stage.at(0.05, &PLAYER_EYE).instances[3].pose;
    assert_eq!((pose.from, pose.to), (0, 1));
    assert!((pose.fraction - 0.5).abs() < 1e-3);
    assert!((frame.styles[3] - 25.0 * 22.0 / 256.0).abs() < 1e-6);
}

#[test]
fn bolts_and_flashes_are_seen_by_the_camera_and_light_by_spheres() {
    let stage = stage();
    // The player's own flash: its body does not stand in that light.
    let flash = stage.at(0.25, &PLAYER_EYE);
    let player = shown(&flash)
        .iter()
        .filter(|(f, _)| *f == MODELS[2])
        .count();
    assert_eq!(player, 1);
    let bolts: Vec<_> = (flash.instances.iter())
        .filter(|i| i.name == MODELS[4])
        .collect();
    assert_eq!(bolts.len(), 7);
    assert!(bolts.iter().all(|i| i.seen_by == SeenBy::CAMERA));
    // From the player on, northwards.
    let first = Vec3::from(bolts[0].transform.translation);
    assert_eq!(first, Vec3::new(256.0, 256.0, 40.0));
    // 200 units make four lights; the flash and the one who glows have one each.
    assert_eq!(flash.lights.len(), 4 + 2);
    let row = &flash.lights[2..];
    assert!(
        row.iter()
            .all(|l| (l.position.x, l.position.z) == (256.0, 40.0))
    );
    // At 32 units beside a long row, 200 values of a lightmap.
    let spacing = row[1].position.y - row[0].position.y;
    let sum: f32 = (-2000..2000)
        .map(|i| {
            let r2 = 32.0 * 32.0 + (i as f32 * spacing).powi(2);
            row[0].intensity.z * 32.0 / r2.powf(1.5)
        })
        .sum();
    let value = sum / scene::import::IRRADIANCE_PER_VALUE;
    // The row is not dense: within the ripple that 50 units between lights leave at 32.
    assert!((value - 200.0).abs() < 30.0, "{value}");
}

#[test]
fn particles_face_the_camera_in_the_colour_of_the_palette() {
    let stage = stage();
    let frame = stage.at(0.2 + 1e-6, &PLAYER_EYE);
    let dots = &frame.loose;
    // Some of the twenty have a life of no length.
    let count = dots.triangles.len() / 4;
    assert!((8..=20).contains(&count), "{count}");
    let basis = frame.camera.view_basis(4, 3);
    for t in &dots.triangles {
        let [a, b, c] = t.vertices.map(|v| dots.positions[v as usize]);
        let normal = (b - a).cross(c - a);
        let forward = basis.forward.as_vec3();
        assert!((normal.normalize() + forward).length() < 1e-3);
        let material = &stage.scene.materials[t.material.0 as usize];
        let emission = material.emission.expect("an emission");
        for [u, v] in t.uv {
            let index = v as usize * 16 + u as usize;
            assert!((72..80).contains(&index));
            let texel = stage.scene.textures[emission.0 as usize].rgba[index];
            assert_eq!(texel[0], index as u8);
        }
    }
}

/// The weapon is small enough to be inside the player and has the same picture as the large one.
#[test]
fn weapons_in_hand_stick_in_no_wall() {
    let stage = stage();
    let frame = stage.at(0.05, &PLAYER_EYE);
    let weapon = frame.instances.last().expect("a weapon");
    let mesh = &stage.scene.meshes[weapon.mesh];
    let eye = frame.camera.position;
    let state = stage
        .timeline
        .state_at(0.05, &Options::default())
        .expect("a state");
    let hand = state.view_model.expect("a weapon");
    let large = scene::alias::placement(hand.origin, hand.angles.to_array(), 1.0);
    for &p in &mesh.positions {
        let small = weapon.transform.transform_point3(p) - eye;
        assert!(small.length() <= 12.001, "{small}");
        let whole = large.transform_point3(p) - eye;
        assert!(small.normalize().dot(whole.normalize()) > 0.9999);
    }
}

#[test]
fn what_moved_is_known_from_one_frame_to_the_next() {
    let stage = stage();
    let (before, mut now) = (stage.at(0.15, &PLAYER_EYE), stage.at(0.25, &PLAYER_EYE));
    now.follow(&before);
    now.check(&stage.scene).expect("a frame");
    let past = now.before.as_ref().expect("the frame before");
    for (instance, past) in now.instances.iter().zip(&past.instances) {
        let was = (before.instances.iter()).find(|i| i.name == instance.name);
        match instance.name.as_str() {
            // The door goes up by ten units a second.
            name if name == MODELS[1] => {
                let way =
                    instance.transform.translation - past.expect("a door").transform.translation;
                assert!((way.z - 1.0).abs() < 1e-3, "{way}");
            }
            name if name == MODELS[3] || name == MODELS[4] => {}
            _ => {
                let was = was.expect("it was there");
                let moved = was.transform != instance.transform || was.pose != instance.pose;
                assert_eq!(past.is_some(), moved, "{}", instance.name);
            }
        }
    }
}

#[test]
fn frames_are_in_the_fog_that_the_server_sets() {
    let stage = stage();
    assert!(stage.scene.features.fog && stage.scene.fog.is_none());
    assert_eq!(stage.at(0.15, &PLAYER_EYE).fog, None);
    let fog = stage.at(0.35, &PLAYER_EYE).fog.expect("fog");
    assert_eq!(Some(fog), FogKeys::new(0.2, [1.0, 0.0, 0.2]).medium());
    // Fog that options ask for stays.
    let asked = ImportOptions {
        fog: Some(FogKeys::OFF),
        ..ImportOptions::default()
    };
    let stage = stage_of(&asked);
    assert!(!stage.scene.features.fog);
    assert_eq!(stage.at(0.35, &PLAYER_EYE).fog, None);
}

/// A level with fog of its own, whose server changes fog and sky; messages every 0.1 s.
#[test]
fn fog_fades_from_the_level_s_own_and_skies_change() {
    let mut w = DemoWriter::new(Dialect::QUAKE, -1);
    w.server_info("title", 1, &MODELS[..1], &[])
        .set_view(1)
        .signon(1);
    w.signon(3).end_block([0.0; 3]);
    for i in 0..20_u16 {
        w.frame(10.0 + f32::from(i) / 10.0, &[(1, Entity::default())]);
        w.client(&Client::default());
        match i {
            4 => drop(w.fog(102, [255, 0, 51], 50)),
            // From where it is then.
            7 => drop(w.fog(0, [255, 0, 51], 0)),
            // Colours stay where a command gives none.
            9 => drop(w.raw(b"\x09fog 0.8\n\0")),
            12 => drop(w.skybox("night_")),
            15 => drop(w.skybox("")),
            _ => {}
        }
        w.end_block([0.0; 3]);
    }
    let mut warnings = Warnings::new();
    let bytes = w.finish();
    let demo = Demo::parse(&bytes, &Limits::default(), &mut warnings).expect("a demo");
    let timeline = Timeline::new(&demo, &|_| None, &mut warnings);
    let mut map = room();
    map.world_key("fog", "0.2 0.6 0.4 0.2");
    let parts = Parts::of(&timeline, 0);
    let options = ImportOptions::default();
    let (scene, cast) = import_cast(
        &compile(&map),
        &palette(),
        &|_| None,
        &options,
        parts.list(),
    )
    .expect("a stage");
    let stage = Stage {
        timeline,
        scene,
        cast,
    };
    let own = [0.2, 0.6, 0.4, 0.2];
    let asked = [0.4, 1.0, 0.0, 0.2];
    // Message i comes into force at (i - 1) / 10 s; the fade takes half a second.
    let faded =
        |share: f32| -> [f32; 4] { std::array::from_fn(|i| own[i] + (asked[i] - own[i]) * share) };
    for (t, expected) in [
        (0.25, own),
        (0.3, own),
        (0.4, faded(0.2)),
        (0.55, faded(0.5)),
        (0.7, [0.0; 4]),
        (0.85, [0.8, 1.0, 0.0, 0.2]),
    ] {
        let [density, r, g, b] = expected;
        let expected = FogKeys::new(density, [r, g, b]).medium();
        let found = stage.at(t, &PLAYER_EYE).fog;
        let numbers = |fog: Option<scene::Fog>| {
            fog.map_or([0.0; 4], |f| {
                [1000.0 * f.extinction, f.albedo.x, f.albedo.y, f.albedo.z]
            })
        };
        for (a, b) in numbers(found).iter().zip(numbers(expected)) {
            assert!((a - b).abs() < 1e-4, "{t} s: {found:?}, not {expected:?}");
        }
    }
    let skies = [1.05, 1.15, 1.35, 1.45].map(|t| stage.timeline.sky_at(t));
    assert_eq!(skies, [None, Some("night_"), Some("night_"), Some("")]);
}

#[test]
fn particles_are_known_from_one_frame_to_the_next() {
    let stage = stage();
    // They begin at 0.1 s: message 2 comes into force then.
    let (before, mut now) = (stage.at(0.12, &PLAYER_EYE), stage.at(0.15, &PLAYER_EYE));
    now.follow(&before);
    now.check(&stage.scene).expect("a frame");
    let past = &now.before.as_ref().expect("the frame before").loose;
    assert!(!past.is_empty() && past.len() == now.loose.positions.len());
    for (i, was) in past.iter().enumerate() {
        assert!(before.loose.positions.contains(was), "corner {i} at {was}");
    }
    // What was not there would have been where its speed says.
    now.follow(&stage.at(0.05, &PLAYER_EYE));
    let past = &now.before.as_ref().expect("the frame before").loose;
    for ((was, at), drift) in past.iter().zip(&now.loose.positions).zip(&now.drifts) {
        let way = *at - *was;
        assert!((way - drift.velocity * 0.1).length() < 1e-3, "{way}");
        assert!(drift.velocity.z < 0.0, "it falls");
    }
}

#[test]
fn missing_models_are_told_of_and_left_out() {
    let stage = stage();
    assert!(!stage.cast.models.contains_key(MODELS[6]));
    let told = stage.scene.report.warnings.iter();
    assert_eq!(told.filter(|w| w.contains("progs/absent.mdl")).count(), 1);
    // The world alone stands still: neither the level's entities nor its brush models are placed.
    assert_eq!(stage.scene.instances.len(), 1);
    let wall = stage.cast.models.get("*1");
    assert!(matches!(wall, Some(CastModel::Brush { .. })));
}

#[test]
fn every_real_demo_makes_frames() {
    let Some(dir) = data() else { return };
    let limits = Limits::default();
    let search = SearchPath::builder()
        .basedir(&dir)
        .build()
        .expect("search path");
    let files = |path: &str| search.read_optional(path).ok().flatten().map(|f| f.bytes);
    let palette = Palette::parse(&files("gfx/palette.lmp").expect("a palette")).expect("a palette");
    let options = ImportOptions {
        light_lists: false,
        ..ImportOptions::default()
    };
    let all = Options {
        unseen: Unseen::All,
        ..Options::default()
    };
    let (mut made, mut absent) = (0, 0);
    for path in std::fs::read_dir(dir.join("loose/dem")).expect("demos") {
        let path = path.expect("a demo").path();
        let bytes = std::fs::read(&path).expect("a demo");
        let mut warnings = Warnings::new();
        let Ok(demo) = Demo::parse(&bytes, &limits, &mut warnings) else {
            continue;
        };
        let timeline = Timeline::new(&demo, &|_| None, &mut warnings);
        for (number, level) in timeline.levels().iter().enumerate() {
            let Ok(file) = Level::load(&search, &level.map, &limits) else {
                absent += 1;
                continue;
            };
            let parts = Parts::of(&timeline, number);
            let (scene, cast) =
                import_cast(&file, &palette, &files, &options, parts.list()).expect("a stage");
            for i in 0..10 {
                let (from, to) = level.span;
                let t = from + (to - from) * (f64::from(i) + 0.5) / 10.0;
                let state = timeline.state_at(t, &all).expect("a state");
                let frame = frame(&state, level, &scene, &cast, &PLAYER_EYE);
                frame
                    .check(&scene)
                    .unwrap_or_else(|e| panic!("{}: {e}", path.display()));
                // Nearly all that is there is shown: triggers have no faces.
                assert!(frame.instances.len() * 2 > state.entities.len());
                made += 1;
            }
        }
    }
    assert!(made >= 160 && absent == 1, "{made} made, {absent} absent");
}
