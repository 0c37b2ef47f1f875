//! One view, from nothing to figures: measure, get a reference that is good enough, compare.

use super::evaluate::{self, Rendered};
use super::identity::{Hasher, REFERENCE_SEED, measured_seed, settings_hash};
use super::machine::processor_seconds;
use super::measure;
use super::plan::Plan;
use super::reference::{MIN_BATCHES, Reference, Stale, Stamp, cache_name};
use super::result::{ReferenceNote, View};
use super::watch::Watch;
use crate::job::AnyRenderer;
use anyhow::{Context as _, Result};
use scene::render::{Estimator, Selection, Settings};
use scene::{Camera, Scene};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// A reference is wanted with this share of the smallest error measured.
const SHARE: f64 = 1.0 / 20.0;

/// Samples of the run that says how long a reference takes.
const PILOT: u32 = 8;

/// Most samples per pixel of a batch.
const MAX_BATCH: u64 = 1 << 16;

/// Makes a renderer for settings.
pub type Maker<'a> = dyn Fn(&Settings) -> Result<Box<dyn AnyRenderer>> + 'a;

/// Everything about a view but its figures.
pub struct Job<'a> {
    /// What is measured.
    pub plan: &'a Plan,
    /// The level.
    pub scene: &'a Scene,
    /// Its hash.
    pub level_hash: &'a str,
    /// Where from.
    pub camera: Camera,
    /// Name and driver of the device.
    pub device: (&'a str, &'a str),
    /// The device.
    pub maker: &'a Maker<'a>,
    /// A reference that was given.
    pub given: Option<&'a Path>,
    /// Where references are kept.
    pub cache: &'a Path,
    /// Tells what goes on.
    pub watch: &'a Watch,
    /// Whether to finish.
    pub stop: &'a dyn Fn() -> bool,
    /// When a reference must be done.
    pub deadline: Option<Instant>,
}

