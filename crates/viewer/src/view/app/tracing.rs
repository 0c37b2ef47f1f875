//! What the device traces for a frame: the view as it is now, at a size and in slices that fit.

use super::{App, Moment};
use crate::cli::{CameraChoice, Render};
use crate::clip::{Show, frame_seed};
use crate::job::Stopped;
use crate::output::Layer;
use crate::view::convergence::Point;
use crate::view::fly::Eye;
use crate::view::look::demo_defaults;
use crate::view::pace::{Slice, coarse};
use crate::view::player::Player;
use crate::view::stage::{Showing, Stage, Wanted, settings_of};
use anyhow::Result;
use rt::Filter;
use scene::camera::DEFAULT_FOV_DEG;
use scene::render::{Renderer as _, Settings};
use scene::timeline::State;
use scene::{Frame, playback};
use std::time::Instant;

/// After so many seconds without a change the picture is made at its full size.
const SETTLED: f32 = 0.15;

impl App {
    /// Samples per pixel that the picture has at its full size.
    #[must_use]
    pub fn samples(&self) -> u32 {
        if self.is_still() {
            self.pace.samples()
        } else {
            0
        }
    }

    /// Whether the picture is made at its full size.
    pub(in crate::view) fn is_still(&self) -> bool {
        self.told.as_ref().is_some_and(|[told, full]| told == full)
    }

    /// What the renderer is told, at full size.
    #[must_use]
    pub fn settings(&self) -> Option<&Settings> {
        self.told.as_ref().map(|[_, full]| full)
    }

    /// The picture that the renderer has at full size.
    ///
    /// # Errors
    /// When the device fails.
    pub fn film(&mut self) -> Result<Option<scene::render::Film>> {
        match &mut self.stage {
            Some(stage) if self.told.is_some() => Ok(Some(stage.tracer.film()?)),
            _ => Ok(None),
        }
    }

    /// Coarse pictures are shown in squares where they are twice as coarse and more.
    pub(super) fn filter(&self) -> Filter {
        if self.is_still() {
            Filter::Nearest
        } else {
            Filter::Linear
        }
    }

