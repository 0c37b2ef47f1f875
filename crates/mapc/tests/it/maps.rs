//! Small maps, each with something hard in it.

use mapc::{Brush, CompileError, Map, Options, Plane, Texture, compile, parse_map};

use crate::check;
use crate::reader::{Bsp, Random};

fn textured(map: &mut Map) -> &mut Map {
    for name in [
        "wall", "floor", "panel", "*water", "*lava", "sky", "+0lamp", "+1lamp", "{grate",
    ] {
        map.texture(Texture::from_fn(name, 64, 64, |x, y| (x ^ y) as u8));
    }
    map
}

fn start(at: &str) -> [(&str, &str); 1] {
    [("origin", at)]
}

/// `mins` to `maxs` must be a box without any of the void outside the map.
fn everything(map: &Map, mins: [f64; 3], maxs: [f64; 3]) -> Vec<u8> {
    let out = compile(map, &Options::default()).unwrap();
    let bsp = Bsp::new(&out.bytes);
    check::closed(&bsp);
    check::winding(&bsp);
    check::marks(&bsp);
    check::contents(map, &bsp, mins, maxs, 4000);
    check::visibility(&bsp, mins, maxs, 2000);
    out.bytes
}

/// Two rooms and a crooked passage, a column, a ramp, a pool, sky, coplanar panels: every rule
/// of the compiler is met at least once.
fn course() -> Map {
    let mut map = Map::new();
    textured(&mut map);
    map.world_key("message", "course");
    // First room, open to the sky, its +X wall with a door.
    map.brush_box([-16.0, -16.0, -16.0], [528.0, 400.0, 0.0], "floor");
    map.brush_box([-16.0, -16.0, 0.0], [0.0, 400.0, 256.0], "wall");
    map.brush_box([0.0, -16.0, 0.0], [512.0, 0.0, 256.0], "wall");
    map.brush_box([0.0, 384.0, 0.0], [512.0, 400.0, 256.0], "wall");
    map.brush_box([512.0, -16.0, 0.0], [528.0, 160.0, 256.0], "wall");
    map.brush_box([512.0, 224.0, 0.0], [528.0, 400.0, 256.0], "wall");
    map.brush_box([512.0, 160.0, 112.0], [528.0, 224.0, 256.0], "wall");
    map.brush_box([-16.0, -16.0, 256.0], [528.0, 400.0, 272.0], "sky");
    // Second room with a pool; panels flush with and proud of its walls.
    map.room([528.0, 96.0, -64.0], [800.0, 320.0, 192.0], 16.0, "wall");
    // Its -X wall would close the door.
    let brushes = &mut map.entities[0].brushes;
    brushes.remove(brushes.len() - 6);
    map.brush_box([512.0, 160.0, -16.0], [528.0, 224.0, 0.0], "floor");
    map.brush_box([528.0, 96.0, -64.0], [600.0, 320.0, 0.0], "floor");
    map.brush_box([600.0, 96.0, -64.0], [800.0, 320.0, -16.0], "*water");
    map.brush_box([790.0, 150.0, 20.0], [816.0, 250.0, 100.0], "panel");
    map.brush_box([700.0, 304.0, 20.0], [760.0, 336.0, 100.0], "+0lamp");
    // A ramp and a slanted column cut across everything.
    let s = 0.5f64.sqrt();
    map.brush(Brush::from_planes(&[
        (
            Plane {
                normal: [0.6, 0.0, 0.8],
                dist: 120.0,
            },
            "panel",
        ),
        (
            Plane {
                normal: [-1.0, 0.0, 0.0],
                dist: 0.0,
            },
            "wall",
        ),
        (
            Plane {
                normal: [0.0, -1.0, 0.0],
                dist: -40.0,
            },
            "wall",
        ),
        (
            Plane {
                normal: [0.0, 1.0, 0.0],
                dist: 140.0,
            },
            "wall",
        ),
        (
            Plane {
                normal: [0.0, 0.0, -1.0],
                dist: 8.0,
            },
            "wall",
        ),
    ]));
    map.brush(Brush::from_planes(&[
        (
            Plane {
                normal: [s, s, 0.0],
                dist: 433.1,
            },
            "panel",
        ),
        (
            Plane {
                normal: [-s, -s, 0.0],
                dist: -390.7,
            },
            "panel",
        ),
        (
            Plane {
                normal: [s, -s, 0.0],
                dist: 31.3,
            },
            "panel",
        ),
        (
            Plane {
                normal: [-s, s, 0.0],
                dist: 9.9,
            },
            "panel",
        ),
        (
            Plane {
                normal: [0.0, 0.0, -1.0],
                dist: 8.0,
            },
            "panel",
        ),
        (
            Plane {
                normal: [0.1, 0.0, 0.995f64],
                dist: 180.0,
            },
            "panel",
        ),
    ]));
    // A detail, which takes no part in visibility.
    map.brush_entity(
        "func_detail",
        &[],
        vec![Brush::cuboid(
            [40.0, 200.0, 0.0],
            [90.0, 260.0, 70.0],
            ["panel"; 6],
        )],
    );
    // T-junctions: a stack of odd bricks against a wall, and a brush floating in the water.
    map.brush_box([100.0, 350.0, 0.0], [170.0, 384.0, 33.0], "panel");
    map.brush_box([130.0, 350.0, 33.0], [200.0, 384.0, 66.0], "panel");
    map.brush_box([170.0, 360.0, 0.0], [211.0, 384.0, 33.0], "floor");
    map.brush_box([640.0, 140.0, -40.0], [700.0, 200.0, 4.0], "floor");
    map.entity("info_player_start", &start("300 100 32"));
    map.entity(
        "light",
        &[("origin", "300 200 200"), ("light", "300"), ("style", "3")],
    );
    map.brush_entity(
        "func_door",
        &[("angle", "-1")],
        vec![Brush::cuboid(
            [514.0, 160.0, 0.0],
            [524.0, 224.0, 112.0],
            ["panel"; 6],
        )],
    );
    map.brush_entity(
        "func_illusionary",
        &[],
        vec![Brush::cuboid(
            [602.0, 96.0, 0.0],
            [604.0, 320.0, 64.0],
            ["{grate"; 6],
        )],
    );
    map
}

