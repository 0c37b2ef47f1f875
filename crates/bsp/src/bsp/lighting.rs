//! Lightmaps: where a face's samples are, how they lie on it, and what they are worth.
//!
//! Light values are in the unit in which 1 shows a texture as it is stored; a byte sample v is
//! v / 128.

use super::{Bsp, Face};
use crate::error::{Limits, WarningKind, Warnings};
use crate::reader::Reader;

/// Quake's luxels are this wide, in texels of the unscaled texture axes.
pub const LUXEL: f64 = 16.0;

const LIT_HEADER: usize = 8;
const LIT_RGB: i32 = 1;
const LIT_E5BGR9: i32 = 0x0001_0001;
/// What `light -lit2` of ericw-tools writes for FTE: a 16-byte header with the number of faces, then for each
/// face 17 bytes with offset, styles, size and scale of its samples.
const LIT_OF_OWN_SCALE: i32 = 2;

/// The samples that light a level.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LightSamples {
    /// The lighting lump, one byte for each sample.
    Lump,
    /// The lighting lump, red, green and blue for each sample: a Half-Life level under version 29.
    LumpRgb,
    /// Red, green and blue bytes for each sample, from `.lit` or `RGBLIGHTING`.
    Rgb(Vec<u8>),
    /// `E5BGR9` words for each sample, from `.lit` or `LIGHTING_E5BGR9`.
    E5Bgr9(Vec<u8>),
}

impl LightSamples {
    /// The value of a sample; black beyond the end.
    pub fn value(&self, bsp: &Bsp, index: usize) -> [f32; 3] {
        let rgb = |data: &[u8]| {
            let sample = Reader::at(data, index.saturating_mul(3)).and_then(|mut r| r.array::<3>());
            sample
                .unwrap_or_default()
                .map(|v| f32::from(v) * (1.0 / 128.0))
        };
        match self {
            Self::Lump => {
                let v = bsp.lighting.get(index).copied().unwrap_or(0);
                [f32::from(v) * (1.0 / 128.0); 3]
            }
            Self::LumpRgb => rgb(&bsp.lighting),
            Self::Rgb(data) => rgb(data),
            Self::E5Bgr9(data) => {
                let word = Reader::at(data, index.saturating_mul(4)).and_then(|mut r| r.u32());
                e5bgr9(word.unwrap_or(0))
            }
        }
    }

    /// Reads a `.lit` file for a level of `samples` lightmap samples.
    ///
    /// # Errors
    /// Why it does not fit the level, as words.
    pub fn from_lit(file: &[u8], samples: usize) -> Result<Self, String> {
        let mut r = Reader::new(file);
        if r.array::<4>() != Some(*b"QLIT") {
            return Err("it does not begin with QLIT".to_owned());
        }
        let version = r.i32().ok_or("it ends inside of its header")?;
        let size = match version {
            LIT_RGB => 3,
            LIT_E5BGR9 => 4,
            LIT_OF_OWN_SCALE => {
                return Err(format!(
                    "it has version {version}, whose samples have a scale of their own on every face (light -lit2), \
                     and which is not read; known are {LIT_RGB} and {LIT_E5BGR9}"
                ));
            }
            _ => {
                return Err(format!(
                    "it has version {version}, known are 1 and {LIT_E5BGR9}"
                ));
            }
        };
        let body = file.get(LIT_HEADER..).unwrap_or_default();
        if Some(body.len()) != samples.checked_mul(size) {
            return Err(format!(
                "it has {} bytes of samples where {samples} samples of {size} bytes are due",
                body.len()
            ));
        }
        Ok(if version == LIT_RGB {
            Self::Rgb(body.to_vec())
        } else {
            Self::E5Bgr9(body.to_vec())
        })
    }
}

/// Decodes a sample of 9-bit mantissas and a common exponent, red in the lowest bits: 1 shows a
/// texture as it is stored.
pub fn e5bgr9(word: u32) -> [f32; 3] {
    let exponent = (word >> 27) as i32 - 24;
    let scale = 2.0_f32.powi(exponent);
    [word, word >> 9, word >> 18].map(|m| (m & 0x1ff) as f32 * scale)
}

/// The grid of luxels that covers a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Extents {
    /// Texture coordinates of luxel (0, 0), in luxels.
    pub min: [i32; 2],
    /// Luxels across and down.
    pub size: [u32; 2],
}

impl Extents {
    /// The grid over texture coordinates, in texels. Compilers and engines agree on it only if each
    /// coordinate is rounded to f32 before it is compared.
    fn over(st: impl Iterator<Item = [f64; 2]>, luxel: f64, limits: &Limits) -> Option<Self> {
        let mut low = [f32::INFINITY; 2];
        let mut high = [f32::NEG_INFINITY; 2];
        for point in st {
            let point = point.map(|c| c as f32);
            if !point.iter().all(|c| c.is_finite()) {
                return None;
            }
            for ((low, high), c) in low.iter_mut().zip(&mut high).zip(point) {
                *low = low.min(c);
                *high = high.max(c);
            }
        }
        let mut out = Self {
            min: [0; 2],
            size: [0; 2],
        };
        let axes = out.min.iter_mut().zip(&mut out.size);
        for ((min, size), (low, high)) in axes.zip(low.into_iter().zip(high)) {
            let first = (f64::from(low) / luxel).floor();
            let last = (f64::from(high) / luxel).ceil();
            let count = last - first + 1.0;
            let fits = first.abs() < 1.0e9 && count <= f64::from(limits.max_luxels_per_axis);
            if !fits || count.is_nan() {
                return None;
            }
            *min = first as i32;
            *size = count as u32;
        }
        Some(out)
    }
}

