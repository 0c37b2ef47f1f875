//! Levels, from brushes to picture: what the import makes of what compilers and mappers leave.

use super::{ASTRAY, CROSSING};
use crate::builder::camera;
use crate::case::{Case, Escapes, Truth};
use crate::formulas::closed_box;
use crate::level::{GLOW, LAMP, block, compile, import_bytes, linear, map, room, scene_of};
use crate::lumps::Lumps;
use glam::Vec3;
use mapc::{Brush, Map, Plane};
use scene::import::LightMode;
use scene::render::Estimator::{Mis, Naive, Nee};
use scene::{Camera, Scene};
use std::sync::Arc;

/// Why devices may lead rays astray in levels of many small faces.
const CLOSED: &str = "hundreds of edges, slivers among them: of the rays within rounding of one, which shared \
    corners should keep, a device loses a few";

pub fn cases() -> Vec<Case> {
    let mut all = vec![
        furnace(
            "collinear faces",
            "Faces with many corners on straight sides, slanted brushes and slivers, as compiled.",
            clutter,
        )
        .astray(ASTRAY, CLOSED),
        Case::new(
            "T-junctions",
            "The same level without the corners that closed its T-junctions: the import does.",
            Truth::Radiance([series(); 3]),
            view(),
            || {
                let mut map = room("glow");
                clutter(&mut map);
                let mut lumps = Lumps::of(&compile(&map));
                lumps.strip_collinear();
                import_bytes(lumps.bytes(), LightMode::Textures)
            },
        )
        .depth(4)
        .by(&[Naive])
        .every_pixel()
        .astray(ASTRAY, CLOSED)
        .facts(|scene| match scene.report.t_junctions_split {
            0 => Err("no T-junction was split".to_owned()),
            _ => is_sealed(scene),
        }),
        furnace(
            "coplanar movers",
            "A wall and doors that are flush with floor, wall and each other: none shines twice.",
            movers,
        )
        .astray(ASTRAY, CROSSING),
        Case::new(
            "coplanar movers, lights",
            "The same by light sampling, which also chooses faces that a mover hides.",
            Truth::Radiance([series(); 3]),
            view(),
            || {
                let mut map = room("glow");
                movers(&mut map);
                scene_of(&map)
            },
        )
        .depth(4)
        .by(&[Mis]),
        Case::new(
            "movers in one place",
            "Two doors and a wall of the same brush: what is there three times shines once.",
            Truth::Radiance([series(); 3]),
            view(),
            || {
                let mut map = room("glow");
                for class in ["func_door", "func_door", "func_wall"] {
                    let brush = block([200.0, 300.0, 0.0], [330.0, 340.0, 100.0], "glow");
                    map.brush_entity(class, &[], vec![brush]);
                }
                scene_of(&map)
            },
        )
        .depth(4)
        .facts(is_sealed),
        mover_wins("flush func_wall wins", "func_wall"),
        mover_wins("flush func_door wins", "func_door"),
    ];
    all.extend(visibility());
    all.extend(openings());
    all.extend([
        Case::new(
            "dark room under a bright sky",
            "A sealed room without a lamp, in a hall of sky: every sample is exactly black.",
            Truth::Black,
            camera(Vec3::new(500.0, 500.0, 150.0), 5.0, 30.0, 100.0),
            || scene_of(&dark_room()),
        )
        .by(&[Naive, Nee, Mis])
        .facts(|scene| {
            let shines = scene.features.sky && scene.emitters.total_weight > 1e6;
            if !shines {
                return Err("the sky does not shine".to_owned());
            }
            is_sealed(scene)
        }),
        Case::new(
            "a space after a number",
            "`\"light\" \"150 \"` is a light of 150, and not of the default 300.",
            Truth::Same(Box::new(|| lit_by("150"))),
            view(),
            || lit_by("150 "),
        )
        .depth(3)
        .by(&[Nee]),
    ]);
    all.extend(extensions());
    all
}

