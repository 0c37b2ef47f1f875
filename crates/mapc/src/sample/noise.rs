//! Noise and shapes that textures are made of. Everything wraps around, and everything is plain
//! arithmetic, so that every machine draws the same texels.

/// A number from 0 to 1 for a lattice point.
pub(super) fn hash(x: i64, y: i64, seed: u64) -> f64 {
    let mut z = (x as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
        ^ (y as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f)
        ^ seed.wrapping_mul(0x1656_67b1_9e37_79f9);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

fn smooth(t: f64) -> f64 {
    t * t * (3.0 - 2.0 * t)
}

/// Value noise with a lattice of `cell` texels that repeats every `size` texels.
pub(super) fn value(x: f64, y: f64, cell: f64, size: [usize; 2], seed: u64) -> f64 {
    let (u, v) = (x / cell, y / cell);
    let (i, j) = (u.floor(), v.floor());
    let (fu, fv) = (smooth(u - i), smooth(v - j));
    let wrap = |k: f64, n: usize| (k as i64).rem_euclid((n as f64 / cell) as i64);
    let at = |di: f64, dj: f64| hash(wrap(i + di, size[0]), wrap(j + dj, size[1]), seed);
    let top = at(0.0, 0.0) + (at(1.0, 0.0) - at(0.0, 0.0)) * fu;
    let low = at(0.0, 1.0) + (at(1.0, 1.0) - at(0.0, 1.0)) * fu;
    top + (low - top) * fv
}

/// Octaves of value noise, 0 to 1 around 0.5.
pub(super) fn fractal(x: f64, y: f64, cell: f64, size: [usize; 2], seed: u64) -> f64 {
    let (mut sum, mut weight, mut total, mut cell) = (0.0, 1.0, 0.0, cell);
    for octave in 0..4 {
        sum += weight * value(x, y, cell, size, seed + octave);
        total += weight;
        weight *= 0.55;
        cell *= 0.5;
        if cell < 1.0 {
            break;
        }
    }
    sum / total
}

/// Distance to the nearest and second nearest of points scattered one to a cell.
pub(super) fn cells(x: f64, y: f64, cell: f64, size: [usize; 2], seed: u64) -> (f64, f64, f64) {
    let (i, j) = ((x / cell).floor() as i64, (y / cell).floor() as i64);
    let count = |n: usize| (n as f64 / cell) as i64;
    let (mut first, mut second, mut id) = (f64::INFINITY, f64::INFINITY, 0.0);
    for dj in -1..=1 {
        for di in -1..=1 {
            let (ci, cj) = (i + di, j + dj);
            let (wi, wj) = (ci.rem_euclid(count(size[0])), cj.rem_euclid(count(size[1])));
            let px = (ci as f64 + 0.15 + 0.7 * hash(wi, wj, seed)) * cell;
            let py = (cj as f64 + 0.15 + 0.7 * hash(wi, wj, seed + 77)) * cell;
            let d = ((px - x) * (px - x) + (py - y) * (py - y)).sqrt() / cell;
            if d < first {
                second = first;
                first = d;
                id = hash(wi, wj, seed + 99);
            } else if d < second {
                second = d;
            }
        }
    }
    (first, second, id)
}

/// A texel's place in a bond of blocks.
pub(super) struct Block {
    /// A number from 0 to 1 of its own for each block.
    pub(super) id: f64,
    /// Light from the bevel: positive at the upper and left edge, negative at the others.
    pub(super) bevel: f64,
    /// Is this the joint between blocks?
    pub(super) joint: bool,
}

/// Blocks of `w` by `h` texels, every other course moved by half, with joints of one or two
/// texels and bevels of `bevel` texels.
pub(super) fn block(
    [x, y]: [usize; 2],
    [w, h]: [usize; 2],
    size: [usize; 2],
    [joint, bevel]: [usize; 2],
    seed: u64,
) -> Block {
    let course = y / h;
    let shifted = (x + if course % 2 == 1 { w / 2 } else { 0 }) % size[0];
    let (u, v) = (shifted % w, y % h);
    let id = hash((shifted / w) as i64, course as i64, seed);
    let is_joint = u < joint || v < joint;
    let (left, up) = (u.saturating_sub(joint), v.saturating_sub(joint));
    let (right, down) = (w - 1 - u, h - 1 - v);
    let edge = |d: usize| {
        if d < bevel {
            1.0 - d as f64 / bevel as f64
        } else {
            0.0
        }
    };
    let light = edge(left).max(edge(up)) - edge(right).max(edge(down));
    Block {
        id,
        bevel: if is_joint { 0.0 } else { light },
        joint: is_joint,
    }
}

/// Distance in texels from the edge of a rectangle, positive inside; `None` outside.
pub(super) fn inside(x: usize, y: usize, [x0, y0, x1, y1]: [usize; 4]) -> Option<usize> {
    (x >= x0 && x < x1 && y >= y0 && y < y1)
        .then(|| (x - x0).min(x1 - 1 - x).min(y - y0).min(y1 - 1 - y))
}

/// The light on the frame of a rectangle: 1 on its upper and left edge, -1 on the others.
pub(super) fn frame_light(x: usize, y: usize, [x0, y0, x1, y1]: [usize; 4]) -> f64 {
    let near = (x - x0).min(y - y0);
    let far = (x1 - 1 - x).min(y1 - 1 - y);
    if near <= far { 1.0 } else { -1.0 }
}
