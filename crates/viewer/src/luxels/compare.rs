//! Traced light against a level's lightmaps, luxel by luxel.

use super::faces::{Faces, Polygon};
use super::light::{ByStyle, Sample, light_at};
use super::shadows::{Shadows, texture_name};
use bsp::bsp::{FaceLight, LightSamples, Lightmap};
use bsp::{Bsp, Level, Limits};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use scene::import::CompilerLights;
use std::collections::{BTreeMap, BTreeSet};

/// The luxels of one face.
#[derive(Clone, Debug)]
pub struct FaceLuxels {
    /// Its number in the level.
    pub face: usize,
    /// Luxels across.
    pub width: u32,
    /// Luxels down.
    pub height: u32,
    /// Row by row.
    pub luxels: Vec<Luxel>,
}

/// What is known of a luxel.
#[derive(Clone, Debug)]
pub enum Luxel {
    /// Traced and baked light, in units of lightmap bytes (128 shows a texture as it is stored).
    Compared(Vec<Pair>),
    /// It lies beyond its face or in solid: the compilers fill it from its neighbours.
    Outside,
    /// Light comes to it through glass.
    BehindGlass,
}

/// Light of one style at a luxel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// Light style.
    pub style: u16,
    /// What was traced, as it would be stored.
    pub traced: [f32; 3],
    /// What the level has.
    pub baked: [f32; 3],
}

impl Pair {
    /// Largest difference of a channel.
    #[must_use]
    pub fn difference(&self) -> f32 {
        (self.traced.iter().zip(self.baked))
            .map(|(t, b)| (t - b).abs())
            .fold(0.0, f32::max)
    }

    /// Traced less baked, over the channels.
    #[must_use]
    pub fn excess(&self) -> f32 {
        let sum: f32 = self.traced.iter().zip(self.baked).map(|(t, b)| t - b).sum();
        sum / 3.0
    }
}

/// All luxels of a level, and what has none.
#[derive(Clone, Debug, Default)]
pub struct Comparison {
    /// Faces with lightmaps.
    pub faces: Vec<FaceLuxels>,
    /// Faces without, or whose lightmaps are black.
    pub unlit_faces: usize,
}

/// Traces a level's luxels. `oversampling` points to each side stand for a luxel: 1, or 2 and 4 where
/// the compiler was told `-extra` or `-extra4`.
#[must_use]
pub fn compare(
    level: &Level,
    lights: &CompilerLights,
    oversampling: u32,
    limits: &Limits,
) -> Comparison {
    let bsp = &level.bsp;
    let (shadows, faces) = (Shadows::new(level), Faces::new(bsp));
    let of_models = (0..bsp.models.len()).flat_map(|model| {
        bsp.drawable_faces(model)
            .map(move |(face, _)| (model, face))
    });
    let work: Vec<(usize, usize, FaceLight)> = of_models
        .map(|(model, face)| (model, face, bsp.face_light(face, limits)))
        .collect();
    let unlit_faces = work
        .iter()
        .filter(|w| !matches!(w.2, FaceLight::Lightmap(_)))
        .count();
    let faces = work
        .par_iter()
        .filter_map(|(model, face, light)| {
            let FaceLight::Lightmap(map) = light else {
                return None;
            };
            let task = Task {
                bsp,
                samples: &level.light,
                lights,
                shadows: &shadows,
                faces: &faces,
                oversampling: oversampling.max(1),
            };
            task.face(*face, *model, map)
        })
        .collect();
    Comparison { faces, unlit_faces }
}

/// What every face is compared with.
struct Task<'a> {
    bsp: &'a Bsp,
    samples: &'a LightSamples,
    lights: &'a CompilerLights,
    shadows: &'a Shadows<'a>,
    faces: &'a Faces<'a>,
    oversampling: u32,
}

impl Task<'_> {
    fn face(&self, index: usize, model: usize, map: &Lightmap) -> Option<FaceLuxels> {
        let face = self.bsp.faces.get(index)?;
        let normal = Polygon::of(self.bsp, face)?.normal;
        let is_liquid = texture_name(self.bsp, face).starts_with('*');
        let two_sided = is_liquid || self.shadows.models[model].alpha < 1.0;
        let mut light = Vec::with_capacity((map.width * map.height) as usize);
        for y in 0..map.height {
            for x in 0..map.width {
                light.push(self.luxel(index, map, [x, y], normal, model, two_sided));
            }
        }
        // The compilers store what reaches 1 somewhere on the face.
        let mut strongest: BTreeMap<u16, f64> = BTreeMap::new();
        for (&style, value) in light.iter().filter_map(|l| l.as_ref().ok()).flatten() {
            let most = strongest.entry(style).or_default();
            *most = most.max(value.max_element());
        }
        let traced = strongest
            .into_iter()
            .filter(|(_, most)| *most >= 1.0)
            .map(|(s, _)| s);
        let styles: BTreeSet<u16> = traced.chain(map.styles.iter().copied()).collect();
        let luxels = (light.into_iter().zip(0..))
            .map(|(light, i)| match light {
                Err(why) => why,
                Ok(light) => {
                    let at = [i % map.width, i / map.width];
                    let pairs = styles.iter().map(|&s| self.pair(s, &light, map, at));
                    Luxel::Compared(pairs.collect())
                }
            })
            .collect();
        Some(FaceLuxels {
            face: index,
            width: map.width,
            height: map.height,
            luxels,
        })
    }

    /// The mean light over a luxel's points that get light.
    fn luxel(
        &self,
        index: usize,
        map: &Lightmap,
        [x, y]: [u32; 2],
        normal: DVec3,
        model: usize,
        two_sided: bool,
    ) -> Result<ByStyle, Luxel> {
        let n = self.oversampling;
        let (mut sum, mut count) = (ByStyle::new(), 0);
        for part in 0..n * n {
            let inside = DVec2::new(f64::from(part % n), f64::from(part / n)) + 0.5;
            let at = DVec2::new(f64::from(x), f64::from(y)) - 0.5 + inside / f64::from(n);
            let Some(point) = self.faces.sample_point(index, map, at, model, self.shadows) else {
                continue;
            };
            let sample = Sample {
                point,
                normal,
                model,
                two_sided,
            };
            let light = light_at(&sample, self.lights, self.shadows).ok_or(Luxel::BehindGlass)?;
            for (style, value) in light {
                *sum.entry(style).or_default() += value;
            }
            count += 1;
        }
        if count == 0 {
            return Err(Luxel::Outside);
        }
        sum.values_mut().for_each(|v| *v /= f64::from(count));
        Ok(sum)
    }

    fn pair(&self, style: u16, light: &ByStyle, map: &Lightmap, [x, y]: [u32; 2]) -> Pair {
        let slot = map.styles.iter().position(|&s| s == style);
        let baked = slot.map_or([0.0; 3], |slot| {
            (self.samples.value(self.bsp, map.sample(slot, x, y))).map(|v| v * 128.0)
        });
        let value = light.get(&style).copied().unwrap_or_default();
        Pair {
            style,
            traced: stored(value, self.samples),
            baked,
        }
    }
}

