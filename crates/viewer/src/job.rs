//! Samples until enough: the loop around a renderer, with its progress and its reasons to stop.

use crate::progress::Progress;
use anyhow::{Result, bail};
use scene::Frame;
use scene::render::{Film, Renderer};
use std::time::{Duration, Instant};

/// A [`Renderer`] of any kind.
pub trait AnyRenderer {
    /// See [`Renderer::accumulate`].
    ///
    /// # Errors
    /// When the device fails.
    fn accumulate(&mut self, samples: u32) -> Result<()>;
    /// See [`Renderer::accumulate_per_pixel`].
    ///
    /// # Errors
    /// When the device fails.
    fn accumulate_per_pixel(&mut self, samples: &[u32]) -> Result<()>;
    /// See [`Renderer::show`].
    ///
    /// # Errors
    /// When the frame contradicts the scene, or the device fails.
    fn show(&mut self, frame: &Frame) -> Result<()>;
    /// See [`Renderer::restart`].
    ///
    /// # Errors
    /// When the device fails.
    fn restart(&mut self, seed: u64) -> Result<()>;
    /// See [`Renderer::finish`].
    ///
    /// # Errors
    /// When the device fails.
    fn finish(&mut self) -> Result<()>;
    /// See [`Renderer::film`].
    ///
    /// # Errors
    /// When the device fails.
    fn film(&mut self) -> Result<Film>;
}

impl<R: Renderer> AnyRenderer for R {
    fn accumulate(&mut self, samples: u32) -> Result<()> {
        Ok(Renderer::accumulate(self, samples)?)
    }

    fn accumulate_per_pixel(&mut self, samples: &[u32]) -> Result<()> {
        Ok(Renderer::accumulate_per_pixel(self, samples)?)
    }

    fn show(&mut self, frame: &Frame) -> Result<()> {
        Ok(Renderer::show(self, frame)?)
    }

    fn restart(&mut self, seed: u64) -> Result<()> {
        Ok(Renderer::restart(self, seed)?)
    }

    fn finish(&mut self) -> Result<()> {
        Ok(Renderer::finish(self)?)
    }

    fn film(&mut self) -> Result<Film> {
        Ok(Renderer::film(self)?)
    }
}

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub struct Goal {
    /// Samples per pixel, > 0.
    pub spp: u32,
    /// Take no samples after this moment.
    pub deadline: Option<Instant>,
    /// Stop below this estimated relMSE.
    pub target_error: Option<f64>,
}

/// Why the loop stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stopped {
    /// All samples were taken.
    Complete,
    /// The time was up.
    Deadline,
    /// The picture is good enough.
    TargetError,
    /// The user asked to finish.
    Interrupted,
}

impl Stopped {
    /// The name in JSON.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Complete => "complete",
            Self::Deadline => "time limit",
            Self::TargetError => "target error",
            Self::Interrupted => "interrupted",
        }
    }
}

/// Samples before an estimated error is believed: the variance of a handful of samples misses
/// whatever light they have not found yet.
pub(crate) const MIN_SAMPLES_FOR_ERROR: u32 = 16;

/// The number of samples at which the estimated error is looked at after a look at `done`: looking costs a
/// read-back, so the numbers grow evenly.
pub(crate) fn next_check(done: u32) -> u32 {
    done + (done / 8).max(1)
}

/// How long a call should take: short enough for Ctrl-C and a lively bar, long enough that the
/// call itself costs nothing.
const CALL: Duration = Duration::from_millis(250);

/// Takes samples until `goal` or `interrupted`.
///
/// The number of samples of a call follows the clock; the picture does not, because renderers give
/// the same one however its samples are split into calls, and because the estimated error is
/// looked at after fixed numbers of samples.
///
/// # Errors
/// When the device fails, or the user interrupts before the first sample.
pub fn run(
    renderer: &mut dyn AnyRenderer,
    goal: &Goal,
    progress: &mut Progress,
    interrupted: &dyn Fn() -> bool,
) -> Result<Stopped> {
    let start = Instant::now();
    let mut done = 0;
    let mut next_look = MIN_SAMPLES_FOR_ERROR;
    loop {
        if interrupted() {
            if done == 0 {
                bail!("interrupted before the first sample; nothing was written");
            }
            return Ok(Stopped::Interrupted);
        }
        // Without any sample there is neither a picture nor a speed: one is taken in any case.
        let mut samples = 1;
        if done > 0 {
            let per_sample = start.elapsed().as_secs_f64() / f64::from(done);
            if let Some(deadline) = goal.deadline {
                let left = deadline.saturating_duration_since(Instant::now());
                if that_fit(left, per_sample) == 0 {
                    return Ok(Stopped::Deadline);
                }
                samples = that_fit(left.min(CALL), per_sample);
            } else {
                samples = that_fit(CALL, per_sample);
            }
            // Never more than twice what was taken so far: the first samples are no measure.
            samples = samples.clamp(1, done).min(goal.spp - done);
            if goal.target_error.is_some() {
                samples = samples.min(next_look - done);
            }
        }
        renderer.accumulate(samples)?;
        done += samples;
        tracing::debug!("{done} samples");
        if done == goal.spp {
            progress.finish(done);
            return Ok(Stopped::Complete);
        }
        if let Some(target) = goal.target_error
            && done >= next_look
        {
            if renderer.film()?.estimated_relmse() <= target {
                progress.finish(done);
                return Ok(Stopped::TargetError);
            }
            next_look = next_check(done);
        }
        progress.show(done, renderer)?;
    }
}

