//! Lamps that are small, far, many or hidden; and many samples.

use super::{GREY, odd_turn, rho};
use crate::builder::{Builder, camera, probe};
use crate::case::{Case, Escapes, Truth};
use crate::formulas::rectangle_form_factor;
use glam::{Affine3A, Vec3};
use scene::render::Estimator::{Mis, Naive, Nee};
use scene::{PointLight, Scene};
use std::f64::consts::PI;
use std::sync::Arc;

pub fn cases() -> Vec<Case> {
    vec![
        one_unit_lamp(),
        one_texel_lamp(),
        small_sphere(),
        lamp_at_65k(),
        many_emitters(),
        slit(),
        room_at_65k(),
        million(),
        sparse_million(),
    ]
}

/// What a grey plane facing up at the origin shows of light from rectangles of radiance `emitted`
/// that face down: `rho / pi` times the irradiance `pi Le F`.
fn reflected(rectangles: impl Iterator<Item = (f64, [f64; 2], [f64; 2], f64)>) -> [f64; 3] {
    let sum: f64 = rectangles
        .map(|(emitted, x, y, height)| emitted * rectangle_form_factor(x, y, height))
        .sum();
    [rho() * sum; 3]
}

/// A case of light that is reflected once, by the ground at the origin.
fn on_the_ground(
    name: &'static str,
    tests: &'static str,
    truth: [f64; 3],
    make: fn() -> Arc<Scene>,
) -> Case {
    let view = probe(Vec3::new(30.0, -20.0, 20.0), Vec3::ZERO);
    Case::new(name, tests, Truth::Radiance(truth), view, make)
        .depth(2)
        .by(&[Nee, Mis])
        .escapes(Escapes::Free)
}

/// Grey ground at the origin.
fn ground(b: &mut Builder, half: f32) {
    let grey = b.plain(GREY, 0.0);
    b.slab(Vec3::ZERO, [half; 2], true, grey, [1.0; 2]);
}

/// Where the far lamps hang: in a corner of nothing, so that no coordinate helps.
const LAMP: [f32; 3] = [1000.0, 700.0, 4096.0];
const LAMP_RADIANCE: f32 = 1e6;

fn one_unit_lamp() -> Case {
    let [x, y, z] = LAMP.map(f64::from);
    let spans = ([x - 0.5, x + 0.5], [y - 0.5, y + 0.5]);
    let truth = reflected([(f64::from(LAMP_RADIANCE), spans.0, spans.1, z)].into_iter());
    on_the_ground(
        "one-unit lamp at 4 k",
        "Light from a lamp of one unit, 4,096 units up.",
        truth,
        || {
            let mut b = Builder::new();
            ground(&mut b, 100.0);
            let lamp = b.plain(0, LAMP_RADIANCE);
            b.slab(LAMP.into(), [0.5; 2], false, lamp, [1.0; 2]);
            b.build()
        },
    )
}

/// The lit texel of the lamp: column and row.
const TEXEL: [usize; 2] = [5, 9];
const TEXELS: usize = 16;

fn one_texel_lamp() -> Case {
    let [x, y, z] = LAMP.map(f64::from);
    let half = TEXELS as f64 / 2.0;
    // Seen from below, columns run along x and rows against y.
    let (left, top) = (x - half + TEXEL[0] as f64, y + half - TEXEL[1] as f64);
    let spans = ([left, left + 1.0], [top - 1.0, top]);
    let truth = reflected([(f64::from(LAMP_RADIANCE), spans.0, spans.1, z)].into_iter());
    on_the_ground(
        "one-texel lamp at 4 k",
        "One lit texel of 256 on a lamp 4,096 units up; samples of the others find nothing.",
        truth,
        || {
            let mut b = Builder::new();
            ground(&mut b, 100.0);
            let mut texels = vec![[0, 0, 0, 255]; TEXELS * TEXELS];
            let base = b.texture(TEXELS, texels.clone());
            texels[TEXEL[1] * TEXELS + TEXEL[0]] = [255; 4];
            let glow = b.texture(TEXELS, texels);
            let lamp = b.material(base, Some(glow), LAMP_RADIANCE);
            let half = TEXELS as f32 / 2.0;
            b.slab(LAMP.into(), [half; 2], false, lamp, [TEXELS as f32; 2]);
            b.build()
        },
    )
    .interval(0.3)
}

