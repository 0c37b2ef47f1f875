//! What people see while a bench runs.

use super::reference::Reference;
use indicatif::{ProgressBar, ProgressStyle};
use std::cell::RefCell;
use std::time::Duration;

/// A line on stderr that says what is going on; nothing where stderr is no terminal.
#[derive(Debug)]
pub struct Watch {
    bar: Option<ProgressBar>,
    view: RefCell<String>,
}

impl Watch {
    /// A line if `visible`.
    #[must_use]
    pub fn new(visible: bool) -> Self {
        let bar = visible.then(|| {
            let style = ProgressStyle::with_template("{spinner} {elapsed} {wide_msg}")
                .unwrap_or_else(|_| ProgressStyle::default_spinner());
            let bar = ProgressBar::new_spinner().with_style(style);
            bar.enable_steady_tick(Duration::from_millis(250));
            bar
        });
        Self {
            bar: bar.filter(|b| !b.is_hidden()),
            view: RefCell::default(),
        }
    }

    /// A view begins.
    pub fn view(&self, name: &str) {
        self.view.replace(name.to_owned());
        self.step("load");
    }

    /// What is done with it.
    pub fn step(&self, what: &str) {
        if let Some(bar) = &self.bar {
            bar.set_message(format!("{}: {what}", self.view.borrow()));
        }
        tracing::info!("{}: {what}", self.view.borrow());
    }

    /// How far a reference is.
    pub fn reference(&self, made: &Reference, wanted: f64, per_batch: Duration, left: Duration) {
        let count = made.batches();
        if count == 0 {
            self.step("reference");
            return;
        }
        let fewest = super::reference::MIN_BATCHES;
        let mut still = per_batch * fewest.saturating_sub(count);
        let mut error = String::new();
        if count >= fewest {
            // Error falls as one over the batches.
            let relmse = made.relmse();
            let more = f64::from(count) * (relmse / wanted - 1.0).max(0.0);
            still = Duration::from_secs_f64((per_batch.as_secs_f64() * more).min(3e7)).min(left);
            error = format!(", relMSE {relmse:.1e} of {wanted:.1e}");
        }
        self.step(&format!(
            "reference, {count} batches{error}, {} s left",
            still.as_secs()
        ));
    }

    /// Something that people should know.
    pub fn warn(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| tracing::warn!("{text}")),
            None => tracing::warn!("{text}"),
        }
    }

    /// Removes the line.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
