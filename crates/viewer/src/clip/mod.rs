//! A demo as film: frames at exact times, each of which can be made alone and is the same however it
//! comes about.

mod audience;
mod pattern;
mod ratio;
mod report;
pub(crate) mod resume;
mod shutter;
mod stage;
mod target;
mod writer;
pub mod y4m;

pub use audience::{Audience, Reached};
pub use pattern::Pattern;
pub use ratio::{Ratio, Steps};
pub use shutter::Shutter;
pub(crate) use stage::screen;
pub use stage::{Show, Stage};

use crate::adaptive::{self, Adaptive};
use crate::cli::{Demo as Args, Global, PictureArgs};
use crate::cmd::Context;
use crate::device::Device;
use crate::job::{self, AnyRenderer, Goal, Stopped};
use crate::level::{Source, sha256};
use crate::output::{Layer, Note, Screen};
use crate::progress::Progress;
use crate::view::look::noted_demo_command;
use crate::view::save::COMMAND;
use crate::{Outcome, Usage, demo, interrupt, shot};
use anyhow::{Context as _, Result, bail};
use report::{Record, Summary, Told};
use scene::Frame;
use scene::render::{Counters, Settings};
use scene::timeline::{State, Timeline, Unseen};
use serde_json::{Map, Value};
use std::collections::BTreeSet;
use std::ops::Range;
use std::time::{Duration, Instant};
use target::Targets;
use writer::Writer;

/// Most frames of a clip.
const MOST_FRAMES: u32 = 100_000_000;

/// Spreads the bits of a number over all of another (SplitMix64: Steele, Lea, Flood 2014).
pub(crate) fn mix(number: u64) -> u64 {
    let mut z = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The seed of a frame of a clip that was asked for with `seed`.
pub(crate) fn frame_seed(seed: u64, frame: u32) -> u64 {
    mix(mix(seed) ^ u64::from(frame))
}

/// Renders frames of a demo.
///
/// # Errors
/// When options make no sense together, a file is missing or cannot be written, or the device fails; after
/// Ctrl-C with what is missing.
pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    interrupt::install()?;
    run_for(args, context, &Audience::default())
}

/// As [`run`], for someone else than a terminal: with an audience that watches nothing is printed, and it
/// may end the clip as Ctrl-C does.
///
/// # Errors
/// As [`run`].
pub fn run_for(args: &Args, context: &Context, audience: &Audience) -> Result<Outcome> {
    let targets = Targets::parse(&args.output)?;
    check(args, &targets)?;
    let bytes = demo::read(args.demo.as_deref(), &context.global)?;
    let timeline =
        demo::timeline(&bytes, &context.global).with_context(|| args.name().to_owned())?;
    let clip = Clip {
        args,
        context,
        audience,
        steps: steps(args),
        show: Show {
            timeline: &timeline,
            unseen: unseen(args),
            bare: args.picture.scene.entities.no_entities,
        },
    };
    let frames = clip.frames()?;
    clip.check_levels(&frames)?;
    targets.prepare(&frames)?;
    let made = made(args, &bytes)?;
    let found = if args.clip.resume {
        resume::find(&targets, &frames, &made)?
    } else {
        resume::Found::new()
    };
    clip.render(targets, frames, &made, &found)
}

/// All that frames depend on besides their numbers and the files of their level: see [`resume::settings`].
pub(crate) fn made(args: &Args, demo: &[u8]) -> Result<String> {
    let picture = &args.picture;
    let read = (picture.scene.surfaces.rules()?, picture.view.path()?);
    Ok(resume::settings(
        &args.clip,
        picture,
        unseen(args),
        &sha256(demo),
        &sha256(format!("{read:?}").as_bytes()),
    ))
}

