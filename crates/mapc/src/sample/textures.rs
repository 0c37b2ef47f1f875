//! The sample level's textures, drawn by code in its own palette.

use super::noise::{block, cells, fractal, frame_light, hash, inside, value};
use super::palette::{
    BLUE, BRASS, BRICK, CRUST, FIRE, GREY, HOLE, LAMP, MOSS, RED, SAND, SKY, STEEL, STONE, TEAL,
    WATER, WOOD, shade,
};
use crate::texture::Texture;

/// Fullbright warm white, the brightest of its kind.
const WARM: u8 = LAMP * 16 + 7;
/// Fullbright blue-white.
const COLD: u8 = LAMP * 16 + 3;

/// All textures of the level.
pub(super) fn textures() -> Vec<Texture> {
    let mut all = vec![
        blocks("wall_stone", STONE, [64, 32], 1),
        blocks("wall_sand", SAND, [64, 64], 2),
        brick(),
        slabs("floor_tile", STONE, 3),
        slabs("floor_sand", SAND, 4),
        planks(),
        beam(),
        trim(),
        metal(),
        tech(),
        rock(),
        grass(),
        crate_side(),
        door(),
        button(),
        lamp_panel(),
        lamp_small(),
        grate(),
        lava(),
        water(),
        teleport(),
        sky(),
        Texture::from_fn("trigger", 64, 64, |x, y| shade(RED, 0.5, x, y)),
    ];
    all.extend((0..4).map(lamp_frame));
    all
}

fn at(x: usize, y: usize) -> (f64, f64) {
    (x as f64, y as f64)
}

fn blocks(name: &str, row: u8, size: [usize; 2], seed: u64) -> Texture {
    Texture::from_fn(name, 128, 128, |x, y| {
        let (u, v) = at(x, y);
        let b = block([x, y], size, [128, 128], [2, 3], seed);
        let grain = fractal(u, v, 16.0, [128, 128], seed * 31) - 0.5;
        let pits = value(u, v, 2.0, [128, 128], seed * 57);
        if b.joint {
            return shade(row, 0.30 + 0.25 * grain, x, y);
        }
        let pit = if pits > 0.86 { -0.10 } else { 0.0 };
        shade(
            row,
            0.62 + 0.12 * (b.id - 0.5) + 0.28 * grain + 0.13 * b.bevel + pit,
            x,
            y,
        )
    })
}

fn brick() -> Texture {
    Texture::from_fn("brick", 64, 64, |x, y| {
        let (u, v) = at(x, y);
        let b = block([x, y], [32, 16], [64, 64], [2, 2], 11);
        let grain = fractal(u, v, 8.0, [64, 64], 12) - 0.5;
        if b.joint {
            return shade(SAND, 0.42 + 0.3 * grain, x, y);
        }
        shade(
            BRICK,
            0.52 + 0.22 * (b.id - 0.5) + 0.25 * grain + 0.12 * b.bevel,
            x,
            y,
        )
    })
}

fn slabs(name: &str, row: u8, seed: u64) -> Texture {
    Texture::from_fn(name, 128, 128, |x, y| {
        let (u, v) = at(x, y);
        let b = block([x, y], [64, 64], [256, 128], [1, 2], seed);
        // Courses are moved by half a slab in `block`; floors look better as a plain grid.
        let (gx, gy) = (x % 64, y % 64);
        let id = hash((x / 64) as i64, (y / 64) as i64, seed + 5);
        let edge = gx.min(gy).min(63 - gx).min(63 - gy);
        let grain = fractal(u, v, 32.0, [128, 128], seed * 13) - 0.5;
        let fine = value(u, v, 2.0, [128, 128], seed * 19) - 0.5;
        if gx == 0 || gy == 0 {
            return shade(row, 0.34, x, y);
        }
        let bevel = match edge {
            1 => 0.10 * if gx.min(gy) == 1 { 1.0 } else { -1.0 },
            _ => 0.0,
        };
        let inlay = if inside(gx, gy, [6, 6, 59, 59]) == Some(0) {
            -0.10
        } else {
            0.0
        };
        let tone = 0.10 * (id - 0.5) + 0.02 * b.id;
        shade(
            row,
            0.60 + tone + 0.24 * grain + 0.06 * fine + bevel + inlay,
            x,
            y,
        )
    })
}

fn planks() -> Texture {
    Texture::from_fn("planks", 64, 64, |x, y| wood_texel(x, y, 16, 21))
}

fn beam() -> Texture {
    Texture::from_fn("beam", 64, 32, |x, y| {
        let light = match y {
            0..=1 => 0.16,
            30..=31 => -0.2,
            _ => 0.0,
        };
        let (u, v) = at(x, y);
        let streak = value(u, v * 8.0, 16.0, [64, 256], 23) - 0.5;
        let grain = fractal(u, v, 16.0, [64, 32], 24) - 0.5;
        shade(WOOD, 0.46 + 0.3 * streak + 0.2 * grain + light, x, y)
    })
}

