//! Pictures or poses that follow each other and begin again: the groups of models and sprites.

use crate::reader::Reader;

/// Seconds that each part of a group is shown where the file's own times are of no use.
const DEFAULT_STEP: f32 = 0.1;

/// The times of a group: part `i` is shown until `ends[i]`, then the next one, and after the last one
/// the first again.
#[derive(Clone, Debug, PartialEq)]
pub struct Cycle {
    /// At least one; they never fall, and the last one is above 0.
    ends: Box<[f32]>,
}

impl Cycle {
    /// The cycle of `ends`, cumulative and in seconds, and whether they could be used: where one is not
    /// above 0, or they fall, each part takes a tenth of a second instead. There is always a part.
    pub fn new(ends: &[f32]) -> (Self, bool) {
        let rise = ends.is_sorted() && ends.iter().all(|&e| e > 0.0 && e.is_finite());
        let ends = if rise && !ends.is_empty() {
            ends.into()
        } else {
            (1..=ends.len().max(1))
                .map(|i| i as f32 * DEFAULT_STEP)
                .collect()
        };
        (Self { ends }, rise)
    }

    /// `n` times of a file.
    pub(crate) fn read(r: &mut Reader<'_>, n: usize) -> Option<(Self, bool)> {
        let times = r.take(n.checked_mul(4)?)?;
        let (times, _) = times.as_chunks::<4>();
        let times: Vec<f32> = times.iter().map(|&t| f32::from_le_bytes(t)).collect();
        Some(Self::new(&times))
    }

    /// How many parts there are; at least 1.
    pub fn parts(&self) -> usize {
        self.ends.len()
    }

    /// Seconds until it begins again; above 0.
    pub fn seconds(&self) -> f32 {
        self.ends.last().copied().unwrap_or(DEFAULT_STEP)
    }

    /// Which part is shown at `time` (seconds, may be negative), and how much of its own time has gone
    /// by then, 0 to below 1.
    pub fn at(&self, time: f64) -> (usize, f32) {
        let wrapped = time.rem_euclid(f64::from(self.seconds()));
        let time = if wrapped.is_finite() { wrapped } else { 0.0 };
        let last = self.ends.len() - 1;
        let part = (self.ends.iter())
            .position(|&end| f64::from(end) > time)
            .unwrap_or(last);
        let end_of = |part: usize| self.ends.get(part).map_or(0.0, |&e| f64::from(e));
        let begin = part.checked_sub(1).map_or(0.0, end_of);
        let gone = (time - begin) / (end_of(part) - begin);
        let below_1 = 1.0 - f32::EPSILON;
        let gone = if gone.is_finite() { gone as f32 } else { 0.0 };
        (part, gone.clamp(0.0, below_1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_shown_until_their_end_and_begin_again() {
        let (cycle, used) = Cycle::new(&[0.1, 0.3, 0.4]);
        assert!(used);
        assert_eq!(cycle.parts(), 3);
        for (time, part, gone) in [
            (0.0, 0, 0.0),
            (0.05, 0, 0.5),
            (0.15, 1, 0.25),
            (0.35, 2, 0.5),
            (0.45, 0, 0.5),
            (4.05, 0, 0.5),
            (-0.05, 2, 0.5),
        ] {
            let (p, g) = cycle.at(time);
            assert_eq!(p, part, "{time}");
            assert!((g - gone).abs() < 1e-4, "{time}: {g}");
        }
    }

    #[test]
    fn useless_times_give_tenths_of_a_second() {
        for ends in [&[0.0, 0.1][..], &[0.2, 0.1], &[f32::NAN, 1.0], &[-1.0, 1.0]] {
            let (cycle, used) = Cycle::new(ends);
            assert!(!used);
            assert_eq!(cycle.seconds(), 0.2);
            assert_eq!(cycle.at(0.15).0, 1);
        }
        let (cycle, _) = Cycle::new(&[]);
        assert_eq!((cycle.parts(), cycle.at(1e30).0), (1, 0));
        assert_eq!(cycle.at(f64::INFINITY), (0, 0.0));
    }

    #[test]
    fn parts_without_time_are_passed_over() {
        let (cycle, used) = Cycle::new(&[0.1, 0.1, 0.2]);
        assert!(used);
        assert_eq!(cycle.at(0.15).0, 2);
    }
}
