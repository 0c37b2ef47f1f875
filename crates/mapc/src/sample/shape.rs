//! Closed surfaces that models are put together from, each with its own patch of the skin.

use super::palette::shade;
use crate::{Model, ModelFrame, ModelPose, ModelSkin, ModelSkinVertex, Vec3};

/// A part of the skin: left, upper, width, height in texels.
pub(super) type Patch = [usize; 4];

/// The surface of a model in one pose.
#[derive(Clone, Debug, Default)]
pub(super) struct Shape {
    positions: Vec<Vec3>,
    skin: Vec<ModelSkinVertex>,
    triangles: Vec<(bool, [u32; 3])>,
}

impl Shape {
    /// Rows of points that are joined to a surface. Rows run to the left of the outside when the next row is
    /// above; the last point of a row is its first one again, on the other edge of the patch.
    fn net(&mut self, rows: &[Vec<Vec3>], [x, y, width, height]: Patch) {
        let first = self.positions.len();
        let columns = rows[0].len();
        for (i, row) in rows.iter().enumerate() {
            for (j, p) in row.iter().enumerate() {
                self.positions.push(*p);
                // The first row is the lowest, and skins begin at the top.
                let up = rows.len() - 1 - i;
                self.skin.push(ModelSkinVertex {
                    on_seam: false,
                    at: [
                        (x + (width - 1) * j / (columns - 1)) as i32,
                        (y + (height - 1) * up / (rows.len() - 1)) as i32,
                    ],
                });
            }
        }
        for i in 1..rows.len() {
            for j in 1..columns {
                let at = |i: usize, j: usize| (first + i * columns + j) as u32;
                let quad = [at(i - 1, j - 1), at(i - 1, j), at(i, j), at(i, j - 1)];
                for [a, b, c] in [[0, 2, 1], [0, 3, 2]] {
                    let corners = [quad[a], quad[b], quad[c]];
                    let [p, q, r] = corners.map(|k| self.positions[k as usize]);
                    if p != q && q != r && r != p {
                        self.triangles.push((true, corners));
                    }
                }
            }
        }
    }

    /// A surface of revolution: radii and heights from bottom to top, moved by `place`.
    pub(super) fn lathe(
        &mut self,
        profile: &[[f64; 2]],
        sides: usize,
        patch: Patch,
        place: impl Fn(Vec3) -> Vec3,
    ) {
        let rows: Vec<Vec<Vec3>> = profile
            .iter()
            .map(|[radius, height]| {
                let point = |j: usize| {
                    let turn = (j % sides) as f64 / sides as f64;
                    place([radius * cosine(turn), radius * sine(turn), *height])
                };
                (0..=sides).map(point).collect()
            })
            .collect();
        self.net(&rows, patch);
    }

    /// An ellipsoid around `centre`; its poles lie along x.
    pub(super) fn ellipsoid(
        &mut self,
        centre: Vec3,
        radii: Vec3,
        [rows, sides]: [usize; 2],
        patch: Patch,
    ) {
        let profile: Vec<[f64; 2]> = (0..=rows)
            .map(|i| {
                let turn = i as f64 / rows as f64 / 2.0;
                let radius = if i % rows == 0 { 0.0 } else { sine(turn) };
                [radius, -cosine(turn)]
            })
            .collect();
        self.lathe(&profile, sides, patch, |[y, z, x]| {
            [
                centre[0] + x * radii[0],
                centre[1] + y * radii[1],
                centre[2] + z * radii[2],
            ]
        });
    }

    /// A limb from one point to another that is as thick as `radii` at its ends, which are closed.
    pub(super) fn limb(&mut self, ends: [Vec3; 2], radii: [f64; 2], sides: usize, patch: Patch) {
        let [a, b] = ends;
        let along = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
        let length = dot(along, along).sqrt();
        let along = along.map(|c| c / length);
        let aside = if along[2].abs() < 0.9 {
            [0.0, 0.0, 1.0]
        } else {
            [1.0, 0.0, 0.0]
        };
        let u = unit(cross(aside, along));
        let v = cross(along, u);
        let profile = [
            [0.0, 0.0],
            [radii[0], 0.0],
            [radii[1], length],
            [0.0, length],
        ];
        self.lathe(&profile, sides, patch, |[x, y, z]| {
            [0, 1, 2].map(|k| a[k] + u[k] * x + v[k] * y + along[k] * z)
        });
    }
}

