//! What the picture costs, measured as it goes.

use rt::Timing;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Frames that are remembered.
const FRAMES: usize = 120;
/// Rays are counted this often.
const RAYS_EVERY: Duration = Duration::from_millis(700);

/// Passes of most frames: known from the start, they have the same numbers in every window.
const USUAL: [&str; 3] = ["path trace", "tone map", "overlay"];

/// What a frame took.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Taken {
    /// Seconds since the one before.
    pub seconds: f32,
    /// The processor's milliseconds for panels.
    pub panels_ms: f32,
    /// The device's milliseconds for passes that were done since the frame before, by their numbers; those that are not
    /// there took none.
    pub passes: Vec<f32>,
}

/// A part of the device's work.
#[derive(Clone, Debug, PartialEq)]
pub struct Pass {
    /// What the renderer calls it.
    pub name: &'static str,
    /// Where it is in [`Taken::passes`]: the same as long as the window is open.
    pub number: usize,
    /// Mean of the last frames, in milliseconds.
    pub mean_ms: f32,
}

/// Measures.
#[derive(Debug)]
pub struct Statistics {
    /// The last frames.
    frames: VecDeque<Taken>,
    /// Names of passes by their numbers.
    known: Vec<&'static str>,
    /// One sample of all pixels.
    sample_ms: f64,
    /// GPU times of the frame before.
    display: Vec<Timing>,
    /// When the picture began, and its paths so far.
    begun: Instant,
    paths: f64,
    last: Instant,
    rays_per_path: Option<f64>,
    counted: Instant,
}

impl Default for Statistics {
    fn default() -> Self {
        let now = Instant::now();
        Self {
            frames: VecDeque::new(),
            known: USUAL.to_vec(),
            sample_ms: 0.0,
            display: Vec::new(),
            begun: now,
            paths: 0.0,
            last: now,
            rays_per_path: None,
            counted: now,
        }
    }
}

impl Statistics {
    /// A new picture.
    pub fn restart(&mut self) {
        (self.begun, self.paths) = (Instant::now(), 0.0);
        self.last = self.begun;
    }

    /// A frame took so many seconds, the processor so many milliseconds for its panels, and the device so
    /// long for what it traced since the frame before, and to show it.
    pub fn frame(&mut self, seconds: f32, panels_ms: f64, traced: &[Timing], display: &[Timing]) {
        if self.frames.len() == FRAMES {
            self.frames.pop_front();
        }
        let mut passes = vec![0.0; self.known.len()];
        for timing in traced.iter().chain(display) {
            let is_it = |name: &&str| *name == timing.name;
            let number = self.known.iter().position(is_it).unwrap_or_else(|| {
                self.known.push(timing.name);
                passes.push(0.0);
                passes.len() - 1
            });
            passes[number] += timing.milliseconds as f32;
        }
        self.frames.push_back(Taken {
            seconds,
            panels_ms: panels_ms as f32,
            passes,
        });
        self.display = display.to_vec();
    }

    /// The passes of the last frames, by their numbers.
    #[must_use]
    pub fn passes(&self) -> Vec<Pass> {
        let count = self.frames.len().max(1) as f32;
        let spent = |number: usize| -> f32 {
            let of = |frame: &Taken| frame.passes.get(number).copied();
            self.frames.iter().filter_map(of).sum()
        };
        let passes = self.known.iter().enumerate().map(|(number, name)| Pass {
            name,
            number,
            mean_ms: spent(number) / count,
        });
        passes.filter(|pass| pass.mean_ms > 0.0).collect()
    }

    /// A sample of all pixels took the device so many milliseconds.
    pub fn sampled(&mut self, ms: f64) {
        self.sample_ms = ms;
    }

    /// The picture has so many samples per pixel.
    pub fn traced(&mut self, samples: f64, [width, height]: [u32; 2]) {
        self.paths = samples * f64::from(width) * f64::from(height);
        self.last = Instant::now();
    }

    /// Whether the rays should be counted once more.
    #[must_use]
    pub fn wants_rays(&self) -> bool {
        self.counted.elapsed() > RAYS_EVERY
    }