/// Radiance after four vertices in a closed level of nothing but the texture `glow`, whatever its
/// shape.
fn series() -> f64 {
    closed_box(linear(GLOW), linear(GLOW), 4)
}

fn view() -> Camera {
    camera(Vec3::new(200.0, 180.0, 120.0), 15.0, 40.0, 100.0)
}

fn is_sealed(scene: &Scene) -> Result<(), String> {
    if scene.report.sealed {
        return Ok(());
    }
    Err(format!(
        "the level is not sealed: {} holes",
        scene.report.holes
    ))
}

/// A glowing room with something in it that glows alike.
fn furnace(
    name: &'static str,
    tests: &'static str,
    fill: impl Fn(&mut Map) + Send + Sync + 'static,
) -> Case {
    let truth = Truth::Radiance([series(); 3]);
    Case::new(name, tests, truth, view(), move || {
        let mut map = room("glow");
        fill(&mut map);
        scene_of(&map)
    })
    .depth(4)
    .by(&[Naive])
    .every_pixel()
    .facts(is_sealed)
}

/// A convex block of the texture `glow` above the floor: a box whose top is cut by a slanted plane
/// through the point `through`.
fn wedge(mins: [f64; 3], maxs: [f64; 3], normal: Vec3, through: [f64; 3]) -> Brush {
    let axis = |i: usize, sign: f64, dist: f64| {
        let mut normal = [0.0; 3];
        normal[i] = sign;
        (Plane { normal, dist }, "glow")
    };
    let n = normal.as_dvec3().normalize();
    let slanted = Plane {
        normal: n.to_array(),
        dist: n.dot(through.into()),
    };
    let mut planes: Vec<(Plane, &str)> = (0..3)
        .flat_map(|i| [axis(i, -1.0, -mins[i]), axis(i, 1.0, maxs[i])])
        .collect();
    planes.push((slanted, "glow"));
    Brush::from_planes(&planes)
}

/// Steps, wedges and thin slabs that meet floor and walls at odd places.
fn clutter(map: &mut Map) {
    for i in 0..6 {
        let x = 20.0 + 75.0 * f64::from(i);
        // Steps against a wall, of heights that share no corners.
        map.brush(block(
            [x, 460.0 - 7.0 * f64::from(i), 0.0],
            [x + 75.0, 512.0, 13.0 + 11.0 * f64::from(i)],
            "glow",
        ));
        // Wedges whose slanted tops run into the floor.
        let y = 30.0 + 60.0 * f64::from(i);
        let lean = Vec3::new(0.1 + 0.17 * i as f32, 0.23, 1.0);
        map.brush(wedge(
            [400.0, y, 0.0],
            [470.0, y + 40.0, 60.0],
            lean,
            [430.0, y, 21.0],
        ));
    }
    // A slab of 1/8 unit, one of almost no slant, and a beam across the room.
    map.brush(block([300.0, 40.0, 0.0], [360.0, 100.0, 0.125], "glow"));
    map.brush(wedge(
        [40.0, 300.0, 0.0],
        [140.0, 400.0, 8.0],
        Vec3::new(0.004, 0.001, 1.0),
        [90.0, 350.0, 4.0],
    ));
    map.brush(block([0.0, 250.5, 200.0], [512.0, 262.25, 216.0], "glow"));
}

/// Movers sunk into floor and wall so that their fronts are flush, and two side by side.
fn movers(map: &mut Map) {
    map.brush_entity(
        "func_wall",
        &[],
        vec![block([64.0, 64.0, -16.0], [192.0, 192.0, 0.0], "glow")],
    );
    map.brush_entity(
        "func_door",
        &[],
        vec![block([256.0, 64.0, -16.0], [384.0, 192.0, 0.0], "glow")],
    );
    map.brush_entity(
        "func_door",
        &[],
        vec![block([512.0, 200.0, 0.0], [528.0, 260.0, 128.0], "glow")],
    );
    // Doors that meet in the middle, stand on the floor and touch nothing else.
    for y in [300.0, 340.0] {
        map.brush_entity(
            "func_door",
            &[],
            vec![block([300.0, y, 0.0], [310.0, y + 40.0, 100.0], "glow")],
        );
    }
}