/// What a frame notes of itself besides what every picture does.
pub(crate) struct Noted<'a> {
    /// The options of its clip.
    pub args: &'a Args,
    /// Where files are looked up.
    pub global: &'a Global,
    /// Its number.
    pub frame: u32,
    /// Samples of each pixel.
    pub samples: u32,
    /// The demo at its time.
    pub state: &'a State,
    /// What the game does to the screen.
    pub screen: &'a Screen,
    /// See [`crate::level::Loaded::digest`].
    pub stage: &'a str,
    /// See [`made`].
    pub made: &'a str,
}

impl Noted<'_> {
    /// The notes.
    pub fn notes(&self) -> Vec<(&'static str, Note)> {
        let clip = &self.args.clip;
        let time = steps(self.args).time(self.frame);
        let numbers = |of: &[f32]| {
            let numbers: Vec<String> = of.iter().map(ToString::to_string).collect();
            Note::Text(numbers.join(" "))
        };
        let command = noted_demo_command(self.args, self.global, self.frame, self.samples);
        vec![
            ("demo", Note::Text(self.args.name().to_owned())),
            ("frame", Note::Int(self.frame.into())),
            ("fps", Note::Text(clip.fps.to_string())),
            ("demoTime", Note::Text(time.to_string())),
            ("shutter", Note::Float(clip.shutter as f32)),
            (
                "intermission",
                Note::Int(self.state.view.intermission.into()),
            ),
            (resume::STAGE, Note::Text(self.stage.to_owned())),
            (resume::MADE, Note::Text(self.made.to_owned())),
            ("tint", numbers(&self.screen.tint)),
            ("shown", numbers(&self.screen.shown)),
            (COMMAND, Note::Text(command)),
        ]
    }
}

/// When the frames of a clip are.
pub(crate) fn steps(args: &Args) -> Steps {
    Steps {
        from: args.clip.from.unwrap_or(Ratio::ZERO),
        fps: args.clip.fps,
    }
}

/// What is shown that the server did not send.
fn unseen(args: &Args) -> Unseen {
    let view = &args.picture.view;
    let is_free = view.camera.is_some() || view.camera_path.is_some();
    match args.clip.unseen {
        Some(name) => name.into(),
        None if is_free => Unseen::All,
        None => Unseen::Hidden,
    }
}

/// Refuses options that make no sense for a demo.
fn check(args: &Args, targets: &Targets) -> Result<()> {
    args.picture.check()?;
    let usage = |why: &str| Err(Usage(why.to_owned()).into());
    let scene = &args.picture.scene;
    if scene.at != 0.0 {
        return usage("--at: a demo has a time of its own; --from and --to choose a part of it");
    }
    if scene.entities.deathmatch || scene.entities.skill != 1 {
        return usage("--skill, --deathmatch: a demo shows who was there when it was recorded");
    }
    if args.clip.resume && targets.has_streams() {
        return usage("--resume: a video stream cannot be gone on with; write a sequence of files");
    }
    Ok(())
}

/// Frames of a demo that were asked for.
struct Clip<'a> {
    args: &'a Args,
    context: &'a Context,
    audience: &'a Audience,
    steps: Steps,
    show: Show<'a>,
}

/// A level that is being rendered.
struct Scenery {
    stage: Stage,
    settings: Settings,
    renderer: Option<Box<dyn AnyRenderer>>,
}

