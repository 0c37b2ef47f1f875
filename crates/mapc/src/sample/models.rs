//! The models of the sample level and of its demo: a torch, a rune, a scarab that walks, a staff in the player's hand, what
//! it throws, and the player.

use super::noise::{fractal, hash};
use super::palette::{BRASS, BRICK, FIRE, LAMP, SAND, STEEL, STONE, TEAL, WOOD};
use super::shape::{Patch, Shape, Skin, cosine, model, sine};
use crate::{Model, Vec3};

/// Fullbright green, as bright as it gets.
const GREEN: u8 = LAMP * 16 + 10;
/// Fullbright magenta.
const MAGENTA: u8 = LAMP * 16 + 13;
/// Model flags: a trail of fire and a light; turns about itself.
const ROCKET: u32 = 1;
const ROTATE: u32 = 8;

/// Frames of the scarab's walk begin here.
pub(super) const WALK: u16 = 1;
/// How many there are.
pub(super) const STEPS: u16 = 6;
/// Units that a scarab walks in one round of its legs.
pub(super) const STRIDE: f32 = 36.0;
/// Frames of the staff's kick begin here.
pub(super) const KICK: u16 = 1;
/// How many there are.
pub(super) const KICKS: u16 = 5;
/// How many frames the player's walk has.
pub(super) const PACES: u16 = 6;

/// Every model by its path in a game directory.
pub(super) fn models() -> Vec<(&'static str, Model)> {
    vec![
        ("progs/flame.mdl", torch()),
        ("progs/end1.mdl", rune()),
        ("progs/scarab.mdl", scarab()),
        ("progs/v_staff.mdl", staff()),
        ("progs/missile.mdl", missile()),
        ("progs/player.mdl", player()),
    ]
}

/// A value from 0 to 1 that wraps around.
fn grain(u: f64, v: f64, seed: u64) -> f64 {
    fractal(u * 32.0, v * 32.0, 8.0, [32, 32], seed)
}

/// A torch whose holder is bolted to a wall behind it, with a flame of six poses.
fn torch() -> Model {
    const WOODEN: Patch = [0, 0, 16, 32];
    const BURNING: Patch = [16, 0, 16, 32];
    let mut skin = Skin::new(32, 32);
    skin.paint(WOODEN, |u, v| {
        if v > 0.7 {
            (BRASS, 0.35 + 0.4 * grain(u, v, 5))
        } else {
            (WOOD, 0.25 + 0.4 * grain(u, v * 0.3, 6))
        }
    });
    skin.paint(BURNING, |u, v| {
        let edge = 0.25 * (grain(u, v, 7) - 0.5);
        (FIRE, (1.05 - v + edge).clamp(0.12, 1.0))
    });
    let pose = |i: usize| {
        let mut shape = Shape::default();
        let holder = [
            [0.0, -14.0],
            [1.2, -13.0],
            [1.6, -3.0],
            [3.0, 0.0],
            [0.0, 0.5],
        ];
        shape.lathe(&holder, 8, WOODEN, |p| p);
        // Widths of the flame from its foot to its tip; each pose has its own wind.
        let body = [1.2, 2.8, 3.2, 2.5, 1.5, 0.0];
        let time = i as f64 / 6.0;
        let profile: Vec<[f64; 2]> = (body.iter().enumerate())
            .map(|(k, width)| {
                let height = 0.4 + 2.7 * k as f64;
                let swell = 1.0 + 0.18 * sine(time + 0.31 * k as f64);
                let tip = if k + 1 == body.len() {
                    2.2 * sine(time * 2.0)
                } else {
                    0.0
                };
                [width * swell, height + tip]
            })
            .collect();
        shape.lathe(&profile, 7, BURNING, |[x, y, z]| {
            let lean = z * z / 220.0;
            [
                x + lean * 2.2 * sine(time + z / 24.0),
                y + lean * 2.2 * cosine(2.0 * time + z / 30.0),
                z,
            ]
        });
        shape
    };
    let mut model = model(&skin, &[("burn", 0.1, (0..6).map(pose).collect())]);
    model.random_start = true;
    model
}

