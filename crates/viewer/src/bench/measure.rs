//! Runs that are timed: one renderer, several budgets on its way.

use super::result::Budget;
use crate::job::AnyRenderer;
use anyhow::Result;
use scene::render::{Counters, Film};
use std::time::{Duration, Instant};

/// How long a call should take: short enough for Ctrl-C.
const CALL: Duration = Duration::from_millis(250);

/// The picture when a budget was used up.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// The budget.
    pub budget: Budget,
    /// Samples per pixel.
    pub samples: u32,
    /// Seconds of rendering for them.
    pub seconds: f64,
    /// What was counted.
    pub counters: Counters,
    /// Mean radiance.
    pub beauty: Vec<[f32; 3]>,
    /// Variance of that mean.
    pub variance: Vec<[f32; 3]>,
    /// The renderer's own estimate of its relMSE.
    pub estimated_relmse: f64,
}

impl Snapshot {
    fn new(budget: Budget, seconds: f64, film: Film) -> Self {
        Self {
            budget,
            samples: film.samples,
            seconds,
            counters: film.counters,
            estimated_relmse: film.estimated_relmse(),
            beauty: film.beauty,
            variance: film.variance,
        }
    }
}

/// Renders through all `budgets` and keeps the picture at each; `None` if `stop` said so before
/// the last.
///
/// The budgets of a run share its samples: the picture of 64 samples goes on to be that of 256.
/// Time is that of the calls that take samples, until they are taken. The first sample is not timed, because the first
/// dispatch of a renderer is not like the others; it counts as the mean of the timed ones. A
/// budget in seconds ends before the sample that would exceed it, but not before the second.
///
/// # Errors
/// When the device fails.
pub fn run(
    renderer: &mut dyn AnyRenderer,
    budgets: &[Budget],
    stop: &dyn Fn() -> bool,
) -> Result<Option<Vec<Snapshot>>> {
    let mut snapshots: Vec<Option<Snapshot>> = vec![None; budgets.len()];
    renderer.accumulate(1)?;
    renderer.finish()?;
    let (mut done, mut timed) = (1u32, 0.0f64);
    loop {
        let per_sample = timed / f64::from((done - 1).max(1));
        let elapsed = timed + per_sample;
        // Samples that still fit into a budget; 0 when it is used up.
        let left = |budget: &Budget| match *budget {
            Budget::Samples(n) => n.saturating_sub(done),
            Budget::Seconds(_) if done < 2 => 1,
            Budget::Seconds(s) => ((s - elapsed) / per_sample.max(1e-9)).max(0.0) as u32,
        };
        let mut film = None;
        for (budget, snapshot) in budgets.iter().zip(&mut snapshots) {
            if snapshot.is_none() && left(budget) == 0 {
                if film.is_none() {
                    film = Some(renderer.film()?);
                }
                *snapshot = (film.clone()).map(|film| Snapshot::new(*budget, elapsed, film));
            }
        }
        let waiting = (budgets.iter().zip(&snapshots)).filter(|(_, s)| s.is_none());
        let Some(next) = waiting.map(|(budget, _)| left(budget)).min() else {
            break;
        };
        if stop() {
            return Ok(None);
        }
        // Few calls: each costs time that is not spent on samples.
        let quick = match done {
            1 => 1,
            _ => (CALL.as_secs_f64() / per_sample.max(1e-9)) as u32,
        };
        let samples = next.min(quick).max(1);
        let start = Instant::now();
        renderer.accumulate(samples)?;
        renderer.finish()?;
        timed += start.elapsed().as_secs_f64();
        done += samples;
    }
    Ok(Some(snapshots.into_iter().flatten().collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene::Frame;
    use std::cell::Cell;

    /// Counts samples at once, and sleeps over each when waited for, as a device works on.
    #[derive(Default)]
    struct Fake {
        samples: u32,
        waiting: u32,
        sleep: Duration,
    }

    impl AnyRenderer for Fake {
        fn accumulate(&mut self, samples: u32) -> Result<()> {
            self.samples += samples;
            self.waiting += samples;
            Ok(())
        }

        fn finish(&mut self) -> Result<()> {
            std::thread::sleep(self.sleep * std::mem::take(&mut self.waiting));
            Ok(())
        }

        fn film(&mut self) -> Result<Film> {
            Ok(Film {
                samples: self.samples,
                ..Film::default()
            })
        }

        fn accumulate_per_pixel(&mut self, _: &[u32]) -> Result<()> {
            unreachable!("pixels are treated alike")
        }

        fn show(&mut self, _: &Frame) -> Result<()> {
            unreachable!("nothing moves")
        }

        fn restart(&mut self, _: u64) -> Result<()> {
            unreachable!("there is one picture")
        }
    }

    #[test]
    fn every_budget_gets_its_picture_in_the_order_asked() {
        let mut fake = Fake {
            sleep: Duration::from_millis(2),
            ..Fake::default()
        };
        let budgets = [
            Budget::Samples(2),
            Budget::Samples(24),
            Budget::Seconds(1e-4),
            Budget::Seconds(0.03),
        ];
        let shots = run(&mut fake, &budgets, &|| false).unwrap().unwrap();
        let samples: Vec<u32> = shots.iter().map(|s| s.samples).collect();
        assert_eq!((samples[0], samples[1], samples[2]), (2, 24, 2));
        // Fewer than the 15 of 2 ms each, because a sleep is never shorter than asked.
        assert!((2..=15).contains(&samples[3]), "{samples:?}");
        assert!(shots[1].seconds >= 24.0 * 2e-3);
    }

    #[test]
    fn a_stop_gives_nothing_half() {
        let mut fake = Fake::default();
        let polls = Cell::new(0);
        let second = || {
            polls.set(polls.get() + 1);
            polls.get() == 2
        };
        let shots = run(&mut fake, &[Budget::Samples(1000)], &second).unwrap();
        assert!(shots.is_none());
    }
}