/// A model of several frames, each of one pose or, with the seconds that each lasts, of a group of poses.
/// All shapes are made of the same parts.
pub(super) fn model(skin: &Skin, frames: &[(&str, f32, Vec<Shape>)]) -> Model {
    let pose = |name: &str, i: usize, shape: &Shape| ModelPose {
        name: format!("{name}{i}"),
        positions: shape.positions.clone(),
    };
    let made = frames
        .iter()
        .map(|(name, seconds, shapes)| match &**shapes {
            [shape] => ModelFrame::Single(pose(name, 0, shape)),
            shapes => ModelFrame::Group(
                (shapes.iter().enumerate())
                    .map(|(i, shape)| (seconds * (i + 1) as f32, pose(name, i, shape)))
                    .collect(),
            ),
        });
    let first = &frames[0].2[0];
    Model {
        skin_size: [skin.width as u32, skin.height as u32],
        skins: vec![ModelSkin::Single(skin.pixels.clone())],
        skin_vertices: first.skin.clone(),
        triangles: first.triangles.clone(),
        frames: made.collect(),
        ..Model::default()
    }
}

/// A picture of palette indices.
#[derive(Clone, Debug)]
pub(super) struct Skin {
    width: usize,
    height: usize,
    pixels: Vec<u8>,
}

impl Skin {
    pub(super) fn new(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            pixels: vec![0; width * height],
        }
    }

    /// Paints a patch: `texel` gives the row of the palette and the shade at parts (0 to 1) of its width, from the
    /// left, and height, from the bottom.
    pub(super) fn paint(
        &mut self,
        [left, upper, width, height]: Patch,
        texel: impl Fn(f64, f64) -> (u8, f64),
    ) {
        for y in upper..upper + height {
            for x in left..left + width {
                let u = ((x - left) as f64 + 0.5) / width as f64;
                let v = 1.0 - ((y - upper) as f64 + 0.5) / height as f64;
                let (row, value) = texel(u, v);
                self.pixels[y * self.width + x] = shade(row, value, x, y);
            }
        }
    }

    /// Paints texels of one colour of the last row of the palette.
    pub(super) fn lamp(&mut self, [left, upper, width, height]: Patch, colour: u8) {
        for y in upper..upper + height {
            self.pixels[y * self.width + left..][..width].fill(colour);
        }
    }
}

/// Sine of whole turns. A series of its own, so that every machine makes the same bytes.
pub(super) fn sine(turns: f64) -> f64 {
    let part = turns - turns.round();
    // Within a quarter turn of 0 the series has all digits.
    let part = if part > 0.25 {
        0.5 - part
    } else if part < -0.25 {
        -0.5 - part
    } else {
        part
    };
    let x = part * std::f64::consts::TAU;
    let mut term = x;
    let mut sum = x;
    for k in 1..12 {
        term *= -x * x / f64::from((2 * k) * (2 * k + 1));
        sum += term;
    }
    sum
}

/// Cosine of whole turns.
pub(super) fn cosine(turns: f64) -> f64 {
    sine(turns + 0.25)
}

fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn unit(a: Vec3) -> Vec3 {
    let length = dot(a, a).sqrt();
    a.map(|c| c / length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sines_are_sines() {
        for i in -50..50 {
            let turns = f64::from(i) * 0.037;
            let right = (turns * std::f64::consts::TAU).sin();
            assert!((sine(turns) - right).abs() < 1e-13, "{turns}");
        }
    }

    /// Volumes by the divergence theorem: positive only if all triangles run clockwise seen from outside.
    #[test]
    fn parts_are_closed_and_face_outwards() {
        let volume = |shape: &Shape| -> f64 {
            shape
                .triangles
                .iter()
                .map(|(_, corners)| {
                    let [a, c, b] = corners.map(|k| shape.positions[k as usize]);
                    dot(a, cross(b, c)) / 6.0
                })
                .sum()
        };
        let mut ball = Shape::default();
        ball.ellipsoid([3.0, 2.0, 1.0], [1.0, 2.0, 3.0], [32, 48], [0, 0, 8, 8]);
        let exact = 4.0 / 3.0 * std::f64::consts::PI * 6.0;
        assert!((volume(&ball) / exact - 1.0).abs() < 0.01);
        for end in [[5.0, 0.0, 0.0], [0.0, 0.0, 5.0], [-3.0, 4.0, 0.0]] {
            let mut limb = Shape::default();
            limb.limb([[0.0; 3], end], [1.0, 1.0], 4, [0, 0, 8, 8]);
            // A square of diagonal 2.
            assert!((volume(&limb) - 10.0).abs() < 1e-9, "{end:?}");
        }
    }
}
