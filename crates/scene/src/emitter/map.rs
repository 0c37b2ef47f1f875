//! Where a texture emits: rectangles of emitting texels, and sums over them.

use crate::material::{Texture, luminance, srgb_to_linear};
use glam::DVec2;

/// Most texels of a texture that is taken apart; larger ones emit evenly.
const MOST_TEXELS: usize = 1 << 20;
/// The parts of all texels sum up to less than this, so that `f32` holds every sum exactly.
const SUM_OF_PARTS: f64 = (1 << 24) as f64;
/// Most rectangles before they are joined; a texture with more is cut into blocks instead.
const MOST_RECTANGLES: usize = 64;
/// Side of these blocks, in texels.
const BLOCK: u32 = 16;
/// Rectangles are joined where at least this share of the rectangle around both emits: a few dark
/// texels cost nothing, since texels are chosen by what they emit.
const JOIN_SHARE: f64 = 0.5;

/// A rectangle of texels: `x0`, `y0`, and `x1`, `y1` beyond its last ones.
pub type Rectangle = [u32; 4];

/// The emitting texels of a texture.
#[derive(Clone, Debug, PartialEq)]
pub struct EmissionMap {
    /// Texels across.
    pub width: u32,
    /// Texels down.
    pub height: u32,
    /// Rectangles that hold all emitting texels and share no texel.
    pub rectangles: Vec<Rectangle>,
    /// Per texel, 1 + the number of its rectangle; 0 where nothing emits. Rows from the top.
    pub labels: Vec<u32>,
    /// Sums of the texels' parts above and left of each corner of the grid, `(width + 1) * (height +
    /// 1)` of them. A texel's part is a whole number in proportion to its luminance, up to rounding,
    /// and at least 1 if it emits.
    pub sums: Vec<u32>,
    /// Per row, sums of the texels' luminance left of each corner: `height * (width + 1)`.
    rows: Vec<f64>,
}

impl EmissionMap {
    /// Takes an emission texture apart. `is_hole` says which texels are not there, by index. `None`
    /// if nothing emits, or if the texture is too large for it.
    pub(super) fn new(texture: &Texture, is_hole: impl Fn(usize) -> bool) -> Option<Self> {
        let (width, height) = (texture.width, texture.height);
        let (w, h) = (width as usize, height as usize);
        if texture.rgba.len() != w * h || w * h > MOST_TEXELS {
            return None;
        }
        let table: Vec<f64> = (0..=255).map(srgb_to_linear).collect();
        let light: Vec<f64> = (texture.rgba.iter().enumerate())
            .map(|(i, t)| match is_hole(i) {
                true => 0.0,
                false => f64::from(luminance(
                    [t[0], t[1], t[2]].map(|c| table[usize::from(c)] as f32),
                )),
            })
            .collect();
        let total: f64 = light.iter().sum();
        let emitting = light.iter().filter(|&&l| l > 0.0).count();
        if emitting == 0 {
            return None;
        }
        let scale = (SUM_OF_PARTS - 2.0 * emitting as f64 - 1.0) / total;
        let mut sums = vec![0u32; (w + 1) * (h + 1)];
        let mut rows = vec![0.0; h * (w + 1)];
        for y in 0..h {
            let mut row = 0;
            for x in 0..w {
                let light = light[y * w + x];
                row += if light > 0.0 {
                    1 + (light * scale) as u32
                } else {
                    0
                };
                sums[(y + 1) * (w + 1) + x + 1] = sums[y * (w + 1) + x + 1] + row;
                rows[y * (w + 1) + x + 1] = rows[y * (w + 1) + x] + light;
            }
        }
        let rectangles = rectangles(width, height, |x, y| {
            light[y as usize * w + x as usize] > 0.0
        });
        let mut labels = vec![0; w * h];
        for (i, r) in rectangles.iter().enumerate() {
            for (x, y) in texels(r) {
                let at = y as usize * w + x as usize;
                if light[at] > 0.0 {
                    labels[at] = i as u32 + 1;
                }
            }
        }
        Some(Self {
            width,
            height,
            rectangles,
            labels,
            sums,
            rows,
        })
    }