/// A rune: a slim stone with glowing signs inside a ring of brass.
fn rune() -> Model {
    const STONY: Patch = [0, 0, 48, 48];
    const RING: Patch = [48, 0, 16, 48];
    let mut skin = Skin::new(64, 48);
    skin.paint(STONY, |u, v| (TEAL, 0.15 + 0.35 * grain(u, v, 11)));
    // Three signs around the waist: strokes up, across, and a dot.
    for side in 0..3 {
        let x = 16 * side + 6;
        skin.lamp([x + 1, 15, 2, 18], GREEN);
        skin.lamp([x - 2, 19 + 3 * side, 8, 2], GREEN);
        skin.lamp([x + 3, 27, 3, 2], GREEN + 1);
    }
    skin.paint(RING, |u, v| (BRASS, 0.3 + 0.5 * grain(u, v, 12)));
    let mut shape = Shape::default();
    let body = [
        [0.0, -15.0],
        [7.0, -6.0],
        [8.0, 0.0],
        [7.0, 6.0],
        [0.0, 15.0],
    ];
    shape.lathe(&body, 6, STONY, |p| p);
    // A ring is what a small circle sweeps around the axis: down inside, up outside.
    let circle: Vec<[f64; 2]> = (0..=6)
        .map(|i| {
            let turn = f64::from(i % 6) / 6.0 + 0.75;
            [12.5 + 1.3 * cosine(turn), 1.3 * sine(turn)]
        })
        .collect();
    shape.lathe(&circle, 16, RING, |p| p);
    let mut model = model(&skin, &[("rune", 0.1, vec![shape])]);
    model.flags = ROTATE;
    model
}

/// A scarab the size of a dog. It stands on its origin's height less 24, as what walks does.
fn scarab() -> Model {
    const SHELL: Patch = [0, 0, 48, 48];
    const HEAD: Patch = [48, 0, 16, 16];
    const LEG: Patch = [48, 16, 16, 16];
    const EYE: Patch = [48, 32, 16, 16];
    let mut skin = Skin::new(64, 48);
    skin.paint(SHELL, |u, v| {
        // A quarter of the way around is up; below is the belly.
        let up = (u - 0.25).abs();
        let ribs = 0.12 * sine(v * 9.0);
        if up > 0.25 {
            (STONE, 0.2 + 0.2 * grain(u, v, 21))
        } else if v > 0.68 {
            (STEEL, 0.3 + ribs + 0.3 * grain(u, v, 22))
        } else {
            (TEAL, 0.4 + ribs - up + 0.35 * grain(u, v, 23))
        }
    });
    // A line that glows where the wings meet, and a sign on each.
    skin.lamp([11, 16, 2, 26], GREEN);
    for x in [7, 15] {
        skin.lamp([x, 24, 2, 7], GREEN);
        skin.lamp([x, 35, 2, 3], GREEN);
    }
    skin.paint(HEAD, |u, v| (STEEL, 0.25 + 0.35 * grain(u, v, 24)));
    skin.paint(LEG, |u, v| (STONE, 0.15 + 0.3 * v + 0.2 * grain(u, v, 25)));
    skin.paint(EYE, |_, v| (FIRE, 0.55 + 0.3 * v));
    // `walk`: where in a round of its legs it is, 0 to 1, if it walks; `breath` as it stands.
    let pose = |walk: Option<f64>, breath: f64| {
        let mut shape = Shape::default();
        let lift = walk.map_or(0.6 * sine(breath), |w| 0.8 * sine(2.0 * w)) - 24.0;
        let body = [-3.0, 0.0, 15.0 + lift];
        shape.ellipsoid(body, [19.0, 12.0, 8.5], [8, 12], SHELL);
        let nod = walk.map_or(0.8 * sine(breath + 0.2), |w| sine(2.0 * w + 0.3));
        let head = [18.0, 0.0, 13.0 + lift + nod];
        shape.ellipsoid(head, [6.5, 6.0, 5.0], [5, 8], HEAD);
        for side in [-1.0, 1.0] {
            let eye = [22.0, 3.6 * side, 15.5 + lift + nod];
            shape.ellipsoid(eye, [1.8, 1.8, 1.8], [4, 6], EYE);
            let feeler = [30.0 + nod, 7.0 * side, 22.0 + lift + 2.0 * nod];
            shape.limb(
                [[22.5, 2.0 * side, 16.0 + lift + nod], feeler],
                [0.6, 0.3],
                4,
                LEG,
            );
            for (k, x) in [11.0, -2.0, -15.0].into_iter().enumerate() {
                // Three legs stand while the other three step.
                let turn = if (k % 2 == 0) == (side > 0.0) {
                    0.0
                } else {
                    0.5
                };
                let (ahead, up) = walk.map_or((0.0, 0.0), |w| step(w + turn));
                let hip = [x * 0.8 - 2.0, 8.0 * side, 12.0 + lift];
                let knee = [x + ahead * 0.6, 17.0 * side, 19.0 + lift + up * 0.8];
                let foot = [x * 1.25 + ahead, 22.0 * side, up - 24.0];
                shape.limb([hip, knee], [2.0, 1.4], 5, LEG);
                shape.limb([knee, foot], [1.4, 0.5], 5, LEG);
            }
        }
        shape
    };
    let part = |i: u16, n: u16| f64::from(i) / f64::from(n);
    let rest = (0..6).map(|i| pose(None, part(i, 6))).collect();
    let mut frames = vec![("rest", 0.2, rest)];
    frames.extend((0..STEPS).map(|i| ("walk", 0.1, vec![pose(Some(part(i, STEPS)), 0.0)])));
    model(&skin, &frames)
}

