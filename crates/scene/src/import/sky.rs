//! The sky of a level: its picture, and how bright that is.
//!
//! A dome of light and the picture of the sky are one radiance, or its light would come twice: the
//! picture is scaled so that its mean is the radiance that the level asks of the dome, each half of
//! the sky and each channel by itself. It is never darkened, and a picture too dark for that makes
//! way for a plain sky.

use super::Files;
use super::names::NameKind;
use super::notes::Notes;
use super::picture::{self, Indexed, SKY_SIDE};
use super::surfaces::{FaceSurface, MaterialSet};
use crate::material::{Material, Surface, Texture, TextureId, luminance, srgb_to_linear};
use crate::sky::{BOX_SIDES, Sky, SkyKind, box_texel, box_uv};
use bsp::Limits;
use bsp::picture::Rgba;
use glam::{DVec3, Vec3};

/// Least factor of a sky's picture: the sky shows as bright as in Quake.
pub const SKY_SCALE: f32 = 1.0;
/// Sky where the level has no picture of one: a clouded evening, linear RGB.
pub const FLAT_SKY: Vec3 = Vec3::new(0.10, 0.11, 0.14);
/// A picture of the sky is brightened this much at most: a night sky stays a night sky, whatever
/// the level asks for.
pub const MAX_SKY_SCALE: f32 = 32.0;
/// A picture that would have to be brightened this much is black, and makes way for plain light of
/// the radiance asked for: the level would have no light at all.
pub const BLACK_SKY_SCALE: f32 = 1000.0;

/// Endings of the names of a skybox's pictures, two letters each, in the order of [`BOX_SIDES`].
const BOX_ENDINGS: &str = "rtbklfftupdn";
/// Most texels along a side of a skybox's picture.
const MAX_BOX_SIDE: u32 = 4096;

/// The surface of a sky texture called `name`. The first one that is drawn decides what the sky is.
pub fn surface(
    picture: Option<Indexed<'_>>,
    name: &str,
    set: &mut MaterialSet,
    notes: &mut Notes,
) -> FaceSurface {
    match &set.sky_name {
        None => {
            set.sky_name = Some(name.to_owned());
            set.sky = sky(picture, name, set, notes);
            set.clear_sky.scale = set.sky.scale;
            set.clear_sky.mean = mean_radiance(set);
            [set.sky.scale, set.sky.veil] = set.clear_sky.in_fog(set.fog);
        }
        Some(first) if first != name => notes.add("second sky", || {
            format!("sky texture {name:?} shows the sky of {first:?}: a level has one sky")
        }),
        Some(_) => {}
    }
    let base = match set.sky.kind {
        SkyKind::Scrolling { back, .. } => back,
        SkyKind::Box(first) => first,
        SkyKind::Flat(_) | SkyKind::None => set.add_texture(picture::checkerboard(name)),
    };
    // Most sky faces are above: they are seen by its upper half, but the lower one may be brighter.
    let mean = mean_radiance(set);
    let [upper, lower] = [0, 1].map(|half| set.sky.scale[half] * mean[half] + set.sky.veil[half]);
    let material = Material {
        surface: Surface::Sky,
        emission_weight: luminance(upper.to_array()).max(luminance(lower.to_array())),
        ..Material::new(name, base)
    };
    FaceSurface {
        kind: NameKind::Sky,
        material: set.add(material, false),
        scale: [1.0; 2],
        size: [SKY_SIDE; 2],
        translucent: false,
    }
}

/// Mean radiance of the two halves of the sky's picture before it is scaled.
fn mean_radiance(set: &MaterialSet) -> [Vec3; 2] {
    match set.sky.kind {
        SkyKind::None => [Vec3::ZERO; 2],
        SkyKind::Flat(radiance) => [radiance; 2],
        SkyKind::Scrolling { back, front } => {
            let [back, front] = [back, front].map(|id| &set.textures[id.0 as usize]);
            [picture::sky_mean(back, front); 2]
        }
        SkyKind::Box(first) => box_mean(&set.textures[first.0 as usize..][..BOX_SIDES]),
    }
}

/// Mean radiance of the upper and the lower half of a skybox, weighted by the cosine with the
/// vertical: what lights the ground, and a ceiling.
fn box_mean(sides: &[Texture]) -> [Vec3; 2] {
    /// Directions along each axis of a side; pictures are finer, but not in their means.
    const STEPS: i32 = 64;
    let table: Vec<f64> = (0..=255).map(srgb_to_linear).collect();
    let mut sums = [(DVec3::ZERO, 0.0); 2];
    let axes = [
        DVec3::X,
        DVec3::Y,
        DVec3::NEG_X,
        DVec3::NEG_Y,
        DVec3::Z,
        DVec3::NEG_Z,
    ];
    for axis in axes {
        let (s, t) = axis.any_orthonormal_pair();
        for i in 0..STEPS * STEPS {
            let at = |k: i32| (2.0 * f64::from(k) + 1.0) / f64::from(STEPS) - 1.0;
            let toward = axis + s * at(i % STEPS) + t * at(i / STEPS);
            let (side, uv) = box_uv(toward.to_array());
            let [r, g, b, _] = sides[side].rgba[box_texel(&sides[side], uv)];
            let color = DVec3::from([r, g, b].map(|c| table[usize::from(c)]));
            // A part of a side is seen under a solid angle that falls with the cubed distance.
            let weight = toward.z.abs() / toward.length_squared().powi(2);
            let (sum, weights) = &mut sums[usize::from(toward.z < 0.0)];
            *sum += color * weight;
            *weights += weight;
        }
    }
    sums.map(|(sum, weights)| (sum / weights).as_vec3())
}