impl Job<'_> {
    fn settings(&self, estimator: Estimator, selection: Selection, seed: u64) -> Settings {
        Settings {
            width: self.plan.size.0,
            height: self.plan.size.1,
            camera: self.camera.clone(),
            estimator,
            selection,
            candidates: self.plan.candidates,
            sampler: self.plan.sampler,
            depth: self.plan.depth,
            time: self.plan.scene.at as f32,
            seed,
            aovs: false,
            clamp: None,
        }
    }

    /// What the view's reference is stamped with.
    #[must_use]
    pub fn stamp(&self) -> Stamp {
        let settings = self.settings(Estimator::Mis, Selection::default(), 0);
        Stamp {
            level: self.scene.name.clone(),
            level_hash: self.level_hash.to_owned(),
            settings_hash: settings_hash(&settings, &self.plan.scene),
            device: self.device.0.to_owned(),
            estimator: Estimator::Mis.name().to_owned(),
            seed: REFERENCE_SEED,
            samples_per_batch: 0,
        }
    }

    /// The hash of all that a view's figures follow from, for taking them over.
    #[must_use]
    pub fn plan_hash(&self) -> String {
        let mut h = Hasher::default();
        let stamp = self.stamp();
        h.text(env!("CARGO_PKG_VERSION"));
        h.text(self.device.0).text(self.device.1);
        h.text(&stamp.level_hash).text(&stamp.settings_hash);
        for (estimator, selection) in &self.plan.curves {
            h.text(estimator.name()).text(selection.name());
        }
        for budget in &self.plan.budgets {
            h.text(&budget.to_string());
        }
        h.int(self.plan.repeats.into()).int(self.plan.seed);
        h.finish()
    }

    /// Measures the view. `None` if it was to stop before there was anything to tell.
    ///
    /// # Errors
    /// When the device fails, or a reference that was given is none of this view.
    pub fn run(&self) -> Result<Option<View>> {
        let stamp = self.stamp();
        let (width, height) = self.plan.size;
        // A reference that was given is looked at before the work.
        let given = match self.given {
            Some(path) => Some((
                path.to_owned(),
                Reference::load(path, &stamp, width, height).with_context(|| {
                    format!("--reference {}: it cannot be used", path.display())
                })?,
            )),
            None => None,
        };
        let (begun, used) = (Instant::now(), processor_seconds());
        let rendered = self.render()?;
        let used = processor_seconds().zip(used).map(|(now, then)| now - then);
        let cores = used.map_or(f64::NAN, |s| s / begun.elapsed().as_secs_f64());
        if rendered.is_empty() {
            return Ok(None);
        }
        let smallest = (rendered.iter())
            .flat_map(|r| r.runs.iter().flatten())
            .map(|s| s.estimated_relmse)
            .filter(|e| *e > 0.0)
            .fold(f64::INFINITY, f64::min);
        let wanted = smallest * SHARE;
        let start = Instant::now();
        let found = match given {
            Some(given) => Some(given),
            None => self.reference(stamp, wanted)?,
        };
        let Some((file, reference)) = found else {
            return Ok(None);
        };
        let seconds = start.elapsed().as_secs_f64();
        self.watch.step("compare");
        let mut view = self.view(&file, &reference, wanted, seconds, &rendered)?;
        view.cores = cores;
        if !view.reference.is_good() {
            self.watch.warn(&format!(
                "{} from {}: the reference's relMSE is {:.1e} and {wanted:.1e} was wanted; give it \
                 more time with --reference-seconds",
                view.level, view.camera, view.reference.relmse
            ));
        }
        Ok(Some(view))
    }

    fn view(
        &self,
        file: &Path,
        reference: &Reference,
        wanted: f64,
        seconds: f64,
        rendered: &[Rendered],
    ) -> Result<View> {
        let c = &self.camera;
        let [x, y, z] = c.position.to_array();
        Ok(View {
            level: self.scene.name.clone(),
            camera: c.name.clone(),
            pose: [x, y, z, c.pitch_deg, c.yaw_deg, c.roll_deg],
            width: self.plan.size.0,
            height: self.plan.size.1,
            depth: self.plan.depth,
            lights: self.plan.scene.lights.name().to_owned(),
            level_hash: self.level_hash.to_owned(),
            settings_hash: reference.stamp.settings_hash.clone(),
            plan_hash: self.plan_hash(),
            triangles: self.scene.triangle_count(),
            emitters: self.scene.emitters.list.len() + self.scene.lights.len(),
            sealed: self.scene.report.sealed,
            cores: f64::NAN,
            reference: ReferenceNote {
                file: file.display().to_string(),
                device: reference.stamp.device.clone(),
                estimator: reference.stamp.estimator.clone(),
                seed: reference.stamp.seed,
                samples: reference.samples(),
                batches: reference.batches(),
                relmse: reference.relmse(),
                wanted,
                seconds,
            },
            curves: evaluate::curves(reference, rendered)?,
        })
    }

    /// Renders every curve as often as planned, or as often as there was time for; curves without a
    /// whole run are missing.
    ///
    /// Repeats are the outer loop: what else the machine does changes over seconds, and so shows
    /// in the spread of a curve's repeats instead of in one curve's favour.
    fn render(&self) -> Result<Vec<Rendered>> {
        let mut rendered: Vec<Rendered> = (self.plan.curves.iter())
            .map(|&(estimator, selection)| {
                let chooses = estimator.samples_lights();
                Rendered {
                    estimator: estimator.name().to_owned(),
                    selection: if chooses { selection.name() } else { "-" }.to_owned(),
                    sees_all_light: chooses || !self.scene.features.point_lights,
                    runs: Vec::new(),
                }
            })
            .collect();
        'all: for repeat in 0..self.plan.repeats {
            for (number, &(estimator, selection)) in self.plan.curves.iter().enumerate() {
                let (name, of) = (estimator.name(), self.plan.repeats);
                self.watch
                    .step(&format!("run {} of {of}, {name}", repeat + 1));
                let seed = measured_seed(self.plan.seed, number, repeat);
                let settings = self.settings(estimator, selection, seed);
                let mut renderer = (self.maker)(&settings)?;
                match measure::run(&mut *renderer, &self.plan.budgets, self.stop)? {
                    Some(run) => rendered[number].runs.push(run),
                    None => break 'all,
                }
            }
        }
        rendered.retain(|r| !r.runs.is_empty());
        Ok(rendered)
    }

    /// The cached reference, made or made better as far as wanted and as time allows. `None` if
    /// it was to stop before there was one.
    fn reference(&self, stamp: Stamp, wanted: f64) -> Result<Option<(PathBuf, Reference)>> {
        let (width, height) = self.plan.size;
        let path = self.cache.join(cache_name(&stamp));
        let mut reference = None;
        if path.exists() {
            match Reference::load(&path, &stamp, width, height) {
                Ok(found) => reference = Some(found),
                Err(why) if why.is::<Stale>() => self.watch.warn(&format!(
                    "the reference {} is stale and is made anew: {why:#}",
                    path.display()
                )),
                Err(why) => self
                    .watch
                    .warn(&format!("a reference is made anew: {why:#}")),
            }
        }
        if let Some(good) = reference.take_if(|r| r.relmse() <= wanted) {
            return Ok(Some((path, good)));
        }
        let start = Instant::now();
        let mut budget = Duration::from_secs_f64(self.plan.reference_seconds);
        if let Some(deadline) = self.deadline {
            budget = budget.min(deadline.saturating_duration_since(start));
        }
        let mut reference = match reference {
            Some(reference) => reference,
            None => {
                let samples_per_batch = self.pilot(wanted, budget)?;
                let stamp = Stamp {
                    samples_per_batch,
                    ..stamp
                };
                Reference::empty(stamp, width, height)
            }
        };
        let before = reference.batches();
        loop {
            let made = reference.batches() - before;
            let enough = reference.batches() >= MIN_BATCHES;
            let per_batch = start.elapsed() / made.max(1);
            let late = start.elapsed() + per_batch > budget;
            if enough && (reference.relmse() <= wanted || late) || (self.stop)() {
                break;
            }
            self.watch.reference(
                &reference,
                wanted,
                per_batch,
                budget.saturating_sub(start.elapsed()),
            );
            let settings =
                self.settings(Estimator::Mis, Selection::default(), reference.next_seed());
            let mut renderer = (self.maker)(&settings)?;
            let batch = reference.stamp.samples_per_batch;
            let budgets = [super::result::Budget::Samples(batch)];
            match measure::run(&mut *renderer, &budgets, self.stop)? {
                Some(run) => reference.add(&run[0].beauty)?,
                None => break,
            }
        }
        if reference.batches() < MIN_BATCHES {
            return Ok(None);
        }
        if reference.batches() > before {
            let saved = std::fs::create_dir_all(self.cache)
                .with_context(|| format!("{} cannot be made", self.cache.display()))
                .and_then(|()| reference.save(&path));
            match saved {
                // As it is in the file: the figures are the same when it is used again.
                Ok(()) => reference = Reference::load(&path, &reference.stamp, width, height)?,
                Err(why) => self
                    .watch
                    .warn(&format!("the reference is not kept: {why:#}")),
            }
        }
        Ok(Some((path, reference)))
    }

    /// Samples per batch such that [`MIN_BATCHES`] are as good as wanted or use up `budget`.
    fn pilot(&self, wanted: f64, budget: Duration) -> Result<u32> {
        self.watch.step("reference: how long");
        let seed = REFERENCE_SEED | (REFERENCE_SEED >> 1);
        let settings = self.settings(Estimator::Mis, Selection::default(), seed);
        let mut renderer = (self.maker)(&settings)?;
        let budgets = [super::result::Budget::Samples(PILOT)];
        let Some(run) = measure::run(&mut *renderer, &budgets, self.stop)? else {
            return Ok(PILOT);
        };
        let per_sample = run[0].seconds / f64::from(PILOT);
        let needed = run[0].estimated_relmse * f64::from(PILOT) / wanted;
        // One more batch than needed would do: an estimate is wrong as often upwards as downwards.
        let samples = needed.min(budget.as_secs_f64() / per_sample.max(1e-9));
        let batch = (samples / f64::from(MIN_BATCHES)).ceil() as u64;
        Ok(batch.clamp(2, MAX_BATCH) as u32)
    }
}
