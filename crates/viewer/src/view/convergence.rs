//! How good the picture of a resting eye is, estimated while it gets better, and when that is enough.

use crate::cli::PictureArgs;
use crate::job::{self, Stopped};
use std::time::{Duration, Instant};

/// Looking at the film may take this share of the time.
const SHARE: u32 = 20;
/// Points of the curve that are kept: at an eighth more samples each, more than any picture has.
const MOST: usize = 400;

/// A point of the curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Samples per pixel.
    pub samples: u32,
    /// Estimated relMSE.
    pub error: f64,
    /// Seconds that the picture was worked on.
    pub seconds: f64,
}

/// The curve of a picture.
#[derive(Debug)]
pub struct Convergence {
    points: Vec<Point>,
    /// Samples at the next look.
    next: u32,
    /// When the last look ended, and how long it took.
    looked: (Instant, Duration),
}

impl Default for Convergence {
    fn default() -> Self {
        Self {
            points: Vec::new(),
            next: 2,
            looked: (Instant::now(), Duration::ZERO),
        }
    }
}

impl Convergence {
    /// Another picture begins.
    pub fn restart(&mut self) {
        self.points.clear();
        self.next = 2;
    }

    /// The curve, by samples.
    #[must_use]
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// Samples at which the picture must rest for a look, if one matters: with a target its number of
    /// samples is the same as that of `runelight render`.
    #[must_use]
    pub fn rests_at(&self, target: Option<f64>) -> u32 {
        if target.is_some() {
            self.next
        } else {
            u32::MAX
        }
    }

    /// Whether it is time for a look.
    #[must_use]
    pub fn is_due(&self, samples: u32, target: Option<f64>) -> bool {
        let (at, cost) = self.looked;
        samples >= self.next && (target.is_some() || at.elapsed() > cost * SHARE)
    }

    /// The picture has been looked at, which began at a time.
    pub fn look(&mut self, point: Point, begun: Instant) {
        self.looked = (Instant::now(), begun.elapsed());
        let samples = point.samples;
        self.next = if samples < job::MIN_SAMPLES_FOR_ERROR {
            (samples + samples.div_ceil(2)).min(job::MIN_SAMPLES_FOR_ERROR)
        } else {
            job::next_check(samples)
        };
        if point.error.is_finite() && self.points.len() < MOST {
            self.points.push(point);
        }
    }

    /// Why a picture of so many samples, worked on for so many seconds, needs no more.
    #[must_use]
    pub fn stopped(&self, picture: &PictureArgs, samples: u32, seconds: f64) -> Option<Stopped> {
        let is_good = |target: f64| {
            let enough = |p: &Point| p.samples >= job::MIN_SAMPLES_FOR_ERROR && p.error <= target;
            self.points.last().is_some_and(enough)
        };
        if samples >= picture.spp {
            Some(Stopped::Complete)
        } else if picture.target_error.is_some_and(is_good) {
            Some(Stopped::TargetError)
        } else if samples > 0 && picture.time_limit.is_some_and(|limit| seconds >= limit) {
            Some(Stopped::Deadline)
        } else {
            None
        }
    }

    /// The exponent by which the error falls with the samples, of the second half of the curve: -1 where
    /// samples are independent. `None` of a few points.
    #[must_use]
    pub fn slope(&self) -> Option<f64> {
        let half = &self.points[self.points.len() / 2..];
        if half.len() < 3 {
            return None;
        }
        let logs = half
            .iter()
            .filter(|p| p.error > 0.0)
            .map(|p| [f64::from(p.samples).ln(), p.error.ln()]);
        let logs: Vec<[f64; 2]> = logs.collect();
        let n = logs.len() as f64;
        let mean = |i: usize| logs.iter().map(|p| p[i]).sum::<f64>() / n;
        let [x, y] = [mean(0), mean(1)];
        let over: f64 = logs.iter().map(|p| (p[0] - x) * (p[1] - y)).sum();
        let under: f64 = logs.iter().map(|p| (p[0] - x) * (p[0] - x)).sum();
        (under > 0.0).then(|| over / under)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::look::defaults;

    fn grown(target: Option<f64>, goal: u32) -> (Convergence, Vec<u32>) {
        let mut curve = Convergence::default();
        let mut looks = Vec::new();
        for samples in 1..=goal {
            if target.is_some() && samples >= curve.rests_at(target) || samples == curve.next {
                let point = Point {
                    samples,
                    error: 1.0 / f64::from(samples),
                    seconds: 0.0,
                };
                curve.look(point, Instant::now());
                looks.push(samples);
            }
        }
        (curve, looks)
    }

    #[test]
    fn the_curve_is_looked_at_where_render_looks() {
        let (curve, looks) = grown(Some(1e-9), 60);
        assert_eq!(
            looks,
            [
                2, 3, 5, 8, 12, 16, 18, 20, 22, 24, 27, 30, 33, 37, 41, 46, 51, 57
            ]
        );
        let slope = curve.slope().expect("a slope");
        assert!((slope + 1.0).abs() < 1e-9, "{slope}");
        assert_eq!(Convergence::default().slope(), None);
        assert_eq!(curve.rests_at(None), u32::MAX);
    }

    #[test]
    fn the_first_reason_to_stop_is_told() {
        let mut picture = defaults().picture;
        picture.spp = 100;
        let (curve, _) = grown(None, 20);
        assert_eq!(curve.stopped(&picture, 20, 1e9), None);
        assert_eq!(curve.stopped(&picture, 100, 0.0), Some(Stopped::Complete));
        picture.target_error = Some(0.05);
        assert_eq!(curve.stopped(&picture, 20, 0.0), Some(Stopped::TargetError));
        picture.target_error = Some(0.01);
        assert_eq!(curve.stopped(&picture, 20, 0.0), None);
        picture.time_limit = Some(3.0);
        assert_eq!(curve.stopped(&picture, 20, 3.0), Some(Stopped::Deadline));
        assert_eq!(curve.stopped(&picture, 0, 3.0), None);
        // A handful of samples knows nothing of its error.
        let (few, _) = grown(None, 10);
        picture.target_error = Some(1.0);
        assert_eq!(few.stopped(&picture, 10, 0.0), None);
    }
}
