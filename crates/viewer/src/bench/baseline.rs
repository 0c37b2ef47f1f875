//! Is this run worse than an earlier one, beyond noise?
//!
//! Curves are compared that have the same level, settings, estimator and selection in both runs, in
//! three figures: seconds per sample and relMSE at the largest number of samples both have, and
//! efficiency as the mean over all of those. Each is a ratio of new over old in logarithms, with
//! the standard error of the repeats of both; that of the seconds is pooled over all curves,
//! because a machine's restlessness is the same for all. A figure is a regression if its ratio is
//! significantly worse (one-sided Student, 0.01 over all figures by Sidak), and by more than
//! the tolerance: what one run's repeats cannot know, such as another clock frequency. Times are left
//! out where the machine is another one, or where the processor rendered and the program had more or
//! fewer of its cores than before.

use super::result::{Bench, Budget, Curve, FORMAT, Point, View};
use super::stats::{mean_and_error, sidak_level, t_two_sided};
use crate::device::CPU;
use anyhow::{Context as _, Result, anyhow, bail};
use std::path::Path;

/// Significance over all figures.
const ALPHA: f64 = 0.01;

/// Factor between the cores that two runs on the processor had, up to which times are comparable.
const CORES_MAY_DIFFER: f64 = 1.1;

/// Largest file that is read.
const MAX_BYTES: u64 = 1 << 28;

/// Reads an earlier `bench.json`.
///
/// # Errors
/// When it cannot be read or is none.
pub fn read(path: &Path) -> Result<Bench> {
    let at = || format!("{} cannot be read", path.display());
    let length = std::fs::metadata(path).with_context(at)?.len();
    if length > MAX_BYTES {
        bail!(
            "{}: {length} bytes are more than {MAX_BYTES}",
            path.display()
        );
    }
    let text = std::fs::read_to_string(path).with_context(at)?;
    let bench: Bench = serde_json::from_str(&text)
        .with_context(|| format!("{} is no bench.json", path.display()))?;
    if bench.format != FORMAT {
        bail!(
            "{}: its form is version {}, not {FORMAT}",
            path.display(),
            bench.format
        );
    }
    Ok(bench)
}

/// What the comparison found.
#[derive(Clone, Debug)]
pub struct Verdict {
    /// For people.
    pub text: String,
    /// Figures that became worse.
    pub regressions: usize,
}

/// A figure of a curve in both runs.
struct Figure {
    name: String,
    /// Logarithm of new over old; worse is larger.
    log: f64,
    error: f64,
    df: f64,
    /// Whether it is a time, whose noise is shared.
    is_time: bool,
}

/// Compares two runs.
///
/// # Errors
/// When they have nothing in common that could be compared; the sentence says why.
pub fn compare(old: &Bench, new: &Bench, tolerance: f64) -> Result<Verdict> {
    let mut text = String::new();
    let same_machine = old.machine == new.machine && old.device == new.device;
    if !same_machine {
        text += &format!(
            "another machine ({} on {} before), so times are not compared\n",
            old.device, old.machine.cpu
        );
    } else if old.driver != new.driver {
        text += &format!(
            "another driver: {} before, {} now\n",
            old.driver, new.driver
        );
    }
    let mut figures = Vec::new();
    let mut why_not = Vec::new();
    for view in &new.views {
        let name = format!("{} {}", view.level, view.camera);
        match partner(old, view) {
            Err(why) => why_not.push(format!("{name}: {why}")),
            Ok(before) => {
                // A processor that also does other work says nothing about the program.
                let busy = new.device == CPU
                    && (view.cores / before.cores).ln().abs() > CORES_MAY_DIFFER.ln();
                if busy && same_machine {
                    text += &format!(
                        "{name}: the program had {:.2} cores before and {:.2} now, so times are \
                         not compared\n",
                        before.cores, view.cores
                    );
                }
                let times = same_machine && !busy;
                for curve in &view.curves {
                    let same = |c: &&Curve| c.name() == curve.name();
                    match before.curves.iter().find(same) {
                        Some(old) => add(&mut figures, &name, old, curve, times),
                        None => why_not.push(format!("{name} {}: new", curve.name())),
                    }
                }
            }
        }
    }
    for why in &why_not {
        text += &format!("not compared: {why}\n");
    }
    if figures.is_empty() {
        return Err(anyhow!(
            "the baseline has nothing to compare with: {}",
            why_not
                .first()
                .map_or("no sample budget is in both", String::as_str)
        ));
    }
    share_noise_of_times(&mut figures);
    let level = sidak_level(ALPHA, figures.len());
    let mut regressions = 0;
    for figure in &figures {
        let p = t_two_sided(figure.log / figure.error, figure.df) / 2.0;
        let significant = p < level && figure.log.abs() > tolerance.ln_1p();
        let worse = figure.log > 0.0;
        let verdict = match (significant, worse) {
            (true, true) => "WORSE",
            (true, false) => "better",
            _ => "same within noise",
        };
        regressions += usize::from(significant && worse);
        text += &format!(
            "{}: {:.3} times (95 % {}), {verdict}\n",
            figure.name,
            figure.log.exp(),
            spread(figure),
        );
    }
    text += &match regressions {
        0 => "no regression beyond noise".to_owned(),
        n => format!("{n} of {} figures are worse beyond noise", figures.len()),
    };
    Ok(Verdict { text, regressions })
}

