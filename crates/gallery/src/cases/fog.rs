//! Fog: very thin, very thick.

use super::box_around;
use crate::builder::{Builder, camera, probe};
use crate::case::{Case, Truth};
use crate::formulas::{LampBeside, airlight};
use glam::Vec3;
use scene::render::Estimator::{Mis, Naive, Nee, Uniform};
use scene::{Fog, PointLight, Scene};
use std::sync::Arc;

const LAMP: LampBeside = LampBeside {
    along: 3000.0,
    height: 2.0,
    radius: 0.5,
};
const LENGTH: f32 = 4000.0;
const THIN: f32 = 1e-4;

pub fn cases() -> Vec<Case> {
    let eye = Vec3::new(0.0, -2000.0, 0.0);
    let scattered = 1e6 * airlight(f64::from(THIN), f64::from(LENGTH), LAMP, |_| 1.0);
    vec![
        Case::new(
            "lamp in fog",
            "A ray of 4,000 units passes a lamp of radius 1/2 in 2 units' distance.",
            Truth::Radiance([scattered; 3]),
            probe(eye, Vec3::ZERO),
            lamp_in_fog,
        )
        .by(&[Nee, Mis])
        .line(
            1e-3,
            "f32 angles of the camera: a hundredth of a unit at the lamp",
        ),
        Case::new(
            "fog nothing is seen through",
            "Walls that shine, too far away for a number: 1.3 of optical depth to the unit.",
            Truth::Black,
            camera(Vec3::ZERO, 5.0, 30.0, 90.0),
            hidden_walls,
        )
        .by(&[Naive, Uniform, Nee, Mis]),
    ]
}

fn lamp_in_fog() -> Arc<Scene> {
    let mut b = Builder::new();
    let black = b.plain(0, 0.0);
    // The wall behind the eye is a unit away: of a wall in whose plane the eye lies, fog at the very eye
    // would scatter half of its light to the other side.
    let half = Vec3::splat(LENGTH / 2.0);
    b.cuboid(-half - Vec3::Y, half, true, [black; 6]);
    b.light(PointLight {
        position: Vec3::new(2.0, 1000.0, 0.0),
        radius: 0.5,
        intensity: Vec3::splat(1e6),
        ..PointLight::default()
    });
    b.scene.fog = Some(Fog {
        extinction: THIN,
        albedo: Vec3::ONE,
    });
    b.build()
}

fn hidden_walls() -> Arc<Scene> {
    let mut b = Builder::new();
    let bright = b.plain(188, 100.0);
    box_around(&mut b, Vec3::ZERO, 2000.0, bright);
    b.scene.fog = Some(Fog {
        extinction: 1.3,
        albedo: Vec3::ONE,
    });
    b.build()
}
