//! Taking a case's picture, with any renderer.

use crate::case::{Case, Truth};
use crate::judge::{Target, Verdict};
use scene::Scene;
use scene::render::{Estimator, Film, Selection, Settings};
use std::sync::Arc;

/// Seed of the judge in double precision: another than the picture's.
const JUDGE_SEED: u64 = 0x6a75_6467;
/// Largest picture, pixels across: enough threads for any GPU.
const MAX_SIZE: u32 = 512;

/// How much of a case to render.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Times the case's own pixels across and down.
    pub zoom: u32,
    /// Samples per pixel.
    pub samples: u32,
}

/// A renderer: a picture of a scene with this number of samples per pixel.
pub type Render<'a, E> = dyn FnMut(&Arc<Scene>, &Settings, u32) -> Result<Film, E> + 'a;

impl Case {
    /// What `scale` times the case's own number of paths are spent on: first on pixels, so that a
    /// GPU has threads enough, then on samples; below 1 on fewer samples. A case of fixed size
    /// stays as it is.
    #[must_use]
    pub fn plan(&self, scale: f64) -> Plan {
        if self.fixed {
            return Plan {
                zoom: 1,
                samples: self.samples,
            };
        }
        let most = f64::from((MAX_SIZE / self.size).max(1));
        let zoom = scale.sqrt().floor().clamp(1.0, most);
        let samples = (f64::from(self.samples) * scale / (zoom * zoom)).ceil();
        Plan {
            zoom: zoom as u32,
            // A variance needs two.
            samples: (samples as u32).max(2),
        }
    }

    /// Checks the scene's facts, renders the case and judges the picture. `render` is the renderer
    /// on trial, `judge` the one in double precision; it is asked, once,
    /// where the truth is its own.
    ///
    /// # Errors
    /// When a renderer fails.
    pub fn run<E>(
        &self,
        estimator: Estimator,
        plan: Plan,
        render: &mut Render<'_, E>,
        judge: &mut Render<'_, E>,
    ) -> Result<(Film, Verdict), E> {
        let settings = self.settings(estimator, plan.zoom);
        let film = render(self.scene(), &settings, plan.samples)?;
        let other;
        let target = match &self.truth {
            Truth::Radiance(_) | Truth::Black => Target::Truth,
            Truth::Same(make) => {
                other = render(&make(), &settings, plan.samples)?;
                Target::Film(&other)
            }
            Truth::Judge(samples) => Target::Film(match self.judged.get() {
                Some(known) => known,
                None => {
                    // The mean over a picture is the same at any number of pixels.
                    let mut settings = self.settings(Estimator::Mis, 1);
                    settings.seed = JUDGE_SEED;
                    // Whatever a level's tree says of its lights, the judge does not ask.
                    settings.selection = Selection::Power;
                    let film = judge(self.scene(), &settings, *samples)?;
                    self.judged.get_or_init(|| film)
                }
            }),
        };
        let mut verdict = self.judge(&film, target);
        verdict.failures.extend((self.facts)(self.scene()).err());
        Ok((film, verdict))
    }
}

#[cfg(test)]
mod tests {
    use crate::cases;

    #[test]
    fn paths_go_to_pixels_first() {
        let all = cases();
        let case = &all[0];
        let plan = |scale| {
            let p = case.plan(scale);
            (p.zoom, p.samples)
        };
        assert_eq!((case.size, case.samples), (8, 256));
        assert_eq!(plan(1.0), (1, 256));
        assert_eq!(plan(0.1), (1, 26));
        assert_eq!(plan(4.0), (2, 256));
        assert_eq!(plan(65_536.0), (64, 4096));
        let million = all.iter().find(|c| c.fixed).expect("a fixed case");
        assert_eq!(million.plan(1e3).samples, 1_000_000);
        assert_eq!(million.plan(1e-3).samples, 1_000_000);
    }
}