fn spread(figure: &Figure) -> String {
    let half = super::stats::t_quantile(0.975, figure.df) * figure.error;
    if half.is_finite() {
        let ends = [-half, half].map(|h| (figure.log + h).exp());
        format!("{:.3}..{:.3}", ends[0], ends[1])
    } else {
        "unknown".to_owned()
    }
}

/// The same view in the old run.
fn partner<'a>(old: &'a Bench, view: &View) -> Result<&'a View, String> {
    let same_place = |v: &&View| v.level == view.level && v.pose == view.pose;
    let Some(found) = old.views.iter().find(same_place) else {
        return Err("the baseline does not have this view".to_owned());
    };
    let exact = |v: &&View| {
        same_place(v) && v.level_hash == view.level_hash && v.settings_hash == view.settings_hash
    };
    match old.views.iter().find(exact) {
        Some(exact) => Ok(exact),
        None if found.level_hash != view.level_hash => {
            Err("the level, or what its import makes of it, has changed".to_owned())
        }
        None => Err("other settings (size, depth, time, light)".to_owned()),
    }
}

fn add(figures: &mut Vec<Figure>, view: &str, old: &Curve, new: &Curve, times: bool) {
    let both: Vec<(&Point, &Point)> = (new.points.iter())
        .filter(|p| matches!(p.budget, Budget::Samples(_)))
        .filter_map(|p| Some((old.points.iter().find(|o| o.budget == p.budget)?, p)))
        .collect();
    let Some(&(old_last, new_last)) = both.last() else {
        return;
    };
    let logs = |runs: &[f64]| -> Vec<f64> { runs.iter().map(|v| v.ln()).collect() };
    let curve = new.name();
    let mut push = |what: String, old: &[f64], new: &[f64], is_time: bool| {
        let ((a, a_error), (b, b_error)) = (mean_and_error(old), mean_and_error(new));
        if (b - a).is_finite() {
            figures.push(Figure {
                name: format!("{view}, {curve}, {what}"),
                log: b - a,
                error: a_error.hypot(b_error),
                df: (old.len() + new.len()) as f64 - 2.0,
                is_time,
            });
        }
    };
    let [a, b] = [old_last, new_last].map(|p| logs(&p.relmse_runs));
    push(format!("relMSE at {}", new_last.budget), &a, &b, false);
    if times {
        let [a, b] = [old_last, new_last].map(|p| logs(&p.seconds_runs));
        push(format!("seconds for {}", new_last.budget), &a, &b, true);
        let cost = |points: &[&Point]| -> Vec<f64> {
            let repeats = points
                .iter()
                .map(|p| p.relmse_runs.len())
                .min()
                .unwrap_or(0);
            (0..repeats)
                .map(|r| {
                    let sum: f64 = (points.iter())
                        .map(|p| (p.relmse_runs[r] * p.seconds_runs[r]).ln())
                        .sum();
                    sum / points.len() as f64
                })
                .collect()
        };
        let (old, new): (Vec<&Point>, Vec<&Point>) = both.into_iter().unzip();
        push(
            "relMSE times seconds".to_owned(),
            &cost(&old),
            &cost(&new),
            false,
        );
    }
}

/// Gives all times the noise of all times together.
fn share_noise_of_times(figures: &mut [Figure]) {
    let known = |f: &&Figure| f.is_time && f.error.is_finite();
    let (squares, df) = (figures.iter().filter(known)).fold((0.0, 0.0), |(s, d), f| {
        (s + f.error * f.error * f.df, d + f.df)
    });
    if df > 0.0 {
        for figure in figures.iter_mut().filter(|f| f.is_time) {
            figure.error = (squares / df).sqrt();
            figure.df = df;
        }
    }
}