    /// Sum of the texels' parts in a rectangle.
    #[must_use]
    pub fn sum(&self, [x0, y0, x1, y1]: Rectangle) -> u32 {
        let at = |x: u32, y: u32| self.sums[y as usize * (self.width as usize + 1) + x as usize];
        at(x1, y1) + at(x0, y0) - at(x0, y1) - at(x1, y0)
    }

    /// Integral of the emission's relative luminance over a polygon in texel coordinates, in either
    /// winding, that lies within the texture.
    ///
    /// By Green's theorem: with `F(u, v)` the luminance left of `u` in the row of `v`, the integral
    /// is that of `F dv` along the border. Between grid lines `F` is linear along an edge, and its
    /// value at the middle is its mean.
    pub(super) fn integrate(&self, polygon: &[DVec2]) -> f64 {
        let mut sum = 0.0;
        let mut cuts = Vec::new();
        for (i, &a) in polygon.iter().enumerate() {
            let b = polygon[(i + 1) % polygon.len()];
            cuts.clear();
            cuts.extend([0.0, 1.0]);
            for (from, to) in [(a.x, b.x), (a.y, b.y)] {
                let (low, high) = (from.min(to).ceil(), from.max(to).floor());
                if to != from && high >= low {
                    let lines = (high - low) as u32;
                    cuts.extend((0..=lines).map(|k| (low + f64::from(k) - from) / (to - from)));
                }
            }
            cuts.sort_unstable_by(f64::total_cmp);
            for pair in cuts.windows(2) {
                let middle = a.lerp(b, 0.5 * (pair[0] + pair[1]));
                sum += self.left_of(middle) * (b.y - a.y) * (pair[1] - pair[0]);
            }
        }
        sum.abs()
    }

    /// Luminance left of a point within its row.
    fn left_of(&self, p: DVec2) -> f64 {
        let (w, h) = (self.width as usize, self.height as usize);
        let y = (p.y.max(0.0) as usize).min(h - 1);
        let x = (p.x.max(0.0) as usize).min(w - 1);
        let row = &self.rows[y * (w + 1)..];
        row[x] + (row[x + 1] - row[x]) * (p.x - x as f64)
    }
}

/// Texels of a rectangle, rows from the top.
fn texels(&[x0, y0, x1, y1]: &Rectangle) -> impl Iterator<Item = (u32, u32)> {
    (y0..y1).flat_map(move |y| (x0..x1).map(move |x| (x, y)))
}

/// Rectangles that hold all emitting texels and share none.
fn rectangles(width: u32, height: u32, emits: impl Fn(u32, u32) -> bool) -> Vec<Rectangle> {
    let maximal = maximal_rectangles(width, height, &emits);
    let small = if maximal.len() <= MOST_RECTANGLES {
        maximal
    } else {
        blocks(width, height, &emits)
    };
    joined(small, &emits)
}

/// Greedy maximal rectangles of emitting texels: from each texel not yet taken, in order, the larger
/// of the one that grows to the right first and the one that grows down first. Stops when there are
/// too many.
fn maximal_rectangles(
    width: u32,
    height: u32,
    emits: &impl Fn(u32, u32) -> bool,
) -> Vec<Rectangle> {
    let mut free: Vec<bool> = texels(&[0, 0, width, height])
        .map(|(x, y)| emits(x, y))
        .collect();
    let mut out = Vec::new();
    for (x, y) in texels(&[0, 0, width, height]) {
        let is_free = |x: u32, y: u32| free[(y * width + x) as usize];
        if !is_free(x, y) {
            continue;
        }
        let wide = (x..width).find(|&i| !is_free(i, y)).unwrap_or(width);
        let deep = (y..height)
            .find(|&j| (x..wide).any(|i| !is_free(i, j)))
            .unwrap_or(height);
        let tall = (y..height).find(|&j| !is_free(x, j)).unwrap_or(height);
        let broad = (x..width)
            .find(|&i| (y..tall).any(|j| !is_free(i, j)))
            .unwrap_or(width);
        let by_row = [x, y, wide, deep];
        let by_column = [x, y, broad, tall];
        let best = if area(&by_column) > area(&by_row) {
            by_column
        } else {
            by_row
        };
        for (i, j) in texels(&best) {
            free[(j * width + i) as usize] = false;
        }
        out.push(best);
        if out.len() > MOST_RECTANGLES {
            break;
        }
    }
    out
}