    /// Traces what fits into this frame of a window of `size` pixels. Whether the film has changed.
    pub(super) fn trace(&mut self, size: [u32; 2], seconds: f32) -> Result<bool> {
        self.is_behind = true;
        self.go_along();
        let mut args = self.args.clone();
        args.picture.view.camera = Some(CameraChoice::Pose(self.eye.pose()));
        let percent = self.panels.percent.clamp(1, 100);
        let scaled = size.map(|n| (n * percent / 100).max(1));
        args.picture.view.size = scaled.into();
        if self.player.is_some() {
            match self.moment_of_demo(&args) {
                Ok(true) => {}
                Ok(false) => return Ok(false),
                Err(error) => {
                    self.notices.error(format!("{error:#}"));
                    return Ok(false);
                }
            }
        }
        let Some(stage) = &mut self.stage else {
            return Ok(false);
        };
        let full = match (&self.frame, settings_of(&args, &stage.scene)) {
            (Some(frame), Ok(still)) => Ok(Settings {
                camera: frame.camera.clone(),
                time: frame.time,
                // As the first frame of a film has it: so that `runelight demo` can make the same.
                seed: frame_seed(still.seed, 0),
                ..still
            }),
            (_, still) => still,
        };
        let full = match full {
            Ok(full) => full,
            Err(error) => {
                self.notices.error(format!("{error:#}"));
                return Ok(false);
            }
        };
        let changed = self.settings() != Some(&full);
        let Some(stage) = &mut self.stage else {
            return Ok(false);
        };
        self.still_for = if changed {
            0.0
        } else {
            self.still_for + seconds
        };
        // The device's own frames may take as long as a slice.
        self.pace.budget_ms = self
            .panels
            .budget_ms
            .max(2.0 * self.statistics.display_ms());
        let busy = stage.tracer.is_busy()?;
        if !busy && let Some([told, _]) = &self.told {
            self.pace
                .learn([told.width, told.height], stage.tracer.sample_ms());
        }
        if changed {
            self.coarseness = self.pace.coarseness(scaled);
        } else if self.still_for > SETTLED && self.pace.samples() > 0 && !busy {
            // Twice as fine, and again, so that slow devices show something better soon.
            self.coarseness = (self.coarseness / 2).max(1);
        }
        let mut now = full.clone();
        [now.width, now.height] = coarse(scaled, self.coarseness);
        if self.told.as_ref().map(|[told, _]| told) != Some(&now) {
            if busy && self.coarseness > 1 {
                // A slow device that still works on the last view: this one would only wait.
                return Ok(false);
            }
            stage.tracer.set(&now)?;
            if let Some(frame) = &self.frame {
                stage.tracer.show(frame)?;
            }
            self.pace.restart();
            self.statistics.restart();
            self.convergence.restart();
        } else if busy {
            self.told = Some([now, full]);
            self.is_behind = false;
            return Ok(false);
        }
        let size = [now.width, now.height];
        let is_whole = now == full;
        self.told = Some([now, full]);
        self.is_behind = false;
        // Coarse pictures have one sample; while the eye moves it must be there with the frame.
        let goal = if is_whole { self.look_at_error()? } else { 1 };
        self.meter()?;
        let Some(stage) = &mut self.stage else {
            return Ok(false);
        };
        let whole = self.still_for <= SETTLED && !is_whole || is_whole && self.is_saving;
        let Some(slice) = self.pace.next(size, goal, whole) else {
            return Ok(false);
        };
        match slice {
            Slice::Samples(n) => stage.tracer.accumulate(n)?,
            Slice::Rows(rows) => {
                let width = size[0] as usize;
                let mut schedule = vec![0; width * size[1] as usize];
                let range = rows.start as usize * width..rows.end as usize * width;
                schedule[range].fill(1);
                stage.tracer.accumulate_per_pixel(&schedule)?;
            }
        }
        if self.statistics.wants_rays() {
            let rays = stage.tracer.rays()?;
            self.statistics
                .rays(rays, self.pace.progress(size[1]), size);
        }
        self.statistics.traced(self.pace.progress(size[1]), size);
        // The picture is shown when every pixel has a sample.
        Ok(self.pace.samples() > 0)
    }

    /// Whether the picture under way is of the demo's time, or there is no demo.
    #[must_use]
    pub fn shows_moment(&self) -> bool {
        let Some(player) = &self.player else {
            return true;
        };
        let (Some(moment), Some(frame), Some(full)) = (&self.moment, &self.frame, self.settings())
        else {
            return false;
        };
        moment.time == player.time && full.time == frame.time && full.camera == frame.camera
    }

    /// Why the picture gets no more samples, once it does not.
    #[must_use]
    pub fn stopped(&self) -> Option<Stopped> {
        let (samples, seconds) = (self.samples(), self.statistics.seconds());
        if !self.is_still() || !self.pace.is_even() {
            return None;
        }
        (self.convergence).stopped(&self.args.picture, samples, seconds)
    }

    /// Estimates the picture's error where it is time to. Samples up to which may be traced now.
    fn look_at_error(&mut self) -> Result<u32> {
        let (samples, target) = (self.pace.samples(), self.args.picture.target_error);
        let rests = self.pace.is_even();
        if let Some(stage) = &mut self.stage
            && rests
            && self.convergence.is_due(samples, target)
        {
            let begun = Instant::now();
            let film = stage.tracer.film()?;
            if self.auto_exposure.is_due() {
                self.auto_exposure.look(&film);
            }
            let error = film.estimated_relmse();
            let point = Point {
                samples,
                error,
                seconds: self.statistics.seconds(),
            };
            self.convergence.look(point, begun);
        }
        Ok(match self.stopped() {
            Some(_) => samples,
            None => (self.args.picture.spp).min(self.convergence.rests_at(target)),
        })
    }

