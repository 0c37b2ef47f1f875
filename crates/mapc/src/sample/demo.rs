//! A demo of the sample level, written by hand: a walk from the hall to the courtyard, past all that moves.

use super::models::{KICK, KICKS, PACES, STEPS, STRIDE, WALK};
use super::shape::{cosine, sine};
use super::sprites::BLASTS;
use crate::demo::{Client, DemoWriter, Dialect, Entity, Vec3};
use crate::{CompileError, Map, parse_map};

/// Messages of a second.
const RATE: u16 = 30;
/// Seconds.
const LENGTH: u16 = 6;
/// Clock of the server when the demo begins.
const BEGIN: f32 = 2.0;

/// Files that entities show, in the order of their numbers; brush models of the level follow.
const MODELS: [&str; 9] = [
    "maps/sample.bsp",
    "progs/player.mdl",
    "progs/v_staff.mdl",
    "progs/flame.mdl",
    "progs/end1.mdl",
    "progs/scarab.mdl",
    "progs/missile.mdl",
    "progs/s_explod.spr",
    "progs/s_light.spr",
];
const PLAYER: u16 = 2;
const STAFF: u16 = 3;
const FLAME: u16 = 4;
const RUNE: u16 = 5;
const SCARAB: u16 = 6;
const MISSILE: u16 = 7;
const BLAST: u16 = 8;
const GLOBE: u16 = 9;
const FIRST_BRUSH_MODEL: u16 = 10;

/// Seconds at which things happen.
const PICKS_UP: f32 = 1.9;
const THROWS: f32 = 3.3;
const DOOR_OPENS: f32 = 0.5;
const PLAT_RISES: f32 = 3.8;
const IS_BITTEN: f32 = 5.1;

/// Effects of an entity: the flash of a weapon.
const MUZZLE_FLASH: u8 = 2;

/// Where the player's box stands, and where it looks: seconds, place on the floor, pitch and yaw.
const WAY: [(f32, [f32; 2], [f32; 2]); 7] = [
    (0.0, [40.0, -56.0], [2.0, 6.0]),
    (1.2, [170.0, -52.0], [3.0, -30.0]),
    (2.2, [320.0, -24.0], [3.0, -14.0]),
    (3.2, [470.0, 0.0], [-2.0, 0.0]),
    (4.2, [620.0, 4.0], [-4.0, 2.0]),
    (5.1, [716.0, -30.0], [2.0, -12.0]),
    (6.0, [750.0, -34.0], [-6.0, 18.0]),
];

/// The demo as a file. `text` is the source of the level that it plays in.
///
/// # Errors
/// As [`parse_map`].
pub(super) fn demo(text: &str) -> Result<Vec<u8>, CompileError> {
    let map = parse_map(text)?;
    let cast = Cast::of(&map);
    let mut demo = DemoWriter::new(
        Dialect {
            protocol: 666,
            ..Dialect::QUAKE
        },
        -1,
    );
    cast.begin(&mut demo);
    for tick in 0..=LENGTH * RATE {
        cast.moment(&mut demo, f32::from(tick) / f32::from(RATE));
    }
    demo.disconnect();
    demo.end_block([0.0; 3]);
    Ok(demo.finish())
}

/// What of the level stands in the demo.
struct Cast {
    title: String,
    brush_models: u16,
    /// Entities that stay for good.
    statics: Vec<Entity>,
    /// Brush models that never move.
    still: Vec<u16>,
    door: u16,
    plat: u16,
    /// Where runes and scarabs are.
    runes: Vec<Vec3>,
    scarabs: Vec<Vec3>,
}

impl Cast {
    fn of(map: &Map) -> Self {
        let mut cast = Self {
            title: String::new(),
            brush_models: 0,
            statics: Vec::new(),
            still: Vec::new(),
            door: 0,
            plat: 0,
            runes: Vec::new(),
            scarabs: Vec::new(),
        };
        for entity in &map.entities {
            let at = entity.vector("origin").unwrap_or_default();
            let at = at.map(|c| c as f32);
            let stays = |model| Entity {
                model,
                origin: at,
                ..Entity::default()
            };
            let class = entity.get("classname").unwrap_or_default();
            let mut model = 0;
            if !entity.brushes.is_empty() && class != "worldspawn" && class != "func_detail" {
                model = FIRST_BRUSH_MODEL + cast.brush_models;
                cast.brush_models += 1;
            }
            match class {
                "worldspawn" => cast.title = entity.get("message").unwrap_or_default().to_owned(),
                "light_torch_small_walltorch" => cast.statics.push(stays(FLAME)),
                "light_globe" => cast.statics.push(stays(GLOBE)),
                "func_illusionary" => cast.statics.push(stays(model)),
                "func_wall" | "func_button" => cast.still.push(model),
                "func_door" => cast.door = model,
                "func_plat" => cast.plat = model,
                "item_sigil" => cast.runes.push(at),
                "monster_scarab" => cast.scarabs.push(at),
                _ => {}
            }
        }
        cast
    }

