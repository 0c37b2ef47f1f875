//! How much is traced in one frame of the window: whole samples where the device is fast, some rows of
//! one where it is slow, so that the interface never waits long. While the camera moves the picture
//! gets smaller instead.

use std::ops::Range;

/// What to trace next.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Slice {
    /// So many samples of every pixel.
    Samples(u32),
    /// One sample of every pixel of these rows.
    Rows(Range<u32>),
}

/// Work for the device, measured and handed out.
#[derive(Clone, Debug, PartialEq)]
pub struct Pace {
    /// Milliseconds of tracing in a frame, at most.
    pub budget_ms: f64,
    /// Samples that a frame takes at most, however fast the device is.
    pub most_samples: u32,
    /// Milliseconds that a sample of a pixel takes; `None` before the first measure.
    pixel_ms: Option<f64>,
    /// Samples that every pixel has.
    done: u32,
    /// Rows that have one more.
    rows: u32,
}

/// Pictures are never smaller than one pixel for so many of the window's, across and down.
pub const COARSEST: u32 = 8;

/// The share of a picture that the very first slice takes, before anything was measured.
const FIRST_SHARE: u32 = 16;

impl Default for Pace {
    fn default() -> Self {
        Self {
            budget_ms: 25.0,
            most_samples: 16,
            pixel_ms: None,
            done: 0,
            rows: 0,
        }
    }
}

impl Pace {
    /// Samples that every pixel has.
    #[must_use]
    pub fn samples(&self) -> u32 {
        self.done
    }

    /// Samples per pixel so far, parts included.
    #[must_use]
    pub fn progress(&self, height: u32) -> f64 {
        f64::from(self.done) + f64::from(self.rows) / f64::from(height.max(1))
    }

    /// Whether all pixels have as many samples.
    #[must_use]
    pub fn is_even(&self) -> bool {
        self.rows == 0
    }

    /// A new picture begins. What was learned about the device stays.
    pub fn restart(&mut self) {
        (self.done, self.rows) = (0, 0);
    }

    /// Forgets how long a sample takes: another scene, another way to trace.
    pub fn forget(&mut self) {
        self.pixel_ms = None;
    }

    /// Learns how long one sample of a whole picture of `size` took.
    pub fn learn(&mut self, size: [u32; 2], sample_ms: f64) {
        if sample_ms > 0.0 {
            self.pixel_ms = Some(sample_ms / pixels(size));
        }
    }

    /// The next slice of a picture of `size` that shall get `goal` samples; `None` when it has them.
    /// `whole` asks for a whole sample whatever it takes.
    pub fn next(&mut self, size: [u32; 2], goal: u32, whole: bool) -> Option<Slice> {
        let height = size[1];
        if self.done >= goal && self.rows == 0 {
            return None;
        }
        let fits = self.pixel_ms.map(|ms| self.budget_ms / (ms * pixels(size)));
        let slice = match fits {
            _ if self.rows > 0 && whole => Slice::Rows(self.rows..height),
            Some(samples) if samples >= 1.0 && self.rows == 0 => {
                let most = self.most_samples.min(goal - self.done).max(1);
                Slice::Samples((samples as u32).clamp(1, most))
            }
            _ if whole && self.rows == 0 => Slice::Samples(1),
            _ => {
                let share = fits.unwrap_or(1.0 / f64::from(FIRST_SHARE));
                let rows = ((share * f64::from(height)) as u32).max(1);
                Slice::Rows(self.rows..(self.rows + rows).min(height))
            }
        };
        match &slice {
            Slice::Samples(n) => self.done += n,
            Slice::Rows(rows) => self.rows = rows.end,
        }
        if self.rows == height {
            self.done += 1;
            self.rows = 0;
        }
        Some(slice)
    }

    /// How many of the window's pixels one of the picture stands for, across and down, while the
    /// camera moves: 1, 2, 4 or [`COARSEST`], so that a sample of the picture fits the budget.
    #[must_use]
    pub fn coarseness(&self, size: [u32; 2]) -> u32 {
        let Some(pixel_ms) = self.pixel_ms else {
            return COARSEST;
        };
        let fits = |n: &u32| pixel_ms * pixels(coarse(size, *n)) <= self.budget_ms;
        [1, 2, 4].into_iter().find(fits).unwrap_or(COARSEST)
    }
}

fn pixels([width, height]: [u32; 2]) -> f64 {
    f64::from(width) * f64::from(height)
}

/// The size of a picture of which each pixel stands for `n` by `n` of the window's.
#[must_use]
pub fn coarse(size: [u32; 2], n: u32) -> [u32; 2] {
    size.map(|side| (side / n).max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [100, 40];

    #[test]
    fn slow_devices_get_rows_and_fast_ones_samples() {
        let mut pace = Pace::default();
        // Nothing is known yet.
        assert_eq!(pace.next(SIZE, 9, false), Some(Slice::Rows(0..2)));
        pace.learn(SIZE, 100.0);
        assert_eq!(pace.next(SIZE, 9, false), Some(Slice::Rows(2..12)));
        pace.learn(SIZE, 1.0);
        // The sample that was begun is finished by rows.
        assert_eq!(pace.next(SIZE, 9, false), Some(Slice::Rows(12..40)));
        assert_eq!((pace.samples(), pace.is_even()), (1, true));
        assert_eq!(pace.next(SIZE, 9, false), Some(Slice::Samples(8)));
        assert_eq!(pace.next(SIZE, 9, false), None);
        pace.restart();
        assert_eq!(pace.next(SIZE, 9999, false), Some(Slice::Samples(16)));
        // A lower goal than what is there.
        assert_eq!(pace.next(SIZE, 3, false), None);
    }

    #[test]
    fn whole_samples_are_finished_at_once() {
        let mut pace = Pace::default();
        pace.learn(SIZE, 1000.0);
        assert_eq!(pace.next(SIZE, 9, false), Some(Slice::Rows(0..1)));
        assert!((pace.progress(40) - 1.0 / 40.0).abs() < 1e-9);
        assert_eq!(pace.next(SIZE, 9, true), Some(Slice::Rows(1..40)));
        assert_eq!(pace.next(SIZE, 9, true), Some(Slice::Samples(1)));
        assert_eq!((pace.samples(), pace.is_even()), (2, true));
        // A sample that was begun is finished, also beyond the goal.
        pace.next(SIZE, 9, false);
        assert!(pace.next(SIZE, 1, false).is_some());
    }

    #[test]
    fn every_pixel_gets_every_sample_once() {
        let mut pace = Pace::default();
        let (mut rows, mut all) = (vec![0; 40], 0);
        for ms in [500.0, 3.0, 90.0, 1e6, 0.5, 40.0].iter().cycle() {
            match pace.next(SIZE, 7, false) {
                None => break,
                Some(Slice::Samples(n)) => all += n,
                Some(Slice::Rows(range)) => range.for_each(|row| rows[row as usize] += 1),
            }
            pace.learn(SIZE, *ms);
        }
        assert!(rows.iter().all(|r| r + all == 7), "{rows:?} and {all}");
        assert_eq!(pace.samples(), 7);
    }

    #[test]
    fn pictures_get_coarser_where_they_would_be_slow() {
        let mut pace = Pace::default();
        assert_eq!(pace.coarseness(SIZE), COARSEST);
        for (ms, n) in [(10.0, 1), (26.0, 2), (101.0, 4), (401.0, 8), (1e9, 8)] {
            pace.learn(SIZE, ms);
            assert_eq!(pace.coarseness(SIZE), n, "{ms} ms");
        }
        assert_eq!(coarse([100, 5], 8), [12, 1]);
    }
}