fn wood_texel(x: usize, y: usize, width: usize, seed: u64) -> u8 {
    let (plank, u) = (x / width, x % width);
    let id = hash(plank as i64, 0, seed);
    let (fx, fy) = at(x, y);
    let streak = value(fx * 4.0, fy + 37.0 * id, 8.0, [256, 64], seed + 1) - 0.5;
    let grain = fractal(fx, fy, 16.0, [64, 64], seed + 2) - 0.5;
    let nail = (u == 3 || u == width - 4) && (y % 64 == 4 || y % 64 == 59);
    if nail {
        return shade(STEEL, 0.25, x, y);
    }
    let light = match u {
        0 => -0.34,
        1 => 0.12,
        _ if u == width - 1 => -0.14,
        _ => 0.0,
    };
    shade(
        WOOD,
        0.55 + 0.14 * (id - 0.5) + 0.3 * streak + 0.16 * grain + light,
        x,
        y,
    )
}

fn trim() -> Texture {
    Texture::from_fn("trim", 64, 16, |x, y| {
        let (u, v) = at(x, y);
        let grain = fractal(u, v, 8.0, [64, 16], 41) - 0.5;
        let stud = {
            let (dx, dy) = (u % 32.0 - 15.5, v - 7.5);
            (dx * dx + dy * dy).sqrt()
        };
        if stud < 3.2 {
            let (dx, dy) = (u % 32.0 - 15.5, v - 7.5);
            return shade(BRASS, 0.72 - 0.07 * (dx + dy), x, y);
        }
        let light = match y {
            0..=1 => 0.30,
            2 => 0.12,
            13 => -0.10,
            14..=15 => -0.28,
            _ => 0.0,
        };
        shade(
            BRASS,
            0.50 + light + 0.22 * grain - if stud < 4.6 { 0.2 } else { 0.0 },
            x,
            y,
        )
    })
}

fn metal() -> Texture {
    Texture::from_fn("metal", 64, 64, |x, y| metal_texel(x, y, STEEL, 51))
}

fn metal_texel(x: usize, y: usize, row: u8, seed: u64) -> u8 {
    let (u, v) = at(x, y);
    let grain = fractal(u, v * 4.0, 16.0, [64, 256], seed) - 0.5;
    let rust = fractal(u, v, 16.0, [64, 64], seed + 7);
    let (px, py) = (x % 32, y % 32);
    let rivet = {
        let (dx, dy) = (
            (u % 32.0 - 15.5).abs() - 11.0,
            (v % 32.0 - 15.5).abs() - 11.0,
        );
        (dx * dx + dy * dy).sqrt()
    };
    if px == 0 || py == 0 {
        return shade(row, 0.22, x, y);
    }
    let edge = match (px.min(py), px.max(py)) {
        (1, _) => 0.18,
        (_, 31) => -0.16,
        _ => 0.0,
    };
    if rivet < 1.8 {
        let lit = u % 32.0 < 8.0 || v % 32.0 < 8.0;
        return shade(row, if lit { 0.82 } else { 0.7 }, x, y);
    }
    if rust > 0.68 {
        return shade(BRICK, 0.40 + 0.3 * grain, x, y);
    }
    shade(
        row,
        0.52 + 0.26 * grain + edge - if rivet < 3.0 { 0.14 } else { 0.0 },
        x,
        y,
    )
}

/// A wall panel with two thin cold lamps and an engraved grid.
fn tech() -> Texture {
    Texture::from_fn("tech", 64, 64, |x, y| {
        for bar in [[12, 8, 20, 24], [44, 8, 52, 24]] {
            if let Some(d) = inside(x, y, bar) {
                return if d == 0 {
                    shade(STEEL, 0.2, x, y)
                } else {
                    COLD
                };
            }
        }
        let screen = [8, 32, 56, 56];
        if let Some(d) = inside(x, y, screen) {
            if d < 2 {
                return shade(TEAL, 0.45 + 0.2 * frame_light(x, y, screen), x, y);
            }
            let line = y % 4 == 0 && x % 7 != 3;
            return shade(
                TEAL,
                if line { 0.62 } else { 0.26 + 0.002 * x as f64 },
                x,
                y,
            );
        }
        metal_texel(x, y, STEEL, 61)
    })
}

