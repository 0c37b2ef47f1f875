//! Gloss and metal: what microfacets reflect once and more adds up.

use super::odd_turn;
use crate::builder::{Builder, camera};
use crate::case::{Case, Truth};
use crate::formulas::closed_box;
use glam::Vec3;
use scene::Scene;
use scene::gloss::Gloss;
use std::sync::Arc;

pub fn cases() -> Vec<Case> {
    [
        ("gloss furnace, polished", 0.1, 1e-3),
        ("gloss furnace, satin", 0.4, 1e-3),
        ("gloss furnace, rough", 1.0, 1.5e-2),
    ]
    .into_iter()
    .map(|(name, roughness, line)| {
        Case::new(
            name,
            "A closed box of white metal that emits reflects at every vertex all that arrives.",
            Truth::Radiance([closed_box(1.0, rho(), 4); 3]),
            camera(Vec3::ZERO, 5.0, 30.0, 90.0),
            move || metal_box(roughness),
        )
        .depth(4)
        .line(
            line,
            "the table of what facets reflect is linear between its entries, and how much a grazing \
             ray is reflected more depends a little on the roughness; rough facets reflect light \
             several times, and each time a metal that is not quite white keeps its share",
        )
    })
    .collect()
}

/// What metal as white as an albedo may be reflects of even light: Schlick's term is 1/21 on average.
fn rho() -> f64 {
    let straight = f64::from(scene::material::MAX_ALBEDO);
    straight + (1.0 - straight) / 21.0
}

fn metal_box(roughness: f32) -> Arc<Scene> {
    let mut b = Builder::new();
    let wall = b.plain(255, 1.0);
    b.edit(wall).finish.gloss = Some(Gloss {
        roughness,
        metallic: 1.0,
        specular: 0.0,
        roughness_map: None,
    });
    let (min, max) = (Vec3::new(-31.0, -40.0, -20.0), Vec3::new(50.0, 17.0, 29.0));
    b.cuboid(min, max, true, [wall; 6]);
    b.transform(odd_turn());
    b.build()
}