    /// What a server says before a level is played.
    fn begin(&self, demo: &mut DemoWriter) {
        let numbered: Vec<String> = (1..=self.brush_models).map(|n| format!("*{n}")).collect();
        let mut models = MODELS.to_vec();
        models.extend(numbered.iter().map(String::as_str));
        demo.server_info(&self.title, 1, &models, &[])
            .set_view(1)
            .signon(1);
        demo.end_block([0.0; 3]);
        for (number, entity) in self.entities(0.0) {
            demo.baseline(number, &entity);
        }
        for entity in &self.statics {
            demo.spawn_static(entity);
        }
        demo.signon(2);
        demo.end_block([0.0; 3]);
        // Name, frags and colours of the player.
        demo.raw(b"\x0d\0walker\0\x0e\0\0\0\x11\0\x4d");
        for (style, letters) in [
            (0, "m"),
            (1, "mpnqomsolnpmkomrn"),
            (10, "mmmbmmaammmmmbammm"),
        ] {
            demo.light_style(style, letters);
        }
        demo.signon(3);
        demo.end_block(self.look(0.0));
    }

    /// What a server says at a moment.
    fn moment(&self, demo: &mut DemoWriter, t: f32) {
        // The moments nearest to when things happen.
        let happens = |at: f32| (t - at).abs() < 0.5 / f32::from(RATE);
        demo.frame(BEGIN + t, &self.entities(t));
        if happens(PICKS_UP) {
            demo.text(9, "bf\n");
        }
        if happens(hit().0) {
            demo.effect(3, hit().1);
        }
        let here = stand(t);
        if happens(IS_BITTEN) {
            let from = self.scarab(1, IS_BITTEN).origin;
            demo.damage(0, 24, from);
            demo.particles([here[0], here[1], 36.0], [0, 0, 2], 20, 73);
        }
        let kick = t - THROWS;
        let is_kicked = kick >= 0.0 && kick < f32::from(KICKS) / 10.0;
        let speed = velocity(t).map(|v| (v / 16.0) as i8);
        demo.client(&Client {
            velocity: [speed[0], speed[1], 0],
            punch: [if is_kicked && kick < 0.15 { -3 } else { 0 }, 0, 0],
            weapon: STAFF,
            weapon_frame: if is_kicked {
                KICK + (kick * 10.0) as u16
            } else {
                0
            },
            health: if t >= IS_BITTEN { 76 } else { 100 },
            ..Client::default()
        });
        demo.end_block(self.look(t));
    }

    /// Where the player looks.
    fn look(&self, t: f32) -> Vec3 {
        let [pitch, yaw] = along(t, |key| key.2);
        [pitch, yaw, 0.0]
    }

    /// All entities that there are.
    fn entities(&self, t: f32) -> Vec<(u16, Entity)> {
        let [pitch, yaw, _] = self.look(t);
        let mut all = vec![Entity {
            model: PLAYER,
            origin: stand(t),
            angles: [-pitch / 3.0, yaw, 0.0],
            frame: 1 + (t * 10.0) as u16 % PACES,
            colormap: 1,
            effects: if (0.0..0.05).contains(&(t - THROWS)) {
                MUZZLE_FLASH
            } else {
                0
            },
            ..Entity::default()
        }];
        let brush = |model, z| Entity {
            model,
            origin: [0.0, 0.0, z],
            ..Entity::default()
        };
        all.push(brush(self.door, moved(t - DOOR_OPENS, 104.0)));
        all.push(brush(self.plat, moved(t - PLAT_RISES, 58.0) - 58.0));
        all.extend(self.still.iter().map(|model| brush(*model, 0.0)));
        all.extend((0..self.scarabs.len()).map(|i| self.scarab(i, t)));
        let mut numbered: Vec<(u16, Entity)> = (1..).zip(all).collect();
        // What comes and goes has numbers of its own.
        if t < PICKS_UP {
            numbered.extend((50..).zip(self.runes.iter().map(|at| Entity {
                model: RUNE,
                origin: *at,
                ..Entity::default()
            })));
        }
        let (hits, place) = hit();
        let flies = t - THROWS;
        if flies >= 0.0 && t < hits {
            let begin = muzzle();
            let part = flies / (hits - THROWS);
            numbered.push((
                60,
                Entity {
                    model: MISSILE,
                    origin: [0, 1, 2].map(|k| begin[k] + (place[k] - begin[k]) * part),
                    angles: [rise(begin, place), 0.0, 0.0],
                    ..Entity::default()
                },
            ));
        }
        let burns = ((t - hits) * 10.0 + 0.01).floor();
        if burns >= 0.0 && burns < f32::from(BLASTS) {
            numbered.push((
                61,
                Entity {
                    model: BLAST,
                    origin: place,
                    frame: burns as u16,
                    ..Entity::default()
                },
            ));
        }
        numbered
    }

