//! Rays that left the level: how many, and where the first of them began.

use scene::Scene;
use scene::render::{Counters, Film};
use serde::Serialize;
use std::fmt;

/// Rays that left in 1e9 rays traced, shadow rays included.
#[must_use]
pub fn per_billion(counters: &Counters) -> f64 {
    counters.escaped as f64 * 1e9 / counters.rays.max(1) as f64
}

/// A ray that left the level; see [`scene::render::Escape`].
#[derive(Clone, Debug, Serialize)]
pub struct Left {
    /// Column and row of the pixel.
    pub pixel: [u32; 2],
    /// Number of the sample.
    pub sample: u32,
    /// Where the ray began, world space.
    pub origin: [f32; 3],
    /// Its direction.
    pub direction: [f32; 3],
    /// The face it began on; `None` for a camera ray.
    pub face: Option<u32>,
    /// That face's texture.
    pub texture: Option<String>,
}

/// The rays that left of those the film kept.
#[must_use]
pub fn left(film: &Film, scene: &Scene) -> Vec<Left> {
    (film.escapes.iter())
        .map(|escape| {
            let triangle = scene.triangle_beside(escape.origin.into());
            let material = triangle.map(|t| &scene.materials[t.material.0 as usize]);
            Left {
                pixel: [escape.pixel % film.width, escape.pixel / film.width],
                sample: escape.sample,
                origin: escape.origin,
                direction: escape.direction,
                face: triangle.map(|t| t.face),
                texture: material.map(|m| m.name.clone()),
            }
        })
        .collect()
}

impl fmt::Display for Left {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("left from ")?;
        match (self.face, &self.texture) {
            (Some(face), Some(texture)) => write!(f, "face {face} ({texture})")?,
            _ => f.write_str("the camera")?,
        }
        let ([x, y, z], [dx, dy, dz]) = (self.origin, self.direction);
        let ([column, row], sample) = (self.pixel, self.sample);
        write!(
            f,
            " at {x} {y} {z} along {dx} {dy} {dz} (pixel {column} {row}, sample {sample})"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_leaves_is_said_with_its_face() {
        let left = Left {
            pixel: [7, 2],
            sample: 3,
            origin: [1.0, 2.5, -3.0],
            direction: [0.0, 0.0, 1.0],
            face: Some(12),
            texture: Some("metal".into()),
        };
        let sentence = "left from face 12 (metal) at 1 2.5 -3 along 0 0 1 (pixel 7 2, sample 3)";
        assert_eq!(left.to_string(), sentence);
    }
}
