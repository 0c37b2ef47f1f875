//! What a bench measures: levels x cameras x estimators x selections x budgets.

use super::result::Budget;
use crate::cli::{Bench as Args, CameraChoice, Lights, SceneArgs};
use scene::render::{Estimator, Sampler, Selection};

/// What to measure.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Levels by name, `None` for the bundled one, each with its cameras.
    pub levels: Vec<(Option<String>, Vec<CameraChoice>)>,
    /// Whether a level that is not found is left out with a warning.
    pub may_lack_levels: bool,
    /// Curves of every view.
    pub curves: Vec<(Estimator, Selection)>,
    /// Light samples of which one is kept.
    pub candidates: u32,
    /// Where random numbers come from.
    pub sampler: Sampler,
    /// Budgets, rising, samples before seconds.
    pub budgets: Vec<Budget>,
    /// Pixels across and down.
    pub size: (u32, u32),
    /// Path vertices after the camera.
    pub depth: u32,
    /// Independent runs of every curve.
    pub repeats: u32,
    /// Seconds a view's reference may take.
    pub reference_seconds: f64,
    /// What the scene is made of.
    pub scene: SceneArgs,
    /// Base of all seeds.
    pub seed: u64,
}

/// A ready-made plan.
struct Preset {
    levels: &'static [(Option<&'static str>, &'static [usize])],
    spp: &'static [u32],
    seconds: &'static [f64],
    size: (u32, u32),
    depth: u32,
    repeats: u32,
    reference_seconds: f64,
}

const QUICK: Preset = Preset {
    levels: &[(None, &[0, 1])],
    spp: &[8, 16, 32, 64, 128],
    seconds: &[0.25],
    size: (64, 36),
    depth: 4,
    repeats: 4,
    reference_seconds: 20.0,
};

const SUITE: Preset = Preset {
    levels: &[
        (None, &[0, 1]),
        // From its start dark, with little light from afar.
        (Some("start"), &[0, 1]),
        (Some("lq_e0m3"), &[0, 1]),
        // From the intermission dark.
        (Some("lq_e0m1"), &[0, 1]),
        // The most emitters, 3181.
        (Some("lq_e1m7"), &[1]),
    ],
    spp: &[16, 64, 256, 1024],
    seconds: &[0.5],
    size: (320, 180),
    depth: 8,
    repeats: 4,
    reference_seconds: 20.0,
};

const DEFAULT: Preset = Preset {
    levels: &[(None, &[0])],
    spp: &[16, 64, 256, 1024],
    seconds: &[],
    size: (320, 180),
    depth: 8,
    repeats: 4,
    reference_seconds: 120.0,
};

impl Plan {
    /// The plan that the options make.
    #[must_use]
    pub fn new(args: &Args) -> Self {
        let preset = match (args.quick, args.suite) {
            (true, _) => &QUICK,
            (_, true) => &SUITE,
            _ => &DEFAULT,
        };
        let cameras = |numbers: &[usize]| -> Vec<CameraChoice> {
            match &args.cameras {
                Some(list) => list.0.clone(),
                None => numbers.iter().map(|n| CameraChoice::Index(*n)).collect(),
            }
        };
        let levels = if args.levels.is_empty() {
            (preset.levels.iter())
                .map(|(level, numbers)| (level.map(str::to_owned), cameras(numbers)))
                .collect()
        } else {
            (args.levels.iter())
                .map(|level| (Some(level.clone()), cameras(&[0])))
                .collect()
        };
        let mut scene = args.scene.clone();
        if (args.quick || args.suite) && scene.lights == Lights::Auto {
            // All estimators find these lights: they have one expectation.
            scene.lights = Lights::Textures;
        }
        let mut curves = Vec::new();
        for &estimator in &args.estimators.0 {
            for &selection in &args.selections.0 {
                // Without a choice among lights there is one curve.
                let selection = if estimator.samples_lights() {
                    selection
                } else {
                    Selection::default()
                };
                if !curves.contains(&(estimator, selection)) {
                    curves.push((estimator, selection));
                }
            }
        }
        Self {
            levels,
            may_lack_levels: args.suite && args.levels.is_empty(),
            curves,
            candidates: args.candidates,
            sampler: args.sampler.into(),
            budgets: budgets(args, preset),
            size: args.size.unwrap_or(preset.size),
            depth: args.depth.unwrap_or(preset.depth),
            repeats: args.repeats.unwrap_or(preset.repeats),
            reference_seconds: args.reference_seconds.unwrap_or(preset.reference_seconds),
            scene,
            seed: args.seed,
        }
    }

    /// Bytes that the pictures of a view take until its reference is there.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let pixels = u64::from(self.size.0) * u64::from(self.size.1);
        let pictures = self.curves.len() * self.budgets.len() * self.repeats as usize;
        pixels * 24 * pictures as u64
    }
}

fn budgets(args: &Args, preset: &Preset) -> Vec<Budget> {
    let (mut spp, mut seconds) = match (&args.spp, &args.seconds) {
        (None, None) => (preset.spp.to_vec(), preset.seconds.to_vec()),
        (spp, seconds) => (
            spp.as_ref().map_or(Vec::new(), |list| list.0.clone()),
            seconds.as_ref().map_or(Vec::new(), |list| list.0.clone()),
        ),
    };
    spp.sort_unstable();
    spp.dedup();
    seconds.sort_by(f64::total_cmp);
    seconds.dedup();
    (spp.into_iter().map(Budget::Samples))
        .chain(seconds.into_iter().map(Budget::Seconds))
        .collect()
}
