//! Sums over samples, and the picture they make.

use crate::integrator::PathSample;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use scene::LightStyle;
use scene::render::{Clamped, Counters, Escape, Film, StyleLayer};

/// Sums of one pixel's radiance.
#[derive(Clone, Debug, Default)]
pub(crate) struct PixelSums {
    /// Samples taken, those that were not finite among them.
    pub samples: u32,
    radiance: DVec3,
    squared: DVec3,
    /// Of styles after the first, at brightness 1; empty until there is some.
    styled: Box<[DVec3]>,
    /// Radiance lost to a clamp, and in how many samples; nothing until there is some.
    lost: Option<Box<(DVec3, u32)>>,
}

/// Sums of one pixel's layers.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LayerSums {
    emission: DVec3,
    direct: DVec3,
    indirect: DVec3,
    albedo: DVec3,
    normal: DVec3,
    position: DVec3,
    depth: f64,
    motion: DVec2,
    id: u32,
}

impl PixelSums {
    /// Adds the radiance of one sample; what is not finite counts as black.
    pub fn add(&mut self, radiance: DVec3) {
        self.samples += 1;
        if !radiance.is_finite() {
            return;
        }
        self.radiance += radiance;
        self.squared += radiance * radiance;
    }

    /// Adds light of the scene's styles, of which there are `count`, from a sample that is finite.
    pub fn add_styled(&mut self, styled: &[(usize, DVec3)], count: usize) {
        if self.styled.is_empty() && !styled.is_empty() {
            self.styled = vec![DVec3::ZERO; count - 1].into();
        }
        for &(style, radiance) in styled {
            self.styled[style - 1] += radiance;
        }
    }

    /// Counts radiance that a sample lost to a clamp.
    pub fn add_lost(&mut self, radiance: DVec3) {
        let (sum, samples) = &mut **self.lost.get_or_insert_default();
        *sum += radiance;
        *samples += 1;
    }

    fn mean(&self) -> DVec3 {
        self.radiance / self.divisor()
    }

    /// Number of samples; without any, 1.
    fn divisor(&self) -> f64 {
        f64::from(self.samples.max(1))
    }

    /// Variance of the mean; 0 with fewer than two samples, which tell nothing about it.
    fn variance(&self) -> DVec3 {
        let samples = self.divisor();
        if samples < 2.0 {
            return DVec3::ZERO;
        }
        let spread = self.squared - self.radiance * self.radiance / samples;
        spread.max(DVec3::ZERO) / ((samples - 1.0) * samples)
    }
}

/// What all pixels lost to a clamp.
pub(crate) fn clamped(pixels: &[PixelSums]) -> Clamped {
    let lost = pixels
        .iter()
        .filter_map(|p| Some((p.divisor(), p.lost.as_ref()?)));
    let (lost, samples) = lost.fold((DVec3::ZERO, 0), |(sum, n), (divisor, lost)| {
        (sum + lost.0 / divisor, n + u64::from(lost.1))
    });
    Clamped {
        lost: (lost / pixels.len() as f64).to_array(),
        samples,
    }
}

impl LayerSums {
    /// Adds a sample with finite radiance.
    pub fn add_light(&mut self, sample: &PathSample) {
        self.emission += sample.emission;
        self.direct += sample.direct;
        self.indirect += sample.indirect;
    }

    /// Adds what the camera ray hit; `depth` is along the view direction, `pixels` are those of a unit on
    /// the image plane, `first_sample` says whether this is the pixel's first.
    pub fn add_first_hit(
        &mut self,
        sample: &PathSample,
        depth: f64,
        pixels: DVec2,
        first_sample: bool,
    ) {
        let Some(first) = sample.first else { return };
        self.albedo += first.albedo;
        self.normal += first.normal;
        self.position += first.position;
        self.depth += depth;
        self.motion += first.motion * pixels;
        if first_sample {
            self.id = first.face.wrapping_add(1);
        }
    }
}

/// The picture so far; without samples it is black.
pub(crate) fn develop(
    [width, height]: [u32; 2],
    pixels: &[PixelSums],
    styles: &[LightStyle],
    layers: &[LayerSums],
    counters: Counters,
    escapes: Vec<Escape>,
) -> Film {
    let vector = |v: DVec3| v.as_vec3().to_array();
    let layer = |of: fn(&LayerSums) -> DVec3| -> Vec<[f32; 3]> {
        (layers.par_iter().zip(pixels))
            .map(|(l, p)| vector(of(l) / p.divisor()))
            .collect()
    };
    let samples = |p: &PixelSums| p.samples;
    let is_even = pixels.iter().all(|p| p.samples == pixels[0].samples);
    let beauty: Vec<_> = pixels.par_iter().map(|p| vector(p.mean())).collect();
    let styled = (1..styles.len()).map(|style| {
        let sum = |p: &PixelSums| p.styled.get(style - 1).copied().unwrap_or_default();
        pixels
            .iter()
            .map(|p| vector(sum(p) / p.divisor()))
            .collect()
    });
    Film {
        styles: StyleLayer::all(styles, &beauty, styled),
        width,
        height,
        samples: (counters.paths as f64 / pixels.len() as f64).round() as u32,
        sample_counts: if is_even {
            Vec::new()
        } else {
            pixels.iter().map(samples).collect()
        },
        beauty,
        clamped: None,
        denoised: Vec::new(),
        variance: pixels.par_iter().map(|p| vector(p.variance())).collect(),
        emission: layer(|l| l.emission),
        direct: layer(|l| l.direct),
        indirect: layer(|l| l.indirect),
        albedo: layer(|l| l.albedo),
        normal: layer(|l| l.normal),
        position: layer(|l| l.position),
        depth: (layers.par_iter().zip(pixels))
            .map(|(l, p)| (l.depth / p.divisor()) as f32)
            .collect(),
        motion: (layers.par_iter().zip(pixels))
            .map(|(l, p)| (l.motion / p.divisor()).as_vec2().to_array())
            .collect(),
        id: layers.par_iter().map(|l| l.id).collect(),
        counters,
        escapes,
    }
}