impl Clip<'_> {
    fn picture(&self) -> &PictureArgs {
        &self.args.picture
    }

    fn timeline(&self) -> &Timeline {
        self.show.timeline
    }

    /// The numbers of the frames that were asked for.
    fn frames(&self) -> Result<Range<u32>> {
        let duration = self.timeline().duration();
        let all = self.steps.before_seconds(duration).min(MOST_FRAMES);
        let clip = &self.args.clip;
        let (first, end) = match (clip.frames, clip.to) {
            (Some(range), _) => (range.first, range.end.unwrap_or(all).min(all)),
            (None, Some(to)) => (0, self.steps.before(to).min(all)),
            (None, None) => (0, all),
        };
        if first >= end {
            bail!(
                "{}: there are no such frames; it plays for {duration:.3} s, which from {} s on are \
                 {all} frames",
                self.args.name(),
                self.steps.from.value()
            );
        }
        Ok(first..end)
    }

    /// The level of a frame.
    fn level(&self, frame: u32) -> Result<usize> {
        let level = self.timeline().level_at(self.steps.time(frame));
        level.context("the demo shows no moment of a level")
    }

    /// The level of a frame, and the name of its skybox if the server asks for one.
    fn place(&self, frame: u32) -> Result<(usize, Option<&str>)> {
        let sky = self.timeline().sky_at(self.steps.time(frame));
        Ok((self.level(frame)?, sky))
    }

    /// Looks whether all levels are there before any is rendered.
    fn check_levels(&self, frames: &Range<u32>) -> Result<()> {
        let levels = self.level(frames.start)?..=self.level(frames.end - 1)?;
        let maps = (self
            .timeline()
            .levels()
            .get(levels)
            .unwrap_or_default()
            .iter())
        .filter(|level| level.span.1 > level.span.0)
        .map(|level| level.map.as_str());
        for map in maps.collect::<BTreeSet<&str>>() {
            Source::of_demo(map, &self.context.global)
                .with_context(|| self.args.name().to_owned())?;
        }
        Ok(())
    }

    /// Makes the frames that were not found.
    fn render(
        &self,
        targets: Targets,
        frames: Range<u32>,
        made: &str,
        found: &resume::Found,
    ) -> Result<Outcome> {
        let device = Device::choose(&self.context.global.device)?;
        let told = Told {
            json: self.context.json,
            to_stderr: targets.take_stdout(),
            silent: self.audience.watches(),
        };
        let (width, height) = self.picture().view.size;
        let streams = targets.streams().to_vec();
        let found_files: Vec<(u32, Vec<_>)> = (found.keys())
            .map(|&f| (f, targets.files(f).map(|(path, _)| path).collect()))
            .collect();
        let targets = targets.open([width, height], self.steps.fps)?;
        let writer = Writer::start(targets, self.picture().denoise, told);
        for (frame, files) in &found_files {
            told.resumed(*frame, self.steps.time(*frame), files)?;
        }
        let goal = Goal {
            spp: self.picture().spp,
            deadline: None,
            target_error: self.picture().target_error,
        };
        let missing = frames.len() as u32 - found.len() as u32;
        let mut run = Run {
            clip: self,
            device: &device,
            made,
            found,
            goal,
            progress: self.progress(&goal, missing),
            scenery: None,
            summary: Summary {
                asked: frames.len() as u32,
                resumed: found.len() as u32,
                stopped: Stopped::Complete.name(),
                ..Summary::default()
            },
            begin: None,
        };
        let rendered = run.frames(frames.clone(), &writer);
        let mut summary = run.summary;
        let tail = Instant::now();
        // A stream that was interrupted is a shorter film; one that failed is none.
        let written = writer.finish(rendered.is_ok());
        summary.wait += tail.elapsed();
        summary.cost = written?;
        rendered?;
        summary.total = run
            .begin
            .map_or(Duration::ZERO, |b| b.elapsed())
            .saturating_sub(summary.load + summary.build);
        told.line(&if told.json {
            let mut map = Map::new();
            map.insert("demo".into(), self.args.name().into());
            map.insert("device".into(), device.name.clone().into());
            map.insert("driver".into(), device.driver.clone().into());
            map.insert("size".into(), format!("{width}x{height}").into());
            map.insert("fps".into(), self.steps.fps.to_string().into());
            map.insert(
                "streams".into(),
                streams.iter().map(|p| p.display().to_string()).collect(),
            );
            if let Value::Object(told) = summary.json() {
                map.extend(told);
            }
            Value::Object(map).to_string()
        } else {
            summary.text()
        })?;
        if summary.stopped == Stopped::Interrupted.name() {
            let done = summary.frames.len() as u32 + summary.resumed;
            let rest = if streams.is_empty() {
                "; --resume makes the rest"
            } else {
                ""
            };
            bail!("interrupted after {done} of {} frames{rest}", summary.asked);
        }
        Ok(Outcome::Done)
    }

    fn progress(&self, goal: &Goal, missing: u32) -> Progress {
        let visible = !self.context.global.quiet && !self.audience.watches();
        Progress::of_frames(visible, goal, missing).told_to(self.audience.reached())
    }

    /// Whether someone asked to end.
    fn interrupted(&self) -> bool {
        interrupt::asked() || self.audience.asks_to_end()
    }

    /// A moment at `time` that knows where all was a frame before, if that is asked for and the level was
    /// there.
    fn followed(&self, mut shown: Frame, time: f64, stage: &Stage) -> Result<Frame> {
        let timeline = self.timeline();
        let before = time - 1.0 / self.steps.fps.value();
        let is_asked = self.picture().layers.0.contains(&Layer::Motion);
        if is_asked && before >= timeline.levels()[stage.index].span.0 {
            let state = self.show.state(before, stage.index)?;
            shown.follow(&stage.frame(&state, timeline)?);
        }
        Ok(shown)
    }
}

