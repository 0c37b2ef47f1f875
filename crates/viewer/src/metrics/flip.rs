//! LDR-FLIP: how different two pictures look when one flips between them on a display.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild: "FLIP: A Difference Evaluator
//! for Alternating Images", HPG 2020. Symbols and constants are the paper's.

use crate::tonemap::srgb_decode;

/// Viewing distance the errors are given for, in pixels per degree: a 0.7 m wide display of
/// 3840 pixels seen from 0.7 m, the paper's default (67 in round figures).
pub const PIXELS_PER_DEGREE: f32 = 67.020_645;

/// Contrast sensitivity of the achromatic, red-green and blue-yellow channels, each a sum of two
/// Gaussians `a sqrt(pi / b) exp(-pi^2 d^2 / b)` over the distance `d` in degrees (table 1).
const CSF: [[(f32, f32); 2]; 3] = [
    [(1.0, 0.0047), (0.0, 1e-5)],
    [(1.0, 0.0053), (0.0, 1e-5)],
    [(34.1, 0.04), (13.5, 0.025)],
];
/// Exponent of the colour difference.
const Q_C: f32 = 0.7;
/// Share of the largest colour difference that is mapped to `P_T`.
const P_C: f32 = 0.4;
/// Where `P_C` is mapped to.
const P_T: f32 = 0.95;
/// Width of the edge and point detectors in degrees.
const W: f32 = 0.082;
/// Exponent of the feature difference.
const Q_F: f32 = 0.5;

/// Linear sRGB to CIE XYZ, D65.
const RGB_TO_XYZ: [[f32; 3]; 3] = [
    [0.412_390_8, 0.357_584_33, 0.180_480_8],
    [0.212_639, 0.715_168_66, 0.072_192_32],
    [0.019_330_82, 0.119_194_78, 0.950_532_2],
];
/// Inverse of [`RGB_TO_XYZ`].
const XYZ_TO_RGB: [[f32; 3]; 3] = [
    [3.240_97, -1.537_383_2, -0.498_610_76],
    [-0.969_243_64, 1.875_967_5, 0.041_555_06],
    [0.055_630_08, -0.203_976_96, 1.056_971_5],
];

/// FLIP error of every pixel, 0..=1, between two pictures of `width` by `height` display codes
/// (sRGB-encoded, 0..=1, rows from the top).
///
/// # Panics
/// If a slice does not hold `width * height` pixels.
#[must_use]
pub fn flip(
    reference: &[[f32; 3]],
    image: &[[f32; 3]],
    width: usize,
    height: usize,
    pixels_per_degree: f32,
) -> Vec<f32> {
    assert!(reference.len() == width * height && image.len() == width * height);
    let [r, i] = [reference, image].map(|codes| Seen::new(codes, width, height, pixels_per_degree));
    let largest = {
        let [green, blue] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(hunt_lab);
        hyab(green, blue).powf(Q_C)
    };
    (0..r.colour.len())
        .map(|p| {
            let difference = hyab(r.colour[p], i.colour[p]).powf(Q_C);
            let knee = P_C * largest;
            let colour = if difference < knee {
                P_T / knee * difference
            } else {
                P_T + (difference - knee) / (largest - knee) * (1.0 - P_T)
            };
            let edge = (r.edge[p] - i.edge[p]).abs();
            let point = (r.point[p] - i.point[p]).abs();
            let feature = (edge.max(point) / std::f32::consts::SQRT_2).powf(Q_F);
            colour.clamp(0.0, 1.0).powf(1.0 - feature.clamp(0.0, 1.0))
        })
        .collect()
}

/// What an eye at the viewing distance takes from one picture.
struct Seen {
    /// Hunt-adjusted L*a*b* after the contrast sensitivity filter.
    colour: Vec<[f32; 3]>,
    /// Strength of edges.
    edge: Vec<f32>,
    /// Strength of points.
    point: Vec<f32>,
}

