//! Closed boxes: whatever their shape, radiance in them is a geometric series.

use super::{ASTRAY, CROSSING, GREY, balanced, box_around, odd_turn, rho};
use crate::builder::{Builder, camera, cuboid_sides};
use crate::case::{Case, Truth};
use crate::formulas::closed_box;
use glam::{Affine3A, Vec3};
use scene::render::Estimator::{Mis, Naive, Nee, Uniform};
use scene::{Camera, Scene};
use std::sync::Arc;

pub fn cases() -> Vec<Case> {
    vec![
        Case::new(
            "closed box",
            "All reflections in a closed box sum to Le / (1 - rho).",
            Truth::Radiance([closed_box(1.0, rho(), 0); 3]),
            inside(),
            plain_box,
        )
        .by(&[Naive, Uniform, Mis]),
        Case::new(
            "closed box, depth 4",
            "Four vertices give Le (1 - rho^4) / (1 - rho) in every single path.",
            Truth::Radiance([closed_box(1.0, rho(), 4); 3]),
            inside(),
            plain_box,
        )
        .depth(4)
        .by(&[Naive])
        .every_pixel(),
        Case::new(
            "white furnace",
            "Where each surface emits what it does not reflect, nothing can be seen.",
            Truth::Radiance([1.0; 3]),
            inside(),
            white_furnace,
        ),
        Case::new(
            "box at 65 k",
            "A room of 160 units whose coordinates end in steps of 1/128 unit, in every path.",
            Truth::Radiance([closed_box(1.0, rho(), 4); 3]),
            camera(far(), 5.0, 30.0, 90.0),
            far_box,
        )
        .depth(4)
        .by(&[Naive])
        .every_pixel(),
        Case::new(
            "box at 65 k, lights",
            "The same room by light sampling: distances are differences of large coordinates.",
            Truth::Radiance([closed_box(1.0, rho(), 4); 3]),
            camera(far(), 5.0, 30.0, 90.0),
            far_box,
        )
        .depth(4)
        .by(&[Mis]),
        Case::new(
            "box of 131 k",
            "A room from -65,536 to 65,536 with pillars 16 units thick: long rays, small things.",
            Truth::Radiance([closed_box(1.0, rho(), 4); 3]),
            camera(Vec3::new(64_900.0, -64_800.0, -65_500.0), 5.0, 130.0, 90.0),
            wide_box,
        )
        .depth(4)
        .by(&[Naive])
        .every_pixel()
        .astray(ASTRAY, CROSSING),
        Case::new(
            "slivers",
            "Walls cut into triangles up to a million times longer than wide, in every path.",
            Truth::Radiance([closed_box(1.0, rho(), 4); 3]),
            inside(),
            || sliver_box().build(),
        )
        .depth(4)
        .by(&[Naive])
        .every_pixel(),
        Case::new(
            "slivers, lights",
            "The same walls by light sampling, which chooses slivers by their area.",
            Truth::Radiance([closed_box(1.0, rho(), 4); 3]),
            inside(),
            || sliver_box().build(),
        )
        .depth(4)
        .by(&[Mis]),
        Case::new(
            "slivers at 65 k",
            "The same walls where a step is 1/128 unit: slivers become lines or fold over.",
            Truth::Radiance([closed_box(1.0, rho(), 4); 3]),
            camera(far(), 5.0, 30.0, 90.0),
            || {
                let mut b = sliver_box();
                // What folds over shows its back.
                let wall = scene::MaterialId(0);
                b.edit(wall).two_sided = true;
                b.transform(Affine3A::from_translation(far()));
                b.build()
            },
        )
        .depth(4)
        .by(&[Naive])
        .every_pixel()
        .astray(
            ASTRAY,
            "triangles that are thinner than the rounding of their corners",
        ),
        Case::new(
            "dark room at 65 k",
            "One unit of wall between a dark room and a bright sky, where a step is 1/128 unit.",
            Truth::Black,
            camera(far(), 5.0, 30.0, 90.0),
            far_dark_room,
        )
        .by(&[Naive, Nee, Mis]),
    ]
}