#[test]
fn a_course_of_hard_cases_is_closed_visible_and_right_everywhere() {
    let map = course();
    let bytes = everything(&map, [-15.0, -15.0, -15.0], [527.0, 399.0, 271.0]);
    let bsp = Bsp::new(&bytes);
    check::contents(
        &map,
        &bsp,
        [529.0, 81.0, -79.0],
        [815.0, 335.0, 207.0],
        4000,
    );
    check::visibility(&bsp, [400.0, 81.0, -79.0], [815.0, 335.0, 207.0], 2000);
    assert_eq!(bsp.models().len(), 3);
    // Both frames of the animation are there though only the first is used.
    assert!(bsp.texture_names().contains(&"+1lamp".to_owned()));
    assert_eq!(bytes, compile(&map, &Options::default()).unwrap().bytes);
}

#[test]
fn a_closed_box_has_six_faces_and_one_leaf() {
    let mut map = Map::new();
    textured(&mut map).room([0.0; 3], [200.0, 100.0, 64.0], 16.0, "wall");
    map.entity("info_player_start", &start("64 64 32"));
    let bytes = everything(&map, [-15.0; 3], [215.0, 115.0, 79.0]);
    let bsp = Bsp::new(&bytes);
    assert_eq!(bsp.faces().len(), 6);
    assert_eq!(bsp.vertices().len(), 8);
    assert_eq!(bsp.leafs().len(), 2);
    // Twelve edges, each shared by two faces, and the unused first.
    assert_eq!(bsp.lump(12).len(), 13 * 4);
    // Normals point inward: every face sees the middle of the room.
    for f in bsp.faces() {
        let (n, d) = bsp.planes()[f.plane];
        let at = n[0] * 100.0 + n[1] * 50.0 + n[2] * 32.0 - d;
        assert!(if f.side { at < 0.0 } else { at > 0.0 });
    }
    // The player's box fits in the middle and not at the wall; the ogre's is too tall.
    let head = bsp.models()[0].2;
    assert_eq!(bsp.clip_contents(head[1], [100.0, 50.0, 25.0]), -1);
    assert_eq!(bsp.clip_contents(head[1], [10.0, 50.0, 25.0]), -2);
    assert_eq!(bsp.clip_contents(head[2], [100.0, 50.0, 32.0]), -2);
}