/// Where a foot is in a round of its leg: ahead of its middle, and above ground. For half of it the foot stands, and the
/// ground moves it back.
fn step(turns: f64) -> (f64, f64) {
    let reach = f64::from(STRIDE) / 4.0;
    let at = turns.rem_euclid(1.0);
    if at < 0.5 {
        (reach * (1.0 - 4.0 * at), 0.0)
    } else {
        (
            reach * (4.0 * at - 3.0),
            5.0 * sine((at - 0.5).min(1.0 - at)),
        )
    }
}

/// A staff with a glowing crystal, as its bearer sees it.
fn staff() -> Model {
    const SHAFT: Patch = [0, 0, 16, 64];
    const CLAW: Patch = [16, 0, 16, 32];
    const CRYSTAL: Patch = [16, 32, 16, 32];
    let mut skin = Skin::new(32, 64);
    skin.paint(SHAFT, |u, v| {
        if (v * 8.0).fract() < 0.18 {
            (BRASS, 0.3 + 0.5 * grain(u, v, 31))
        } else {
            (WOOD, 0.2 + 0.4 * grain(u, v * 0.25, 32))
        }
    });
    skin.paint(CLAW, |u, v| (BRASS, 0.3 + 0.5 * grain(u, v, 33)));
    skin.paint(CRYSTAL, |u, v| (BRICK, 0.2 + 0.5 * grain(u, v, 34)));
    skin.lamp([20, 38, 8, 20], MAGENTA);
    let pose = |back: f64| {
        let mut shape = Shape::default();
        let at = |p: Vec3| [p[0] - 5.0 * back, p[1], p[2] + 1.5 * back];
        let low = at([6.0, -8.0, -15.0]);
        let tip = at([30.0, -5.0, -6.5]);
        shape.limb([low, tip], [1.3, 1.0], 8, SHAFT);
        let beyond = |along: f64, out: [f64; 2]| {
            let d: Vec3 = [0, 1, 2].map(|k| (tip[k] - low[k]) / 25.7);
            [
                tip[0] + d[0] * along,
                tip[1] + d[1] * along + out[0],
                tip[2] + d[2] * along + out[1],
            ]
        };
        for i in 0..3 {
            let turn = f64::from(i) / 3.0;
            let out = |r: f64| [r * cosine(turn), r * sine(turn)];
            shape.limb(
                [beyond(-0.5, [0.0; 2]), beyond(2.0, out(2.6))],
                [0.7, 0.6],
                5,
                CLAW,
            );
            shape.limb(
                [beyond(2.0, out(2.6)), beyond(5.5, out(1.7))],
                [0.6, 0.2],
                5,
                CLAW,
            );
        }
        let centre = beyond(3.0, [0.0; 2]);
        shape.ellipsoid(centre, [3.0, 1.4, 1.4], [4, 6], CRYSTAL);
        shape
    };
    let kick = [1.0, 0.75, 0.45, 0.2, 0.05];
    let mut frames = vec![("hold", 0.1, vec![pose(0.0)])];
    frames.extend(kick.map(|back| ("kick", 0.1, vec![pose(back)])));
    model(&skin, &frames)
}

/// What the staff throws; it flies along x.
fn missile() -> Model {
    const BODY: Patch = [0, 0, 16, 32];
    let mut skin = Skin::new(16, 32);
    skin.paint(BODY, |u, v| {
        if v < 0.3 {
            (FIRE, 1.0 - v)
        } else {
            (BRICK, 0.3 + 0.5 * grain(u, v, 41))
        }
    });
    let mut shape = Shape::default();
    let profile = [
        [0.0, -9.0],
        [2.0, -6.0],
        [2.4, 2.0],
        [1.4, 7.0],
        [0.0, 10.0],
    ];
    shape.lathe(&profile, 8, BODY, |[y, z, x]| [x, y, z]);
    let mut model = model(&skin, &[("fly", 0.1, vec![shape])]);
    model.flags = ROCKET;
    model
}