/// Light as the compilers store it: bytes are scaled down to 255 together and cut off, without colour
/// the strongest channel counts; what has exponents stays as it is.
fn stored(value: DVec3, samples: &LightSamples) -> [f32; 3] {
    if matches!(samples, LightSamples::E5Bgr9(_)) {
        return value.as_vec3().to_array();
    }
    let most = value.max_element();
    let value = if most > 255.0 {
        value * (255.0 / most)
    } else {
        value
    };
    let value = match samples {
        LightSamples::Lump => DVec3::splat(value.max_element()),
        _ => value,
    };
    value.floor().as_vec3().to_array()
}

/// Figures over many luxels, in units of lightmap bytes.
#[derive(Clone, Debug, PartialEq)]
pub struct Figures {
    /// Luxels.
    pub count: usize,
    /// Half of the differences are not larger.
    pub median: f32,
    /// Nine of ten are not larger.
    pub p90: f32,
    /// 99 of a hundred are not larger.
    pub p99: f32,
    /// The largest.
    pub max: f32,
    /// Mean of traced less baked.
    pub excess: f64,
}

impl Figures {
    /// Figures over pairs; `None` without any.
    #[must_use]
    pub fn over<'a>(pairs: impl Iterator<Item = &'a Pair>) -> Option<Self> {
        let (mut differences, mut excess) = (Vec::new(), 0.0);
        for pair in pairs {
            differences.push(pair.difference());
            excess += f64::from(pair.excess());
        }
        differences.sort_unstable_by(f32::total_cmp);
        let count = differences.len();
        let &max = differences.last()?;
        // The least value that a share of all does not exceed.
        let percentile =
            |share: f64| differences[((share * count as f64).ceil() as usize).max(1) - 1];
        Some(Self {
            count,
            median: percentile(0.5),
            p90: percentile(0.9),
            p99: percentile(0.99),
            max,
            excess: excess / count as f64,
        })
    }
}

impl Comparison {
    /// All that was compared.
    pub fn pairs(&self) -> impl Iterator<Item = &Pair> {
        self.luxels().flat_map(|l| match l {
            Luxel::Compared(pairs) => pairs.as_slice(),
            Luxel::Outside | Luxel::BehindGlass => &[],
        })
    }

    /// All luxels.
    pub fn luxels(&self) -> impl Iterator<Item = &Luxel> {
        self.faces.iter().flat_map(|f| &f.luxels)
    }

    /// Figures for each light style.
    #[must_use]
    pub fn by_style(&self) -> Vec<(u16, Figures)> {
        let styles: BTreeSet<u16> = self.pairs().map(|p| p.style).collect();
        (styles.into_iter())
            .filter_map(|s| Some((s, Figures::over(self.pairs().filter(|p| p.style == s))?)))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_the_least_values_that_a_share_does_not_exceed() {
        let pairs: Vec<Pair> = (1..=100)
            .map(|i| Pair {
                style: 0,
                traced: [0.0, 0.0, i as f32],
                baked: [0.0; 3],
            })
            .collect();
        let f = Figures::over(pairs.iter()).unwrap();
        assert_eq!(
            (f.count, f.median, f.p90, f.p99, f.max),
            (100, 50.0, 90.0, 99.0, 100.0)
        );
        assert!((f.excess - 50.5 / 3.0).abs() < 1e-5);
        assert_eq!(Figures::over([].iter()), None);
    }

    #[test]
    fn light_is_stored_as_compilers_do() {
        let bright = DVec3::new(510.0, 255.0, 1.0);
        let rgb = LightSamples::Rgb(Vec::new());
        assert_eq!(stored(bright, &rgb), [255.0, 127.0, 0.0]);
        assert_eq!(stored(bright, &LightSamples::Lump), [255.0; 3]);
        let float = LightSamples::E5Bgr9(Vec::new());
        assert_eq!(stored(bright, &float), [510.0, 255.0, 1.0]);
    }
}