/// What emits in each block of a grid, without its dark border.
fn blocks(width: u32, height: u32, emits: &impl Fn(u32, u32) -> bool) -> Vec<Rectangle> {
    let corners = |length: u32| (0..length).step_by(BLOCK as usize);
    (corners(height).flat_map(|y| corners(width).map(move |x| (x, y))))
        .filter_map(|(x, y)| {
            let block = [x, y, (x + BLOCK).min(width), (y + BLOCK).min(height)];
            (texels(&block).filter(|&(i, j)| emits(i, j)))
                .map(|(i, j)| [i, j, i + 1, j + 1])
                .reduce(|a, b| around(&a, &b))
        })
        .collect()
}

/// Joins neighbours, the fullest first, while what is around both is still mostly bright.
fn joined(mut all: Vec<Rectangle>, emits: &impl Fn(u32, u32) -> bool) -> Vec<Rectangle> {
    loop {
        let mut best: Option<(f64, usize, usize)> = None;
        for i in 0..all.len() {
            for j in i + 1..all.len() {
                let both = around(&all[i], &all[j]);
                let most = f64::from(area(&all[i]) + area(&all[j])) / f64::from(area(&both));
                let others = || (0..all.len()).filter(|&k| k != i && k != j);
                if most < JOIN_SHARE.max(best.map_or(0.0, |b| b.0))
                    || others().any(|k| overlap(&all[k], &both))
                {
                    continue;
                }
                let bright = texels(&both).filter(|&(x, y)| emits(x, y)).count();
                let share = bright as f64 / f64::from(area(&both));
                if share >= JOIN_SHARE && best.is_none_or(|b| share > b.0) {
                    best = Some((share, i, j));
                }
            }
        }
        let Some((_, i, j)) = best else { return all };
        all[i] = around(&all[i], &all[j]);
        all.remove(j);
    }
}

fn area(&[x0, y0, x1, y1]: &Rectangle) -> u32 {
    (x1 - x0) * (y1 - y0)
}

fn around(a: &Rectangle, b: &Rectangle) -> Rectangle {
    [
        a[0].min(b[0]),
        a[1].min(b[1]),
        a[2].max(b[2]),
        a[3].max(b[3]),
    ]
}

