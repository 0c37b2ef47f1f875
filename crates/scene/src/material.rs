//! Materials and textures.

use crate::gloss::Gloss;
use glam::Vec3;

/// Index into `Scene::materials`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MaterialId(pub u32);

/// Index into `Scene::textures`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TextureId(pub u32);

/// Largest albedo a renderer uses: texels are clamped to it, so that a path in a closed white room
/// loses energy and ends.
pub const MAX_ALBEDO: f32 = 0.99;

/// An 8-bit picture, read with nearest sampling and wrapping.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Texture {
    /// For people and debug names.
    pub name: String,
    /// Texels across.
    pub width: u32,
    /// Texels down.
    pub height: u32,
    /// `width * height` texels, rows from the top: sRGB-encoded red, green, blue, and alpha
    /// (255 there, 0 a hole).
    pub rgba: Vec<[u8; 4]>,
}

/// How a surface treats light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Surface {
    /// A Lambertian reflector on both sides.
    #[default]
    Diffuse,
    /// Shows the sky in the ray's direction and ends the path. Ignores the textures.
    Sky,
}

/// What a surface looks like.
///
/// Radiance emitted to the front (or to both sides if [`Material::two_sided`]) is the decoded
/// emission texel times [`Material::emission_scale`]; albedo is the decoded base texel, at most
/// [`MAX_ALBEDO`].
#[derive(Clone, Debug)]
pub struct Material {
    /// The texture's name in the level.
    pub name: String,
    /// Diffuse, or sky.
    pub surface: Surface,
    /// Base colour; its alpha decides the alpha test.
    pub base: TextureId,
    /// Emitted colour, of the same size as the base; black texels do not emit.
    pub emission: Option<TextureId>,
    /// Radiance of a white emission texel.
    pub emission_scale: f32,
    /// Mean luminance of its emitted radiance, both sides together; 0 if it is no light to choose.
    pub emission_weight: f32,
    /// Texels with alpha 0 are holes.
    pub alpha_tested: bool,
    /// Emits to both sides (liquid surfaces, which are one interface with two faces).
    pub two_sided: bool,
    /// The texture is warped like a liquid's; see [`warp`].
    pub warped: bool,
    /// Least irradiance of its surfaces in steady light, in scenes with [`crate::LightSums`], instead of that of
    /// all surfaces; black if it has none of its own.
    pub least_light: Vec3,
    /// What it is besides an opaque Lambertian reflector.
    pub finish: Finish,
    /// Materials that it shows in turn in frames, for a fifth of a second each from the level's beginning
    /// on; empty if it shows itself. They differ in their pictures alone, which have one size, and
    /// their [`Material::emission_weight`] is the mean of all.
    pub frames: Vec<MaterialId>,
}

impl Material {
    /// An opaque Lambertian reflector that shows `base` and emits nothing.
    #[must_use]
    pub fn new(name: impl Into<String>, base: TextureId) -> Self {
        Self {
            name: name.into(),
            surface: Surface::Diffuse,
            base,
            emission: None,
            emission_scale: 0.0,
            emission_weight: 0.0,
            alpha_tested: false,
            two_sided: false,
            warped: false,
            least_light: Vec3::ZERO,
            finish: Finish::default(),
            frames: Vec::new(),
        }
    }

    /// Whether light passes through it somewhere, so that shadow rays must ask.
    #[must_use]
    pub fn is_see_through(&self) -> bool {
        self.alpha_tested || self.finish.alpha < 1.0
    }
}

/// What a surface is besides an opaque Lambertian reflector; the default is nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finish {
    /// Share of the surface, everywhere on it, that is painted with the textures and opaque, 0 to 1.
    /// The rest is a smooth interface, which reflects by Fresnel's equations and else lets light pass
    /// straight on.
    pub alpha: f32,
    /// Index of refraction of the interface, at least 1; at 1 it reflects nothing.
    pub ior: f32,
    /// What of the light that passes the interface is left, per channel, 0 to 1.
    pub tint: Vec3,
    /// Absorption of what is behind the front of the interface, per channel and world unit.
    pub absorption: Vec3,
    /// Gloss of the painted part; without it that is Lambertian.
    pub gloss: Option<Gloss>,
    /// Normals of the painted part, of the base texture's size: bytes `128 + 127 x` of the components
    /// along `u`, against `v`, and along the face's normal.
    pub normals: Option<TextureId>,
}

impl Default for Finish {
    fn default() -> Self {
        Self {
            alpha: 1.0,
            ior: 1.0,
            tint: Vec3::ONE,
            absorption: Vec3::ZERO,
            gloss: None,
            normals: None,
        }
    }
}

/// Luminance of linear RGB with sRGB primaries (ITU-R BT.709).
#[must_use]
pub fn luminance(rgb: [f32; 3]) -> f32 {
    0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]
}

/// Decodes one sRGB-encoded byte to a linear value in 0..=1 (IEC 61966-2-1).
#[must_use]
pub fn srgb_to_linear(encoded: u8) -> f64 {
    decode_srgb(f64::from(encoded) / 255.0)
}

/// Decodes an sRGB-encoded value in 0..=1 to a linear one.
#[must_use]
pub fn decode_srgb(c: f64) -> f64 {
    if c <= 0.04045 {
        c / 12.92
    } else {
        ((c + 0.055) / 1.055).powf(2.4)
    }
}

/// Units that one tile of a warped texture covers, whatever its size in texels.
pub const WARP_TILE: f64 = 64.0;

/// Liquid warp at `time` (seconds): `u + 8 sin(2 pi v / 128 + time)`, likewise `v` (software
/// Quake's turbulence).
///
/// Texture coordinates of warped materials are in world units instead of texels: the texel is
/// `warp(uv) / WARP_TILE` times the texture's size.
#[must_use]
pub fn warp(uv: [f64; 2], time: f64) -> [f64; 2] {
    let k = std::f64::consts::TAU / 128.0;
    [
        uv[0] + 8.0 * (uv[1] * k + time).sin(),
        uv[1] + 8.0 * (uv[0] * k + time).sin(),
    ]
}
