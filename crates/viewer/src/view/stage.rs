//! A level that is shown: loaded, imported and uploaded beside the frame loop.

use super::export::of_demo;
use super::fly::Eye;
use crate::cli::{CameraChoice, Global, Render};
use crate::demo;
use crate::level::{Loaded, Source};
use anyhow::{Context as _, Result, anyhow};
use rt::{Gpu, PathTracer};
use scene::import::{Cast, ImportOptions};
use scene::playback::Parts;
use scene::render::Settings;
use scene::timeline::Timeline;
use scene::{Camera, Scene};
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// A level on the device.
pub struct Stage {
    /// As it was named, `None` for the bundled one.
    pub level: Option<String>,
    /// The level's files.
    pub loaded: Arc<Loaded>,
    /// How it was imported.
    pub options: ImportOptions,
    /// What the renderer has.
    pub scene: Arc<Scene>,
    /// What is shown of a demo; `None` of a level by itself.
    pub showing: Option<Showing>,
    /// The renderer.
    pub tracer: PathTracer,
    /// The camera that its sprites are turned to.
    pub turned_to: Camera,
    /// Reading, importing, uploading.
    pub seconds: [f64; 3],
}

/// A level of a demo.
pub struct Showing {
    /// The demo.
    pub timeline: Arc<Timeline>,
    /// The level's number in it.
    pub index: usize,
    /// What moves.
    pub cast: Cast,
}

/// What is to be loaded.
#[derive(Clone)]
pub enum Wanted {
    /// A level by its name or file; `None` is the bundled one.
    Level(Option<String>),
    /// The same files once more, with other options.
    Again(Option<String>, Arc<Loaded>),
    /// The level of a demo at a time, in the sky that the server asks for then; the demo is read first where it is not given.
    Demo(String, Option<Arc<Timeline>>, f64),
    /// The same scene with its sprites turned to another camera.
    Turned(Option<String>, Arc<Loaded>, Arc<Scene>),
}

impl Wanted {
    fn name(&self) -> String {
        match self {
            Self::Demo(demo, ..) => demo.clone(),
            Self::Level(level) | Self::Again(level, _) | Self::Turned(level, ..) => {
                level.clone().unwrap_or_else(|| "the sample level".into())
            }
        }
    }
}

/// The bundled demo, as it is opened.
pub const SAMPLE_DEMO: &str = "the sample.dem";

/// What loading is doing.
const PHASES: [&str; 3] = ["reading", "importing", "uploading"];

/// A level on its way.
///
/// Dropped, it is given up, and all that is of the device is gone afterwards: nothing may still work on a device
/// when the program ends, for its driver is unloaded then.
pub struct Loading {
    wanted: Wanted,
    phase: Arc<AtomicU8>,
    begun: Instant,
    result: Receiver<Result<Stage>>,
    /// The device, while it is wanted; locked while something is made on it.
    gpu: Arc<Mutex<Option<Gpu>>>,
}

/// All that loading needs besides the level and the device.
#[derive(Clone)]
pub struct Order {
    /// Where files are.
    pub global: Global,
    /// How the picture is made; its camera is taken only with `eye`.
    pub args: Render,
    /// Where from; `None` for the level's own first camera, or the one that `args` names.
    pub eye: Option<Eye>,
}

impl Loading {
    /// Begins to load in the background.
    #[must_use]
    pub fn start(wanted: Wanted, order: Order, gpu: Gpu) -> Self {
        let (sender, result) = channel();
        let phase = Arc::new(AtomicU8::new(0));
        let (told, what) = (Arc::clone(&phase), wanted.clone());
        let gpu = Arc::new(Mutex::new(Some(gpu)));
        let gate = Arc::clone(&gpu);
        std::thread::spawn(move || {
            let prepared = prepare(what, &order, &told);
            let gpu = gate.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(gpu) = &*gpu {
                told.store(2, Ordering::Relaxed);
                // Sent before others may have the lock: a stage is never dropped here while somebody waits.
                let _ = sender.send(prepared.and_then(|p| upload(p, gpu)));
            }
        });
        Self {
            wanted,
            phase,
            begun: Instant::now(),
            result,
            gpu,
        }
    }

    /// The level, once it is there or has failed.
    #[must_use]
    pub fn poll(&mut self) -> Option<Result<Stage>> {
        match self.result.try_recv() {
            Ok(result) => Some(result),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err(anyhow!(
                "{}: loading ended without a word",
                self.wanted.name()
            ))),
        }
    }

    /// What is loaded.
    #[must_use]
    pub fn name(&self) -> String {
        self.wanted.name()
    }

    /// Whether the files are read anew.
    #[must_use]
    pub fn is_new(&self) -> bool {
        matches!(self.wanted, Wanted::Level(_) | Wanted::Demo(_, None, _))
    }

    /// What is being done, the share of all that is done before, and for how long it lasts so far.
    #[must_use]
    pub fn progress(&self) -> (&'static str, f32, Duration) {
        let phase = usize::from(self.phase.load(Ordering::Relaxed)).min(PHASES.len() - 1);
        let share = phase as f32 / PHASES.len() as f32;
        (PHASES[phase], share, self.begun.elapsed())
    }
}