/// How many samples are likely to fit into `time`.
fn that_fit(time: Duration, seconds_per_sample: f64) -> u32 {
    (time.as_secs_f64() / seconds_per_sample.max(1e-9)) as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    /// Counts samples; its error falls as one over their number.
    #[derive(Default)]
    struct Fake {
        samples: u32,
        calls: Vec<u32>,
        sleep: Duration,
    }

    impl AnyRenderer for Fake {
        fn accumulate(&mut self, samples: u32) -> Result<()> {
            self.samples += samples;
            self.calls.push(samples);
            std::thread::sleep(self.sleep);
            Ok(())
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

        fn finish(&mut self) -> Result<()> {
            Ok(())
        }

        fn film(&mut self) -> Result<Film> {
            let beauty = (1.0f64 - scene::render::RELMSE_EPSILON).sqrt() as f32;
            Ok(Film {
                width: 1,
                height: 1,
                samples: self.samples,
                beauty: vec![[beauty; 3]],
                variance: vec![[1.0 / self.samples as f32; 3]],
                ..Film::default()
            })
        }
    }

    fn goal(spp: u32) -> Goal {
        Goal {
            spp,
            deadline: None,
            target_error: None,
        }
    }

    fn hidden() -> Progress {
        Progress::new(false, &goal(1), 1)
    }

    #[test]
    fn all_samples_are_taken_and_no_more() {
        let mut fake = Fake::default();
        let stopped = run(&mut fake, &goal(10), &mut hidden(), &|| false).unwrap();
        assert_eq!((stopped, fake.samples), (Stopped::Complete, 10));
        assert!(
            fake.calls.len() < 10,
            "fast samples share a call: {:?}",
            fake.calls
        );
    }

    #[test]
    fn a_deadline_in_the_past_still_gives_one_sample() {
        let mut fake = Fake::default();
        let goal = Goal {
            deadline: Some(Instant::now()),
            ..goal(100)
        };
        let stopped = run(&mut fake, &goal, &mut hidden(), &|| false).unwrap();
        assert_eq!((stopped, fake.calls), (Stopped::Deadline, vec![1]));
    }

    #[test]
    fn slow_samples_are_taken_one_by_one_until_the_next_would_be_late() {
        let mut fake = Fake {
            sleep: Duration::from_millis(300),
            ..Fake::default()
        };
        let goal = Goal {
            deadline: Some(Instant::now() + Duration::from_millis(800)),
            ..goal(100)
        };
        let stopped = run(&mut fake, &goal, &mut hidden(), &|| false).unwrap();
        assert_eq!(stopped, Stopped::Deadline);
        assert!(
            fake.samples <= 2 && fake.calls.iter().all(|&c| c == 1),
            "{:?}",
            fake.calls
        );
        assert_eq!(that_fit(Duration::from_secs(5), 2.0), 2);
    }

    #[test]
    fn the_target_error_is_believed_only_after_some_samples() {
        let mut fake = Fake::default();
        let goal = Goal {
            target_error: Some(0.5),
            ..goal(1000)
        };
        let stopped = run(&mut fake, &goal, &mut hidden(), &|| false).unwrap();
        assert_eq!(
            (stopped, fake.samples),
            (Stopped::TargetError, MIN_SAMPLES_FOR_ERROR)
        );
    }

    #[test]
    fn an_interruption_keeps_what_there_is() {
        let mut fake = Fake::default();
        let polls = Cell::new(0);
        let third = || {
            polls.set(polls.get() + 1);
            polls.get() == 3
        };
        let stopped = run(&mut fake, &goal(10), &mut hidden(), &third).unwrap();
        assert_eq!((stopped, fake.samples), (Stopped::Interrupted, 2));
        let error = run(&mut fake, &goal(10), &mut hidden(), &|| true).unwrap_err();
        assert!(error.to_string().contains("before the first sample"));
    }
}