const MIN: Vec3 = Vec3::new(-31.0, -40.0, -20.0);
const MAX: Vec3 = Vec3::new(50.0, 17.0, 29.0);

fn inside() -> Camera {
    camera(Vec3::ZERO, 5.0, 30.0, 90.0)
}

fn far() -> Vec3 {
    Vec3::new(65_000.0, -65_100.0, 64_900.0)
}

fn plain_box() -> Arc<Scene> {
    let mut b = Builder::new();
    let wall = b.plain(GREY, 1.0);
    b.cuboid(MIN, MAX, true, [wall; 6]);
    b.transform(odd_turn());
    b.build()
}

fn white_furnace() -> Arc<Scene> {
    let mut b = Builder::new();
    let [dark, middle, bright] = [60, 150, 220].map(|grey| balanced(&mut b, grey, false));
    let walls = [dark, middle, bright, bright, middle, dark];
    b.cuboid(Vec3::splat(-50.0), Vec3::splat(50.0), true, walls);
    let (min, max) = (Vec3::new(10., -15., -50.), Vec3::new(30., 20., -10.));
    b.cuboid(min, max, false, walls);
    b.transform(odd_turn());
    b.build()
}

/// Turned oddly, then moved: every corner is rounded to the grid out there.
fn far_box() -> Arc<Scene> {
    let mut b = Builder::new();
    let wall = b.plain(GREY, 1.0);
    box_around(&mut b, Vec3::ZERO, 80.0, wall);
    b.transform(odd_turn());
    b.transform(Affine3A::from_translation(far()));
    b.build()
}

fn wide_box() -> Arc<Scene> {
    let mut b = Builder::new();
    let wall = b.plain(GREY, 1.0);
    box_around(&mut b, Vec3::ZERO, 65_536.0, wall);
    // Pillars on the floor in one corner of the room, near the eye.
    for i in 0..8_u8 {
        let x = 64_000.0 + 150.0 * f32::from(i);
        let at = Vec3::new(x, -64_000.0 - 100.0 * f32::from(i % 3), -65_536.0);
        let top = at + Vec3::new(16.0, 16.0, 300.0);
        b.cuboid(at, top, false, [wall; 6]);
    }
    b.build()
}

fn sliver_box() -> Builder {
    let mut b = Builder::new();
    let wall = b.plain(GREY, 1.0);
    for (face, corners) in cuboid_sides(MIN, MAX, true).into_iter().enumerate() {
        let [p, q, r, s] = corners;
        let normal = (q - p).cross(s - p).normalize();
        let inwards = (s - p).normalize();
        // From 1/16 unit down to 1/16,384, over sides of up to 81 units.
        let height = (-4.0 - 2.0 * face as f32).exp2();
        let e = p.midpoint(q) + inwards * height;
        let f = p.lerp(q, 0.3) + inwards * (height / 4.0);
        let mut add = |corners| b.triangle(corners, normal, wall, face as u32);
        add([p, q, f]);
        add([q, e, f]);
        add([e, p, f]);
        add([q, r, e]);
        add([r, s, e]);
        add([s, p, e]);
    }
    b.transform(odd_turn());
    b
}

fn far_dark_room() -> Arc<Scene> {
    let mut b = Builder::new();
    let (wall, sky) = (b.plain(GREY, 0.0), b.sky(1000.0));
    box_around(&mut b, Vec3::ZERO, 64.0, wall);
    box_around(&mut b, Vec3::ZERO, 65.0, sky);
    b.transform(odd_turn());
    b.transform(Affine3A::from_translation(far()));
    b.scene.sky = scene::Sky {
        kind: scene::sky::SkyKind::Flat(Vec3::splat(1000.0)),
        ..scene::Sky::default()
    };
    b.build()
}
