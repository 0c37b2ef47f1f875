//! `runelight bench`.

use super::Context;
use crate::bench::plan::Plan;
use crate::bench::result::{Bench, FORMAT, Machine, View};
use crate::bench::view::Job;
use crate::bench::watch::Watch;
use crate::bench::{baseline, bias, csv, hard, identity, plot, reference, report};
use crate::cli::{Bench as Args, CameraChoice, ViewArgs};
use crate::device::Device;
use crate::interrupt;
use crate::level::Source;
use crate::output::PartFile;
use crate::{Outcome, Usage};
use anyhow::{Context as _, Result, bail};
use scene::{Camera, Scene};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The folder that is written to unless one is given.
const OUTPUT: &str = "bench";
/// Most memory for pictures that wait for their reference.
const MAX_BYTES: u64 = 8 << 30;

/// Runs the command.
///
/// # Errors
/// When a level cannot be loaded, the device fails, a reference or baseline given cannot be used,
/// or an output cannot be written.
pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    if args.hard {
        return run_hard(args, context);
    }
    let plan = Plan::new(args);
    check(args, &plan)?;
    interrupt::install()?;
    let before = match &args.baseline {
        Some(path) => Some(baseline::read(path)?),
        None => None,
    };
    let device = Device::choose(&context.global.device)?;
    let output = args.output.as_deref().unwrap_or(Path::new(OUTPUT));
    let json = target(output, "bench.json")?;
    let done = if args.resume && json.exists() {
        baseline::read(&json)?.views
    } else {
        Vec::new()
    };

    let mut bench = Bench {
        format: FORMAT,
        program: env!("CARGO_PKG_VERSION").to_owned(),
        machine: Machine::this(),
        device: device.name.clone(),
        driver: device.driver.clone(),
        complete: true,
        seconds: 0.0,
        views: Vec::new(),
    };
    let watch = Watch::new(!context.global.quiet);
    let all = Run {
        args,
        context,
        plan: &plan,
        device: &device,
        watch: &watch,
        done,
        deadline: (args.time_limit).map(|s| context.start + Duration::from_secs_f64(s)),
    };
    let ended = all.views(&mut bench, &json);
    watch.finish();
    ended?;
    if bench.views.is_empty() {
        bail!("it ended before the first view was measured; there is nothing to write");
    }
    write_all(output, &bench)?;
    context.print(&if context.json {
        serde_json::to_string(&bench)?
    } else {
        report::text(&bench)
    })?;
    finish(args, &bench, before.as_ref())
}

/// The gallery of hard cases.
fn run_hard(args: &Args, context: &Context) -> Result<Outcome> {
    interrupt::install()?;
    let device = Device::choose(&context.global.device)?;
    let files = match &args.output {
        Some(dir) => Some((target(dir, "hard.json")?, target(dir, "hard.txt")?)),
        None => None,
    };
    let watch = Watch::new(!context.global.quiet);
    let deadline = (args.time_limit).map(|s| context.start + Duration::from_secs_f64(s));
    let report = hard::run(&device, args.paths, &watch, &interrupt::asked, deadline);
    watch.finish();
    let report = report?;
    if report.rows.is_empty() {
        bail!("it ended before the first picture; there is nothing to write");
    }
    if let Some((json, text)) = files {
        write(&text, &report.text())?;
        write(&json, &serde_json::to_string_pretty(&report)?)?;
    }
    context.print(&if context.json {
        serde_json::to_string(&report)?
    } else {
        report.text()
    })?;
    Ok(if report.passed() {
        Outcome::Done
    } else {
        Outcome::LimitExceeded
    })
}

/// A file in a folder, which is made. What cannot be written is known before the work.
fn target(dir: &Path, name: &str) -> Result<PathBuf> {
    std::fs::create_dir_all(dir).with_context(|| format!("{} cannot be made", dir.display()))?;
    let path = dir.join(name);
    drop(PartFile::create(&path)?);
    Ok(path)
}

fn check(args: &Args, plan: &Plan) -> Result<()> {
    if plan.bytes() > MAX_BYTES {
        let gib = plan.bytes() >> 30;
        return Err(Usage(format!(
            "the pictures of a view would take {gib} GiB of memory until it has its reference; \
             a smaller --size or fewer --repeats or --spp will do"
        ))
        .into());
    }
    let views: usize = plan.levels.iter().map(|l| l.1.len()).sum();
    if args.reference.is_some() && views != 1 {
        return Err(Usage(format!(
            "--reference is of a single view, and {views} are to be measured"
        ))
        .into());
    }
    Ok(())
}

/// What the views share.
struct Run<'a> {
    args: &'a Args,
    context: &'a Context,
    plan: &'a Plan,
    device: &'a Device,
    watch: &'a Watch,
    done: Vec<View>,
    deadline: Option<Instant>,
}

