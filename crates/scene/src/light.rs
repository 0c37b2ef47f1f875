//! Light entities as small spheres.

use crate::material::luminance;
use glam::Vec3;

/// A light entity: a sphere that emits evenly over its surface and can't be seen or hit.
///
/// Renderers that find light only by hitting it (`naive`, `uniform`) do not see these lights; `nee`
/// and `mis` sample the sphere by solid angle and give the sample the weight 1. From inside the
/// sphere it gives no light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointLight {
    /// Centre, world space.
    pub position: Vec3,
    /// Radius in world units, > 0.
    pub radius: f32,
    /// Radiant intensity per RGB channel (power per solid angle in the unit of radiance times
    /// squared world units): the sphere's radiance is `intensity / (pi radius^2)`.
    pub intensity: Vec3,
    /// A cone that limits the light, or `None` for all directions.
    pub spot: Option<Spot>,
}

/// The cone of a spotlight: full strength inside `cos_inner`, none outside `cos_outer`, linear in
/// the cosine between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    /// Unit direction the light shines to, world space.
    pub direction: Vec3,
    /// Cosine of half the inner cone.
    pub cos_inner: f32,
    /// Cosine of half the outer cone; `<= cos_inner`.
    pub cos_outer: f32,
}

impl PointLight {
    /// Weight among the emitters: the light's power divided by pi, as luminance.
    #[must_use]
    pub fn weight(&self) -> f32 {
        let share = self.spot.map_or(1.0, |s| (1.0 - s.cos_outer) / 2.0);
        4.0 * luminance(self.intensity.to_array()) * share
    }
}
