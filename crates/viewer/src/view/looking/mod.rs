//! What is shown instead of the picture, or beside it. Nothing here changes how a picture is made: none of
//! it is in a command.

pub mod color;
pub mod layer;
pub mod survey;
pub mod zoom;

pub use layer::{Legend, Shown};
pub use zoom::Zoom;

use crate::tonemap::Tonemap;
use layer::Sources;
use scene::render::{Film, Settings};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, channel};
use survey::{Key, Probes, Subject, Survey};

/// A picture that was kept, to compare with.
#[derive(Clone, Debug)]
pub struct Kept {
    /// What it is called.
    pub name: String,
    /// All that is known of it.
    pub film: Arc<Film>,
    /// What its rays met, where that was looked at.
    pub survey: Option<Arc<Survey>>,
    /// Tells it from others.
    id: u64,
}

/// Numbers that tell one thing from the next.
fn fresh() -> u64 {
    static LAST: AtomicU64 = AtomicU64::new(0);
    LAST.fetch_add(1, Ordering::Relaxed)
}

/// All about looking.
#[derive(Default)]
pub struct Looking {
    /// The layer.
    pub shown: Shown,
    /// Number of the light style of [`Shown::Style`].
    pub style: u16,
    /// Where the colours of numbers begin and end; `None` finds out.
    pub range: Option<[f32; 2]>,
    /// How near.
    pub zoom: Zoom,
    /// Share of the window, from the left, that shows what was kept.
    pub split: f32,
    /// What is compared with; nothing shows no split.
    pub kept: Option<Kept>,
    /// What is typed as the file of a picture.
    pub file: String,
    /// A file on its way.
    reading: Option<Receiver<Result<Kept, String>>>,
    /// The film as it was read last, and which one it is.
    film: Option<(Arc<Film>, u64)>,
    /// Samples that it had.
    progress: f64,
    /// What it is a picture of.
    told: Option<Settings>,
    /// Seconds since it was read.
    age: f32,
    /// What rays met.
    survey: Option<Arc<Survey>>,
    /// What they were sent for last, and their answers.
    asked: Option<Key>,
    asking: Option<Receiver<Result<Survey, String>>>,
    /// The layer as it is shown, and of what was kept.
    now: Option<Plate>,
    then: Option<Plate>,
}

/// A layer made ready to be shown.
pub struct Plate {
    /// What it was made of.
    made_of: MadeOf,
    /// Its colours.
    pub texture: egui::TextureHandle,
    /// What they mean.
    pub legend: Legend,
}

/// What a [`Plate`] depends on.
#[derive(Clone, Debug, PartialEq)]
struct MadeOf {
    film: u64,
    survey: Option<u64>,
    leaf: Option<u32>,
    shown: Shown,
    style: u16,
    range: Option<[f32; 2]>,
    display: (f32, Tonemap),
}

impl Looking {
    /// A split in the middle, once there is something to compare with.
    #[must_use]
    pub fn new() -> Self {
        Self {
            split: 0.5,
            ..Self::default()
        }
    }

    /// What the colours of the layer mean, as it is shown.
    #[must_use]
    pub fn legend(&self) -> Option<&Legend> {
        self.now.as_ref().map(|plate| &plate.legend)
    }

    /// The film, as it was read last.
    #[must_use]
    pub fn film(&self) -> Option<&Arc<Film>> {
        self.film.as_ref().map(|(film, _)| film)
    }

    /// What rays met, as it was looked at last.
    #[must_use]
    pub fn survey(&self) -> Option<&Arc<Survey>> {
        self.survey.as_ref()
    }

    /// Forgets what is another scene's.
    pub fn restart(&mut self) {
        (self.film, self.survey, self.told) = (None, None, None);
        (self.asked, self.asking) = (None, None);
        self.now = None;
    }

    /// Keeps the film that was read last under a name.
    pub fn keep(&mut self, name: String) {
        if let Some((film, id)) = &self.film {
            self.kept = Some(Kept {
                name,
                film: Arc::clone(film),
                survey: self.survey.clone(),
                id: *id,
            });
        }
    }

    /// Begins to read a picture to compare with.
    pub fn open(&mut self, path: PathBuf) {
        let (sender, receiver) = channel();
        std::thread::spawn(move || {
            // Nobody waits any more if the receiver is gone.
            let _ = sender.send(read(&path));
        });
        self.reading = Some(receiver);
    }