impl Seen {
    fn new(codes: &[[f32; 3]], width: usize, height: usize, ppd: f32) -> Self {
        let opponent: Vec<[f32; 3]> = (codes.iter())
            .map(|c| ycxcz(multiply(&RGB_TO_XYZ, c.map(srgb_decode))))
            .collect();
        let plane = |c: usize| -> Vec<f32> { opponent.iter().map(|p| p[c]).collect() };
        let filter = |plane: &[f32], x: &[f32], y: &[f32]| convolve(plane, width, height, x, y);

        let [y, cx, cz] = [0, 1, 2].map(|channel| {
            let values = plane(channel);
            let mut sum = vec![0.0; values.len()];
            for (kernel, weight) in csf_kernels(channel, ppd) {
                let part = filter(&values, &kernel, &kernel);
                sum.iter_mut().zip(part).for_each(|(s, v)| *s += weight * v);
            }
            sum
        });
        let colour = (0..codes.len())
            .map(|p| {
                let rgb = multiply(&XYZ_TO_RGB, xyz_of_ycxcz([y[p], cx[p], cz[p]]));
                hunt_lab(rgb.map(|x| x.clamp(0.0, 1.0)))
            })
            .collect();

        let luma: Vec<f32> = opponent.iter().map(|p| (p[0] + 16.0) / 116.0).collect();
        let [smooth, first, second] = feature_kernels(ppd);
        let strength = |kernel: &[f32]| -> Vec<f32> {
            let across = filter(&luma, kernel, &smooth);
            let down = filter(&luma, &smooth, kernel);
            across.iter().zip(down).map(|(a, d)| a.hypot(d)).collect()
        };
        Self {
            colour,
            edge: strength(&first),
            point: strength(&second),
        }
    }
}

/// One-dimensional kernels of a channel's Gaussians, each of sum 1, with their weights in the
/// two-dimensional sum.
fn csf_kernels(channel: usize, ppd: f32) -> Vec<(Vec<f32>, f32)> {
    let widest = CSF.iter().flatten().fold(0.0f32, |w, &(_, b)| w.max(b));
    let pi2 = std::f32::consts::PI * std::f32::consts::PI;
    let radius = (3.0 * (widest / (2.0 * pi2)).sqrt() * ppd).ceil() as i32;
    let mut kernels: Vec<(Vec<f32>, f32)> = (CSF[channel].iter())
        .filter(|(a, _)| *a > 0.0)
        .map(|&(a, b)| {
            let raw: Vec<f32> = (-radius..=radius)
                .map(|x| (-pi2 * (x as f32 / ppd).powi(2) / b).exp())
                .collect();
            let sum: f32 = raw.iter().sum();
            let weight = a * (std::f32::consts::PI / b).sqrt() * sum * sum;
            (raw.iter().map(|v| v / sum).collect(), weight)
        })
        .collect();
    let total: f32 = kernels.iter().map(|k| k.1).sum();
    kernels.iter_mut().for_each(|k| k.1 /= total);
    kernels
}

/// A Gaussian of sum 1, its first derivative and its second derivative, the latter two with
/// positive and negative weights that each sum to 1.
fn feature_kernels(ppd: f32) -> [Vec<f32>; 3] {
    let sigma = 0.5 * W * ppd;
    let radius = (3.0 * sigma).ceil() as i32;
    let weigh = |f: &dyn Fn(f32) -> f32| -> Vec<f32> {
        (-radius..=radius)
            .map(|x| f(x as f32) * (-(x as f32).powi(2) / (2.0 * sigma * sigma)).exp())
            .collect()
    };
    [
        balanced(weigh(&|_| 1.0)),
        balanced(weigh(&|x| -x)),
        balanced(weigh(&|x| x * x / (sigma * sigma) - 1.0)),
    ]
}

/// Scales the positive weights to a sum of 1 and the negative ones to a sum of -1.
fn balanced(mut kernel: Vec<f32>) -> Vec<f32> {
    let positive: f32 = kernel.iter().filter(|v| **v > 0.0).sum();
    let negative: f32 = -kernel.iter().filter(|v| **v < 0.0).sum::<f32>();
    for v in &mut kernel {
        *v /= if *v > 0.0 {
            positive
        } else {
            negative.max(1e-30)
        };
    }
    kernel
}

/// Convolves with `across` along rows, then with `down` along columns; pixels outside the picture
/// repeat its border. (A correlation, in fact: only symmetric kernels and magnitudes are used.)
fn convolve(plane: &[f32], width: usize, height: usize, across: &[f32], down: &[f32]) -> Vec<f32> {
    let mut rows = vec![0.0; plane.len()];
    let radius = across.len() / 2;
    let mut padded = vec![0.0; width + 2 * radius];
    for (out, row) in rows.chunks_exact_mut(width).zip(plane.chunks_exact(width)) {
        padded[..radius].fill(row[0]);
        padded[radius..radius + width].copy_from_slice(row);
        padded[radius + width..].fill(row[width - 1]);
        for (x, o) in out.iter_mut().enumerate() {
            *o = across.iter().zip(&padded[x..]).map(|(k, v)| k * v).sum();
        }
    }
    let mut result = vec![0.0; plane.len()];
    let radius = down.len() / 2;
    for (y, out) in result.chunks_exact_mut(width).enumerate() {
        for (k, weight) in down.iter().enumerate() {
            let source = (y + k).saturating_sub(radius).min(height - 1) * width;
            for (o, v) in out.iter_mut().zip(&rows[source..source + width]) {
                *o += weight * v;
            }
        }
    }
    result
}

