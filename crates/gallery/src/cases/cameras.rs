//! Cameras where no camera should be.

use super::{GREY, balanced, box_around};
use crate::builder::{Builder, camera};
use crate::case::{Case, Truth};
use glam::Vec3;
use scene::Scene;
use scene::render::Estimator::{Mis, Naive, Nee};
use std::sync::Arc;

pub fn cases() -> Vec<Case> {
    let furnace = |name, tests, position| {
        let view = camera(position, 10.0, 30.0, 120.0);
        Case::new(name, tests, Truth::Radiance([1.0; 3]), view, nested)
    };
    vec![
        furnace(
            "camera in a plane",
            "The eye lies in a face: on either side of it radiance is 1.",
            Vec3::new(32.0, 3.0, 5.0),
        ),
        furnace(
            "camera on an edge",
            "The eye lies on the edge of two faces.",
            Vec3::new(32.0, 32.0, 5.0),
        ),
        furnace(
            "camera in a corner",
            "The eye is a vertex that three faces share.",
            Vec3::splat(32.0),
        ),
        Case::new(
            "camera in a solid",
            "Inside of a pillar in a bright room there are only backs, which do not emit.",
            Truth::Black,
            camera(Vec3::new(3.0, -2.0, 1.0), 10.0, 30.0, 120.0),
            pillar,
        )
        .by(&[Naive, Nee, Mis]),
    ]
}

/// A furnace in a furnace; all faces are two-sided, so every ray meets radiance 1.
fn nested() -> Arc<Scene> {
    let mut b = Builder::new();
    let [dark, bright] = [100, 200].map(|grey| balanced(&mut b, grey, true));
    box_around(&mut b, Vec3::ZERO, 100.0, dark);
    box_around(&mut b, Vec3::ZERO, 32.0, bright);
    b.build()
}

fn pillar() -> Arc<Scene> {
    let mut b = Builder::new();
    let glow = b.plain(GREY, 1.0);
    box_around(&mut b, Vec3::ZERO, 100.0, glow);
    // Short of floor and ceiling: a shared plane would show the room's own faces.
    let half = Vec3::new(16.0, 16.0, 90.0);
    b.cuboid(-half, half, false, [glow; 6]);
    b.build()
}