/// Looking down on a mover that glows, flush with a floor that does not.
fn mover_wins(name: &'static str, class: &'static str) -> Case {
    Case::new(
        name,
        "Of two surfaces in one plane the entity's is seen, in every sample.",
        Truth::Radiance([linear(LAMP); 3]),
        camera(Vec3::new(256.0, 256.0, 100.0), 90.0, 0.0, 40.0),
        move || {
            let mut map = room("wall");
            let mover = block([192.0, 192.0, -16.0], [320.0, 320.0, 0.0], "lamp");
            map.brush_entity(class, &[], vec![mover]);
            scene_of(&map)
        },
    )
    .depth(1)
    .by(&[Naive])
    .every_pixel()
    .facts(is_sealed)
}

/// Three rooms in a row with doorways that do not line up, and a lamp in the last.
fn suite() -> Vec<u8> {
    let mut map = map();
    map.room([0.0; 3], [800.0, 256.0, 128.0], 16.0, "wall");
    for (x, [near, far]) in [(256.0, [40.0, 100.0]), (528.0, [150.0, 220.0])] {
        let mut part = |y: [f64; 2], z: [f64; 2]| {
            map.brush(block([x, y[0], z[0]], [x + 8.0, y[1], z[1]], "wall"));
        };
        part([0.0, near], [0.0, 128.0]);
        part([far, 256.0], [0.0, 128.0]);
        part([near, far], [90.0, 128.0]);
    }
    map.brush(block([600.0, 40.0, 120.0], [740.0, 200.0, 128.0], "lamp"));
    map.entity("info_player_start", &[("origin", "128 128 32")]);
    compile(&map)
}

/// Levels whose visibility is missing or wrong: light does not go by it.
fn visibility() -> Vec<Case> {
    let same = |name, tests, spoil: fn(&mut Vec<u8>)| {
        let truth = Truth::Same(Box::new(|| import_bytes(suite(), LightMode::Textures)));
        let view = camera(Vec3::new(330.0, 60.0, 60.0), 5.0, 60.0, 100.0);
        Case::new(name, tests, truth, view, move || {
            let mut lumps = Lumps::of(&suite());
            spoil(lumps.visibility());
            import_bytes(lumps.bytes(), LightMode::Textures)
        })
        .samples(8, 64)
        .by(&[Mis])
        .facts(is_sealed)
    };
    // The same by the lists of lights that are made from the rows, in the lamp's own room.
    let lit = |name, tests, spoil: fn(&mut Vec<u8>)| {
        let view = camera(Vec3::new(600.0, 100.0, 60.0), 5.0, 60.0, 100.0);
        Case::new(name, tests, Truth::Judge(4096), view, move || {
            let mut lumps = Lumps::of(&suite());
            spoil(lumps.visibility());
            import_bytes(lumps.bytes(), LightMode::Textures)
        })
        .samples(8, 256)
        .depth(3)
        .by(&[Mis])
        .interval(0.05)
        .facts(is_sealed)
    };
    vec![
        same("no PVS", "A level without visibility rows.", Vec::clear),
        same(
            "PVS of zeros",
            "Visibility rows by which nothing is seen from anywhere.",
            |rows| rows.fill(0),
        ),
        same(
            "PVS turned over",
            "Visibility rows by which only what is hidden is seen.",
            |rows| rows.iter_mut().for_each(|b| *b = !*b),
        ),
        lit(
            "lists, no PVS",
            "Lists of lights without visibility rows.",
            Vec::clear,
        ),
        lit(
            "lists, PVS of zeros",
            "Lists of lights that lack the lamp overhead.",
            |rows| rows.fill(0),
        ),
    ]
}

