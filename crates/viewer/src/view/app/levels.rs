//! Which level or demo is there: opening, reading anew, importing with other options.

use super::App;
use crate::cli::{CameraChoice, Render};
use crate::view::export::of_demo;
use crate::view::fly::Eye;
use crate::view::hot::Hot;
use crate::view::player::Player;
use crate::view::stage::{Loading, Order, Stage, Wanted};
use crate::view::watch::Watch;
use scene::import::ImportOptions;
use std::path::PathBuf;
use std::sync::Arc;

impl App {
    /// Begins to load a level. The old one stays until it is there.
    pub fn open(&mut self, level: Option<String>) {
        let is_demo = |name: &String| name.to_ascii_lowercase().ends_with(".dem");
        match level {
            Some(demo) if is_demo(&demo) => self.load(Wanted::Demo(demo, None, 0.0), false),
            level => self.load(Wanted::Level(level), false),
        }
    }

    /// Begins to load a demo, to be shown at a time, from the player's eye or a free one.
    pub(in crate::view) fn open_at(&mut self, demo: String, (time, follows): (f64, bool)) {
        self.load(Wanted::Demo(demo, None, time), false);
        self.seeks = Some((time, follows));
    }

    pub(super) fn load(&mut self, wanted: Wanted, keeps_eye: bool) {
        let mut args = self.args.clone();
        args.picture.view.size = self.told.as_ref().map_or((64, 64), |[_, full]| {
            (full.width.min(64), full.height.min(64))
        });
        let order = Order {
            global: self.global.clone(),
            args,
            eye: keeps_eye.then_some(self.eye),
        };
        // What is given up ends by itself: to wait for it here would hold up the frame.
        self.given_up.extend(self.loading.take());
        self.loading = Some(Loading::start(wanted, order, self.gpu.clone()));
        self.considered = Some(self.args.clone());
    }

    /// Takes what was loaded meanwhile.
    pub(super) fn receive_level(&mut self) {
        self.given_up.retain_mut(|l| l.poll().is_none());
        if let Some(loading) = &mut self.loading
            && let Some(result) = loading.poll()
        {
            let (is_new, name) = (loading.is_new(), loading.name());
            self.loading = None;
            match result {
                Ok(stage) => self.take(stage, is_new),
                // What was shown stays.
                Err(error) => {
                    self.seeks = None;
                    self.notices.error(format!("{name}: {error:#}"));
                }
            }
        }
    }

    pub(super) fn take(&mut self, stage: Stage, is_new: bool) {
        let name = stage.level.clone();
        let seeks = self.seeks.take();
        self.watch = match &stage.showing {
            None => name.as_ref().and_then(|name| Watch::new(name.as_ref())),
            Some(_) => None,
        };
        (self.moment, self.frame, self.asked) = (None, None, None);
        self.player = stage
            .showing
            .as_ref()
            .map(|showing| match self.player.take() {
                Some(player) if Arc::ptr_eq(&player.timeline, &showing.timeline) => player,
                _ => {
                    let (time, follows) = seeks.unwrap_or((0.0, true));
                    let timeline = showing.timeline.clone();
                    Player {
                        follows,
                        ..Player::new(name.unwrap_or_default(), timeline, time)
                    }
                }
            });
        let same_level = (self.stage.as_ref()).is_some_and(|old| old.level == stage.level);
        if is_new && !same_level {
            let view = &mut self.args.picture.view;
            let camera = stage.turned_to.clone();
            self.eye = Eye::of(&camera);
            // From here on the eye says where from, and the options what kind of camera it is.
            (view.camera, view.camera_path) = (None, None);
            if let Some(lens) = camera.lens {
                view.aperture = Some(lens.radius.into());
                view.focus = Some(lens.focus.into());
            }
            self.considered = Some(self.args.clone());
            (self.walker, self.camera) = (None, 0);
            self.flight.stop();
        }
        if let Some(name) = stage.level.as_ref().filter(|_| is_new) {
            self.preferences.visit(name);
        }
        if is_new {
            for warning in stage.scene.report.warnings.iter().take(3) {
                self.notices.say(warning.clone());
            }
        }
        self.args.level.clone_from(&stage.level);
        self.stage = Some(stage);
        self.told = None;
        self.pace.restart();
        self.pace.forget();
        self.statistics.restart();
        self.convergence.restart();
        self.looking.restart();
        (self.inspection, self.inspected) = (None, None);
    }

    /// Remembers where the eye is, as the panel of places does.
    pub(in crate::view) fn remember_place(&mut self) {
        let Some(level) = self.stage.as_ref().map(|s| s.loaded.level.name.clone()) else {
            return;
        };
        let pose = self.eye.pose();
        let places = self.preferences.places.entry(level).or_default();
        if !places.contains(&pose) {
            places.push(pose);
        }
    }