#[test]
fn liquid_surfaces_come_in_opposite_pairs() {
    let mut map = Map::new();
    textured(&mut map).room([0.0; 3], [128.0; 3], 16.0, "wall");
    map.brush_box([0.0; 3], [128.0, 128.0, 40.0], "*lava");
    map.entity("info_player_start", &start("64 64 80"));
    let bytes = everything(&map, [1.0; 3], [127.0; 3]);
    let bsp = Bsp::new(&bytes);
    let names = bsp.texture_names();
    let lava: Vec<_> = bsp
        .faces()
        .into_iter()
        .filter(|f| names[bsp.texinfo(f.texinfo).1] == "*lava")
        .collect();
    assert_eq!(lava.len(), 2);
    assert_ne!(lava[0].side, lava[1].side);
    let mut a = lava[0].vertices.clone();
    a.reverse();
    let turn = a.iter().position(|v| *v == lava[1].vertices[0]).unwrap();
    a.rotate_left(turn);
    assert_eq!(a, lava[1].vertices);
}

#[test]
fn the_later_of_two_flush_brushes_gives_the_texture() {
    let mut map = Map::new();
    textured(&mut map).room([0.0; 3], [128.0; 3], 16.0, "wall");
    map.brush_box([32.0, 32.0, -8.0], [96.0, 96.0, 0.0], "panel");
    map.entity("info_player_start", &start("64 64 80"));
    let bytes = everything(&map, [-15.0; 3], [143.0; 3]);
    let bsp = Bsp::new(&bytes);
    let (vertices, names) = (bsp.vertices(), bsp.texture_names());
    let panel: Vec<_> = bsp
        .faces()
        .into_iter()
        .filter(|f| names[bsp.texinfo(f.texinfo).1] == "panel")
        .collect();
    assert_eq!(panel.len(), 1);
    let mut corners: Vec<_> = panel[0].vertices.iter().map(|v| vertices[*v]).collect();
    corners.sort_by(|a, b| a.partial_cmp(b).unwrap());
    let expected = [
        [32.0, 32.0, 0.0],
        [32.0, 96.0, 0.0],
        [96.0, 32.0, 0.0],
        [96.0, 96.0, 0.0],
    ];
    assert_eq!(corners, expected);
}

#[test]
fn a_leak_names_the_entity_unless_leaks_are_allowed() {
    let mut map = Map::new();
    textured(&mut map).room([0.0; 3], [128.0; 3], 16.0, "wall");
    map.entity("info_player_start", &start("64 64 80"));
    map.entity("light", &start("64 64 500"));
    let leak = compile(&map, &Options::default()).unwrap_err();
    let CompileError::Leak {
        entity,
        ref classname,
        ..
    } = leak
    else {
        panic!("{leak}")
    };
    assert_eq!((entity, classname.as_str()), (2, "light"));
    map.entities.pop();
    assert!(
        compile(&map, &Options::default())
            .unwrap()
            .warnings
            .is_empty()
    );
    // One wall less.
    map.entities[0].brushes.remove(1);
    let leak = compile(&map, &Options::default()).unwrap_err();
    assert!(leak.to_string().contains("info_player_start"), "{leak}");
    let open = Options {
        allow_leaks: true,
        ..Options::default()
    };
    let out = compile(&map, &open).unwrap();
    assert_eq!(out.warnings.len(), 1);
    check::closed(&Bsp::new(&out.bytes));
}

#[test]
fn random_heaps_of_overlapping_brushes_stay_closed() {
    for seed in 0..5 {
        let mut random = Random(seed);
        let mut map = Map::new();
        textured(&mut map).room([0.0; 3], [256.0, 256.0, 192.0], 16.0, "wall");
        let names = ["wall", "panel", "floor", "*water", "sky", "*lava"];
        for i in 0..9 {
            let a = random
                .point([-8.0; 3], [220.0, 220.0, 140.0])
                .map(f64::round);
            let size = random.point([8.0; 3], [90.0; 3]).map(f64::round);
            let b = std::array::from_fn(|k| a[k] + size[k]);
            let mut brush = Brush::cuboid(a, b, [names[i % names.len()]; 6]);
            if i % 3 == 0 {
                // Cut a corner off, at any angle.
                let n = random.point([0.1; 3], [1.0; 3]);
                let l = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
                let normal = n.map(|v| v / l);
                let mid: [f64; 3] = std::array::from_fn(|k| a[k] + 0.7 * size[k]);
                let dist = (0..3).map(|k| normal[k] * mid[k]).sum();
                let cut = Brush::from_planes(&[(Plane { normal, dist }, names[i % names.len()])]);
                brush.faces.extend(cut.faces);
            }
            map.brush(brush);
        }
        // The start must be in the open: drop brushes around it.
        let p = [240.0, 240.0, 170.0];
        map.entities[0].brushes.retain(|b| !b.contains(p));
        map.entity("info_player_start", &start("240 240 170"));
        let out = compile(&map, &Options::default()).unwrap();
        let bsp = Bsp::new(&out.bytes);
        check::closed(&bsp);
        check::winding(&bsp);
        check::visibility(&bsp, [0.0; 3], [256.0, 256.0, 192.0], 1000);
    }
}

