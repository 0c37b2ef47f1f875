//! Rays that left the level: how many, and where the first of them began.

use scene::Scene;
use scene::render::{Counters, Escape, Film};
use serde_json::{Value, json};

/// Rays that left in 1e9 rays traced, shadow rays included.
#[must_use]
pub fn per_billion(counters: &Counters) -> f64 {
    counters.escaped as f64 * 1e9 / counters.rays.max(1) as f64
}

/// The escapes that were kept: where each began, on which face with which texture, where it went.
#[must_use]
pub fn json(film: &Film, scene: &Scene) -> Value {
    let one = |e: &Escape| {
        json!({
            "pixel": [e.pixel % film.width, e.pixel / film.width],
            "sample": e.sample,
            "origin": e.origin,
            "direction": e.direction,
            "face": e.face,
            "texture": e.face.and_then(|face| texture_of(scene, face)),
        })
    };
    film.escapes.iter().map(one).collect()
}

/// The same, one sentence each.
pub fn sentences<'a>(film: &'a Film, scene: &'a Scene) -> impl Iterator<Item = String> + 'a {
    film.escapes.iter().map(|e| {
        let [x, y, z] = e.origin;
        let [dx, dy, dz] = e.direction;
        let face = match e.face {
            None => "the camera".to_owned(),
            Some(face) => {
                let texture = texture_of(scene, face).unwrap_or("unknown");
                format!("face {face} ({texture})")
            }
        };
        format!(
            "escaped from {face} at {x:.4} {y:.4} {z:.4} to {dx:.4} {dy:.4} {dz:.4} (pixel {} {}, \
             sample {})",
            e.pixel % film.width,
            e.pixel / film.width,
            e.sample
        )
    })
}

/// Name of the material of a face of the level.
fn texture_of(scene: &Scene, face: u32) -> Option<&str> {
    let mut triangles = scene.meshes.iter().flat_map(|m| &m.triangles);
    let triangle = triangles.find(|t| t.face == face)?;
    Some(&scene.materials[triangle.material.0 as usize].name)
}
