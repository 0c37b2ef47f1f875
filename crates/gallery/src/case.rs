//! What a case of the gallery is.

use crate::builder;
use scene::render::{Estimator, Film, Selection, Settings};
use scene::{Camera, Scene};
use std::fmt;
use std::sync::{Arc, OnceLock};

/// Makes a scene when it is first asked for.
pub type MakeScene = Box<dyn Fn() -> Arc<Scene> + Send + Sync>;

/// What is known about a case's picture.
pub enum Truth {
    /// Every pixel has this expected radiance (linear RGB), by a closed form.
    Radiance([f64; 3]),
    /// Every pixel is exactly 0, in every sample.
    Black,
    /// The picture is that of this other scene, bit for bit, on the same device; it is not black.
    Same(MakeScene),
    /// The mean of the picture is what the renderer in double precision finds by `mis` with this
    /// number of samples per pixel, within the standard errors of both.
    Judge(u32),
}

impl Truth {
    /// A word or two for tables.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Radiance(_) => "closed form",
            Self::Black => "exactly black",
            Self::Same(_) => "same picture",
            Self::Judge(_) => "f64 renderer",
        }
    }
}

impl fmt::Debug for Truth {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Radiance(rgb) => write!(f, "Radiance({rgb:?})"),
            Self::Judge(samples) => write!(f, "Judge({samples})"),
            Self::Black | Self::Same(_) => f.write_str(self.name()),
        }
    }
}

/// How many rays may leave the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Escapes {
    /// None: the scene is sealed.
    Never,
    /// At least one: the scene is open, and a renderer that counts none hides it.
    Some,
    /// Every path, with its first ray.
    Always,
    /// Any number: the scene is an open stage, and what leaves it matters to nobody.
    Free,
}

/// The pass line: how far from the truth a picture may be beyond what its own noise explains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Largest error relative to the truth that rounding and the stated effects explain.
    pub relative: f64,
    /// Why this much.
    pub why: &'static str,
    /// Widest 95 % interval of the mean, relative to the truth, at the case's own number of
    /// samples: a noisier picture would pass anything, and fails.
    pub interval: f64,
    /// Whether every single pixel must meet the line without any allowance for noise: each path
    /// finds the same light.
    pub every_pixel: bool,
    /// Rays of 10^9 that a device may lose or lead astray: as many pixels may be wrong, and as many rays
    /// may leave. 0 where surfaces share their edges: devices lose nothing there.
    pub astray: f64,
    /// Why as many.
    pub astray_why: &'static str,
}

/// Single precision: a path's value is a product and a sum of a few terms, each rounded to 6e-8.
const F32: (f64, &str) = (
    1e-5,
    "a path is a few f32 products and sums, each rounded to 6e-8; a texel's colour to 1e-7",
);

/// A scene that is hard on renderers, a view of it and what is true about the picture.
pub struct Case {
    /// A few words.
    pub name: &'static str,
    /// What it tests, one sentence.
    pub tests: &'static str,
    make: MakeScene,
    made: OnceLock<Arc<Scene>>,
    /// The picture of [`Truth::Judge`], once it is made.
    pub(crate) judged: OnceLock<Film>,
    /// Where from.
    pub camera: Camera,
    /// Pixels across and down.
    pub size: u32,
    /// Path vertices; 0 is unlimited.
    pub depth: u32,
    /// The estimators whose expectation is the truth and that find it in reasonable time.
    pub estimators: Vec<Estimator>,
    /// Samples per pixel that show what the case is there for.
    pub samples: u32,
    /// Whether size and samples stand for themselves and must not be scaled.
    pub fixed: bool,
    /// What is known about the picture.
    pub truth: Truth,
    /// How many rays may leave the scene.
    pub escapes: Escapes,
    /// What must hold of the scene itself before any ray is traced.
    pub facts: fn(&Scene) -> Result<(), String>,
    /// The pass line.
    pub line: Line,
}

impl Case {
    /// A case of a sealed scene; 8 by 8 pixels with 256 samples of a path of any length by `naive`
    /// and `mis`, unless said otherwise.
    pub fn new(
        name: &'static str,
        tests: &'static str,
        truth: Truth,
        camera: Camera,
        make: impl Fn() -> Arc<Scene> + Send + Sync + 'static,
    ) -> Self {
        Self {
            name,
            tests,
            make: Box::new(make),
            made: OnceLock::new(),
            judged: OnceLock::new(),
            camera,
            size: 8,
            depth: 0,
            estimators: vec![Estimator::Naive, Estimator::Mis],
            samples: 256,
            fixed: false,
            truth,
            escapes: Escapes::Never,
            facts: |_| Ok(()),
            line: Line {
                relative: F32.0,
                why: F32.1,
                interval: 0.02,
                every_pixel: false,
                astray: 0.0,
                astray_why: "",
            },
        }
    }

    pub(crate) fn depth(mut self, depth: u32) -> Self {
        self.depth = depth;
        self
    }

    pub(crate) fn by(mut self, estimators: &[Estimator]) -> Self {
        self.estimators = estimators.to_vec();
        self
    }

    pub(crate) fn samples(mut self, size: u32, samples: u32) -> Self {
        (self.size, self.samples) = (size, samples);
        self
    }

    pub(crate) fn fixed(mut self) -> Self {
        self.fixed = true;
        self
    }

    pub(crate) fn escapes(mut self, escapes: Escapes) -> Self {
        self.escapes = escapes;
        self
    }

    pub(crate) fn facts(mut self, facts: fn(&Scene) -> Result<(), String>) -> Self {
        self.facts = facts;
        self
    }

    pub(crate) fn line(mut self, relative: f64, why: &'static str) -> Self {
        (self.line.relative, self.line.why) = (relative, why);
        self
    }

    pub(crate) fn interval(mut self, interval: f64) -> Self {
        self.line.interval = interval;
        self
    }

    pub(crate) fn every_pixel(mut self) -> Self {
        self.line.every_pixel = true;
        self
    }

    /// Surfaces cross or touch without sharing an edge there, or triangles are as thin as rounding.
    pub(crate) fn astray(mut self, per_billion: f64, why: &'static str) -> Self {
        (self.line.astray, self.line.astray_why) = (per_billion, why);
        self
    }

    /// The scene; made when it is first asked for.
    #[must_use]
    pub fn scene(&self) -> &Arc<Scene> {
        self.made.get_or_init(|| (self.make)())
    }

    /// What to ask of a renderer, at `zoom` times the pixels across and down.
    #[must_use]
    pub fn settings(&self, estimator: Estimator, zoom: u32) -> Settings {
        let size = self.size.saturating_mul(zoom.max(1));
        let mut settings = builder::settings(self.camera.clone(), size, estimator, self.depth);
        if matches!(self.truth, Truth::Same(_)) {
            // Lists of lights may differ, and with them the samples.
            settings.selection = Selection::Power;
        }
        settings
    }

    /// Paths of one picture at the case's own size and samples.
    #[must_use]
    pub fn paths(&self) -> u64 {
        u64::from(self.size) * u64::from(self.size) * u64::from(self.samples)
    }
}

impl fmt::Debug for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Case")
            .field("name", &self.name)
            .field("truth", &self.truth)
            .finish_non_exhaustive()
    }
}
