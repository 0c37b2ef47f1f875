//! Samples where the noise is: the same number of samples, spread by what a pilot saw.
//!
//! After a pilot of as many samples in every pixel, pixel `p` gets further ones in proportion to the
//! standard deviation that its neighbours had, relative as relMSE counts it (Neyman's allocation,
//! 1934, minimises the sum of variances). The neighbours' and not its own: what a pixel's samples
//! were then says nothing of how many more it gets, so the mean over all of them, pilot included,
//! stays unbiased. (The densities are scaled to a mean of 1 over the picture, which ties a pixel to
//! itself by one part in the number of pixels.) A density that followed a pixel's own samples would
//! favour means that happen to be low: few samples, no light found yet, no more samples.

use crate::job::AnyRenderer;
use anyhow::Result;
use rayon::prelude::*;
use scene::Frame;
use scene::render::{Film, RELMSE_EPSILON};

/// Pixels to each side that a pixel's density looks at.
const RADIUS: usize = 2;

/// Share of the samples that is spread evenly: a pilot that saw no light in a corner is no proof that
/// there is none.
const EVEN_SHARE: f64 = 0.15;

/// Largest density: a single firefly must not take the whole picture's samples, and a GPU that has a
/// few long pixels left stands idle beside them.
const MAX_DENSITY: f64 = 4.0;

/// A renderer whose samples go where the noise is, once `pilot` samples per pixel are taken.
pub struct Adaptive {
    inner: Box<dyn AnyRenderer>,
    pilot: u32,
    taken: u32,
    /// By pixel, after the pilot: samples per sample per pixel.
    density: Vec<f64>,
}

/// Samples of the pilot for a picture of `spp` samples per pixel: enough to tell where the noise is,
/// few enough to leave something to spread.
#[must_use]
pub fn pilot(spp: u32) -> u32 {
    (spp / 16).clamp(16, 64)
}

impl Adaptive {
    /// Wraps `inner`, which has no samples yet.
    #[must_use]
    pub fn new(inner: Box<dyn AnyRenderer>, pilot: u32) -> Self {
        Self {
            inner,
            pilot,
            taken: 0,
            density: Vec::new(),
        }
    }
}

impl AnyRenderer for Adaptive {
    /// Adds `samples` per pixel on average.
    fn accumulate(&mut self, samples: u32) -> Result<()> {
        let even = samples.min(self.pilot.saturating_sub(self.taken));
        if even > 0 {
            self.inner.accumulate(even)?;
            self.taken += even;
        }
        if samples == even {
            return Ok(());
        }
        if self.density.is_empty() {
            self.density = density(&self.inner.film()?);
        }
        // From totals, so that the picture does not depend on how samples are split into calls.
        let begin = f64::from(self.taken - self.pilot);
        let end = begin + f64::from(samples - even);
        let schedule: Vec<u32> = (self.density.iter().enumerate())
            .map(|(pixel, density)| {
                let offset = dither(pixel);
                let total = |n: f64| (density * n + offset).floor();
                (total(end) - total(begin)) as u32
            })
            .collect();
        self.taken += samples - even;
        self.inner.accumulate_per_pixel(&schedule)
    }

    fn accumulate_per_pixel(&mut self, samples: &[u32]) -> Result<()> {
        self.inner.accumulate_per_pixel(samples)
    }

    fn show(&mut self, frame: &Frame) -> Result<()> {
        self.inner.show(frame)
    }

    fn restart(&mut self, seed: u64) -> Result<()> {
        self.taken = 0;
        self.density.clear();
        self.inner.restart(seed)
    }

    fn finish(&mut self) -> Result<()> {
        self.inner.finish()
    }

    fn film(&mut self) -> Result<Film> {
        self.inner.film()
    }
}

/// A number in 0..1 by pixel, evenly distributed: where fractions of samples are rounded up.
fn dither(pixel: usize) -> f64 {
    // The golden ratio's multiples modulo 1 (Weyl).
    (pixel as f64 * 0.618_033_988_749_895).fract()
}

/// How many samples each pixel of `pilot` should get, as multiples of the mean.
fn density(pilot: &Film) -> Vec<f64> {
    let width = pilot.width as usize;
    let mut density: Vec<f64> = (0..pilot.beauty.len())
        .into_par_iter()
        .map(|pixel| noise_around(pilot, pixel % width, pixel / width))
        .collect();
    scale_to_one(&mut density);
    for d in &mut density {
        *d = (EVEN_SHARE + (1.0 - EVEN_SHARE) * *d).min(MAX_DENSITY);
    }
    scale_to_one(&mut density);
    density
}

