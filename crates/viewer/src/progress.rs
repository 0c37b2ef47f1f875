//! The progress bar: samples, time left, speed, estimated error.

use crate::job::{AnyRenderer, Goal};
use anyhow::Result;
use indicatif::{ProgressBar, ProgressStyle};
use std::time::{Duration, Instant};

/// A progress bar on stderr, or nothing where stderr is no terminal.
#[derive(Debug)]
pub struct Progress {
    bar: Option<ProgressBar>,
    start: Instant,
    goal: Goal,
    /// When the film was last read for the figures, and how long that took.
    looked: Option<(Instant, Duration)>,
    figures: String,
}

/// Looking at the film may take this share of the time.
const SHARE: u32 = 20;

impl Progress {
    /// A bar for `goal` over a picture of `pixels`; nothing unless `visible` and stderr is a
    /// terminal.
    #[must_use]
    pub fn new(visible: bool, goal: &Goal, pixels: u64) -> Self {
        let bar = visible.then(|| {
            let style = ProgressStyle::with_template(
                "{spinner} [{wide_bar:.green}] {pos}/{len} samples  {msg}",
            )
            .unwrap_or_else(|_| ProgressStyle::default_bar())
            .progress_chars("=> ");
            let bar = ProgressBar::new(u64::from(goal.spp)).with_style(style);
            bar.set_message(format!("{pixels} pixels"));
            bar.enable_steady_tick(Duration::from_millis(250));
            bar
        });
        Self {
            bar: bar.filter(|b| !b.is_hidden()),
            start: Instant::now(),
            goal: *goal,
            looked: None,
            figures: String::new(),
        }
    }

    /// Shows `done` samples; reads the film for speed and error now and then.
    ///
    /// # Errors
    /// When the device fails.
    pub fn show(&mut self, done: u32, renderer: &mut dyn AnyRenderer) -> Result<()> {
        let Some(bar) = &self.bar else {
            return Ok(());
        };
        let due = self
            .looked
            .is_none_or(|(at, cost)| at.elapsed() > (cost * SHARE).max(Duration::from_secs(1)));
        if due {
            let before = Instant::now();
            let film = renderer.film()?;
            let rays = film.counters.rays as f64 / self.start.elapsed().as_secs_f64();
            self.figures = format!("{:.2} Mrays/s", rays / 1e6);
            let error = film.estimated_relmse();
            if error.is_finite() {
                self.figures += &format!("  relMSE {error:.2e}");
            }
            self.looked = Some((Instant::now(), before.elapsed()));
        }
        let left = time_left(&self.goal, done, self.start.elapsed());
        bar.set_position(u64::from(done));
        bar.set_message(format!("{} left  {}", clock(left), self.figures));
        Ok(())
    }

    /// Removes the bar.
    pub fn finish(&mut self, done: u32) {
        if let Some(bar) = self.bar.take() {
            bar.set_position(u64::from(done));
            bar.finish_and_clear();
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// Time until all samples are taken or the deadline is reached, after `done` of them in `elapsed`.
fn time_left(goal: &Goal, done: u32, elapsed: Duration) -> Duration {
    let per_sample = elapsed.as_secs_f64() / f64::from(done.max(1));
    // A picture that would take longer than a year is not waited for.
    let seconds = (per_sample * f64::from(goal.spp - done)).min(3e7);
    let all = Duration::from_secs_f64(seconds);
    match goal.deadline {
        Some(deadline) => all.min(deadline.saturating_duration_since(Instant::now())),
        None => all,
    }
}

/// `12s`, `3m05s`, `2h07m`.
fn clock(time: Duration) -> String {
    let s = time.as_secs();
    match s {
        0..60 => format!("{s}s"),
        60..3600 => format!("{}m{:02}s", s / 60, s % 60),
        _ => format!("{}h{:02}m", s / 3600, s / 60 % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_left_is_that_of_the_first_reason_to_stop() {
        let mut goal = Goal {
            spp: 100,
            deadline: None,
            target_error: None,
        };
        let ten = Duration::from_secs(10);
        assert_eq!(clock(time_left(&goal, 10, ten)), "1m30s");
        goal.deadline = Some(Instant::now() + Duration::from_millis(5900));
        assert_eq!(clock(time_left(&goal, 10, ten)), "5s");
        goal.deadline = Some(Instant::now() - ten);
        assert_eq!(clock(time_left(&goal, 10, ten)), "0s");
        assert_eq!(clock(Duration::from_secs(7620)), "2h07m");
    }
}
