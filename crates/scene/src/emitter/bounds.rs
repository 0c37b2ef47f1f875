//! Where a light is and how it shines, for a guess at what it adds at a point without choosing a
//! point on it.

use super::Emitter;
use crate::light::PointLight;
use crate::material::luminance;
use crate::sky::Sun;
use glam::Vec3;

/// What [`LightBounds`] says of the directions a light shines in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shine {
    /// To the front of a plane, by the cosine.
    Front,
    /// To both sides of a plane, by the cosine.
    BothSides,
    /// Everywhere alike.
    AllRound,
    /// In a cone, as a [`crate::light::Spot`] does.
    Cone {
        /// Cosine of half the inner cone.
        cos_inner: f32,
        /// Cosine of half the outer cone.
        cos_outer: f32,
    },
    /// From far away, equally strong at any place.
    Distant,
}

/// A light as seen from afar.
///
/// What it may add at a point `x` with the unit normal `n` on the viewer's side is guessed as
/// `weight cos_x cos_l / d^2`, with `c = centre - x` and `d = max(|c|, radius)`:
///
/// - `cos_x = min(1, (n . c + radius) / d)`, and nothing if that is not above 0: no point of the
///   light is in front of the surface;
/// - `cos_l` is, by [`Shine`], `min(1, (h + radius / 4) / d)` with the height `h` of the point over
///   the light's plane, on its front or on either side, and nothing if `h` is not above 0; 1; or the
///   cone's share in the direction `-c`;
/// - for a distant light, it is `weight min(1, n . axis + radius)`, if that is above 0.
///
/// The guess is above 0 wherever the light adds something, so that choosing by it is unbiased.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightBounds {
    /// Middle, world space.
    pub centre: Vec3,
    /// Distance from there that no point of it exceeds, world units; of a distant light, the sine of
    /// its angular radius.
    pub radius: f32,
    /// Unit normal of a plane, direction of a cone, or direction to a distant light; zero for one
    /// that is in all directions.
    pub axis: Vec3,
    /// Luminance of the irradiance it gives straight on, at distance 1 if it is not a distant light.
    pub weight: f32,
    /// Where to.
    pub shine: Shine,
    /// Its weight among the emitters: the alias table chooses it with this over the sum of all.
    pub power: f32,
}

impl From<&Emitter> for LightBounds {
    fn from(e: &Emitter) -> Self {
        // On its plane, as the middle of its bounds need not be.
        let centre = e.corners.iter().sum::<Vec3>() / 4.0;
        // Further than rounding could bring a corner.
        let reach = |p: &Vec3| p.distance(centre) * 1.001;
        Self {
            centre,
            radius: e.corners.iter().map(reach).fold(0.0, f32::max),
            axis: e.normal,
            weight: if e.two_sided {
                0.5 * e.weight
            } else {
                e.weight
            },
            shine: if e.two_sided {
                Shine::BothSides
            } else {
                Shine::Front
            },
            power: e.weight,
        }
    }
}

impl From<&PointLight> for LightBounds {
    fn from(l: &PointLight) -> Self {
        let (weight, shine) = match (l.compiler, l.spot) {
            (Some(_), _) if l.is_everywhere() => {
                // In all directions, for what `radius` means then.
                return Self {
                    centre: Vec3::ZERO,
                    radius: 1.0,
                    axis: Vec3::ZERO,
                    weight: luminance(l.intensity.abs().to_array()),
                    shine: Shine::Distant,
                    power: l.weight(),
                };
            }
            // As the sphere that its weight among the emitters takes it for. Compilers soften cones in
            // ways of their own.
            (Some(_), _) => (0.25 * l.weight(), Shine::AllRound),
            (None, Some(spot)) => (
                luminance(l.intensity.to_array()),
                Shine::Cone {
                    cos_inner: spot.cos_inner,
                    cos_outer: spot.cos_outer,
                },
            ),
            (None, None) => (luminance(l.intensity.to_array()), Shine::AllRound),
        };
        Self {
            centre: l.position,
            radius: l.radius,
            axis: l.spot.map_or(Vec3::Z, |s| s.direction),
            weight,
            shine,
            power: l.weight(),
        }
    }
}

impl From<&Sun> for LightBounds {
    fn from(s: &Sun) -> Self {
        let cos = 1.0 - s.one_minus_cos;
        Self {
            centre: Vec3::ZERO,
            radius: (1.0 - cos * cos).max(0.0).sqrt() * 1.001 + 1e-6,
            axis: s.direction,
            weight: luminance(s.irradiance().to_array()),
            shine: Shine::Distant,
            power: s.weight,
        }
    }
}