/// Radiant intensity of the small sphere.
const SPHERE: f32 = 1e9;

fn small_sphere() -> Case {
    const AT: Vec3 = Vec3::new(500.0, 700.0, 2900.0);
    let cos_over_d2 = f64::from(AT.z) / AT.as_dvec3().length().powi(3);
    on_the_ground(
        "small sphere at 3 k",
        "A light entity of radius 0.4 whose cone of 2e-8 steradians vanishes in 1 - cos.",
        [rho() / PI * f64::from(SPHERE) * cos_over_d2; 3],
        || {
            let mut b = Builder::new();
            ground(&mut b, 100.0);
            b.light(PointLight {
                position: AT,
                radius: 0.4,
                intensity: Vec3::splat(SPHERE),
                ..PointLight::default()
            });
            b.build()
        },
    )
}

const FAR: Vec3 = Vec3::new(65_000.0, -65_100.0, 64_900.0);

fn lamp_at_65k() -> Case {
    let truth = reflected([(3.0, [-20.0, 30.0], [-25.0, 5.0], 32.0)].into_iter());
    let mut case = on_the_ground(
        "lamp at 65 k",
        "A rectangle lights a plane by its form factor, where a step is 1/128 unit.",
        truth,
        || {
            let mut b = Builder::new();
            ground(&mut b, 300.0);
            let lamp = b.plain(0, 3.0);
            b.slab(
                Vec3::new(5.0, -10.0, 32.0),
                [25.0, 15.0],
                false,
                lamp,
                [1.0; 2],
            );
            b.transform(Affine3A::from_translation(FAR));
            b.build()
        },
    )
    .by(&[Naive, Nee, Mis])
    .interval(0.04)
    .line(
        1e-2,
        "light is gathered where rays leave the ground: f32 moves them 32 half-ulps of the \
         largest coordinate, 0.124 unit, off it and so 0.26 unit up the view, where the closed form \
         is 8.6e-3 larger",
    );
    case.camera = probe(FAR + Vec3::new(30.0, -20.0, 20.0), FAR);
    case
}

/// Cells of the ceiling of lamps.
const CELLS: [i16; 2] = [128, 64];

/// Radiance of each lamp and the centre of its cell.
fn lamps() -> impl Iterator<Item = (usize, f64, f64)> {
    (0..CELLS[0]).flat_map(|i| {
        (0..CELLS[1]).map(move |j| {
            // A hash of the cell.
            let h = u32::from(i.unsigned_abs()).wrapping_mul(73_856_093)
                ^ u32::from(j.unsigned_abs()).wrapping_mul(19_349_663);
            let kind = (h.wrapping_mul(0x9e37_79b9) >> 28) as usize;
            let at = |k: i16, n: i16| (f64::from(k) - f64::from(n) / 2.0 + 0.5) * 8.0;
            (kind, at(i, CELLS[0]), at(j, CELLS[1]))
        })
    })
}

/// Radiances over a range of 1,000.
fn lamp_radiance(kind: usize) -> f32 {
    0.03 * (kind as f32 / 1.5).exp2()
}

fn many_emitters() -> Case {
    let truth = reflected(lamps().map(|(kind, x, y)| {
        let span = |c: f64| [c - 2.0, c + 2.0];
        (f64::from(lamp_radiance(kind)), span(x), span(y), 100.0)
    }));
    on_the_ground(
        "8 k emitters",
        "A ceiling of 8,192 lamps whose radiances differ by a factor of 1,000.",
        truth,
        || {
            let mut b = Builder::new();
            ground(&mut b, 100.0);
            let kinds: Vec<_> = (0..16).map(|k| b.plain(0, lamp_radiance(k))).collect();
            for (kind, x, y) in lamps() {
                let at = Vec3::new(x as f32, y as f32, 100.0);
                b.slab(at, [2.0; 2], false, kinds[kind], [1.0; 2]);
            }
            b.build()
        },
    )
    .by(&[Naive, Nee, Mis])
    .interval(0.06)
}

