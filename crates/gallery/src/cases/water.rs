//! Surfaces that light passes through: what they mirror, paint and let pass adds up.

use super::{GREY, balanced, odd_turn, rho};
use crate::builder::{Builder, camera};
use crate::case::{Case, Truth};
use glam::Vec3;
use scene::render::Estimator::Naive;
use scene::{Finish, Scene};
use std::sync::Arc;

pub fn cases() -> Vec<Case> {
    vec![
        Case::new(
            "water furnace",
            "Where each surface emits what it does not reflect, water and glass cannot be seen.",
            Truth::Radiance([1.0; 3]),
            camera(Vec3::new(-20.0, 0.0, 20.0), 25.0, 10.0, 90.0),
            furnace,
        ),
        Case::new(
            "water furnace from below",
            "The same from under the water.",
            Truth::Radiance([1.0; 3]),
            camera(Vec3::new(-20.0, 0.0, -30.0), -25.0, 10.0, 90.0),
            furnace,
        ),
        Case::new(
            "stack of panes",
            "Forty panes of glass between a camera and a wall: more passages than vertices.",
            Truth::Radiance([1.0; 3]),
            camera(Vec3::new(-45.0, 1.0, 2.0), 0.0, 3.0, 20.0),
            panes,
        ),
        Case::new(
            "pane on a wall",
            "Glass in the very planes of floor and ceiling: who passes it does not pass the wall behind.",
            Truth::Radiance([1.0; 3]),
            camera(Vec3::new(-20.0, 3.0, 5.0), 35.0, 10.0, 90.0),
            pane_on_wall,
        )
        // Light sampling sees such a wall through the glass or not, as rounding has it.
        .by(&[Naive]),
    ]
}

fn see_through(b: &mut Builder, grey: u8, alpha: f32, ior: f32) -> scene::MaterialId {
    let id = b.plain(
        grey,
        alpha * (1.0 - scene::material::srgb_to_linear(grey) as f32),
    );
    let material = b.edit(id);
    material.two_sided = true;
    material.emission_weight *= 2.0;
    material.finish = Finish {
        alpha,
        ior,
        ..Finish::default()
    };
    id
}

fn furnace() -> Arc<Scene> {
    let mut b = Builder::new();
    let [dark, bright] = [60, 220].map(|grey| balanced(&mut b, grey, false));
    let (water, glass) = (
        see_through(&mut b, 150, 0.3, 1.33),
        see_through(&mut b, 90, 0.2, 1.5),
    );
    let walls = [dark, bright, bright, dark, dark, bright];
    b.cuboid(Vec3::splat(-50.0), Vec3::splat(50.0), true, walls);
    b.slab(Vec3::Z * -5.0, [50.0; 2], true, water, [1.0; 2]);
    let (min, max) = (Vec3::new(10., -15., -30.), Vec3::new(30., 20., 20.));
    b.cuboid(min, max, false, [glass; 6]);
    b.transform(odd_turn());
    b.build()
}

fn pane_on_wall() -> Arc<Scene> {
    let mut b = Builder::new();
    let wall = b.plain(GREY, 1.0 - rho() as f32);
    let glass = see_through(&mut b, 90, 0.2, 1.5);
    b.cuboid(Vec3::splat(-50.0), Vec3::splat(50.0), true, [wall; 6]);
    // Corners that neither wall has, so that distances round differently.
    for (z, up) in [(-50.0, true), (50.0, false)] {
        b.slab(Vec3::new(3.0, 1.0, z), [37.0, 29.0], up, glass, [1.0; 2]);
    }
    b.build()
}

fn panes() -> Arc<Scene> {
    let mut b = Builder::new();
    let wall = b.plain(GREY, 1.0 - rho() as f32);
    let glass = see_through(&mut b, 0, 0.0, 1.5);
    b.cuboid(Vec3::splat(-50.0), Vec3::splat(50.0), true, [wall; 6]);
    for i in 0..40_u8 {
        let x = f32::from(i) * 2.0 - 40.0;
        let (min, max) = (Vec3::new(x, -30., -30.), Vec3::new(x + 1.0, 30., 30.));
        b.cuboid(min, max, false, [glass; 6]);
    }
    b.build()
}