impl Drop for Loading {
    fn drop(&mut self) {
        let mut gpu = self.gpu.lock().unwrap_or_else(PoisonError::into_inner);
        *gpu = None;
    }
}

/// What the renderer is told, as `runelight render` tells it.
///
/// # Errors
/// When the level has no such camera.
pub fn settings_of(args: &Render, scene: &Scene) -> Result<Settings> {
    let picture = &args.picture;
    Ok(Settings {
        time: picture.scene.at as f32,
        ..picture.settings(picture.view.camera_of(scene, picture.scene.at)?)
    })
}

/// A level before it is on the device.
struct Prepared {
    level: Option<String>,
    loaded: Arc<Loaded>,
    options: ImportOptions,
    scene: Arc<Scene>,
    showing: Option<Showing>,
    settings: Settings,
    /// Reading and importing.
    seconds: [f64; 2],
}

fn prepare(wanted: Wanted, order: &Order, phase: &AtomicU8) -> Result<Prepared> {
    let start = Instant::now();
    let (mut film, mut sky) = (None, None);
    let (level, loaded, scene) = match wanted {
        Wanted::Demo(name, timeline, time) => {
            let timeline = match timeline {
                Some(timeline) => timeline,
                None => {
                    let named = Some(&*name).filter(|name| *name != SAMPLE_DEMO);
                    let bytes = demo::read(named, &order.global)?;
                    Arc::new(demo::timeline(&bytes, &order.global)?)
                }
            };
            let index = timeline.level_at(time).context("the demo shows no level")?;
            let map = &timeline.levels()[index].map;
            let loaded = Arc::new(Source::of_demo(map, &order.global)?.load()?);
            sky = timeline.sky_at(time).map(str::to_owned);
            film = Some((timeline, index));
            (Some(name), loaded, None)
        }
        Wanted::Turned(level, loaded, scene) => (level, loaded, Some(scene)),
        Wanted::Again(level, loaded) => (level, loaded, None),
        Wanted::Level(level) => {
            let source = Source::new(level.as_deref(), &order.global)?;
            (level, Arc::new(source.load()?), None)
        }
    };
    let read = Instant::now();
    phase.store(1, Ordering::Relaxed);
    let mut args = order.args.clone();
    if film.is_some() {
        args.picture = of_demo(&args.picture);
    }
    if let Some(eye) = order.eye {
        args.picture.view.camera = Some(CameraChoice::Pose(eye.pose()));
        args.picture.view.camera_path = None;
    }
    let options = ImportOptions {
        skybox: sky,
        ..args.picture.import_options()?
    };
    let (mut scene, showing) = match (scene, film) {
        (_, Some((timeline, index))) => {
            let parts = Parts::of(&timeline, index);
            let (scene, cast) = loaded.import_cast(&options, parts.list())?;
            let showing = Showing {
                timeline,
                index,
                cast,
            };
            (scene, Some(showing))
        }
        (Some(scene), None) => (scene.as_ref().clone(), None),
        (None, None) => (loaded.import(&options)?, None),
    };
    // A camera's number or name is another level's.
    let at = args.picture.scene.at;
    let view = &mut args.picture.view;
    if order.eye.is_none() && view.camera.is_some() && view.camera_of(&scene, at).is_err() {
        view.camera = None;
    }
    let settings = settings_of(&args, &scene)?;
    scene.turn_sprites(&settings.camera);
    let seconds = [read - start, read.elapsed()].map(|d| d.as_secs_f64());
    Ok(Prepared {
        level,
        loaded,
        options,
        scene: Arc::new(scene),
        showing,
        settings,
        seconds,
    })
}

fn upload(prepared: Prepared, gpu: &Gpu) -> Result<Stage> {
    // One level at a time: uploads are the largest pieces of memory there are.
    static UPLOADS: Mutex<()> = Mutex::new(());
    let _alone = UPLOADS.lock().unwrap_or_else(PoisonError::into_inner);
    let begun = Instant::now();
    let Prepared {
        level,
        loaded,
        options,
        scene,
        showing,
        settings,
        seconds: [read, import],
    } = prepared;
    let tracer = PathTracer::new(gpu, &scene, &settings)?;
    Ok(Stage {
        level,
        loaded,
        options,
        scene,
        showing,
        tracer,
        turned_to: settings.camera,
        seconds: [read, import, begun.elapsed().as_secs_f64()],
    })
}