    /// What another viewer needs to show the same from the same place: options, and of a demo its time and
    /// whether the eye is the player's.
    pub(in crate::view) fn to_go_on(&self) -> (Render, Option<(f64, bool)>) {
        let mut args = self.args.clone();
        if self.stage.is_some() {
            let view = &mut args.picture.view;
            (view.camera, view.camera_path) = (Some(CameraChoice::Pose(self.eye.pose())), None);
        }
        (args, self.player.as_ref().map(|p| (p.time, p.follows)))
    }

    /// Goes on at a moment of the demo that is being loaded.
    pub(in crate::view) fn go_on_at(&mut self, moment: Option<(f64, bool)>) {
        self.seeks = moment;
    }

    /// Traces by the shaders of another folder as soon as one of them is written there, in development builds.
    pub fn watch_shaders(&mut self, folder: PathBuf) {
        self.hot = Some(Hot::of(folder));
    }

    /// Takes shaders that someone has written meanwhile.
    pub(super) fn receive_shaders(&mut self, seconds: f32) {
        let Some(told) = self.hot.as_mut().and_then(|hot| hot.pass(seconds)) else {
            return;
        };
        let taken = told.and_then(|()| match &mut self.stage {
            Some(stage) => stage.tracer.renew().map_err(|e| e.to_string()),
            None => Ok(()),
        });
        match taken {
            Ok(()) => {
                // Everything is traced anew.
                self.told = None;
                self.notices.say("the shaders are compiled anew".into());
            }
            Err(why) => self.notices.error(format!("the old shaders stay: {why}")),
        }
    }

    /// Opens a file of whatever kind.
    pub fn open_file(&mut self, path: &std::path::Path) {
        let extension = path.extension().unwrap_or_default().to_string_lossy();
        match extension.to_ascii_lowercase().as_str() {
            "bsp" | "dem" => self.open(Some(path.display().to_string())),
            "pak" => {
                self.global.pak.push(path.to_owned());
                self.panels.open = true;
                self.panels.browser = None;
            }
            "exr" | "png" => self.restore(path),
            other => {
                let name = path.display();
                let why = format!(
                    "{name}: a level ends in .bsp, a demo in .dem, an archive in .pak, a picture in .exr or \
                     .png, not .{other}"
                );
                self.notices.error(why);
            }
        }
    }

    /// Reads the level's files anew; the eye stays.
    pub fn reload(&mut self) {
        self.asked = None;
        if let Some(player) = &self.player {
            let (demo, time, follows) = (player.demo.clone(), player.time, player.follows);
            self.load(Wanted::Demo(demo, None, time), true);
            self.seeks = Some((time, follows));
            return;
        }
        let level = self.stage.as_ref().map(|s| s.level.clone());
        let level = level.unwrap_or_else(|| self.args.level.clone());
        self.load(Wanted::Level(level), true);
    }

    /// Whether sprites look elsewhere than at the eye: they are turned when it rests.
    pub(super) fn needs_turning(&self) -> bool {
        match (&self.stage, &self.told) {
            (Some(stage), Some([_, full])) => {
                // Those of demos are turned with everything else that moves.
                !stage.scene.sprites.is_empty()
                    && stage.showing.is_none()
                    && stage.turned_to != full.camera
            }
            _ => false,
        }
    }

    /// Imports the level anew where the options ask for another scene.
    pub(super) fn consider(&mut self) {
        let Some(stage) = &self.stage else { return };
        if self.loading.is_some() {
            return;
        }
        if self.considered.as_ref() == Some(&self.args) {
            if self.is_still() && self.needs_turning() {
                let (level, loaded) = (stage.level.clone(), stage.loaded.clone());
                self.load(Wanted::Turned(level, loaded, stage.scene.clone()), true);
            }
            return;
        }
        let options = match &self.player {
            Some(_) => of_demo(&self.args.picture).import_options(),
            None => self.args.picture.import_options(),
        };
        let sky = || self.player.as_ref()?.place()?.1;
        match options.map(|o| ImportOptions { skybox: sky(), ..o }) {
            Ok(options) if options != stage.options => {
                let again = match &self.player {
                    Some(p) => Wanted::Demo(p.demo.clone(), Some(p.timeline.clone()), p.time),
                    None => Wanted::Again(stage.level.clone(), stage.loaded.clone()),
                };
                self.load(again, true);
            }
            Ok(_) => self.considered = Some(self.args.clone()),
            Err(error) => {
                self.notices.error(format!("{error:#}"));
                self.considered = Some(self.args.clone());
            }
        }
    }
}