    /// Shows the picture to the exposure that follows it, where it is time to.
    fn meter(&mut self) -> Result<()> {
        if let Some(stage) = &mut self.stage
            && self.auto_exposure.is_due()
            && self.pace.samples() > 0
        {
            self.auto_exposure.look(&stage.tracer.film()?);
        }
        Ok(())
    }

    /// Takes the eye along with the player, where that is asked for.
    fn go_along(&mut self) {
        let flies = self.flight_path.flies;
        let goes = |p: &&Player| p.along && !p.follows && !flies;
        let state = (self.player.as_ref().filter(goes)).and_then(Player::state);
        let now = state.map(|state| state.view.eye);
        if let (Some(before), Some(now)) = (self.along, now) {
            self.eye.position += now - before;
        }
        self.along = now;
    }

    /// Makes the frame of the demo's time; `false` while its level is not there.
    pub(super) fn moment_of_demo(&mut self, args: &Render) -> Result<bool> {
        let (Some(player), Some(stage)) = (&self.player, &self.stage) else {
            return Ok(false);
        };
        let Some(showing) = &stage.showing else {
            return Ok(false);
        };
        let wanted = player.place();
        let shown = Some((showing.index, stage.options.skybox.clone()));
        if wanted == shown {
            self.asked = None;
        } else if self.loading.is_none() && self.asked != wanted {
            let timeline = Some(player.timeline.clone());
            let level = Wanted::Demo(player.demo.clone(), timeline, player.time);
            self.asked = wanted;
            self.load(level, true);
        }
        let (Some(player), Some(stage)) = (&self.player, &self.stage) else {
            return Ok(false);
        };
        // In another sky the level is shown until that is there.
        let index = player.timeline.level_at(player.time);
        let showing = (stage.showing.as_ref()).filter(|s| Some(s.index) == index);
        let Some(showing) = showing else {
            return Ok(false);
        };
        let view = &args.picture.view;
        let eye = if player.follows {
            playback::Eye::Player {
                fov_deg: view.fov.map_or(DEFAULT_FOV_DEG, |fov| fov as f32),
                lens: view.lens_of(None)?,
            }
        } else {
            playback::Eye::Free(view.camera_of(&stage.scene, 0.0)?)
        };
        let moment = Moment {
            time: player.time,
            eye,
            bare: args.picture.scene.entities.no_entities,
            moves: args.picture.layers.0.contains(&Layer::Motion),
        };
        if self.moment.as_ref() != Some(&moment) {
            let frame = frame_of(&moment, player, stage, showing)?;
            if player.follows {
                self.eye = Eye::of(&frame.camera);
            }
            (self.moment, self.frame) = (Some(moment), Some(frame));
        }
        Ok(true)
    }

    /// The demo at the time of the picture, as a film has it.
    pub(super) fn state_of_demo(&self) -> Result<Option<State>> {
        let showing = self.stage.as_ref().and_then(|s| s.showing.as_ref());
        match (&self.player, &self.moment, showing) {
            (Some(player), Some(moment), Some(showing)) => {
                let show = show_of(player, moment);
                Ok(Some(show.state(moment.time, showing.index)?))
            }
            _ => Ok(None),
        }
    }
}

fn show_of<'a>(player: &'a Player, moment: &Moment) -> Show<'a> {
    Show {
        timeline: &player.timeline,
        unseen: player.unseen(),
        bare: moment.bare,
    }
}

/// What `runelight demo` makes of a moment.
fn frame_of(moment: &Moment, player: &Player, stage: &Stage, showing: &Showing) -> Result<Frame> {
    let (show, levels) = (show_of(player, moment), player.timeline.levels());
    let frame = |time| {
        let state = show.state(time, showing.index)?;
        let level = &levels[state.level];
        let (scene, cast) = (&stage.scene, &showing.cast);
        anyhow::Ok(playback::frame(&state, level, scene, cast, &moment.eye))
    };
    let mut shown = frame(moment.time)?;
    let before = moment.time - 1.0 / demo_defaults().clip.fps.value();
    if moment.moves && before >= levels[showing.index].span.0 {
        shown.follow(&frame(before)?);
    }
    Ok(shown)
}
