//! `bench --hard`: scenes with known answers that are hard to compute, on a device and on the
//! processor. What the cases are and what makes one pass is said in [`gallery`].

use super::report::table;
use super::watch::Watch;
use crate::device::{CPU, Device};
use crate::escapes::{self, Left};
use anyhow::Result;
use gallery::{Case, Escapes, cases};
use scene::Scene;
use scene::render::{Estimator, Film, Settings};
use serde::Serialize;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long a call of a renderer should take: short enough for Ctrl-C.
const CALL: Duration = Duration::from_millis(250);

/// What a run found; what it serializes to is the JSON of `bench --hard`.
#[derive(Clone, Debug, Serialize)]
pub struct HardReport {
    /// Version of the program.
    pub program: &'static str,
    /// Whether all cases were rendered.
    pub complete: bool,
    /// Wall seconds.
    pub seconds: f64,
    /// One per device.
    pub totals: Vec<Total>,
    /// One per device, case and estimator.
    pub rows: Vec<Row>,
}

/// All pictures of a device.
#[derive(Clone, Debug, Serialize)]
pub struct Total {
    /// The device.
    pub device: String,
    /// Its driver.
    pub driver: String,
    /// Pictures.
    pub pictures: usize,
    /// Those that passed.
    pub passed: usize,
    /// Paths.
    pub paths: u64,
    /// Rays.
    pub rays: u64,
    /// Samples that were not finite.
    pub nonfinite: u64,
    /// Rays that left a sealed scene.
    pub escaped_from_sealed: u64,
    /// Rays traced in sealed scenes.
    pub rays_in_sealed: u64,
}

/// One picture.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// The device.
    pub device: String,
    /// The case.
    pub case: &'static str,
    /// What it tests.
    pub tests: &'static str,
    /// Kind of the truth.
    pub truth: &'static str,
    /// Estimator.
    pub estimator: &'static str,
    /// Pixels across and down.
    pub size: u32,
    /// Samples per pixel.
    pub samples: u32,
    /// Paths.
    pub paths: u64,
    /// Rays.
    pub rays: u64,
    /// Seconds, with pipelines and acceleration structures, without the making of the scene.
    pub seconds: f64,
    /// Mean radiance found.
    pub mean: [f64; 3],
    /// Mean radiance expected.
    pub expected: [f64; 3],
    /// Error of the mean in the worst channel.
    pub error: f64,
    /// Half its 95 % interval.
    pub interval95: f64,
    /// The error over what is expected; `None` where that is 0.
    pub relative: Option<f64>,
    /// The error in standard errors; `None` where rounding outweighs the noise.
    pub z: Option<f64>,
    /// The pass line: largest relative error beyond noise.
    pub line: f64,
    /// Its reason.
    pub line_why: &'static str,
    /// Samples that were not finite.
    pub nonfinite: u64,
    /// Rays that left the scene.
    pub escaped: u64,
    /// The same per 10^9 rays.
    pub escaped_per_1e9: f64,
    /// Whether rays may leave it.
    pub may_escape: bool,
    /// Whether it passed.
    pub passed: bool,
    /// What is wrong, a sentence each.
    pub failures: Vec<String>,
    /// What is wrong by no more than the case allows a device, a sentence each.
    pub allowed: Vec<String>,
    /// Rays of 10^9 that a device may lead astray.
    pub astray_line_per_1e9: f64,
    /// Why as many; empty if none.
    pub astray_why: &'static str,
    /// The first rays that left the scene where none may.
    pub escapes: Vec<Left>,
}

/// Renders the gallery on `device`, and on the processor unless that is the device.
///
/// With `paths` the pictures of a Vulkan device have as many paths together; those whose size and
/// samples stand for themselves keep them. The processor, which is the judge, keeps its own number
/// unless it is the device. `stop` is asked often, and no picture begins after `deadline`; what is rendered
/// until then is in the report.
///
/// # Errors
/// When a device fails.
pub fn run(
    device: &Device,
    paths: Option<u64>,
    watch: &Watch,
    stop: &dyn Fn() -> bool,
    deadline: Option<Instant>,
) -> Result<HardReport> {
    let start = Instant::now();
    let all = cases();
    let own: f64 = all
        .iter()
        .filter(|case| !case.fixed)
        .map(|case| (case.paths() * case.estimators.len() as u64) as f64)
        .sum();
    let scale = paths.map_or(1.0, |paths| paths as f64 / own);
    let mut devices = vec![(device.clone(), scale)];
    if device.name != CPU {
        devices.push((Device::cpu(), 1.0));
    }
    let mut report = HardReport {
        program: env!("CARGO_PKG_VERSION"),
        complete: true,
        seconds: 0.0,
        totals: Vec::new(),
        rows: Vec::new(),
    };
    for (device, scale) in &devices {
        let first = report.rows.len();
        for case in &all {
            watch.view(case.name);
            for &estimator in &case.estimators {
                watch.step(&format!("{} on {}", estimator.name(), device.name));
                let is_over = deadline.is_some_and(|d| Instant::now() >= d);
                let row = match is_over {
                    true => None,
                    false => row(case, estimator, device, *scale, stop)?,
                };
                report.complete &= row.is_some();
                report.rows.extend(row);
            }
        }
        report.totals.push(total(device, &report.rows[first..]));
    }
    report.seconds = start.elapsed().as_secs_f64();
    Ok(report)
}

