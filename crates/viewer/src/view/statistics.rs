//! What the picture costs, measured as it goes.

use rt::Timing;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Frames that are remembered.
const FRAMES: usize = 120;
/// Rays are counted this often.
const RAYS_EVERY: Duration = Duration::from_millis(700);

/// What a frame took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Taken {
    /// Seconds since the one before.
    pub seconds: f32,
    /// The processor's milliseconds for panels.
    pub panels_ms: f32,
    /// The device's milliseconds for samples that were done since the frame before.
    pub trace_ms: f32,
    /// The device's milliseconds to show them: tone curve and all that is drawn.
    pub display_ms: f32,
}

/// Measures.
#[derive(Debug)]
pub struct Statistics {
    /// The last frames.
    frames: VecDeque<Taken>,
    /// What the renderer has spent in all.
    spent_ms: f64,
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
            spent_ms: 0.0,
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
    /// long for its parts besides tracing.
    pub fn frame(&mut self, seconds: f32, panels_ms: f64, display: &[Timing]) {
        if self.frames.len() == FRAMES {
            self.frames.pop_front();
        }
        self.frames.push_back(Taken {
            seconds,
            panels_ms: panels_ms as f32,
            ..Taken::default()
        });
        self.display = display.to_vec();
        let display_ms = self.display_ms() as f32;
        if let Some(last) = self.frames.back_mut() {
            last.display_ms = display_ms;
        }
    }

    /// The renderer has spent so many milliseconds of the device in all, and a sample of all pixels took it
    /// so many: belongs to the last frame.
    pub fn device(&mut self, spent_ms: f64, sample_ms: f64) {
        // Another renderer begins at 0.
        let before = if spent_ms < self.spent_ms {
            0.0
        } else {
            self.spent_ms
        };
        if let Some(last) = self.frames.back_mut() {
            last.trace_ms = (spent_ms - before) as f32;
        }
        (self.spent_ms, self.sample_ms) = (spent_ms, sample_ms);
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
    fn a_frame_has_its_own_share_of_the_device() {
        let mut statistics = Statistics::default();
        let display = [Timing {
            name: "overlay",
            milliseconds: 0.5,
        }];
        let mut frame = |spent| {
            statistics.frame(0.1, 2.0, &display);
            statistics.device(spent, 7.0);
            *statistics.frames().back().unwrap()
        };
        assert_eq!(frame(10.0).trace_ms, 10.0);
        assert_eq!(frame(14.0).trace_ms, 4.0);
        // Another renderer.
        let third = frame(3.0);
        assert_eq!(
            (third.trace_ms, third.display_ms, third.panels_ms),
            (3.0, 0.5, 2.0)
        );
        assert_eq!(statistics.frame_ms(), [100.0, 100.0]);
    }
}
