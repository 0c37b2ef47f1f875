//! The progress bar: samples, time left, speed, estimated error.

use crate::clip::Reached;
use crate::job::{AnyRenderer, Goal};
use anyhow::Result;
use indicatif::{ProgressBar, ProgressStyle};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A progress bar on stderr, or nothing where stderr is no terminal.
#[derive(Debug)]
pub struct Progress {
    bar: Option<ProgressBar>,
    /// Who is told besides.
    told: Option<Arc<Reached>>,
    start: Instant,
    goal: Goal,
    /// Pictures in all.
    frames: u32,
    /// Pictures that are done.
    frame: u32,
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
        const SAMPLES: &str = "{spinner} [{wide_bar:.green}] {pos}/{len} samples  {msg}";
        Self::with(visible, goal, 1, SAMPLES, format!("{pixels} pixels"))
    }

    /// A bar for as many pictures, each with the same `goal`.
    #[must_use]
    pub fn of_frames(visible: bool, goal: &Goal, frames: u32) -> Self {
        const FRAMES: &str = "{spinner} [{wide_bar:.green}] {msg}";
        let message = format!("{frames} frames");
        Self::with(visible, goal, frames, FRAMES, message)
    }

    fn with(visible: bool, goal: &Goal, frames: u32, template: &str, message: String) -> Self {
        let bar = visible.then(|| {
            let style = ProgressStyle::with_template(template)
                .unwrap_or_else(|_| ProgressStyle::default_bar())
                .progress_chars("=> ");
            let length = u64::from(goal.spp) * u64::from(frames);
            let bar = ProgressBar::new(length).with_style(style);
            bar.set_message(message);
            bar.enable_steady_tick(Duration::from_millis(250));
            bar
        });
        Self {
            bar: bar.filter(|b| !b.is_hidden()),
            told: None,
            start: Instant::now(),
            goal: *goal,
            frames,
            frame: 0,
            looked: None,
            figures: String::new(),
        }
    }

    /// Tells someone else, too.
    #[must_use]
    pub fn told_to(mut self, told: Option<Arc<Reached>>) -> Self {
        self.told = told;
        self
    }

    /// Shows `done` samples; reads the film for speed and error now and then.
    ///
    /// # Errors
    /// When the device fails.
    pub fn show(&mut self, done: u32, renderer: &mut dyn AnyRenderer) -> Result<()> {
        let before = u64::from(self.goal.spp) * u64::from(self.frame);
        let all = u64::from(self.goal.spp) * u64::from(self.frames);
        let position = before + u64::from(done);
        if let Some(told) = &self.told {
            told.tell(position, all);
        }
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
        let left = time_left(&self.goal, [position, all], self.start.elapsed());
        bar.set_position(position);
        let mut message = format!("{} left  {}", clock(left), self.figures);
        if self.frames > 1 {
            let samples = self.goal.spp;
            let frame = format!("frame {}/{}, ", self.frame + 1, self.frames);
            message.insert_str(0, &format!("{frame}{done}/{samples} samples  "));
        }
        bar.set_message(message);
        Ok(())
    }

    /// A picture is done; removes the bar after the last.
    pub fn finish(&mut self, done: u32) {
        self.frame += 1;
        let position = match self.frames {
            1 => u64::from(done),
            _ => u64::from(self.goal.spp) * u64::from(self.frame),
        };
        if let Some(told) = &self.told {
            told.tell(position, u64::from(self.goal.spp) * u64::from(self.frames));
        }
        if let Some(bar) = &self.bar {
            bar.set_position(position);
            if self.frame >= self.frames {
                bar.finish_and_clear();
                self.bar = None;
            }
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

/// Time until `all` samples are taken or the deadline is reached, after `done` of them in `elapsed`.
fn time_left(goal: &Goal, [done, all]: [u64; 2], elapsed: Duration) -> Duration {
    let per_sample = elapsed.as_secs_f64() / done.max(1) as f64;
    // A picture that would take longer than a year is not waited for.
    let seconds = (per_sample * all.saturating_sub(done) as f64).min(3e7);
    let all = Duration::from_secs_f64(seconds);
    match goal.deadline {
        Some(deadline) => all.min(deadline.saturating_duration_since(Instant::now())),
        None => all,
    }
}

/// `12s`, `3m05s`, `2h07m`.
pub(crate) fn clock(time: Duration) -> String {
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
        assert_eq!(clock(time_left(&goal, [10, 100], ten)), "1m30s");
        goal.deadline = Some(Instant::now() + Duration::from_millis(5900));
        assert_eq!(clock(time_left(&goal, [10, 100], ten)), "5s");
        goal.deadline = Some(Instant::now() - ten);
        assert_eq!(clock(time_left(&goal, [10, 100], ten)), "0s");
        assert_eq!(clock(Duration::from_secs(7620)), "2h07m");
    }
}
