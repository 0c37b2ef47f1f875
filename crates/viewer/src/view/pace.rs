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
    /// What a slice takes.
    cost: Cost,
    /// Samples of each pixel, on average, of the slice that was handed out last; `None` once it was measured.
    share: Option<f64>,
    /// Samples that every pixel has.
    done: u32,
    /// Rows that have one more.
    rows: u32,
    /// Rows of the last slice that was one of rows.
    last_rows: u32,
}

/// Pictures are never smaller than one pixel for so many of the window's, across and down.
pub const COARSEST: u32 = 8;

/// The share of a picture that the very first slice takes, before anything was measured.
const FIRST_SHARE: u32 = 16;

/// Milliseconds that a slice may take beside the same again for what every slice costs.
const MOST_BESIDE_MS: f64 = 50.0;

/// Share of what was known that a new measure leaves.
const REMEMBERED: f64 = 0.8;

/// What a slice takes, in milliseconds for each pixel of the picture: something for every pixel that is asked, also
/// where it gets nothing, and something for each sample. A line through the last slices.
#[derive(Clone, Debug, Default, PartialEq)]
struct Cost {
    /// Weight, and sums of x, y, x x, x y: samples per pixel and milliseconds.
    sums: [f64; 5],
    /// For every pixel of a slice.
    fixed: f64,
    /// For each sample of a pixel, at least something; 0 before the first measure.
    each: f64,
}

impl Cost {
    fn learn(&mut self, share: f64, ms: f64) {
        let new = [1.0, share, ms, share * share, share * ms];
        for (sum, new) in self.sums.iter_mut().zip(new) {
            *sum = *sum * REMEMBERED + new;
        }
        let [n, x, y, xx, xy] = self.sums;
        let spread = n * xx - x * x;
        // Slices that are all alike do not tell one from the other.
        if spread > 1e-3 * n * xx {
            let slope = (n * xy - x * y) / spread;
            self.fixed = ((y - slope * x) / n).clamp(0.0, y / n);
        }
        self.each = ((y - n * self.fixed) / x).max(0.05 * y / x);
    }

    /// A sample of all pixels, of each; `None` before the first measure.
    fn sample(&self) -> Option<f64> {
        (self.each > 0.0).then_some(self.fixed + self.each)
    }

    /// How many samples of all pixels fit into a budget; where every slice costs more than half of that, as much
    /// again as that, so that it is spent on samples, but no more than `most`.
    fn fits(&self, budget: f64, most: f64) -> Option<f64> {
        let left = (budget - self.fixed).max(self.fixed.min(most));
        (self.each > 0.0).then(|| left / self.each)
    }
}