/// One picture, judged; `None` if `stop` said so.
fn row(
    case: &Case,
    estimator: Estimator,
    device: &Device,
    scale: f64,
    stop: &dyn Fn() -> bool,
) -> Result<Option<Row>> {
    let plan = case.plan(scale);
    let scene = case.scene();
    tracing::debug!("{}: {} triangles", case.name, scene.triangle_count());
    let mut seconds = 0.0;
    let mut render = |scene: &Arc<Scene>, settings: &Settings, samples: u32| {
        let start = Instant::now();
        let film = picture(device, scene, settings, samples, stop);
        seconds += start.elapsed().as_secs_f64();
        film
    };
    let cpu = Device::cpu();
    let mut judge = |scene: &Arc<Scene>, settings: &Settings, samples: u32| {
        picture(&cpu, scene, settings, samples, stop)
    };
    let (film, verdict) = match case.run(estimator, plan, &mut render, &mut judge) {
        Ok(found) => found,
        Err(Ended::Stopped) => return Ok(None),
        Err(Ended::Failed(why)) => return Err(why.context(case.name)),
    };
    let counters = film.counters;
    let sealed = case.escapes == Escapes::Never;
    Ok(Some(Row {
        device: device.name.clone(),
        case: case.name,
        tests: case.tests,
        truth: case.truth.name(),
        estimator: estimator.name(),
        size: film.width,
        samples: film.samples,
        paths: counters.paths,
        rays: counters.rays,
        seconds,
        mean: verdict.mean,
        expected: verdict.expected,
        error: verdict.error,
        interval95: verdict.interval,
        relative: Some(verdict.relative).filter(|r| r.is_finite()),
        z: verdict.z,
        line: case.line.relative,
        line_why: case.line.why,
        nonfinite: counters.nonfinite,
        escaped: counters.escaped,
        escaped_per_1e9: verdict.escaped_per_billion,
        may_escape: !sealed,
        passed: verdict.passed(),
        failures: verdict.failures,
        allowed: verdict.allowed,
        astray_line_per_1e9: case.line.astray,
        astray_why: case.line.astray_why,
        escapes: if sealed {
            escapes::left(&film, scene)
        } else {
            Vec::new()
        },
    }))
}

/// Why there is no picture.
enum Ended {
    Stopped,
    Failed(anyhow::Error),
}

impl From<anyhow::Error> for Ended {
    fn from(why: anyhow::Error) -> Self {
        Self::Failed(why)
    }
}

/// A picture in calls short enough to stop between.
fn picture(
    device: &Device,
    scene: &Arc<Scene>,
    settings: &Settings,
    samples: u32,
    stop: &dyn Fn() -> bool,
) -> Result<Film, Ended> {
    let mut renderer = device.renderer(scene, settings)?;
    let (mut done, mut next) = (0, samples.min(16));
    while done < samples {
        if stop() {
            return Err(Ended::Stopped);
        }
        let start = Instant::now();
        renderer.accumulate(next)?;
        renderer.finish()?;
        done += next;
        let per_sample = start.elapsed().as_secs_f64() / f64::from(next);
        let fits = (CALL.as_secs_f64() / per_sample.max(1e-9)) as u32;
        next = fits.clamp(1, next.saturating_mul(16)).min(samples - done);
    }
    Ok(renderer.film()?)
}