/// Where a face's samples are and how they lie on it.
#[derive(Clone, Debug, PartialEq)]
pub struct Lightmap {
    /// Luxels across.
    pub width: u32,
    /// Luxels down.
    pub height: u32,
    /// Index of the first sample; that of slot j, luxel (x, y) is
    /// `offset + (j * height + y) * width + x`.
    pub offset: usize,
    /// Light style of each slot; never empty.
    pub styles: Vec<u16>,
    /// Luxel coordinates of a point: `dot(p, axis.xyz) + axis.w`; whole numbers are sample centres,
    /// between them the light is bilinear.
    pub axes: [[f64; 4]; 2],
}

impl Lightmap {
    /// Index of the sample of `slot` at luxel (x, y).
    pub fn sample(&self, slot: usize, x: u32, y: u32) -> usize {
        let (w, h) = (self.width as usize, self.height as usize);
        self.offset + (slot * h + y as usize) * w + x as usize
    }

    /// Number of samples of all slots.
    pub fn len(&self) -> usize {
        self.styles.len() * self.width as usize * self.height as usize
    }

    /// Whether there is no sample, which does not happen.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// How a face is lit by the compiler.
#[derive(Clone, Debug, PartialEq)]
pub enum FaceLight {
    /// Not at all: it shows its texture as stored (sky, unlit liquids, levels without lighting).
    Fullbright,
    /// No light reaches it, or its samples are not there.
    Black,
    /// By samples.
    Lightmap(Lightmap),
}

impl Bsp {
    /// The luxel grid of a face under Quake's rule, `luxel` texels wide each (16 unless `LMSHIFT`
    /// says otherwise). `None` if coordinates are unusable or the grid is above
    /// [`Limits::max_luxels_per_axis`].
    pub fn extents(&self, face: &Face, luxel: f64, limits: &Limits) -> Option<Extents> {
        let texinfo = self.face_texinfo(face)?;
        let points = self.face_points(face)?;
        Extents::over(points.map(|p| texinfo.st(p)), luxel, limits)
    }

    /// Samples that the level has, whatever their kind.
    pub fn light_sample_count(&self) -> usize {
        if self.rgb_lighting {
            self.lighting.len() / 3
        } else {
            self.lighting.len()
        }
    }

    /// How face `index` is lit by the compiler. Sample indices are proven to be in range.
    pub fn face_light(&self, index: usize, limits: &Limits) -> FaceLight {
        let Some(face) = self.faces.get(index) else {
            return FaceLight::Black;
        };
        match self.lightmap(index, face, limits) {
            Ok(light) => light,
            Err(_) => FaceLight::Black,
        }
    }

    fn lightmap(
        &self,
        index: usize,
        face: &Face,
        limits: &Limits,
    ) -> Result<FaceLight, &'static str> {
        let special = self
            .face_texinfo(face)
            .is_none_or(super::Texinfo::is_special);
        if special || self.lighting.is_empty() {
            return Ok(FaceLight::Fullbright);
        }
        let stored = || {
            let styles = face.styles.iter().take_while(|&&s| s != u8::MAX);
            styles.map(|&s| s.into()).collect()
        };
        let with_shift = self.bspx.get("LMSHIFT").is_some();
        // LMSTYLE belongs to LMSHIFT, LMSTYLE16 stands alone as well.
        let override_styles = with_shift || self.bspx.get("LMSTYLE16").is_some();
        let styles: Vec<u16> = override_styles
            .then(|| self.bspx.lm_styles(index, self.faces.len()))
            .flatten()
            .unwrap_or_else(stored);
        let (offset, size, axes);
        if let Some(own) = self.bspx.decoupled(index) {
            offset = own.offset;
            size = [own.width.into(), own.height.into()];
            axes = own.axes.map(|axis| axis.map(f64::from));
        } else {
            let luxel = match self.bspx.lm_shift(index) {
                Some(shift) if shift < 16 => f64::from(1_u32 << shift),
                _ => LUXEL,
            };
            offset = self
                .bspx
                .lm_offset(index)
                .filter(|_| with_shift)
                .unwrap_or(face.light_offset);
            if offset == -1 {
                return Ok(FaceLight::Black);
            }
            let (Some(texinfo), Some(extents)) =
                (self.face_texinfo(face), self.extents(face, luxel, limits))
            else {
                return Err("has a lightmap of impossible size");
            };
            size = extents.size;
            let axis = |[x, y, z, w]: [f32; 4], min: i32| {
                let [x, y, z, w] = [x, y, z, w].map(|c| f64::from(c) / luxel);
                [x, y, z, w - f64::from(min)]
            };
            axes = [
                axis(texinfo.s, extents.min[0]),
                axis(texinfo.t, extents.min[1]),
            ];
        }
        if offset == -1 || styles.is_empty() {
            return Ok(FaceLight::Black);
        }
        let [width, height] = size;
        let too_large = width.max(height) > limits.max_luxels_per_axis;
        if too_large || width == 0 || height == 0 {
            return Err("has a lightmap of impossible size");
        }
        // Half-Life counts in bytes.
        let unit = if self.rgb_lighting { 3 } else { 1 };
        let first = usize::try_from(offset).map_err(|_| "has a negative light offset")? / unit;
        let map = Lightmap {
            width,
            height,
            offset: first,
            styles,
            axes,
        };
        let end = first.checked_add(map.len());
        if end.is_none_or(|end| end > self.light_sample_count()) {
            return Err("has lightmap samples past the end of the lump");
        }
        Ok(FaceLight::Lightmap(map))
    }

