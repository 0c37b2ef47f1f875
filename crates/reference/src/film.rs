//! Sums over samples, and the picture they make.

use crate::integrator::PathSample;
use glam::DVec3;
use rayon::prelude::*;
use scene::render::{Counters, Film};

/// Sums of one pixel's radiance.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PixelSums {
    radiance: DVec3,
    squared: DVec3,
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
    id: u32,
}

impl PixelSums {
    /// Adds the radiance of one sample.
    pub fn add(&mut self, radiance: DVec3) {
        self.radiance += radiance;
        self.squared += radiance * radiance;
    }

    fn mean(&self, samples: f64) -> DVec3 {
        self.radiance / samples
    }

    /// Variance of the mean; 0 with fewer than two samples, which tell nothing about it.
    fn variance(&self, samples: f64) -> DVec3 {
        if samples < 2.0 {
            return DVec3::ZERO;
        }
        let spread = self.squared - self.radiance * self.radiance / samples;
        spread.max(DVec3::ZERO) / ((samples - 1.0) * samples)
    }
}

impl LayerSums {
    /// Adds a sample with finite radiance.
    pub fn add_light(&mut self, sample: &PathSample) {
        self.emission += sample.emission;
        self.direct += sample.direct;
        self.indirect += sample.indirect;
    }

    /// Adds what the camera ray hit; `depth` is along the view direction, `first_sample` says
    /// whether this is the pixel's first.
    pub fn add_first_hit(&mut self, sample: &PathSample, depth: f64, first_sample: bool) {
        let Some(first) = sample.first else { return };
        self.albedo += first.albedo;
        self.normal += first.normal;
        self.position += first.position;
        self.depth += depth;
        if first_sample {
            self.id = first.face.wrapping_add(1);
        }
    }
}

/// The picture after `samples` samples; without samples it is black.
pub(crate) fn develop(
    [width, height]: [u32; 2],
    samples: u32,
    pixels: &[PixelSums],
    layers: &[LayerSums],
    counters: Counters,
) -> Film {
    let n = f64::from(samples.max(1));
    let vector = |v: DVec3| v.as_vec3().to_array();
    let layer = |of: fn(&LayerSums) -> DVec3| -> Vec<[f32; 3]> {
        layers.par_iter().map(|l| vector(of(l) / n)).collect()
    };
    Film {
        width,
        height,
        samples,
        beauty: pixels.par_iter().map(|p| vector(p.mean(n))).collect(),
        variance: pixels.par_iter().map(|p| vector(p.variance(n))).collect(),
        emission: layer(|l| l.emission),
        direct: layer(|l| l.direct),
        indirect: layer(|l| l.indirect),
        albedo: layer(|l| l.albedo),
        normal: layer(|l| l.normal),
        position: layer(|l| l.position),
        depth: layers.par_iter().map(|l| (l.depth / n) as f32).collect(),
        id: layers.par_iter().map(|l| l.id).collect(),
        counters,
    }
}

/// [`Film::estimated_relmse`] without making a film.
pub(crate) fn estimated_relmse(samples: u32, pixels: &[PixelSums]) -> f64 {
    let n = f64::from(samples);
    if samples < 2 || pixels.is_empty() {
        return f64::INFINITY;
    }
    let sum: f64 = pixels
        .iter()
        .map(|p| {
            let mean = p.mean(n);
            (p.variance(n) / (mean * mean + 1e-2)).element_sum()
        })
        .sum();
    sum / (3 * pixels.len()) as f64
}