fn total(device: &Device, rows: &[Row]) -> Total {
    let sum = |of: fn(&Row) -> u64| rows.iter().map(of).sum();
    let sealed = |of: fn(&Row) -> u64| (rows.iter()).filter(|r| !r.may_escape).map(of).sum();
    Total {
        device: device.name.clone(),
        driver: device.driver.clone(),
        pictures: rows.len(),
        passed: rows.iter().filter(|r| r.passed).count(),
        paths: sum(|r| r.paths),
        rays: sum(|r| r.rays),
        nonfinite: sum(|r| r.nonfinite),
        escaped_from_sealed: sealed(|r| r.escaped),
        rays_in_sealed: sealed(|r| r.rays),
    }
}

impl HardReport {
    /// Whether every case was rendered and passed.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.complete && self.rows.iter().all(|row| row.passed)
    }

    /// The tables for people, with what failed and the rays that escaped below.
    #[must_use]
    pub fn text(&self) -> String {
        let mut text = String::new();
        for total in &self.totals {
            text += &format!("{} ({})\n", total.device, total.driver);
            let mine = self.rows.iter().filter(|r| r.device == total.device);
            let head = [
                "case",
                "estimator",
                "truth",
                "expected",
                "error",
                "95 %",
                "line",
                "z",
                "not finite",
                "escaped/1e9",
                "rays",
                "s",
                "",
            ];
            let rows: Vec<Vec<String>> = std::iter::once(head.map(str::to_owned).to_vec())
                .chain(mine.map(cells))
                .collect();
            text += &table(&rows, 3);
            text += &format!(
                "{} of {} passed; {:.3e} paths, {:.3e} rays, {} samples not finite, {} of {:.3e} \
                 rays left sealed scenes\n\n",
                total.passed,
                total.pictures,
                total.paths as f64,
                total.rays as f64,
                total.nonfinite,
                total.escaped_from_sealed,
                total.rays_in_sealed as f64,
            );
        }
        for row in self.rows.iter().filter(|r| !r.passed) {
            text += &format!("{}, {}, {}: failed\n", row.device, row.case, row.estimator);
            text += &format!("  {}\n", row.tests);
            for failure in &row.failures {
                text += &format!("  {failure}\n");
            }
            for left in &row.escapes {
                text += &format!("  {left}\n");
            }
        }
        for row in self.rows.iter().filter(|r| !r.allowed.is_empty()) {
            let (rate, why) = (row.astray_line_per_1e9, row.astray_why);
            text += &format!("{}, {}, {}: ", row.device, row.case, row.estimator);
            text += &format!("up to {rate} of 1e9 rays may go astray: {why}\n");
            for allowed in &row.allowed {
                text += &format!("  {allowed}\n");
            }
        }
        if !self.complete {
            text += "Not every case was rendered.\n";
        }
        text += &format!("{:.0} s in all", self.seconds);
        text
    }
}

/// A row of the table. Errors are relative to what is expected, absolute where that is 0.
fn cells(row: &Row) -> Vec<String> {
    let expected = row.expected.into_iter().fold(0.0, f64::max);
    let scale = if expected > 0.0 { expected } else { 1.0 };
    vec![
        row.case.to_owned(),
        row.estimator.to_owned(),
        row.truth.to_owned(),
        if expected > 0.0 {
            format!("{expected:.4e}")
        } else {
            "0".to_owned()
        },
        format!("{:+.1e}", row.error / scale),
        format!("{:.1e}", row.interval95 / scale),
        format!("{:.0e}", row.line),
        row.z.map_or("-".to_owned(), |z| format!("{z:+.1}")),
        row.nonfinite.to_string(),
        if row.may_escape {
            "open".to_owned()
        } else {
            format!("{:.0}", row.escaped_per_1e9)
        },
        row.rays.to_string(),
        format!("{:.1}", row.seconds),
        if row.passed { "ok" } else { "FAILED" }.to_owned(),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_leaves_a_report_that_does_not_pass() {
        let asked = std::cell::Cell::new(0);
        let stop = || {
            asked.set(asked.get() + 1);
            asked.get() > 4
        };
        let report = run(&Device::cpu(), Some(1), &Watch::new(false), &stop, None).unwrap();
        assert!(!report.complete && !report.passed());
        // Two samples a pixel are one call each.
        assert_eq!(report.rows.len(), 4);
        let json = serde_json::to_value(&report).unwrap();
        assert_eq!(json["rows"][0]["case"], "closed box");
        assert_eq!(json["rows"][0]["paths"], 128);
        assert_eq!(json["totals"][0]["pictures"], 4);
        let text = report.text();
        assert!(text.contains("Not every case was rendered."), "{text}");
        let past = Some(Instant::now());
        let report = run(&Device::cpu(), Some(1), &Watch::new(false), &|| false, past).unwrap();
        assert!(!report.complete && report.rows.is_empty());
    }
}