fn slit() -> Case {
    let truth = reflected([(5.0, [-0.5, 0.5], [-100.0, 100.0], 64.0)].into_iter());
    on_the_ground(
        "slit of one unit",
        "A lamp seen through a slit 1 unit wide and 200 long, 64 units up.",
        truth,
        || {
            let mut b = Builder::new();
            ground(&mut b, 50.0);
            let (plate, lamp) = (b.plain(GREY, 0.0), b.plain(0, 5.0));
            let far = 2000.0;
            let mut cover = |x: [f32; 2], y: [f32; 2]| {
                let centre = Vec3::new((x[0] + x[1]) / 2.0, (y[0] + y[1]) / 2.0, 64.0);
                let half = [(x[1] - x[0]) / 2.0, (y[1] - y[0]) / 2.0];
                b.slab(centre, half, false, plate, [1.0; 2]);
            };
            cover([-far, -0.5], [-far, far]);
            cover([0.5, far], [-far, far]);
            cover([-0.5, 0.5], [-far, -100.0]);
            cover([-0.5, 0.5], [100.0, far]);
            b.slab(Vec3::Z * 68.0, [2.0, 110.0], false, lamp, [1.0; 2]);
            b.build()
        },
    )
    .interval(0.06)
}

fn room_at_65k() -> Case {
    let view = camera(FAR + Vec3::new(-40.0, -30.0, 10.0), 5.0, 40.0, 90.0);
    Case::new(
        "lit room at 65 k",
        "All light of a lamp in a room with a bench, out where a step is 1/128 unit.",
        Truth::Judge(8192),
        view,
        || {
            let mut b = Builder::new();
            let (wall, lamp) = (b.plain(GREY, 0.0), b.plain(100, 20.0));
            b.cuboid(Vec3::splat(-64.0), Vec3::splat(64.0), true, [wall; 6]);
            b.slab(
                Vec3::new(10.0, 5.0, 48.0),
                [16.0, 12.0],
                false,
                lamp,
                [1.0; 2],
            );
            let (min, max) = (Vec3::new(0.0, -10.0, -64.0), Vec3::new(40.0, 20.0, -30.0));
            b.cuboid(min, max, false, [wall; 6]);
            b.transform(odd_turn());
            b.transform(Affine3A::from_translation(FAR));
            b.build()
        },
    )
    .by(&[Nee, Mis])
    .interval(0.04)
    .line(
        1e-2,
        "as of the lamp at 65 k: rays leave a surface by 0.124 unit in f32, lamp, bench and walls \
         are 16 units apart",
    )
}

fn million() -> Case {
    let emitted = f64::from(0.1_f32) * rho();
    Case::new(
        "10^6 samples",
        "A million equal samples in a pixel: their mean is each of them, and their variance 0.",
        Truth::Radiance([emitted; 3]),
        camera(Vec3::new(0.0, 0.0, 50.0), 90.0, 0.0, 60.0),
        || {
            let mut b = Builder::new();
            let glow = b.texture(1, vec![[GREY, GREY, GREY, 255]]);
            let glow = b.material(glow, Some(glow), 0.1);
            b.slab(Vec3::ZERO, [100.0; 2], true, glow, [1.0; 2]);
            b.build()
        },
    )
    .depth(1)
    .by(&[Naive])
    .samples(2, 1_000_000)
    .fixed()
    .every_pixel()
    .interval(1e-6)
    .line(
        1e-6,
        "a compensated f32 sum is good to 1e-7 whatever the number of terms; the radiance of a \
         sample to 3e-7",
    )
}

/// One lit texel of this many, side by side.
const STRIPES: u16 = 16;

fn sparse_million() -> Case {
    let emitted = 1000.0;
    // Straight down from 128 units a field of view of 90 degrees sees 192 units across (three
    // quarters of it: the field is that of 4:3), which is six tiles for each of two pixels.
    Case::new(
        "10^6 sparse samples",
        "A million samples in a pixel of which one in 16 finds light.",
        Truth::Radiance([emitted / f64::from(STRIPES); 3]),
        camera(Vec3::new(0.0, 0.0, 128.0), 90.0, 0.0, 90.0),
        move || {
            let mut b = Builder::new();
            let mut texels = vec![[0, 0, 0, 255]; usize::from(STRIPES)];
            texels[5] = [255; 4];
            let stripes = b.texture(texels.len(), texels);
            let stripes = b.material(stripes, Some(stripes), emitted as f32);
            let half = 16.0 * f32::from(STRIPES);
            b.slab(Vec3::ZERO, [half; 2], true, stripes, [2.0 * half, 1.0]);
            b.build()
        },
    )
    .depth(1)
    .by(&[Naive])
    .samples(2, 1_000_000)
    .fixed()
    .interval(0.005)
}