fn rock() -> Texture {
    Texture::from_fn("rock", 128, 128, |x, y| {
        let (u, v) = at(x, y);
        let warp = 10.0 * (fractal(u, v, 32.0, [128, 128], 71) - 0.5);
        let (first, second, id) = cells(u + warp, v - warp, 32.0, [128, 128], 72);
        let grain = fractal(u, v, 16.0, [128, 128], 73) - 0.5;
        let crack = ((second - first) * 4.0).min(1.0);
        shade(
            STONE,
            0.24 + 0.26 * crack + 0.16 * (id - 0.5) + 0.34 * grain,
            x,
            y,
        )
    })
}

fn grass() -> Texture {
    Texture::from_fn("grass", 128, 128, |x, y| {
        let (u, v) = at(x, y);
        let patch = fractal(u, v, 32.0, [128, 128], 81) - 0.5;
        let blade = value(u * 2.0, v, 2.0, [256, 128], 82) - 0.5;
        let earth = fractal(u, v, 16.0, [128, 128], 83);
        if earth > 0.70 {
            return shade(WOOD, 0.42 + 0.3 * blade, x, y);
        }
        shade(MOSS, 0.56 + 0.3 * patch + 0.3 * blade, x, y)
    })
}

fn crate_side() -> Texture {
    Texture::from_fn("crate", 64, 64, |x, y| {
        let rim = x.min(y).min(63 - x).min(63 - y);
        if rim < 8 {
            let light = frame_light(x, y, [0, 0, 64, 64]);
            let edge = match rim {
                0 => 0.22 * light,
                7 => -0.22,
                _ => 0.0,
            };
            let (u, v) = at(x, y);
            let grain = fractal(u, v, 8.0, [64, 64], 91) - 0.5;
            let bolt = (x % 56 == 3 || x % 56 == 4) && (y % 56 == 3 || y % 56 == 4);
            return if bolt {
                shade(STEEL, 0.8, x, y)
            } else {
                shade(WOOD, 0.62 + edge + 0.25 * grain, x, y)
            };
        }
        let brace = x.abs_diff(y);
        if brace < 6 {
            let edge = if brace == 5 { -0.2 } else { 0.0 };
            let (u, v) = at(x, y);
            let grain = fractal(u, v, 8.0, [64, 64], 92) - 0.5;
            return shade(WOOD, 0.6 + edge + 0.25 * grain, x, y);
        }
        wood_texel(x, y, 16, 93)
    })
}

/// One leaf of a door, 64 wide and 112 high (the texture is 128: the last rows hide).
fn door() -> Texture {
    Texture::from_fn("door", 64, 128, |x, y| {
        if y >= 112 {
            return shade(STEEL, 0.3, x, y);
        }
        let rim = x.min(y).min(63 - x).min(111 - y);
        if rim < 4 {
            return shade(BRASS, 0.5 + 0.12 * frame_light(x, y, [0, 0, 64, 112]), x, y);
        }
        if (44..68).contains(&y) {
            // Warning stripes.
            let stripe = (x + y) / 8 % 2 == 0;
            let edge = y == 44 || y == 67;
            return match (edge, stripe) {
                (true, _) => shade(GREY, 0.2, x, y),
                (_, true) => shade(RED, 0.58, x, y),
                (_, false) => shade(SAND, 0.72, x, y),
            };
        }
        for panel in [[10, 10, 54, 38], [10, 74, 54, 102]] {
            if let Some(d) = inside(x, y, panel)
                && d < 2
            {
                return shade(TEAL, 0.44 - 0.2 * frame_light(x, y, panel), x, y);
            }
        }
        let (u, v) = at(x, y);
        let grain = fractal(u, v * 2.0, 16.0, [64, 256], 101) - 0.5;
        shade(TEAL, 0.44 + 0.3 * grain, x, y)
    })
}

fn button() -> Texture {
    Texture::from_fn("button", 16, 16, |x, y| {
        let (u, v) = (x as f64 - 7.5, y as f64 - 7.5);
        let r = (u * u + v * v).sqrt();
        if r < 5.5 {
            shade(RED, 0.66 - 0.05 * (u + v), x, y)
        } else {
            shade(STEEL, 0.5 + 0.15 * frame_light(x, y, [0, 0, 16, 16]), x, y)
        }
    })
}

/// The large lamp: warm white behind a brass frame with a cross bar.
fn lamp_panel() -> Texture {
    Texture::from_fn("lamp_panel", 64, 64, |x, y| {
        let rim = x.min(y).min(63 - x).min(63 - y);
        if rim < 4 {
            return shade(BRASS, 0.5 + 0.2 * frame_light(x, y, [0, 0, 64, 64]), x, y);
        }
        if (31..33).contains(&x) || (31..33).contains(&y) {
            return shade(BRASS, 0.4, x, y);
        }
        WARM
    })
}