#[test]
fn text_and_builder_give_the_same_map() {
    let text = r#"
// a comment
{
"classname" "worldspawn"
"message" "two forms"
{
( 0 0 0 ) ( 0 1 0 ) ( 0 0 1 ) wall 0 0 0 1 1
( 64 0 0 ) ( 64 0 1 ) ( 64 1 0 ) wall 0 0 0 1 1
( 0 0 0 ) ( 0 0 1 ) ( 1 0 0 ) wall 8 -4 90 2 0.5
( 0 64 0 ) ( 1 64 0 ) ( 0 64 1 ) wall [ 1 0 0 3 ] [ 0 0 -1 5 ] 0 2 1
( 0 0 0 ) ( 1 0 0 ) ( 0 1 0 ) wall 0 0 0 1 1
( 0 0 64 ) ( 0 1 64 ) ( 1 0 64 ) wall 0 0 0 1 1
}
}
{ "classname" "light" "origin" "-10 0 0" }
"#;
    let map = parse_map(text).unwrap();
    assert_eq!(map.entities.len(), 2);
    assert_eq!(map.entities[0].get("message"), Some("two forms"));
    let open = Options {
        allow_leaks: true,
        ..Options::default()
    };
    let out = compile(&map, &open).unwrap();
    let bsp = Bsp::new(&out.bytes);
    check::closed(&bsp);
    check::contents(&map, &bsp, [-30.0; 3], [90.0; 3], 500);
    assert_eq!(bsp.faces().len(), 6);
    // Axes by hand: rotation 90 turns S (+X) to T, scale 2 halves; T (-Z) turned, scale 0.5.
    let rows: Vec<_> = bsp
        .faces()
        .iter()
        .map(|f| bsp.texinfo(f.texinfo).0)
        .collect();
    assert!(
        rows.contains(&[[0.0, 0.0, 0.5, 8.0], [2.0, 0.0, 0.0, -4.0]]),
        "{rows:?}"
    );
    assert!(
        rows.contains(&[[0.5, 0.0, 0.0, 3.0], [0.0, 0.0, -1.0, 5.0]]),
        "{rows:?}"
    );
    let entities = bsp.entities();
    assert!(entities.contains("\"message\" \"two forms\""));
    assert!(entities.contains("\"origin\" \"-10 0 0\""));
    // The entity text is itself a map without brushes, with the same keys.
    let again = parse_map(&entities).unwrap();
    assert!(
        again
            .entities
            .iter()
            .zip(&map.entities)
            .all(|(a, b)| a.keys == b.keys)
    );
}

#[test]
fn wrong_maps_are_refused_with_the_place() {
    let cases = [
        (
            "{ \"classname\" \"worldspawn\" { ( 0 0 0 ) ( 1 0 0 ) ( 2 0 0 ) w 0 0 0 1 1 } }",
            "brush 0",
        ),
        ("{ \"classname\" \"worldspawn\"\n{ ( 0 x 0 )", "line 2"),
        ("{ \"classname", "line 1"),
        ("}", "line 1"),
        ("", "no entity"),
        ("{ \"classname\" \"worldspawn\" }", "no brush"),
    ];
    for (text, expected) in cases {
        let error = parse_map(text)
            .and_then(|m| compile(&m, &Options::default()).map(|_| ()))
            .unwrap_err()
            .to_string();
        assert!(
            error.contains(expected),
            "{error:?} does not say {expected:?}"
        );
    }
}