/// The white point: the XYZ of linear RGB 1, 1, 1.
fn white() -> [f32; 3] {
    RGB_TO_XYZ.map(|row| row[0] + row[1] + row[2])
}

fn ycxcz(xyz: [f32; 3]) -> [f32; 3] {
    let w = white();
    let [x, y, z] = [xyz[0] / w[0], xyz[1] / w[1], xyz[2] / w[2]];
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn xyz_of_ycxcz(v: [f32; 3]) -> [f32; 3] {
    let w = white();
    let y = (v[0] + 16.0) / 116.0;
    [
        (y + v[1] / 500.0) * w[0],
        y * w[1],
        (y - v[2] / 200.0) * w[2],
    ]
}

/// CIE L*a*b* of linear RGB, with chroma scaled by lightness (the Hunt effect).
fn hunt_lab(rgb: [f32; 3]) -> [f32; 3] {
    let (xyz, w) = (multiply(&RGB_TO_XYZ, rgb), white());
    let delta = 6.0f32 / 29.0;
    let f = |t: f32| {
        if t > delta.powi(3) {
            t.cbrt()
        } else {
            t / (3.0 * delta * delta) + 4.0 / 29.0
        }
    };
    let [x, y, z] = [f(xyz[0] / w[0]), f(xyz[1] / w[1]), f(xyz[2] / w[2])];
    let lightness = 116.0 * y - 16.0;
    let hunt = 0.01 * lightness;
    [lightness, hunt * 500.0 * (x - y), hunt * 200.0 * (y - z)]
}

/// The distance for large colour differences (Abasi et al. 2019).
fn hyab(a: [f32; 3], b: [f32; 3]) -> f32 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

fn multiply(rows: &[[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    rows.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture with flat parts, edges, points and colours, and a disturbed copy.
    fn pair(width: usize, height: usize) -> [Vec<[u8; 3]>; 2] {
        let mut state = 1u32;
        let mut noise = |range: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 16) % range
        };
        let mut reference = Vec::new();
        let mut image = Vec::new();
        for y in 0..height {
            for x in 0..width {
                let block = ((x / 13 + y / 9) % 3 * 90) as u8;
                let p = [block, (x * 255 / width) as u8, (y * 255 / height) as u8];
                reference.push(p);
                let shift = noise(40) as u8;
                let lit = if noise(60) == 0 { 120 } else { 0 };
                image.push([
                    p[0].saturating_add(shift).saturating_add(lit),
                    p[1].saturating_sub(shift / 2),
                    p[2].saturating_add(lit),
                ]);
            }
        }
        [reference, image]
    }

    fn codes(bytes: &[[u8; 3]]) -> Vec<[f32; 3]> {
        bytes
            .iter()
            .map(|p| p.map(|b| f32::from(b) / 255.0))
            .collect()
    }

    #[test]
    fn every_pixel_agrees_with_nvidias_implementation() {
        let (width, height) = (96, 64);
        let [reference, image] = pair(width, height);
        for ppd in [PIXELS_PER_DEGREE, 20.0] {
            let ours = flip(&codes(&reference), &codes(&image), width, height, ppd);
            let [r, i] = [&reference, &image].map(|bytes| {
                let flat: Vec<u8> = bytes.iter().flatten().copied().collect();
                nv_flip::FlipImageRgb8::with_data(width as u32, height as u32, &flat)
            });
            let theirs = nv_flip::flip(r, i, ppd).to_vec();
            let worst = (ours.iter().zip(&theirs)).fold(0.0f32, |w, (a, b)| w.max((a - b).abs()));
            let mean = ours.iter().sum::<f32>() / ours.len() as f32;
            assert!(mean > 0.05, "the test pictures must differ: {mean}");
            assert!(
                worst < 2e-3,
                "largest difference {worst} at {ppd} pixels per degree"
            );
        }
    }

    #[test]
    fn the_same_picture_has_no_error_and_black_on_white_the_largest() {
        let [reference, _] = pair(40, 30);
        let same = flip(
            &codes(&reference),
            &codes(&reference),
            40,
            30,
            PIXELS_PER_DEGREE,
        );
        assert!(same.iter().all(|&e| e == 0.0));
        let (black, white) = (vec![[0.0; 3]; 64], vec![[1.0; 3]; 64]);
        let most = flip(&black, &white, 8, 8, PIXELS_PER_DEGREE);
        // The paper's extreme pair: 0.967 of the range, as a feature-less colour difference.
        assert!(
            most.iter().all(|&e| (e - 0.967).abs() < 2e-3),
            "{}",
            most[0]
        );
    }
}
