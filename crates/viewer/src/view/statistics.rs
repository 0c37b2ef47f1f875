//! What the picture costs, measured as it goes.

use rt::Timing;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Frames that are remembered.
const FRAMES: usize = 120;
/// Rays are counted this often.
const RAYS_EVERY: Duration = Duration::from_millis(700);

/// Measures.
#[derive(Debug)]
pub struct Statistics {
    /// Seconds of the last frames.
    frames: VecDeque<f32>,
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

    /// A frame took so long, and the device so long for its parts besides tracing.
    pub fn frame(&mut self, seconds: f32, display: &[Timing]) {
        if self.frames.len() == FRAMES {
            self.frames.pop_front();
        }
        self.frames.push_back(seconds);
        self.display = display.to_vec();
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

    /// Seconds of the last frames, the oldest first.
    #[must_use]
    pub fn frames(&self) -> &VecDeque<f32> {
        &self.frames
    }

    /// Mean and longest of the last frames, in milliseconds.
    #[must_use]
    pub fn frame_ms(&self) -> [f32; 2] {
        let count = self.frames.len().max(1) as f32;
        let longest = self.frames.iter().copied().fold(0.0, f32::max);
        [self.frames.iter().sum::<f32>() / count, longest].map(|s| s * 1000.0)
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