    /// Whether something is looked at or read that will be shown.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        self.asking.is_some() || self.reading.is_some()
    }

    /// Takes what came meanwhile; an error is a sentence.
    pub(super) fn receive(&mut self) -> Result<(), String> {
        // What is no longer wanted is not shown either.
        if self.shown == Shown::Picture {
            self.now = None;
        }
        if self.kept.is_none() {
            self.then = None;
        }
        if let Some(answer) = self.asking.as_ref().and_then(|a| a.try_recv().ok()) {
            self.asking = None;
            let survey = answer?;
            // Another question may have been asked meanwhile.
            if self.asked.as_ref() == Some(&survey.key) {
                self.survey = Some(Arc::new(survey));
            }
        }
        if let Some(answer) = self.reading.as_ref().and_then(|a| a.try_recv().ok()) {
            self.reading = None;
            self.kept = Some(answer?);
        }
        Ok(())
    }

    /// Sends rays, where the layer asks for them and they were not sent yet.
    pub(super) fn ask(
        &mut self,
        subject: impl FnOnce() -> Subject,
        key: Key,
        probes: &Arc<Probes>,
    ) {
        let answers = |s: &&Arc<Survey>| {
            let same = Key {
                baked: key.baked,
                ..s.key.clone()
            };
            same == key && (s.key.baked || !key.baked)
        };
        if let Some(survey) = self.survey.as_ref().filter(answers) {
            self.asked = Some(survey.key.clone());
            return;
        }
        if self.asking.is_some() || self.asked.as_ref() == Some(&key) {
            return;
        }
        let (subject, probes, asked) = (subject(), Arc::clone(probes), key.clone());
        let (sender, receiver) = channel();
        std::thread::spawn(move || {
            // Nobody waits any more if the receiver is gone.
            let _ = sender.send(probes.survey(&subject, key));
        });
        (self.asked, self.asking) = (Some(asked), Some(receiver));
    }

    /// Whether the film should be read: it is another one, or older than `EVERY` and has other samples.
    pub(super) fn wants_film(
        &mut self,
        settings: &Settings,
        progress: f64,
        seconds: f32,
        is_done: bool,
    ) -> bool {
        /// Reading and colouring a film takes a frame's time or two.
        const EVERY: f32 = 0.5;
        self.age += seconds;
        if self.told.as_ref() != Some(settings) {
            (self.film, self.now) = (None, None);
        }
        match self.film {
            None => true,
            Some(_) => progress != self.progress && (self.age > EVERY || is_done),
        }
    }

    /// Takes a film that was read.
    pub(super) fn take_film(&mut self, film: Film, settings: &Settings, progress: f64) {
        self.film = Some((Arc::new(film), fresh()));
        (self.told, self.progress, self.age) = (Some(settings.clone()), progress, 0.0);
    }

    /// Makes the layers that are to be shown.
    pub(super) fn paint(&mut self, ctx: &egui::Context, level: &Around<'_>) {
        let (now, then) = (self.now.take(), self.then.take());
        let survey = self
            .survey
            .as_deref()
            .filter(|s| Some(&s.key) == self.asked.as_ref() || self.asked.is_none());
        if let Some((film, id)) = self.film.as_ref().filter(|_| self.shown != Shown::Picture) {
            self.now = Some(self.plate(ctx, "layer", now, (film, *id), survey, level));
        }
        if let Some(kept) = &self.kept {
            let survey = kept.survey.as_deref();
            self.then = Some(self.plate(
                ctx,
                "kept layer",
                then,
                (&kept.film, kept.id),
                survey,
                level,
            ));
        }
    }

    fn plate(
        &self,
        ctx: &egui::Context,
        name: &str,
        old: Option<Plate>,
        (film, id): (&Arc<Film>, u64),
        survey: Option<&Survey>,
        level: &Around<'_>,
    ) -> Plate {
        let made_of = MadeOf {
            film: id,
            survey: survey.map(|s| s.id),
            leaf: level.leaf,
            shown: self.shown,
            style: self.style,
            range: self.range,
            display: level.display,
        };
        if let Some(old) = old.filter(|p| p.made_of == made_of) {
            return old;
        }
        let sources = Sources {
            film,
            survey,
            bsp: level.bsp,
            leaf: level.leaf,
            entities: level.entities,
            style: self.style,
            range: self.range,
            display: level.display,
        };
        let (picture, legend) = layer::image(self.shown, &sources);
        let texture = ctx.load_texture(name, picture, egui::TextureOptions::NEAREST);
        Plate {
            made_of,
            texture,
            legend,
        }
    }

    /// The layers to be shown, now and of what was kept.
    #[must_use]
    pub fn plates(&self) -> [Option<&Plate>; 2] {
        [self.now.as_ref(), self.then.as_ref()]
    }
}

/// What of the level and the picture layers are made with.
pub(super) struct Around<'a> {
    pub bsp: Option<&'a bsp::Bsp>,
    /// Leaf whose PVS is shown.
    pub leaf: Option<u32>,
    /// By instance, its entity.
    pub entities: &'a [u32],
    /// Exposure and tone curve.
    pub display: (f32, Tonemap),
}

/// A film of the layers that an EXR has, or of the colours of a PNG.
///
/// # Errors
/// When it is no picture that can be read.
pub fn read(path: &Path) -> Result<Kept, String> {
    let layer = |name: &str| crate::picture::read(path, name);
    let beauty = layer(crate::picture::BEAUTY).map_err(|e| format!("{e:#}"))?;
    let (width, height) = (beauty.width as u32, beauty.height as u32);
    let rgb = |name: &str| layer(name).map_or_else(|_| Vec::new(), |p| p.radiance);
    let one = |name: &str| rgb(name).iter().map(|p| p[0]).collect::<Vec<f32>>();
    let counts = one("samples").iter().map(|&n| n as u32).collect::<Vec<_>>();
    Ok(Kept {
        name: path.file_name().map_or_else(
            || path.display().to_string(),
            |n| n.to_string_lossy().into_owned(),
        ),
        film: Arc::new(Film {
            width,
            height,
            samples: counts.iter().copied().max().unwrap_or(0),
            albedo: rgb("albedo"),
            normal: rgb("normal"),
            depth: one("depth"),
            position: rgb("position"),
            emission: rgb("emission"),
            direct: rgb("direct"),
            indirect: rgb("indirect"),
            motion: rgb("motion").iter().map(|&[x, y, _]| [x, y]).collect(),
            variance: rgb("variance"),
            id: one("id").iter().map(|&n| n as u32).collect(),
            sample_counts: counts,
            beauty: beauty.radiance,
            ..Film::default()
        }),
        survey: None,
        id: fresh(),
    })
}