    /// The samples that come with the level itself: a `BSPX` lump, or the lighting lump.
    pub fn own_light_samples(&self) -> LightSamples {
        if self.rgb_lighting {
            return LightSamples::LumpRgb;
        }
        if let Some(data) = self.bspx.get("LIGHTING_E5BGR9") {
            return LightSamples::E5Bgr9(data.to_vec());
        }
        if let Some(data) = self.bspx.get("RGBLIGHTING") {
            return LightSamples::Rgb(data.to_vec());
        }
        LightSamples::Lump
    }

    /// Finds out whether the lump holds colour, and warns of lightmaps that are not whole.
    pub(super) fn check_lighting(&mut self, limits: &Limits, warnings: &mut Warnings) {
        self.rgb_lighting = self.looks_like_half_life(limits);
        if self.rgb_lighting {
            warnings.add(WarningKind::Mislabelled, "half-life", || {
                "the level has version 29 but lighting of Half-Life (hull 3 is used, all light \
                 offsets are multiples of 3 and leave room for three bytes a sample): its \
                 lightmaps are read as RGB"
                    .to_owned()
            });
        }
        for (index, face) in self.faces.iter().enumerate() {
            if !face.is_valid() {
                continue;
            }
            if let Err(why) = self.lightmap(index, face, limits) {
                warnings.add(WarningKind::Lightmap, why, || {
                    format!("face {index} {why}: it counts as black")
                });
            }
        }
    }

    /// FTE's rule for Half-Life levels under version 29: hull 3 is used, all light offsets are
    /// multiples of 3, and the gaps between them fit samples of three bytes.
    fn looks_like_half_life(&self, limits: &Limits) -> bool {
        let hull3 = self.models.first().is_some_and(|m| m.head_nodes[3] != 0);
        if !hull3 || self.format != super::Format::Bsp29 {
            return false;
        }
        let lit = |f: &&Face| f.is_valid() && f.light_offset >= 0;
        let mut offsets: Vec<(i32, &Face)> = self
            .faces
            .iter()
            .filter(lit)
            .map(|f| (f.light_offset, f))
            .collect();
        if offsets.len() < 4 || offsets.iter().any(|(o, _)| o % 3 != 0) {
            return false;
        }
        offsets.sort_unstable_by_key(|(o, _)| *o);
        let end = i32::try_from(self.lighting.len()).unwrap_or(i32::MAX);
        let next = offsets.iter().skip(1).map(|(o, _)| *o).chain([end]);
        offsets.iter().zip(next).all(|((offset, face), next)| {
            let slots = face.styles.iter().take_while(|&&s| s != u8::MAX).count() as u64;
            let size = self.extents(face, LUXEL, limits).map_or([0; 2], |e| e.size);
            let bytes = u64::from(size[0]) * u64::from(size[1]) * slots * 3;
            let gap = i64::from(next) - i64::from(*offset);
            // Faces may share samples.
            gap == 0 || u64::try_from(gap).is_ok_and(|gap| gap >= bytes)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extents_follow_the_rounding_rule() {
        let over =
            |points: &[[f64; 2]]| Extents::over(points.iter().copied(), LUXEL, &Limits::default());
        let e = over(&[[-8.0, 0.0], [40.0, 16.0]]).unwrap();
        assert_eq!((e.min, e.size), ([-1, 0], [5, 2]));
        // In f64 this would reach into the next luxel, rounded to f32 it does not.
        let e = over(&[[0.0, 0.0], [16.000_000_1, 16.0]]).unwrap();
        assert_eq!(e.size, [2, 2]);
        assert_eq!(over(&[[0.0, f64::NAN]]), None);
        assert_eq!(over(&[[0.0, 0.0], [16.0 * 9000.0, 0.0]]), None);
    }

    #[test]
    fn e5bgr9_one_is_one() {
        assert_eq!(e5bgr9(0x8402_0100), [1.0; 3]);
        assert_eq!(e5bgr9(0x8402_0100 & !0x1ff), [0.0, 1.0, 1.0]);
    }
}