/// The pictures of the skybox `name`, `None` if there is none of them. A missing side is black.
pub fn skybox(
    name: &str,
    files: &Files<'_>,
    limits: &Limits,
    notes: &mut Notes,
) -> Option<Vec<Texture>> {
    let limits = Limits {
        max_texture_side: limits.max_texture_side.min(MAX_BOX_SIDE),
        ..limits.clone()
    };
    let mut missing = Vec::new();
    let sides: Vec<Option<Texture>> = (0..BOX_SIDES)
        .map(|i| {
            let side = &BOX_ENDINGS[2 * i..2 * i + 2];
            let stem = format!("gfx/env/{name}{side}");
            let Some((path, found)) = bsp::picture::find(&stem, files, &limits) else {
                missing.push(side);
                return None;
            };
            let found = found.map_err(|error| {
                notes.add(&path, || format!("the skybox has a black side: {error}"));
            });
            let picture = found.unwrap_or_else(|()| black());
            Some(Texture {
                name: path,
                width: picture.width,
                height: picture.height,
                rgba: picture.texels,
            })
        })
        .collect();
    if sides.iter().all(Option::is_none) {
        notes.add("skybox", || {
            format!(
                "there is no picture of the skybox {name:?} (gfx/env/{name}up.tga and so on): the \
                 sky of the level's texture is shown"
            )
        });
        return None;
    }
    if !missing.is_empty() {
        notes.add("skybox", || {
            let missing = missing.join(", ");
            format!("the skybox {name:?} lacks sides, which are black: {missing}")
        });
    }
    let black_side = || {
        let Rgba {
            width,
            height,
            texels,
        } = black();
        Texture {
            name: format!("{name} (missing side)"),
            width,
            height,
            rgba: texels,
        }
    };
    Some(
        (sides.into_iter())
            .map(|s| s.unwrap_or_else(black_side))
            .collect(),
    )
}

/// A side of one black texel.
fn black() -> Rgba {
    Rgba {
        width: 1,
        height: 1,
        texels: vec![[0, 0, 0, 255]],
    }
}

/// The sky that `picture` shows.
fn sky(picture: Option<Indexed<'_>>, name: &str, set: &mut MaterialSet, notes: &mut Notes) -> Sky {
    let domes = set.domes;
    if let Some(sides) = set.skybox.take() {
        let mean = box_mean(&sides);
        let first = TextureId(set.textures.len() as u32);
        set.textures.extend(sides);
        return scaled(SkyKind::Box(first), mean, domes);
    }
    let Some(picture) = picture else {
        notes.add("sky missing", || {
            format!("sky texture {name:?} has no pixels: the sky has one plain colour")
        });
        return scaled(SkyKind::Flat(FLAT_SKY), [FLAT_SKY; 2], domes);
    };
    let (w, h) = (picture.miptex.width, picture.miptex.height);
    if (w, h) != (2 * SKY_SIDE, SKY_SIDE) {
        notes.add("sky size", || {
            format!(
                "sky texture {name:?} is {w}x{h} instead of 256x128: it is split in the middle and \
                 resampled"
            )
        });
    }
    let [back, front] = picture.sky_layers();
    let mean = picture::sky_mean(&back, &front);
    let brightest = domes[0].max(domes[1]);
    if luminance(mean.to_array()) * BLACK_SKY_SCALE < luminance(brightest.to_array()) {
        notes.add("dark sky", || {
            format!(
                "the level asks for light from a sky whose picture {name:?} is black: the sky has \
                 one plain colour"
            )
        });
        return Sky {
            kind: SkyKind::Flat(Vec3::ONE),
            scale: domes,
            ..Sky::default()
        };
    }
    let [back, front] = [back, front].map(|t| set.add_texture(t));
    scaled(SkyKind::Scrolling { back, front }, [mean; 2], domes)
}

/// A sky whose picture's halves have this mean radiance, brightened to what is asked of them.
fn scaled(kind: SkyKind, mean: [Vec3; 2], domes: [Vec3; 2]) -> Sky {
    let scale = |half: usize| {
        let (dome, mean) = (domes[half], mean[half]);
        let mean = mean.max(Vec3::splat(f32::MIN_POSITIVE));
        (dome / mean).clamp(Vec3::splat(SKY_SCALE), Vec3::splat(MAX_SKY_SCALE))
    };
    Sky {
        kind,
        scale: [scale(0), scale(1)],
        ..Sky::default()
    }
}
