//! The pictures that a texture shows: its own, those that stand for it beside the level, and those
//! that the materials name. All of one size.

use super::names::NameKind;
use super::notes::Notes;
use super::picture::{self, Indexed};
use super::rules::Rule;
use super::{Files, ImportOptions, Lighting};
use crate::material::{Texture, srgb_to_linear};
use bsp::lmp::Palette;
use bsp::miptex::MipTex;
use bsp::picture::find;
use std::cell::Cell;
use std::rc::Rc;

/// Texels of a glow picture darker than this relative luminance do not emit: its black is seldom
/// quite black, and every texel that emits is a light.
pub const LEAST_GLOW: f32 = 0.01;
/// Alpha below which a texel of a replaced fence is a hole.
pub const HOLE: u8 = 128;

/// Texels that all pictures beside a level may have together: files of a few bytes can ask for many.
pub const MAX_TEXELS: u64 = 1 << 28;

/// Where pictures beside the level are.
#[derive(Clone)]
pub struct Beside<'a> {
    /// The files.
    pub files: &'a Files<'a>,
    /// Name of the level: a folder of its own is looked into first.
    pub map: &'a str,
    /// Texels that may still be read, of [`MAX_TEXELS`].
    pub room: Rc<Cell<u64>>,
}

/// What a texture shows; all pictures have the size of `base`.
pub struct Appearance {
    /// Colour, with holes.
    pub base: Texture,
    /// Emitted colour and the number of texels that emit.
    pub emission: Option<(Texture, usize)>,
    /// Normals.
    pub normals: Option<Texture>,
    /// Factors of the roughness.
    pub roughness: Option<Texture>,
    /// Path of the picture that stands for the base.
    pub replaced_by: Option<String>,
}

impl Beside<'_> {
    /// The picture with this path, without its ending, and where it was.
    pub fn picture(
        &self,
        stem: &str,
        options: &ImportOptions,
        notes: &mut Notes,
    ) -> Option<(String, Texture)> {
        let (path, picture) = find(stem, self.files, &options.limits)?;
        match picture {
            Ok(picture) => {
                let left = self.room.get().checked_sub(picture.texels.len() as u64);
                let Some(left) = left else {
                    notes.add("too many pictures", || {
                        format!(
                            "pictures in the place of textures have more than {MAX_TEXELS} texels: \
                             the rest, from {path} on, is not used"
                        )
                    });
                    return None;
                };
                self.room.set(left);
                let texture = Texture {
                    name: path.clone(),
                    width: picture.width,
                    height: picture.height,
                    rgba: picture.texels,
                };
                Some((path, texture))
            }
            Err(error) => {
                notes.add(&path, || format!("{error}: the picture is not used"));
                None
            }
        }
    }

    /// The picture that replaces a texture, or what `suffix` says of it.
    fn replacement(
        &self,
        name: &str,
        suffix: &str,
        options: &ImportOptions,
        notes: &mut Notes,
    ) -> Option<(String, Texture)> {
        if !options.replacements || options.lighting != Lighting::Physical {
            return None;
        }
        let name = name.to_ascii_lowercase().replace('*', "#");
        let map = self.map.to_ascii_lowercase();
        [
            format!("textures/{map}/{name}{suffix}"),
            format!("textures/{name}{suffix}"),
        ]
        .iter()
        .find_map(|stem| self.picture(stem, options, notes))
    }

    /// A picture that the materials name, by its path.
    fn named(&self, path: &str, options: &ImportOptions, notes: &mut Notes) -> Option<Texture> {
        let stem = path.rsplit_once('.').map_or(path, |(stem, _)| stem);
        let found = self.picture(stem, options, notes);
        if found.is_none() {
            notes.add(path, || {
                format!("the materials name a picture {path:?} that is not there")
            });
        }
        found.map(|(_, texture)| texture)
    }
}

