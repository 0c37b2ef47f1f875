//! The sprites of the sample level and of its demo: an explosion, and a globe of light.

use super::noise::{fractal, hash};
use super::palette::{FIRE, HOLE, LAMP, shade};
use crate::{Sprite, SpriteFrame, SpritePicture};

/// Pictures of the explosion.
pub(super) const BLASTS: u16 = 6;

/// Every sprite by its path in a game directory.
pub(super) fn sprites() -> Vec<(&'static str, Sprite)> {
    vec![
        ("progs/s_explod.spr", explosion()),
        ("progs/s_light.spr", globe()),
    ]
}

fn picture(side: usize, texel: impl Fn(f64, f64, usize, usize) -> u8) -> SpritePicture {
    let half = side as f64 / 2.0;
    let mut pixels = Vec::with_capacity(side * side);
    for y in 0..side {
        for x in 0..side {
            let (u, v) = (x as f64 + 0.5 - half, y as f64 + 0.5 - half);
            pixels.push(texel(u / half, v / half, x, y));
        }
    }
    let half = side as i32 / 2;
    SpritePicture {
        origin: [-half, half],
        size: [side as u32; 2],
        pixels,
    }
}

/// A ball of fire that swells, tears and cools.
fn explosion() -> Sprite {
    const SIDE: usize = 48;
    let blast = |i: u16| {
        let age = f64::from(i) / f64::from(BLASTS);
        let reach = 0.5 + 0.5 * (age * 1.6).min(1.0);
        picture(SIDE, |u, v, x, y| {
            let away = (u * u + v * v).sqrt() / reach;
            let at = |c: usize| c as f64 + 7.0 * age;
            let cloud = fractal(at(x), at(y), 12.0, [SIDE; 2], 61 + u64::from(i) / 3);
            let heat = 1.25 - away - age * 1.1 + 0.9 * (cloud - 0.5);
            let torn = age > 0.5 && hash(x as i64 / 2, y as i64 / 2, 63) < age - 0.5;
            if heat < 0.12 || away > 1.0 || torn {
                HOLE
            } else {
                shade(FIRE, heat, x, y)
            }
        })
    };
    Sprite {
        kind: 2,
        frames: (0..BLASTS).map(|i| SpriteFrame::Single(blast(i))).collect(),
        random_start: false,
    }
}

/// A round lamp.
fn globe() -> Sprite {
    let ball = picture(16, |u, v, _, _| match (u * u + v * v).sqrt() {
        r if r > 1.0 => HOLE,
        r => LAMP * 16 + 4 + (3.9 * (1.0 - r * r)) as u8,
    });
    Sprite {
        kind: 2,
        frames: vec![SpriteFrame::Single(ball)],
        random_start: false,
    }
}