fn overlap(a: &Rectangle, b: &Rectangle) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture from rows of letters: '.' is black, 'a' to 'z' shades of grey.
    fn picture(rows: &[&str]) -> Texture {
        let texel = |c: u8| match c {
            b'.' => [0, 0, 0, 255],
            c => [
                (c - b'a') * 10 + 5,
                (c - b'a') * 10 + 5,
                (c - b'a') * 10 + 5,
                255,
            ],
        };
        Texture {
            name: String::new(),
            width: rows[0].len() as u32,
            height: rows.len() as u32,
            rgba: rows.iter().flat_map(|r| r.bytes().map(texel)).collect(),
        }
    }

    #[test]
    fn rectangles_hold_what_emits_once() {
        let map = |rows: &[&str]| EmissionMap::new(&picture(rows), |_| false).unwrap();
        // Two lamps far apart, each one rectangle; a stray texel of its own.
        let lamps = map(&[
            "zz......", "zz......", "........", "...z....", "......zz", "......zz",
        ]);
        assert_eq!(lamps.rectangles, [[0, 0, 2, 2], [3, 3, 4, 4], [6, 4, 8, 6]]);
        // A lamp with a dark seam is one.
        assert_eq!(map(&["zz.zz", "zz.zz"]).rectangles, [[0, 0, 5, 2]]);
        // Noise does not become a rectangle per texel.
        let noise: Vec<String> = (0..64u32)
            .map(|y| {
                (0..64)
                    .map(|x| if (x * 7 + y * 13) % 5 == 0 { 'k' } else { '.' })
                    .collect()
            })
            .collect();
        let noise = map(&noise.iter().map(String::as_str).collect::<Vec<_>>());
        assert!(noise.rectangles.len() <= 16);
        for map in [lamps, noise] {
            for (i, &label) in map.labels.iter().enumerate() {
                let (x, y) = (i as u32 % map.width, i as u32 / map.width);
                let holders: Vec<_> = (map.rectangles.iter())
                    .filter(|r| overlap(r, &[x, y, x + 1, y + 1]))
                    .collect();
                let part = map.sum([x, y, x + 1, y + 1]);
                assert_eq!(part > 0, label > 0);
                assert!(label == 0 || *holders[0] == map.rectangles[label as usize - 1]);
                assert!(holders.len() <= 1);
            }
        }
        assert!(EmissionMap::new(&picture(&["...."]), |_| false).is_none());
        assert!(EmissionMap::new(&picture(&["zzzz"]), |_| true).is_none());
    }

    #[test]
    fn parts_follow_luminance_and_fit_floats() {
        let map = EmissionMap::new(&picture(&["az", "zm"]), |_| false).unwrap();
        let total = map.sum([0, 0, 2, 2]);
        assert!(total < 1 << 24);
        let light = |c: u8| srgb_to_linear((c - b'a') * 10 + 5);
        let sum = light(b'a') + 2.0 * light(b'z') + light(b'm');
        let share = f64::from(map.sum([1, 1, 2, 2])) / f64::from(total);
        assert!((share - light(b'm') / sum).abs() < 1e-6);
        assert!(map.sum([0, 0, 1, 1]) > 0);
    }

    #[test]
    fn integrals_over_polygons_are_sums_over_texels() {
        let rows = [
            "abcdefgh", "hgf.dcba", "zzz..zzz", "amamamam", "........", "qrstuvwx",
        ];
        let map = EmissionMap::new(&picture(&rows), |_| false).unwrap();
        let polygon =
            [(0.3, 0.2), (7.7, 1.1), (6.2, 5.9), (1.5, 4.75)].map(|(x, y)| DVec2::new(x, y));
        // By many small points.
        let n = 400;
        let inside = |p: DVec2| {
            (0..4).all(|i| (polygon[(i + 1) % 4] - polygon[i]).perp_dot(p - polygon[i]) >= 0.0)
        };
        let mut sum = 0.0;
        for y in 0..6 * n {
            for x in 0..8 * n {
                let p = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5) / f64::from(n);
                if inside(p) {
                    let (x, y) = ((x / n) as usize, (y / n) as usize);
                    sum += map.rows[y * 9 + x + 1] - map.rows[y * 9 + x];
                }
            }
        }
        let expected = sum / f64::from(n * n);
        let got = map.integrate(&polygon);
        assert!((got / expected - 1.0).abs() < 1e-4, "{got} for {expected}");
        let back: Vec<DVec2> = polygon.into_iter().rev().collect();
        assert!((map.integrate(&back) - got).abs() < 1e-12);
        let whole = [(0.0, 0.0), (8.0, 0.0), (8.0, 6.0), (0.0, 6.0)].map(|(x, y)| DVec2::new(x, y));
        let all: f64 = (0..6).map(|y| map.rows[y * 9 + 8]).sum();
        assert!((map.integrate(&whole) - all).abs() < 1e-12);
    }
}