    /// The first scarab walks straight on, the others in circles.
    fn scarab(&self, number: usize, t: f32) -> Entity {
        let frame = WALK + (t * 10.0) as u16 % STEPS;
        let way = STRIDE * t * 10.0 / f32::from(STEPS);
        let [x, y, z] = self.scarabs[number];
        let (origin, yaw) = if number == 0 {
            ([x + way, y - 0.17 * way, z], -9.6)
        } else {
            const RADIUS: f32 = 60.0;
            let turn = way / RADIUS / std::f32::consts::TAU + 1.0 / 12.0;
            let at = |turn: f32| {
                let turn = f64::from(turn);
                [RADIUS * cosine(turn) as f32, RADIUS * sine(turn) as f32]
            };
            let (from, to) = (at(1.0 / 12.0), at(turn));
            (
                [x + to[0] - from[0], y + to[1] - from[1], z],
                turn * 360.0 + 90.0,
            )
        };
        Entity {
            model: SCARAB,
            origin,
            angles: [0.0, yaw, 0.0],
            frame,
            ..Entity::default()
        }
    }
}

/// When and where the missile hits the obelisk.
fn hit() -> (f32, Vec3) {
    (4.3, [970.0, 2.0, 104.0])
}

/// Where the missile leaves the staff.
fn muzzle() -> Vec3 {
    let [x, y, z] = stand(THROWS);
    [x + 24.0, y - 4.0, z + 16.0]
}

/// Pitch of an alias model that flies along x from one place to another, in degrees; small angles.
fn rise(from: Vec3, to: Vec3) -> f32 {
    ((to[2] - from[2]) / (to[0] - from[0])).to_degrees()
}

/// Where the player's entity is.
fn stand(t: f32) -> Vec3 {
    let [x, y] = along(t, |key| key.1);
    [x, y, 24.0]
}

/// Units per second.
fn velocity(t: f32) -> [f32; 2] {
    const STEP: f32 = 0.05;
    let (before, after) = (stand(t - STEP), stand(t + STEP));
    [0, 1].map(|k| (after[k] - before[k]) / (2.0 * STEP))
}

/// How far something has moved `seconds` after it began to, at 100 units per second.
fn moved(seconds: f32, way: f32) -> f32 {
    (100.0 * seconds).clamp(0.0, way)
}

/// A smooth way through values of [`WAY`] (a cubic with the mean slopes of its neighbours at each).
fn along(t: f32, value: impl Fn(&(f32, [f32; 2], [f32; 2])) -> [f32; 2]) -> [f32; 2] {
    let t = t.clamp(0.0, WAY[WAY.len() - 1].0);
    let i = WAY
        .partition_point(|key| key.0 <= t)
        .clamp(1, WAY.len() - 1);
    let slope = |k: usize, axis: usize| {
        let (a, b) = (&WAY[k.saturating_sub(1)], &WAY[(k + 1).min(WAY.len() - 1)]);
        (value(b)[axis] - value(a)[axis]) / (b.0 - a.0)
    };
    let (from, to) = (&WAY[i - 1], &WAY[i]);
    let span = to.0 - from.0;
    let s = (t - from.0) / span;
    [0, 1].map(|axis| {
        let (a, b) = (value(from)[axis], value(to)[axis]);
        let (u, v) = (slope(i - 1, axis) * span, slope(i, axis) * span);
        let (s2, s3) = (s * s, s * s * s);
        a * (2.0 * s3 - 3.0 * s2 + 1.0)
            + u * (s3 - 2.0 * s2 + s)
            + b * (3.0 * s2 - 2.0 * s3)
            + v * (s3 - s2)
    })
}