    /// The picture took so many rays.
    pub fn rays(&mut self, rays: u64, samples: f64, [width, height]: [u32; 2]) {
        self.counted = Instant::now();
        let paths = samples * f64::from(width) * f64::from(height);
        if paths > 0.0 && rays > 0 {
            self.rays_per_path = Some(rays as f64 / paths);
        }
    }

    /// The last frames, the oldest first.
    #[must_use]
    pub fn frames(&self) -> &VecDeque<Taken> {
        &self.frames
    }

    /// Mean and longest of the last frames, in milliseconds.
    #[must_use]
    pub fn frame_ms(&self) -> [f32; 2] {
        let count = self.frames.len().max(1) as f32;
        let seconds = || self.frames.iter().map(|f| f.seconds);
        [
            seconds().sum::<f32>() / count,
            seconds().fold(0.0, f32::max),
        ]
        .map(|s| s * 1000.0)
    }

    /// GPU milliseconds of one sample of all pixels, of those that were timed last.
    #[must_use]
    pub fn sample_ms(&self) -> f64 {
        self.sample_ms
    }

    /// The processor's milliseconds for the panels of the last frame.
    #[must_use]
    pub fn panels_ms(&self) -> f64 {
        self.frames.back().map_or(0.0, |f| f.panels_ms.into())
    }

    /// GPU milliseconds that a frame takes besides tracing.
    #[must_use]
    pub fn display_ms(&self) -> f64 {
        self.display.iter().map(|t| t.milliseconds).sum()
    }

    /// GPU times of a frame besides tracing.
    #[must_use]
    pub fn display(&self) -> &[Timing] {
        &self.display
    }

    /// Millions of paths and of rays per second, of this picture.
    #[must_use]
    pub fn speed(&self) -> [Option<f64>; 2] {
        let seconds = (self.last - self.begun).as_secs_f64();
        let paths = (seconds > 0.05).then(|| self.paths / seconds / 1e6);
        [paths, paths.zip(self.rays_per_path).map(|(p, r)| p * r)]
    }

    /// Seconds that the picture was worked on.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        (self.last - self.begun).as_secs_f64()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_has_its_own_share_of_every_pass() {
        let mut statistics = Statistics::default();
        let timing = |name, milliseconds| Timing { name, milliseconds };
        let mut frame = |traced: &[Timing], display: &[Timing]| {
            statistics.frame(0.1, 2.0, traced, display);
            let last = statistics.frames().back().unwrap().clone();
            assert_eq!((last.seconds, last.panels_ms), (0.1, 2.0));
            last.passes
        };
        // Two slices of a picture, and nothing shown yet.
        let slices = [timing("path trace", 1.5), timing("path trace", 2.5)];
        assert_eq!(frame(&slices, &[]), [4.0, 0.0, 0.0]);
        // One that nobody has named before is told apart, and keeps its number.
        let moves = [timing("pose", 1.0), timing("path trace", 3.0)];
        let shows = [timing("tone map", 0.25), timing("overlay", 0.5)];
        assert_eq!(frame(&moves, &shows), [3.0, 0.25, 0.5, 1.0]);
        let other = [timing("sharpen", 8.0), timing("overlay", 0.5)];
        assert_eq!(frame(&[], &other), [0.0, 0.0, 0.5, 0.0, 8.0]);
        assert_eq!(frame(&moves[..1], &[]), [0.0, 0.0, 0.0, 1.0, 0.0]);
        assert_eq!(statistics.display_ms(), 0.0);
        let told: Vec<_> = (statistics.passes().iter())
            .map(|p| (p.name, p.number, p.mean_ms))
            .collect();
        let expected = [
            ("path trace", 0, 1.75),
            ("tone map", 1, 0.0625),
            ("overlay", 2, 0.25),
            ("pose", 3, 0.5),
            ("sharpen", 4, 2.0),
        ];
        assert_eq!(told, expected);
        assert_eq!(statistics.frame_ms(), [100.0, 100.0]);
        // What was long ago is not told.
        for _ in 0..FRAMES {
            statistics.frame(0.1, 2.0, &moves[1..], &[]);
        }
        let names: Vec<_> = statistics.passes().iter().map(|p| p.name).collect();
        assert_eq!(names, ["path trace"]);
    }
}
