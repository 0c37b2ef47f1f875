//! The sky of a level: its picture, and how bright that is.
//!
//! A dome of light and the picture of the sky are one radiance, or its light would come twice: the
//! picture is scaled so that its mean is the radiance that the level asks of the dome, each half of
//! the sky and each channel by itself. It is never darkened, and a picture too dark for that makes
//! way for a plain sky.

use super::names::NameKind;
use super::notes::Notes;
use super::picture::{self, Indexed, SKY_SIDE};
use super::surfaces::{FaceSurface, MaterialSet};
use crate::material::{Finish, Material, Surface, luminance};
use crate::sky::{Sky, SkyKind};
use glam::Vec3;

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
        }
        Some(first) if first != name => notes.add("second sky", || {
            format!("sky texture {name:?} shows the sky of {first:?}: a level has one sky")
        }),
        Some(_) => {}
    }
    let base = match set.sky.kind {
        SkyKind::Scrolling { back, .. } => back,
        SkyKind::Flat(_) | SkyKind::None => set.add_texture(picture::checkerboard(name)),
    };
    // Most sky faces are above: they are seen by its upper half, but the lower one may be brighter.
    let mean = mean_radiance(set);
    let radiance = set
        .sky
        .scale
        .map(|scale| luminance((scale * mean).to_array()));
    let material = Material {
        name: name.to_owned(),
        surface: Surface::Sky,
        base,
        emission: None,
        emission_scale: 0.0,
        emission_weight: radiance[0].max(radiance[1]),
        alpha_tested: false,
        two_sided: false,
        warped: false,
        finish: Finish::default(),
    };
    FaceSurface {
        kind: NameKind::Sky,
        material: set.add(material, false),
        scale: [1.0; 2],
        size: [SKY_SIDE; 2],
        translucent: false,
    }
}

/// Mean radiance of the sky's picture before it is scaled.
fn mean_radiance(set: &MaterialSet) -> Vec3 {
    match set.sky.kind {
        SkyKind::None => Vec3::ZERO,
        SkyKind::Flat(radiance) => radiance,
        SkyKind::Scrolling { back, front } => {
            let [back, front] = [back, front].map(|id| &set.textures[id.0 as usize]);
            picture::sky_mean(back, front)
        }
    }
}

/// The sky that `picture` shows.
fn sky(picture: Option<Indexed<'_>>, name: &str, set: &mut MaterialSet, notes: &mut Notes) -> Sky {
    let domes = set.domes;
    let Some(picture) = picture else {
        notes.add("sky missing", || {
            format!("sky texture {name:?} has no pixels: the sky has one plain colour")
        });
        return scaled(SkyKind::Flat(FLAT_SKY), FLAT_SKY, domes);
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
            suns: Vec::new(),
        };
    }
    let [back, front] = [back, front].map(|t| set.add_texture(t));
    scaled(SkyKind::Scrolling { back, front }, mean, domes)
}

/// A sky whose picture has this mean radiance, brightened to what is asked of its halves.
fn scaled(kind: SkyKind, mean: Vec3, domes: [Vec3; 2]) -> Sky {
    let scale = |dome: Vec3| {
        let mean = mean.max(Vec3::splat(f32::MIN_POSITIVE));
        (dome / mean).clamp(Vec3::splat(SKY_SCALE), Vec3::splat(MAX_SKY_SCALE))
    };
    Sky {
        kind,
        scale: domes.map(scale),
        suns: Vec::new(),
    }
}