impl Default for Pace {
    fn default() -> Self {
        Self {
            budget_ms: 25.0,
            most_samples: 16,
            cost: Cost::default(),
            share: None,
            done: 0,
            rows: 0,
            last_rows: 0,
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
        self.cost = Cost::default();
    }

    /// Learns from the slice that was handed out last how long one sample of a whole picture of `size` takes, at
    /// its pace.
    pub fn learn(&mut self, size: [u32; 2], sample_ms: f64) {
        if let Some(share) = self.share.take().filter(|_| sample_ms > 0.0) {
            let share = share.min(1.0);
            self.cost.learn(share, sample_ms * share / pixels(size));
        }
    }

    /// The next slice of a picture of `size` that shall get `goal` samples; `None` when it has them.
    /// `whole` asks for a whole sample whatever it takes.
    pub fn next(&mut self, size: [u32; 2], goal: u32, whole: bool) -> Option<Slice> {
        let height = size[1];
        if self.done >= goal && self.rows == 0 {
            return None;
        }
        let fits = (self.cost).fits(self.budget_ms / pixels(size), MOST_BESIDE_MS / pixels(size));
        let slice = match fits {
            _ if self.rows > 0 && whole => Slice::Rows(self.rows..height),
            Some(samples) if samples >= 1.0 && self.rows == 0 => {
                let most = self.most_samples.min(goal - self.done).max(1);
                Slice::Samples((samples as u32).clamp(1, most))
            }
            _ if whole && self.rows == 0 => Slice::Samples(1),
            _ => {
                let share = fits.unwrap_or(1.0 / f64::from(FIRST_SHARE));
                let mut rows = ((share * f64::from(height)) as u32).max(1);
                // Slices that are all alike do not tell what each costs besides its rows.
                if rows == self.last_rows {
                    rows += rows.div_ceil(2);
                }
                self.last_rows = rows;
                Slice::Rows(self.rows..(self.rows + rows).min(height))
            }
        };
        match &slice {
            Slice::Samples(n) => self.done += n,
            Slice::Rows(rows) => self.rows = rows.end,
        }
        self.share = Some(match &slice {
            Slice::Samples(n) => f64::from(*n),
            Slice::Rows(rows) => f64::from(rows.end - rows.start) / f64::from(height),
        });
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
        let Some(pixel_ms) = self.cost.sample() else {
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
        // What was measured once is not measured again.
        pace.learn(SIZE, 100.0);
        pace.learn(SIZE, 1e9);
        pace.forget();
        pace.next(SIZE, 9, false);
        pace.learn(SIZE, 1.0);
        // The sample that was begun is finished by rows.
        assert_eq!(pace.next(SIZE, 9, false), Some(Slice::Rows(14..40)));
        assert_eq!((pace.samples(), pace.is_even()), (1, true));
        assert_eq!(pace.next(SIZE, 9, false), Some(Slice::Samples(8)));
        assert_eq!(pace.next(SIZE, 9, false), None);
        pace.restart();
        assert_eq!(pace.next(SIZE, 9999, false), Some(Slice::Samples(16)));
        // A lower goal than what is there.
        assert_eq!(pace.next(SIZE, 3, false), None);
    }

    /// A device that takes 20 ms for whatever slice, and a second for a sample, is not asked for a row at a time.
    #[test]
    fn slices_are_worth_what_they_cost() {
        let mut pace = Pace {
            budget_ms: 15.0,
            ..Pace::default()
        };
        let size = [1000, 400];
        let (mut slices, mut longest) = (0, 0.0_f64);
        while pace.samples() < 1 {
            let Some(Slice::Rows(rows)) = pace.next(size, 1, false) else {
                panic!("rows");
            };
            let share = f64::from(rows.end - rows.start) / 400.0;
            let ms = 20.0 + 1000.0 * share;
            slices += 1;
            if slices > 3 {
                longest = longest.max(ms);
            }
            pace.learn(size, ms / share);
        }
        assert!(
            slices < 60 && longest < 55.0,
            "{slices} slices of {longest} ms"
        );
        // One that costs nothing beside its samples keeps to its budget.
        let mut pace = Pace::default();
        for _ in 0..20 {
            pace.next(size, 100, false);
            pace.learn(size, 1000.0);
        }
        assert!(pace.cost.fixed * pixels(size) < 1e-6);
        let Some(Slice::Rows(rows)) = pace.next(size, 100, false) else {
            panic!("rows");
        };
        assert!(
            [9, 10, 14, 15].contains(&(rows.end - rows.start)),
            "{rows:?}"
        );
        // One that begins to take 40 ms besides is found out, though its slices are down to a row then.
        let mut last = 0;
        for _ in 0..60 {
            let Some(Slice::Rows(rows)) = pace.next(size, 100, false) else {
                panic!("rows");
            };
            last = rows.end - rows.start;
            let share = f64::from(last) / 400.0;
            pace.learn(size, (40.0 + 1000.0 * share) / share);
        }
        assert!((8..32).contains(&last), "{last}");
    }

    #[test]
    fn whole_samples_are_finished_at_once() {
        let mut pace = Pace::default();
        pace.next(SIZE, 9, false);
        pace.learn(SIZE, 1000.0);
        pace.restart();
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
            pace.forget();
            pace.next(SIZE, 9, true);
            pace.learn(SIZE, ms);
            assert_eq!(pace.coarseness(SIZE), n, "{ms} ms");
        }
        assert_eq!(coarse([100, 5], 8), [12, 1]);
    }
}
