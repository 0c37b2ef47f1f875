//! Fog that fills a level.

use glam::Vec3;

/// A homogeneous medium that fills all space: it takes light out of a ray, and scatters some of what
/// it takes evenly in all directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fog {
    /// Share of the light that is taken out of a ray, per world unit: after a distance d
    /// `exp(-extinction d)` is left. Above 0.
    pub extinction: f32,
    /// What of that is scattered, linear RGB, 0 to 1; the rest is absorbed.
    pub albedo: Vec3,
}

impl Fog {
    /// Distance after which half of the light is left, world units.
    #[must_use]
    pub fn half_distance(&self) -> f32 {
        std::f32::consts::LN_2 / self.extinction
    }
}