/// The frames under way.
struct Run<'a> {
    clip: &'a Clip<'a>,
    device: &'a Device,
    made: &'a str,
    found: &'a resume::Found,
    goal: Goal,
    progress: Progress,
    scenery: Option<Scenery>,
    summary: Summary,
    /// When the first frame began.
    begin: Option<Instant>,
}

impl Run<'_> {
    /// Makes frames in order and hands them to the writer, until all are made or something asks to stop.
    fn frames(&mut self, frames: Range<u32>, writer: &Writer) -> Result<()> {
        let limit = self.clip.picture().time_limit;
        let deadline = limit.map(|s| self.clip.context.start + Duration::from_secs_f64(s));
        self.begin = Some(Instant::now());
        for frame in frames {
            self.enter(self.clip.place(frame)?)?;
            if self.found.contains_key(&frame) {
                continue;
            }
            let stopped = if self.clip.interrupted() {
                Some(Stopped::Interrupted)
            } else if deadline.is_some_and(|d| Instant::now() >= d) {
                Some(Stopped::Deadline)
            } else {
                None
            };
            let goes_on = match stopped {
                Some(stopped) => {
                    self.summary.stopped = stopped.name();
                    false
                }
                None => self.frame(frame, writer)?,
            };
            if !goes_on {
                break;
            }
        }
        Ok(())
    }

    /// Loads a level in its sky unless it is there, and compares frames that were found with it.
    fn enter(&mut self, (level, sky): (usize, Option<&str>)) -> Result<()> {
        let is_it = |s: &Scenery| (s.stage.index, s.stage.sky.as_deref()) == (level, sky);
        if self.scenery.as_ref().is_some_and(is_it) {
            return Ok(());
        }
        // One level at a time.
        self.scenery = None;
        let clip = self.clip;
        let begin = Instant::now();
        let global = &clip.context.global;
        let stage = Stage::load(clip.timeline(), level, sky, clip.picture(), global)?;
        for (frame, digest) in self.found {
            if clip.place(*frame)? == (level, sky) && *digest != stage.digest {
                let map = &clip.timeline().levels()[level].map;
                bail!(
                    "--resume: frame {frame} is there, and was made of another {map} or of other models \
                     or textures; remove it, or write elsewhere"
                );
            }
        }
        let state = clip
            .show
            .state(clip.timeline().levels()[level].span.0, level)?;
        let camera = stage.frame(&state, clip.timeline())?.camera;
        let settings = clip.picture().settings(camera);
        shot::warn_of_unseen_lights(&stage.scene, &settings);
        self.summary.load += begin.elapsed();
        self.scenery = Some(Scenery {
            stage,
            settings,
            renderer: None,
        });
        Ok(())
    }

    /// Makes a frame; whether there may be a next one.
    fn frame(&mut self, frame: u32, writer: &Writer) -> Result<bool> {
        let clip = self.clip;
        let timeline = clip.timeline();
        let Some(Scenery {
            stage,
            settings,
            renderer,
        }) = &mut self.scenery
        else {
            bail!("there is no level")
        };
        let renderer = match renderer {
            Some(renderer) => renderer,
            None => {
                let begin = Instant::now();
                let mut made = self.device.renderer(&stage.scene, settings)?;
                if clip.picture().adaptive {
                    let pilot = adaptive::pilot(clip.picture().spp);
                    made = Box::new(Adaptive::new(made, pilot));
                }
                self.summary.build += begin.elapsed();
                renderer.insert(made)
            }
        };
        let begin = Instant::now();
        let time = clip.steps.time(frame);
        let seed = frame_seed(clip.picture().seed, frame);
        let state = clip.show.state(time, stage.index)?;
        let shown = clip.followed(stage.frame(&state, timeline)?, time, stage)?;
        renderer.show(&shown)?;
        renderer.restart(seed)?;
        let prepared = Instant::now();

        let open = clip.args.clip.shutter / clip.steps.fps.value();
        let moment = |share: f64| {
            let time = time + share * open;
            let state = clip.show.state(time, stage.index)?;
            clip.followed(stage.frame(&state, timeline)?, time, stage)
        };
        let mut shutter = Shutter::new(&mut **renderer, &moment, seed);
        let renderer: &mut dyn AnyRenderer = if open > 0.0 {
            &mut shutter
        } else {
            &mut **renderer
        };
        let asked = || clip.interrupted();
        let stopped = match job::run(renderer, &self.goal, &mut self.progress, &asked) {
            Ok(Stopped::Interrupted) => None,
            Err(_) if asked() => None,
            other => Some(other?),
        };
        let Some(stopped) = stopped else {
            // Part of a frame is none.
            self.summary.stopped = Stopped::Interrupted.name();
            return Ok(false);
        };
        let film = renderer.film()?;
        let rendered = Instant::now();

        let settings = Settings {
            camera: shown.camera.clone(),
            time: shown.time,
            seed,
            ..settings.clone()
        };
        let screen = stage.screen(&state, &shown.camera);
        let mut notes = (clip.picture()).notes(&stage.scene, &settings, self.device, &film);
        let noted = Noted {
            args: clip.args,
            global: &clip.context.global,
            frame,
            samples: film.samples,
            state: &state,
            screen: &screen,
            stage: &stage.digest,
            made: self.made,
        };
        notes.extend(noted.notes());
        let mut style = clip.picture().style(notes);
        if !clip.args.clip.no_tint {
            style.screen = screen;
        }
        let record = Record {
            frame,
            time,
            clock: state.clock,
            level: timeline.levels()[stage.index].map.clone(),
            spp: film.samples,
            stopped: stopped.name(),
            seed,
            counts: [
                state.entities.len(),
                state.lights.len(),
                state.particles.len(),
            ],
            prepare: prepared - begin,
            render: rendered - prepared,
            counters: film.counters,
            ..Record::default()
        };
        let summary = &mut self.summary;
        summary.frames.push((rendered - begin).as_secs_f64());
        summary.prepare += record.prepare + rendered.elapsed();
        summary.render += record.render;
        add(&mut summary.counters, &film.counters);
        match writer.send(film, style, record) {
            Some(waited) => summary.wait += waited,
            // It has an error to tell.
            None => return Ok(false),
        }
        Ok(true)
    }
}

fn add(sum: &mut Counters, more: &Counters) {
    sum.paths += more.paths;
    sum.rays += more.rays;
    sum.nonfinite += more.nonfinite;
    sum.escaped += more.escaped;
}