/// The dark room's only light: 8 by 8 fullbright texels in a steel cup.
fn lamp_small() -> Texture {
    Texture::from_fn("lamp_small", 16, 16, |x, y| {
        match inside(x, y, [4, 4, 12, 12]) {
            Some(_) => WARM,
            None => shade(STEEL, 0.4 + 0.15 * frame_light(x, y, [0, 0, 16, 16]), x, y),
        }
    })
}

/// A lamp of four lights of which one after the other is lit.
fn lamp_frame(frame: usize) -> Texture {
    Texture::from_fn(&format!("+{frame}lamp"), 64, 64, |x, y| {
        let (cx, cy) = (x / 32, y / 32);
        let (u, v) = ((x % 32) as f64 - 15.5, (y % 32) as f64 - 15.5);
        let r = (u * u + v * v).sqrt();
        // Clockwise from the upper left.
        let order = [[0, 3], [1, 2]][cx][cy];
        if r < 10.0 {
            return if order == frame {
                if r < 9.0 { COLD } else { LAMP * 16 + 1 }
            } else {
                shade(BLUE, 0.30 - 0.01 * (u + v), x, y)
            };
        }
        if r < 12.5 {
            return shade(BRASS, 0.5 - 0.02 * (u + v), x, y);
        }
        metal_texel(x, y, STEEL, 111)
    })
}

/// A lattice of bars with holes between.
fn grate() -> Texture {
    Texture::from_fn("{grate", 64, 64, |x, y| {
        let (u, v) = (x % 16, y % 16);
        if u >= 4 && v >= 4 {
            return HOLE;
        }
        let light = match (u < 4, v < 4) {
            (true, true) => 0.22,
            (true, false) => [0.12, 0.22, 0.0, -0.18][u],
            _ => [0.12, 0.22, 0.0, -0.18][v],
        };
        let (fx, fy) = at(x, y);
        let grain = fractal(fx, fy, 8.0, [64, 64], 121) - 0.5;
        shade(STEEL, 0.40 + light + 0.3 * grain, x, y)
    })
}

/// Glowing veins between plates of crust; all of it fullbright except the coldest plates.
fn lava() -> Texture {
    Texture::from_fn("*lava", 64, 64, |x, y| {
        let (u, v) = at(x, y);
        let warp = 12.0 * (fractal(u, v, 16.0, [64, 64], 131) - 0.5);
        let (first, second, _) = cells(u + warp, v + warp, 16.0, [64, 64], 132);
        let heat = fractal(u, v, 16.0, [64, 64], 133);
        let vein = 1.0 - ((second - first) * 1.9).min(1.0);
        let glow = 0.10 + 0.66 * vein + 0.5 * (heat - 0.45);
        if glow < 0.2 {
            shade(CRUST, 0.8, x, y)
        } else {
            shade(FIRE, glow, x, y)
        }
    })
}

fn water() -> Texture {
    Texture::from_fn("*water", 64, 64, |x, y| {
        let (u, v) = at(x, y);
        let warp = 10.0 * (fractal(u, v, 16.0, [64, 64], 141) - 0.5);
        let (first, second, _) = cells(u + warp, v - warp, 16.0, [64, 64], 142);
        let ripple = 1.0 - ((second - first) * 2.5).min(1.0);
        let swell = fractal(u, v, 32.0, [64, 64], 143) - 0.5;
        shade(WATER, 0.48 + 0.22 * ripple + 0.4 * swell, x, y)
    })
}

/// Violet glow with brighter threads.
fn teleport() -> Texture {
    Texture::from_fn("*teleport", 64, 64, |x, y| {
        let (u, v) = at(x, y);
        let warp = 16.0 * (fractal(u, v, 16.0, [64, 64], 151) - 0.5);
        let n = fractal(u + warp, v - warp, 16.0, [64, 64], 152);
        let thread = 1.0 - ((n - 0.5).abs() * 9.0).min(1.0);
        match (thread * 3.9 + hash(x as i64, y as i64, 153) * 0.9) as u8 {
            0 => shade(BLUE, 0.35, x, y),
            1 => LAMP * 16 + 12,
            2 => LAMP * 16 + 13,
            _ => LAMP * 16 + 14,
        }
    })
}

/// Two layers of 128 by 128: on the right the sky itself, on the left thin clouds before it
/// (index 0 is where the sky shows through).
fn sky() -> Texture {
    Texture::from_fn("sky_day", 256, 128, |x, y| {
        let (u, v) = ((x % 128) as f64, y as f64);
        let size = [128, 128];
        if x >= 128 {
            let haze = fractal(u, v, 64.0, size, 161);
            return shade(SKY, 0.50 + 0.42 * (haze - 0.4), x, y);
        }
        let cloud = fractal(u, v, 32.0, size, 162);
        if cloud < 0.56 {
            return 0;
        }
        shade(SKY, 0.72 + 1.6 * (cloud - 0.56), x, y)
    })
}