impl Run<'_> {
    /// Measures all views, and writes what there is after each.
    fn views(&self, bench: &mut Bench, json: &Path) -> Result<()> {
        let cache = reference::cache_dir()?;
        for (level, cameras) in &self.plan.levels {
            let Some(scene) = self.load(level.as_deref())? else {
                continue;
            };
            let level_hash = identity::level_hash(&scene);
            for choice in cameras {
                if self.is_over() {
                    bench.complete = false;
                    return Ok(());
                }
                let Some(camera) = self.camera(&scene, choice)? else {
                    continue;
                };
                self.watch.view(&format!("{} {}", scene.name, camera.name));
                let job = Job {
                    plan: self.plan,
                    scene: &scene,
                    level_hash: &level_hash,
                    camera,
                    device: (&self.device.name, &self.device.driver),
                    maker: &|settings| self.device.renderer(&scene, settings),
                    given: self.args.reference.as_deref(),
                    cache: &cache,
                    watch: self.watch,
                    stop: &interrupt::asked,
                    deadline: self.deadline,
                };
                let hash = job.plan_hash();
                let known = (self.done.iter()).find(|v| v.plan_hash == hash && self.is_whole(v));
                let view = match known {
                    Some(view) => Some(view.clone()),
                    None => job.run()?,
                };
                bench.complete &= view.is_some() && !interrupt::asked();
                let Some(view) = view else {
                    return Ok(());
                };
                bench.views.push(view);
                bench.seconds = self.context.start.elapsed().as_secs_f64();
                bias::judge(
                    (bench.views.iter_mut())
                        .flat_map(|v| &mut v.curves)
                        .filter_map(|c| c.bias.as_mut()),
                );
                write(json, &serde_json::to_string_pretty(&bench)?)?;
            }
        }
        Ok(())
    }

    /// Whether a view was measured to its end.
    fn is_whole(&self, view: &View) -> bool {
        view.curves.len() == self.plan.curves.len()
            && (view.curves.iter().flat_map(|c| &c.points))
                .all(|p| p.relmse_runs.len() == self.plan.repeats as usize)
    }

    fn is_over(&self) -> bool {
        interrupt::asked() || self.deadline.is_some_and(|d| Instant::now() >= d)
    }

    /// A level as a scene; `None` if it is one of the suite's that is not here.
    fn load(&self, level: Option<&str>) -> Result<Option<Arc<Scene>>> {
        self.watch.view(level.unwrap_or("sample"));
        let loaded = match Source::new(level, &self.context.global)?.load() {
            Ok(loaded) => loaded,
            Err(why) if self.plan.may_lack_levels => {
                self.watch.warn(&format!("left out: {why:#}"));
                return Ok(None);
            }
            Err(why) => return Err(why),
        };
        Ok(Some(Arc::new(
            loaded.import(&self.plan.scene.import_options()?)?,
        )))
    }

    /// A camera of the level; `None` if it is one of the preset's that the level lacks.
    fn camera(&self, scene: &Scene, choice: &CameraChoice) -> Result<Option<Camera>> {
        if let (CameraChoice::Index(index), None) = (choice, &self.args.cameras)
            && *index >= scene.cameras.len()
        {
            return Ok(None);
        }
        let view = ViewArgs {
            size: self.plan.size,
            camera: Some(choice.clone()),
            camera_path: None,
            fov: None,
            aperture: None,
            focus: None,
        };
        let mut camera = view.camera_of(scene, self.plan.scene.at)?;
        if let CameraChoice::Index(index) = choice {
            // Names repeat: a level has many intermissions.
            camera.name = format!("{index} {}", camera.name);
        }
        Ok(Some(camera))
    }
}

fn write(path: &Path, text: &str) -> Result<()> {
    let mut part = PartFile::create(path)?;
    part.file().write_all(text.as_bytes())?;
    part.commit()
}

fn write_all(dir: &Path, bench: &Bench) -> Result<()> {
    write(
        &dir.join("bench.json"),
        &serde_json::to_string_pretty(bench)?,
    )?;
    write(&dir.join("bench.csv"), &csv::text(bench))?;
    for (name, svg) in plot::all(bench)? {
        write(&dir.join(name), &svg)?;
    }
    Ok(())
}

/// Compares with the baseline and says how it ended.
fn finish(args: &Args, bench: &Bench, before: Option<&Bench>) -> Result<Outcome> {
    let mut outcome = Outcome::Done;
    if let Some(before) = before {
        let verdict = baseline::compare(before, bench, args.tolerance)?;
        eprintln!("{}", verdict.text);
        if verdict.regressions > 0 {
            outcome = Outcome::LimitExceeded;
        }
    }
    let biased = (bench.views.iter().flat_map(|v| &v.curves))
        .any(|c| c.bias.as_ref().is_some_and(|b| b.biased));
    if args.fail_on_bias && biased {
        outcome = Outcome::LimitExceeded;
    }
    Ok(outcome)
}