/// A monk in a robe. Its first two rows of colours are those that players choose.
fn player() -> Model {
    const ROBE: Patch = [0, 0, 48, 48];
    const FACE: Patch = [48, 0, 16, 16];
    const ARM: Patch = [48, 16, 16, 32];
    /// Rows that players' shirts and trousers have.
    const SHIRT: u8 = 1;
    const TROUSERS: u8 = 6;
    let mut skin = Skin::new(64, 48);
    skin.paint(ROBE, |u, v| {
        let folds = 0.15 * sine(u * 9.0) * (1.0 - v);
        let cloth = 0.35 + folds + 0.25 * grain(u, v, 51);
        if v < 0.45 {
            (TROUSERS, cloth)
        } else {
            (SHIRT, cloth)
        }
    });
    skin.paint([0, 25, 48, 3], |u, _| {
        (BRASS, 0.5 + 0.2 * hash((u * 48.0) as i64, 0, 52))
    });
    skin.paint(FACE, |u, v| (SAND, 0.35 + 0.2 * grain(u, v, 53)));
    skin.paint(ARM, |u, v| (SHIRT, 0.3 + 0.3 * grain(u, v, 54)));
    let pose = |walk: f64, reach: f64| {
        let mut shape = Shape::default();
        let bob = 0.8 * sine(2.0 * walk);
        let robe = [
            [0.0, -24.0],
            [11.0, -24.0],
            [8.5, -8.0],
            [7.0, 2.0],
            [8.5, 14.0],
            [7.5, 19.0],
            [3.0, 22.0],
            [0.0, 22.5],
        ];
        shape.lathe(&robe, 12, ROBE, |[x, y, z]| {
            let swing = (2.0 - z).max(0.0) / 26.0 * reach * 2.5 * sine(walk);
            [x + swing, y * 1.15, if z > -23.0 { z + bob } else { z }]
        });
        shape.ellipsoid([1.0, 0.0, 27.0 + bob], [5.0, 4.2, 5.5], [6, 10], FACE);
        for side in [-1.0, 1.0] {
            let swing = reach * 5.0 * side * sine(walk);
            let shoulder = [0.0, 9.0 * side, 17.0 + bob];
            let elbow = [swing * 0.5 - 1.0, 12.0 * side, 7.0 + bob];
            let hand = [7.0 + swing, 9.0 * side, 2.0 + bob];
            shape.limb([shoulder, elbow], [3.2, 2.6], 6, ARM);
            shape.limb([elbow, hand], [2.6, 1.6], 6, ARM);
        }
        shape
    };
    let part = |i: u16| f64::from(i) / f64::from(PACES);
    let mut frames = vec![("stand", 0.1, vec![pose(0.0, 0.0)])];
    frames.extend((0..PACES).map(|i| ("walk", 0.1, vec![pose(part(i), 1.0)])));
    model(&skin, &frames)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ModelFrame;

    #[test]
    fn feet_stand_still_on_the_ground() {
        // Over half a round the ground passes half a stride.
        let (from, to) = (step(0.0), step(0.4999));
        assert!((from.0 - to.0 - f64::from(STRIDE) / 2.0).abs() < 0.01);
        assert_eq!((from.1, to.1), (0.0, 0.0));
        assert!(step(0.75).1 > 2.0);
        assert!((step(0.5).0 - step(0.4999).0).abs() < 0.01);
        assert!((step(0.9999).0 - step(0.0).0).abs() < 0.01);
    }

    #[test]
    fn models_have_what_they_promise() {
        for (name, model) in models() {
            assert!((30..800).contains(&model.triangles.len()), "{name}");
            assert!(model.write().len() < 60_000, "{name}");
        }
        let torch = torch();
        assert!(matches!(&torch.frames[0], ModelFrame::Group(poses) if poses.len() == 6));
        assert_eq!(scarab().frames.len(), usize::from(WALK + STEPS));
        assert_eq!(staff().frames.len(), usize::from(KICK + KICKS));
        assert_eq!(player().frames.len(), 1 + usize::from(PACES));
    }
}
