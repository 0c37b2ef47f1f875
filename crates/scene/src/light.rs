//! Light entities: small spheres, or points with the falloff formulas of the light compilers.

use crate::material::luminance;
use glam::Vec3;

/// A light entity that can't be seen or hit: a sphere that emits evenly over its surface, or, with
/// [`PointLight::compiler`], what the light compilers make of it.
///
/// Renderers that find light only by hitting it (`naive`, `uniform`) do not see these lights; `nee`
/// and `mis` sample them and give the sample the weight 1. From inside the sphere it gives no light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointLight {
    /// Centre, world space.
    pub position: Vec3,
    /// Radius in world units, > 0. Of no meaning with [`PointLight::compiler`].
    pub radius: f32,
    /// Radiant intensity per RGB channel (power per solid angle in the unit of radiance times
    /// squared world units): the sphere's radiance is `intensity / (pi radius^2)`. With
    /// [`PointLight::compiler`] an irradiance, which may be negative. The brightness of the light's
    /// style is in it, unless the scene tells styles apart and lists this one (`Scene::styles`).
    pub intensity: Vec3,
    /// A cone that limits the light, or `None` for all directions.
    pub spot: Option<Spot>,
    /// Number of the light style whose brightness [`PointLight::intensity`] has; 0 is steady light.
    pub style: u16,
    /// The light compilers' formula instead of a sphere.
    pub compiler: Option<CompilerLight>,
}

impl Default for PointLight {
    /// A black sphere of radius 1 at the origin.
    fn default() -> Self {
        Self {
            position: Vec3::ZERO,
            radius: 1.0,
            intensity: Vec3::ZERO,
            spot: None,
            style: 0,
            compiler: None,
        }
    }
}

/// A light style that a film tells apart from the others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightStyle {
    /// Its number.
    pub number: u16,
    /// Its brightness at the moment of the picture.
    pub brightness: f32,
}

/// Most light styles that a film tells apart.
pub const MAX_STYLES: usize = 16;

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

/// How a light of the light compilers lights a surface: from a point, with an irradiance of
/// `intensity * falloff(distance) * ((1 - angle_scale) + angle_scale * cos)` where the cosine between
/// the surface's normal and the direction to the light is above 0, and none elsewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CompilerLight {
    /// What distance does.
    pub falloff: Falloff,
    /// Share of the cosine, 0 to 1.
    pub angle_scale: f32,
}

/// Distance at which the formulas of the compilers other than the linear one have their light's full
/// value, world units.
pub const COMPILER_SCALE: f32 = 128.0;

/// Surfaces are never nearer to a compiler's light than this, world units.
pub const COMPILER_NEAREST: f32 = 0.1;

/// The falloff formulas of the light compilers over the distance d, with K = [`COMPILER_SCALE`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Falloff {
    /// `max(0, 1 - d / reach)`.
    Linear {
        /// Distance at which nothing is left, > 0.
        reach: f32,
    },
    /// `K / (scale d)`.
    Inverse {
        /// Factor of the distance, > 0.
        scale: f32,
    },
    /// `(K / (scale d))^2`.
    InverseSquare {
        /// Factor of the distance, > 0.
        scale: f32,
    },
    /// `(K / (scale d + K))^2`.
    InverseSquareShifted {
        /// Factor of the distance, > 0.
        scale: f32,
    },
    /// The same at any distance.
    Constant,
    /// No light that adds up: where nothing is between, from whatever side, its style's light is at least
    /// this (`delay` 4). Only in scenes that have [`LightSums`].
    Least,
    /// A sun: parallel light along this unit vector, on surfaces that see a sky face in the
    /// direction it comes from.
    Sun(Vec3),
}

/// Irradiance of a lightmap value of 1, where 128 shows a texture as it is stored: a white surface
/// then has the radiance `v / 128`.
pub const IRRADIANCE_PER_VALUE: f32 = std::f32::consts::PI / 128.0;
/// The light compilers do not look for lightmap values up to this (`-gate`).
pub const COMPILER_GATE: f32 = 0.001;

/// How a level's compiler lights become one where not all of them simply add up: all are asked at every
/// point, and none is chosen by chance.
#[derive(Clone, Debug, PartialEq)]
pub struct LightSums {
    /// `_gamma` of the lightmaps: a value v of a style is stored as `255 (v / 255)^(1 / gamma)`.
    pub gamma: f32,
    /// One for each light style that has light, by number.
    pub styles: Vec<StyleSum>,
}

/// The light of one style: what adds up, then the most of that and of each least light, then what takes light
/// away; nothing below 0; then gamma.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StyleSum {
    /// Number of the style.
    pub style: u16,
    /// Brightness that is in the intensities of its lights; 1 if the film tells the style apart. Above 0.
    pub brightness: f32,
    /// Least irradiance of all surfaces, wherever they are (`_minlight`), with the brightness.
    pub least: Vec3,
    /// The first of its lights in the scene's list: those that add up, then those of
    /// [`Falloff::Least`], then those with a negative intensity.
    pub first: u32,
    /// Number of its lights.
    pub count: u32,
}

impl PointLight {
    /// Whether it takes light away, as compiler lights may.
    #[must_use]
    pub fn is_negative(&self) -> bool {
        self.intensity.element_sum() < 0.0
    }

    /// Weight among the emitters: the light's power divided by pi, as luminance. Lights whose
    /// strength does not fall with the squared distance count as the sphere that gives as much light
    /// halfway out, or at [`COMPILER_SCALE`].
    #[must_use]
    pub fn weight(&self) -> f32 {
        /// Squared distance at which light that does not fall off is compared.
        const CONSTANT: f32 = 64.0 * 64.0;
        let share = self.spot.map_or(1.0, |s| (1.0 - s.cos_outer) / 2.0);
        let Some(compiler) = self.compiler else {
            return 4.0 * luminance(self.intensity.to_array()) * share;
        };
        let squared = COMPILER_SCALE * COMPILER_SCALE;
        let sphere = match compiler.falloff {
            Falloff::Linear { reach } => reach * reach / 8.0,
            Falloff::Inverse { scale } => squared / scale,
            Falloff::InverseSquare { scale } => squared / (scale * scale),
            Falloff::InverseSquareShifted { scale } => squared / (4.0 * scale * scale),
            Falloff::Constant | Falloff::Sun(_) => CONSTANT,
            Falloff::Least => 0.0,
        };
        4.0 * luminance(self.intensity.abs().to_array()) * share * sphere
    }

    /// Whether its strength does not depend on the distance.
    #[must_use]
    pub fn is_everywhere(&self) -> bool {
        self.compiler
            .is_some_and(|c| matches!(c.falloff, Falloff::Constant | Falloff::Sun(_)))
    }
}