/// Standard deviation that the neighbours of a pixel have, relative as relMSE counts it.
fn noise_around(pilot: &Film, x: usize, y: usize) -> f64 {
    let (width, height) = (pilot.width as usize, pilot.height as usize);
    let mut count = 0.0;
    let (mut mean, mut variance) = ([0.0; 3], [0.0; 3]);
    for j in y.saturating_sub(RADIUS)..(y + RADIUS + 1).min(height) {
        for i in x.saturating_sub(RADIUS)..(x + RADIUS + 1).min(width) {
            if (i, j) != (x, y) {
                let at = j * width + i;
                count += 1.0;
                for c in 0..3 {
                    mean[c] += f64::from(pilot.beauty[at][c]);
                    variance[c] += f64::from(pilot.variance[at][c]);
                }
            }
        }
    }
    let count = f64::max(count, 1.0);
    let relative = |c: usize| {
        let mean = mean[c] / count;
        variance[c] / count / (mean * mean + RELMSE_EPSILON)
    };
    (relative(0) + relative(1) + relative(2)).sqrt()
}

/// Scales numbers to a mean of 1; all 0 become all 1.
fn scale_to_one(numbers: &mut [f64]) {
    let mean = numbers.iter().sum::<f64>() / numbers.len() as f64;
    let scaled = |n: f64| if mean > 0.0 { n / mean } else { 1.0 };
    numbers.iter_mut().for_each(|n| *n = scaled(*n));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Records the numbers of samples; its right half is noisy.
    #[derive(Default)]
    struct Fake {
        counts: Vec<u32>,
    }

    const SIDE: usize = 20;

    impl AnyRenderer for Fake {
        fn accumulate(&mut self, samples: u32) -> Result<()> {
            self.accumulate_per_pixel(&[samples; SIDE * SIDE])
        }

        fn accumulate_per_pixel(&mut self, samples: &[u32]) -> Result<()> {
            self.counts.resize(samples.len(), 0);
            self.counts
                .iter_mut()
                .zip(samples)
                .for_each(|(c, s)| *c += s);
            Ok(())
        }

        fn show(&mut self, _: &Frame) -> Result<()> {
            Ok(())
        }

        fn restart(&mut self, _: u64) -> Result<()> {
            self.counts.clear();
            Ok(())
        }

        fn finish(&mut self) -> Result<()> {
            Ok(())
        }

        fn film(&mut self) -> Result<Film> {
            let noise = |i: usize| if i % SIDE >= SIDE / 2 { 0.9 } else { 0.1 };
            Ok(Film {
                width: SIDE as u32,
                height: SIDE as u32,
                samples: self.counts[0],
                beauty: vec![[1.0; 3]; SIDE * SIDE],
                variance: (0..SIDE * SIDE).map(|i| [noise(i) * noise(i); 3]).collect(),
                sample_counts: self.counts.clone(),
                ..Film::default()
            })
        }
    }

    fn counts(calls: &[u32]) -> Vec<u32> {
        let mut adaptive = Adaptive::new(Box::<Fake>::default(), 16);
        for &samples in calls {
            adaptive.accumulate(samples).unwrap();
        }
        adaptive.film().unwrap().sample_counts
    }

    #[test]
    fn every_picture_has_its_own_pilot() {
        let mut adaptive = Adaptive::new(Box::<Fake>::default(), 16);
        adaptive.accumulate(64).unwrap();
        adaptive.restart(1).unwrap();
        for samples in [16, 48] {
            adaptive.accumulate(samples).unwrap();
        }
        assert_eq!(adaptive.film().unwrap().sample_counts, counts(&[64]));
    }

    #[test]
    fn samples_follow_the_noise_of_the_pilot() {
        let counts = counts(&[1016]);
        // Away from the border between the halves: 0.15 + 0.85 times 0.1 or 0.9 over their mean.
        for (column, noise) in [(3, 0.1), (16, 0.9)] {
            let expected = 16.0 + 1000.0 * (0.15 + 0.85 * noise / 0.5);
            let found = f64::from(counts[10 * SIDE + column]);
            // The border's columns are between the two and shift the mean a little.
            assert!(
                (found / expected - 1.0).abs() < 0.05,
                "{found} for {expected}"
            );
        }
        let mean = counts.iter().map(|&n| f64::from(n)).sum::<f64>() / counts.len() as f64;
        assert!((mean - 1016.0).abs() < 0.5, "{mean}");
    }

    #[test]
    fn the_split_into_calls_changes_nothing() {
        let whole = counts(&[100]);
        assert_eq!(counts(&[7, 9, 1, 33, 50]), whole);
        assert_eq!(counts(&[16, 84]), whole);
        assert!(counts(&[5, 11]).iter().all(|&n| n == 16));
    }

    #[test]
    fn a_pixel_does_not_decide_about_itself() {
        let mut film = Fake {
            counts: vec![16; SIDE * SIDE],
        }
        .film()
        .unwrap();
        let before = density(&film);
        let at = 10 * SIDE + 5;
        film.variance[at] = [100.0; 3];
        let after = density(&film);
        // It takes from all alike, by the scale; its neighbours get more.
        let (own, far) = (after[at] / before[at], after[3] / before[3]);
        assert!((own / far - 1.0).abs() < 0.3 && own < 1.0, "{own} {far}");
        assert!(after[at + 1] > 2.0 * before[at + 1]);
    }
}
