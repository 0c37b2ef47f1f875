//! A level with one room for each way in which light entities shine. Each room's light has a style of
//! its own, so that its lightmaps tell the ways apart.

use mapc::{Map, Texture};

/// A room's name, and the keys of its lights.
pub type Room = (
    &'static str,
    &'static [&'static [(&'static str, &'static str)]],
);

/// What each style's room has, in order from style 1.
pub const ROOMS: [Room; 12] = [
    ("delay 0", &[&[("light", "300")]]),
    ("delay 1", &[&[("light", "40"), ("delay", "1")]]),
    (
        "delay 2",
        &[&[("light", "120"), ("delay", "2"), ("wait", "0.8")]],
    ),
    ("delay 3", &[&[("light", "150"), ("delay", "3")]]),
    (
        "delay 4",
        &[&[("light", "90"), ("delay", "4")], &[("light", "140")]],
    ),
    ("delay 5", &[&[("light", "300"), ("delay", "5")]]),
    (
        "spotlight",
        &[&[
            ("light", "300"),
            ("mangle", "30 -65 0"),
            ("angle", "80"),
            ("_softangle", "40"),
            ("wait", "0.5"),
        ]],
    ),
    (
        "falloff and colour",
        &[&[
            ("_light", "250"),
            ("_falloff", "230"),
            ("_color", "255 140 60"),
        ]],
    ),
    (
        "negative",
        &[&[("light", "300")], &[("light", "-120"), ("wait", "0.5")]],
    ),
    (
        "angle scale",
        &[
            &[("light", "250"), ("_anglescale", "1")],
            &[("light", "100"), ("_anglescale", "0")],
        ],
    ),
    (
        "template",
        &[&[
            ("light", "200"),
            ("_surface", "panel"),
            ("_surface_spotlight", "1"),
            ("angle", "150"),
        ]],
    ),
    (
        "deviance",
        &[&[
            ("light", "150"),
            ("delay", "2"),
            ("_deviance", "6"),
            ("_samples", "64"),
        ]],
    ),
];

/// Inner size of a room, world units.
const SIZE: [f64; 3] = [256.0, 208.0, 176.0];

/// The level: the rooms in a row along x, and one under the sky, lit by a sun and a dome in style 0.
#[must_use]
pub fn map() -> Map {
    let mut map = Map::new();
    for (name, index) in [("wall", 100), ("panel", 60)] {
        map.texture(Texture::solid(name, 16, 16, index));
    }
    map.texture(Texture::solid("sky1", 256, 128, 80));
    for key in [
        ("_sunlight", "180"),
        ("_sun_mangle", "40 -60 0"),
        ("_sunlight2", "120"),
    ] {
        map.world_key(key.0, key.1);
    }
    for i in 0..=ROOMS.len() {
        let x = 320.0 * i as f64;
        let at = |p: [f64; 3]| [x + p[0], p[1], p[2]];
        let mut walls = ["wall"; 6];
        if i == ROOMS.len() {
            walls[5] = "sky1";
        }
        map.room_faces(at([0.0; 3]), at(SIZE), 16.0, walls);
        // A pillar, and a panel on a wall.
        map.brush_box(at([144.0, 88.0, 0.0]), at([176.0, 120.0, 96.0]), "wall");
        map.brush_box(at([64.0, 0.0, 48.0]), at([192.0, 8.0, 112.0]), "panel");
    }
    let outside = 320.0 * ROOMS.len() as f64;
    map.entity("info_player_start", &[("origin", "40 40 32")]);
    map.entity(
        "info_null",
        &[("origin", &format!("{} 40 32", outside + 40.0))],
    );
    for (i, (_, lights)) in ROOMS.iter().enumerate() {
        let style = (i + 1).to_string();
        for (j, keys) in lights.iter().enumerate() {
            let origin = format!("{} {} 136", 320 * i + 72 + 100 * j, 150 - 30 * j);
            let mut all = vec![("origin", origin.as_str()), ("style", style.as_str())];
            all.extend_from_slice(keys);
            map.entity("light", &all);
        }
        // Rooms that nobody is in would be solid.
        let origin = format!("{} 24 24", 320 * i + 24);
        map.entity("info_null", &[("origin", &origin)]);
    }
    map
}