/// What `shown` shows; `None` if it has no pixels and nothing stands for it.
pub fn of(
    shown: &MipTex,
    palette: &Palette,
    kind: NameKind,
    rule: &Rule,
    beside: &Beside<'_>,
    options: &ImportOptions,
    notes: &mut Notes,
) -> Option<Appearance> {
    let threshold = rule.threshold.unwrap_or(options.threshold);
    let own = shown
        .has_pixels()
        .then(|| Indexed::new(shown, palette, kind == NameKind::Fence));
    let replaced = beside.replacement(&shown.name, "", options, notes);
    let replaced_by = replaced.as_ref().map(|(path, _)| path.clone());
    let mut base = match (replaced, own.as_ref().map(Indexed::base)) {
        (Some((_, picture)), own) => with_holes(picture, kind, own.as_ref()),
        (None, own) => own?,
    };
    let glow = ["_luma", "_glow"]
        .iter()
        .find_map(|suffix| beside.replacement(&shown.name, suffix, options, notes))
        .map(|(_, picture)| picture);
    let mut normals = match &rule.normal_image {
        Some(path) => beside.named(path, options, notes),
        None => (beside.replacement(&shown.name, "_norm", options, notes)).map(|(_, p)| p),
    };
    let mut roughness =
        (rule.roughness_image.as_ref()).and_then(|path| beside.named(path, options, notes));
    let mut emission = match glow {
        Some(glow) => Some(bright_part(&glow, LEAST_GLOW)),
        None => own
            .and_then(|own| own.emission(threshold))
            .map(|(picture, _)| picture),
    };
    if emission.is_none() && rule.emission.is_some() {
        emission = Some(bright_part(&base, threshold));
    }

    // The largest picture says how fine all are.
    let largest = [
        Some(&base),
        emission.as_ref(),
        normals.as_ref(),
        roughness.as_ref(),
    ];
    let (w, h) = (largest.into_iter().flatten())
        .map(|t| (t.width, t.height))
        .max_by_key(|&(w, h)| u64::from(w) * u64::from(h))
        .unwrap_or((base.width, base.height));
    let pictures = [emission.as_mut(), normals.as_mut(), roughness.as_mut()];
    for picture in pictures.into_iter().flatten().chain([&mut base]) {
        resize(picture, w, h);
    }
    if let (Some(picture), Some(colour)) = (&mut emission, rule.emission_color) {
        tint(picture, colour);
    }
    Some(Appearance {
        emission: emission.and_then(|picture| only_light(picture, &base)),
        base,
        normals,
        roughness,
        replaced_by,
    })
}

/// The picture of a replaced texture: only fences have holes, by its own alpha or, where it has none,
/// by that of the texture it replaces.
fn with_holes(mut picture: Texture, kind: NameKind, own: Option<&Texture>) -> Texture {
    let is_fence = kind == NameKind::Fence;
    let has_alpha = picture.rgba.iter().any(|t| t[3] < HOLE);
    let (w, h) = (picture.width, picture.height);
    for (i, texel) in picture.rgba.iter_mut().enumerate() {
        let is_hole = match own {
            Some(own) if !has_alpha => texel_at(own, i, w, h)[3] == 0,
            _ => texel[3] < HOLE,
        };
        texel[3] = if is_fence && is_hole { 0 } else { 255 };
    }
    if is_fence {
        picture::dilate(&mut picture);
    }
    picture
}

/// The texel of a picture where another of `w` by `h` texels has its texel `i`.
fn texel_at(picture: &Texture, i: usize, w: u32, h: u32) -> [u8; 4] {
    let scaled = |at: u64, from: u32, to: u32| (at * u64::from(to) / u64::from(from)) as usize;
    let (x, y) = (i as u64 % u64::from(w), i as u64 / u64::from(w));
    let (x, y) = (scaled(x, w, picture.width), scaled(y, h, picture.height));
    picture.rgba[y * picture.width as usize + x]
}

/// Resamples to the nearest texel.
pub fn resize(picture: &mut Texture, w: u32, h: u32) {
    if (picture.width, picture.height) != (w, h) {
        let count = w as usize * h as usize;
        picture.rgba = (0..count).map(|i| texel_at(picture, i, w, h)).collect();
        (picture.width, picture.height) = (w, h);
    }
}

/// Multiplies linear colours.
pub fn tint(picture: &mut Texture, colour: [f32; 3]) {
    let tables = colour.map(|factor| {
        let of = |byte: u8| linear_to_srgb(srgb_to_linear(byte) * f64::from(factor));
        (0..=255).map(of).collect::<Vec<u8>>()
    });
    for texel in &mut picture.rgba {
        for (channel, table) in texel.iter_mut().zip(&tables) {
            *channel = table[usize::from(*channel)];
        }
    }
}

/// Encodes a linear value in 0..=1 (IEC 61966-2-1).
fn linear_to_srgb(linear: f64) -> u8 {
    let encoded = if linear <= 0.003_130_8 {
        linear * 12.92
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    };
    (encoded * 255.0).round().clamp(0.0, 255.0) as u8
}

/// The texels of at least this relative luminance; the rest is black.
pub fn bright_part(base: &Texture, threshold: f32) -> Texture {
    let mut picture = base.clone();
    for texel in &mut picture.rgba {
        let [r, g, b, _] = *texel;
        if picture::luminance_of([r, g, b]) < threshold {
            *texel = [0, 0, 0, 255];
        }
    }
    picture
}

/// An emission picture without the holes of the base; with the number of texels that are not black, if
/// there are any.
pub fn only_light(mut picture: Texture, base: &Texture) -> Option<(Texture, usize)> {
    let mut count = 0;
    for (texel, under) in picture.rgba.iter_mut().zip(&base.rgba) {
        let [r, g, b, _] = *texel;
        if under[3] == 0 {
            *texel = [0, 0, 0, 255];
        } else {
            texel[3] = 255;
            count += usize::from([r, g, b] != [0; 3]);
        }
    }
    picture.name = format!("{} emission", base.name);
    (count > 0).then_some((picture, count))
}
