//! A level of a demo as a scene, and its moments as frames.

use crate::cli::{Global, PictureArgs, ViewArgs};
use crate::level::Source;
use crate::output::Screen;
use crate::shot;
use anyhow::{Context as _, Result};
use bsp::Level;
use bsp::bsp::contents;
use scene::camera::DEFAULT_FOV_DEG;
use scene::import::{Cast, ImportOptions};
use scene::playback::{self, Eye, Parts};
use scene::timeline::{Options, State, Timeline, Unseen};
use scene::{Camera, CameraPath, Frame, Scene};
use std::sync::Arc;

/// What is seen of a demo.
#[derive(Clone, Copy, Debug)]
pub struct Show<'a> {
    /// The demo.
    pub timeline: &'a Timeline,
    /// What the server did not send.
    pub unseen: Unseen,
    /// Brush models alone.
    pub bare: bool,
}

impl Show<'_> {
    /// The state at `t` seconds; not after `level` has ended.
    ///
    /// # Errors
    /// When the demo shows nothing.
    pub fn state(&self, t: f64, level: usize) -> Result<State> {
        let options = Options {
            unseen: self.unseen,
            ..Options::default()
        };
        let end = self.timeline.levels().get(level).map_or(t, |l| l.span.1);
        let mut state = (self.timeline.state_at(t.min(end), &options))
            .context("the demo shows no moment of a level")?;
        if self.bare {
            let models = &self.timeline.levels()[state.level].models;
            let is_brush =
                |model: u16| models.get(usize::from(model)).is_some_and(|m| m.is_brush());
            state.entities.retain(|e| is_brush(e.model));
            state.statics = 0;
            state.beams.clear();
            state.lights.clear();
            state.particles.clear();
            state.view_model = None;
        }
        Ok(state)
    }
}

/// A level of a demo.
pub struct Stage {
    /// Its index in the timeline.
    pub index: usize,
    /// Name of its skybox, if the server asks for one.
    pub sky: Option<String>,
    /// What frames are shown of.
    pub scene: Arc<Scene>,
    /// See [`crate::level::Loaded::digest`].
    pub digest: String,
    cast: Cast,
    level: Level,
    view: ViewArgs,
    eye: Looking,
}

/// Who looks.
enum Looking {
    /// The same all the time.
    Still(Eye),
    /// A camera that flies by the demo's seconds.
    Flight(CameraPath),
}

impl Stage {
    /// Loads level `index` of the demo, with all models that it shows, in the sky of this name.
    ///
    /// # Errors
    /// When the level cannot be loaded, or has no camera as asked for.
    pub fn load(
        timeline: &Timeline,
        index: usize,
        sky: Option<&str>,
        picture: &PictureArgs,
        global: &Global,
    ) -> Result<Self> {
        let map = &timeline.levels()[index].map;
        let loaded = Source::of_demo(map, global)?.load()?;
        let parts = Parts::of(timeline, index);
        let options = ImportOptions {
            skybox: sky.map(str::to_owned),
            ..picture.import_options()?
        };
        let (scene, cast) = loaded.import_cast(&options, parts.list())?;
        shot::warn_of_oddities(&scene);
        let view = &picture.view;
        let eye = if let Some(path) = view.path()? {
            Looking::Flight(path)
        } else if view.camera.is_some() {
            Looking::Still(Eye::Free(view.camera_of(&scene, 0.0)?))
        } else {
            Looking::Still(Eye::Player {
                fov_deg: view.fov.map_or(DEFAULT_FOV_DEG, |fov| fov as f32),
                lens: view.lens_of(None)?,
            })
        };
        Ok(Self {
            index,
            sky: options.skybox,
            scene: Arc::new(scene),
            digest: loaded.digest(),
            cast,
            level: loaded.level,
            view: view.clone(),
            eye,
        })
    }

    /// A moment as a frame.
    ///
    /// # Errors
    /// When a camera path has a lens without a focus.
    pub fn frame(&self, state: &State, timeline: &Timeline) -> Result<Frame> {
        let level = &timeline.levels()[state.level];
        let flying;
        let eye = match &self.eye {
            Looking::Still(eye) => eye,
            Looking::Flight(path) => {
                flying = Eye::Free(self.view.adjusted(path.at(state.time))?);
                &flying
            }
        };
        let frame = playback::frame(state, level, &self.scene, &self.cast, eye);
        Ok(frame)
    }

    /// What the game does to the player's screen; nothing to that of a camera of its own.
    #[must_use]
    pub fn screen(&self, state: &State, camera: &Camera) -> Screen {
        if !matches!(self.eye, Looking::Still(Eye::Player { .. })) {
            return Screen::default();
        }
        screen(&self.level, state, camera)
    }
}

/// What the game does to the screen of a player whose eye this camera is.
pub(crate) fn screen(level: &Level, state: &State, camera: &Camera) -> Screen {
    let around = level
        .bsp
        .point_contents(0, camera.position.to_array())
        .unwrap_or(contents::EMPTY);
    let is_liquid = [contents::WATER, contents::SLIME, contents::LAVA].contains(&around);
    Screen {
        tint: state.tint.over(around),
        shown: if is_liquid {
            Screen::under_water(state.clock)
        } else {
            Screen::default().shown
        },
    }
}