/// Ways out: a room without its wall towards +x, and an eye that is outside.
fn openings() -> [Case; 3] {
    let make = || {
        let mut map = room("glow");
        // The second wall of the room.
        map.entities[0].brushes.remove(1);
        scene_of(&map)
    };
    let is_open = |scene: &Scene| match scene.report.sealed {
        true => Err("the report calls an open level sealed".to_owned()),
        false => Ok(()),
    };
    [
        Case::new(
            "unsealed, outwards",
            "Beyond a missing wall there is nothing, and nothing is black.",
            Truth::Black,
            camera(Vec3::new(256.0, 256.0, 128.0), 0.0, 0.0, 30.0),
            make,
        )
        .escapes(Escapes::Always)
        .facts(is_open),
        Case::new(
            "unsealed, inwards",
            "Rays that leave by a missing wall are counted, and the room is darker for it.",
            Truth::Judge(8192),
            camera(Vec3::new(400.0, 256.0, 128.0), 0.0, 180.0, 90.0),
            make,
        )
        .escapes(Escapes::Some)
        .facts(is_open),
        Case::new(
            "camera in a level's wall",
            "From inside of the floor of a sealed level there are backs, which do not shine.",
            Truth::Black,
            camera(Vec3::new(256.0, 256.0, -8.0), -60.0, 30.0, 100.0),
            || scene_of(&room("glow")),
        )
        .by(&[Naive, Nee, Mis])
        .escapes(Escapes::Some)
        .facts(is_sealed),
    ]
}

fn dark_room() -> Map {
    let mut map = map();
    map.world_key("sunlight", "20000");
    map.room([0.0; 3], [1024.0, 1024.0, 512.0], 16.0, "sky");
    map.room([400.0, 400.0, 100.0], [600.0, 600.0, 220.0], 1.0, "wall");
    // Pillars in corners and across an edge: more places to leak.
    map.brush(block([400.0, 400.0, 100.0], [416.0, 410.0, 220.0], "wall"));
    map.brush(block([590.0, 480.0, 100.0], [600.0, 520.0, 131.0], "wall"));
    map.entity("info_player_start", &[("origin", "500 500 130")]);
    map.entity("info_null", &[("origin", "100 100 400")]);
    map
}

fn lit_by(light: &str) -> Arc<Scene> {
    let mut map = room("wall");
    map.entity("light", &[("origin", "300 300 180"), ("light", light)]);
    import_bytes(compile(&map), LightMode::Entities)
}

/// Levels with `BSPX` lumps that are empty, there twice, or both.
fn extensions() -> Vec<Case> {
    let same = |name, tests, spoil: fn(&mut Lumps)| {
        let truth = Truth::Same(Box::new(|| import_bytes(suite(), LightMode::Textures)));
        let view = camera(Vec3::new(600.0, 100.0, 60.0), 5.0, 60.0, 100.0);
        Case::new(name, tests, truth, view, move || {
            let mut lumps = Lumps::of(&suite());
            spoil(&mut lumps);
            import_bytes(lumps.bytes(), LightMode::Textures)
        })
        .samples(8, 64)
        .by(&[Mis])
        .facts(is_sealed)
    };
    vec![
        same(
            "empty BSPX lumps",
            "Every known extension is there, and empty.",
            |lumps| {
                for name in bsp::bsp::bspx::KNOWN {
                    lumps.add_bspx(name, Vec::new());
                }
            },
        ),
        same(
            "BSPX lumps there twice",
            "Extensions that are there twice, the second time of a wrong size.",
            |lumps| {
                let faces = lumps.face_count();
                for length in [faces, faces + 1] {
                    for name in ["LMSHIFT", "RGBLIGHTING", "NOBODY_KNOWS"] {
                        lumps.add_bspx(name, vec![2; length]);
                    }
                }
            },
        ),
    ]
}
