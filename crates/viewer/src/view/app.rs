//! What happens in a frame, whatever it is shown on: hands move the eye, the device traces as much as
//! fits, panels lie over the picture.

use super::draw::{self, Textures};
use super::fly::{Controls, Eye, Flight};
use super::keys::{Action, Bindings};
use super::notices::Notices;
use super::pace::{Pace, Slice, coarse};
use super::panels::{self, Panels};
use super::player::Player;
use super::preferences::Preferences;
use super::save::{self, Picture, Saved};
use super::stage::{Loading, Order, Stage, Wanted, settings_of};
use super::statistics::Statistics;
use super::walk::{Walker, Walls};
use super::watch::Watch;
use crate::cli::{CameraChoice, Global, Render};
use crate::device::Device;
use crate::tonemap::Tonemap;
use anyhow::Result;
use rt::{Filter, Gpu, Screen, Shown, ToneCurve};
use scene::camera::DEFAULT_FOV_DEG;
use scene::playback;
use scene::render::{Renderer as _, Settings};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};

/// After so many seconds without a change the picture is made at its full size.
const SETTLED: f32 = 0.15;

/// What a frame is made of.
#[derive(Default)]
pub struct Input {
    /// Keys, pointer, size, time: all that egui knows.
    pub raw: egui::RawInput,
    /// Seconds since the last frame.
    pub seconds: f32,
}

/// What the app asks of whoever has the window.
#[derive(Clone, Debug, PartialEq)]
pub enum Wish {
    /// To end.
    Quit,
    /// To fill the screen, or not.
    FullScreen(bool),
    /// To keep the pointer in the window, hidden, and say how the mouse moves; or no longer.
    HoldMouse(bool),
}

/// How a frame went.
pub struct Output {
    /// For the window system: clipboard, cursor, links.
    pub platform: egui::PlatformOutput,
    /// What is asked of the window.
    pub wishes: Vec<Wish>,
    /// Whether it was shown.
    pub shown: Shown,
    /// In so many seconds the next frame is wanted.
    pub next: f32,
}

/// The viewer without its window.
pub struct App {
    /// The device.
    pub gpu: Gpu,
    /// What it is called.
    pub device: Device,
    /// Where files are looked up.
    pub global: Global,
    /// What the picture depends on besides the eye. Its samples are where to stop.
    pub args: Render,
    /// Who looks.
    pub eye: Eye,
    /// How it flies.
    pub flight: Flight,
    /// Samples and slices.
    pub pace: Pace,
    /// Which panels are open.
    pub panels: Panels,
    /// What the picture costs.
    pub statistics: Statistics,
    /// What was said.
    pub notices: Notices,
    /// Which key does what.
    pub bindings: Bindings,
    /// Where pictures go.
    pub folder: PathBuf,
    /// What is remembered.
    pub preferences: Preferences,
    pub(super) stage: Option<Stage>,
    pub(super) loading: Option<Loading>,
    /// The demo that is shown.
    pub player: Option<Player>,
    /// When and for whom `frame` is.
    moment: Option<(f64, playback::Eye)>,
    /// What is shown of the demo.
    frame: Option<scene::Frame>,
    watch: Option<Watch>,
    /// What `stage` was asked for, so that files of materials are not read in every frame.
    considered: Option<Render>,
    walker: Option<Walker>,
    camera: usize,
    holds_mouse: bool,
    full_screen: bool,
    /// What the tracer is told, and the same at full size.
    told: Option<[Settings; 2]>,
    still_for: f32,
    coarseness: u32,
    is_saving: bool,
    writing: Option<Receiver<Result<Saved>>>,
    /// The last picture that was saved.
    pub saved: Option<Saved>,
    /// Exposure and curve that the picture was shown with.
    shown_as: Option<(f32, Tonemap)>,
    ctx: egui::Context,
    textures: Textures,
}

impl App {
    /// A viewer that begins to load the level that `args` names.
    #[must_use]
    pub fn new((device, gpu): (Device, Gpu), global: Global, mut args: Render) -> Self {
        let eye = Eye {
            position: glam::Vec3::ZERO,
            pitch: 0.0,
            yaw: 0.0,
            roll: 0.0,
        };
        args.picture.adaptive = false;
        let mut app = Self {
            ctx: egui::Context::default(),
            gpu,
            device,
            global,
            eye,
            flight: Flight::default(),
            pace: Pace::default(),
            panels: Panels::default(),
            statistics: Statistics::default(),
            notices: Notices::default(),
            bindings: Bindings::default(),
            folder: PathBuf::new(),
            preferences: Preferences::default(),
            stage: None,
            loading: None,
            player: None,
            moment: None,
            frame: None,
            watch: None,
            considered: None,
            walker: None,
            camera: 0,
            holds_mouse: false,
            full_screen: false,
            told: None,
            still_for: 0.0,
            coarseness: super::pace::COARSEST,
            is_saving: false,
            writing: None,
            saved: None,
            shown_as: None,
            textures: Textures::default(),
            args,
        };
        app.open(app.args.level.clone());
        app
    }

    /// egui's state: fonts, style, what has the focus.
    #[must_use]
    pub fn egui(&self) -> &egui::Context {
        &self.ctx
    }

    /// Begins to load a level. The old one stays until it is there.
    pub fn open(&mut self, level: Option<String>) {
        let is_demo = |name: &String| name.to_ascii_lowercase().ends_with(".dem");
        match level {
            Some(demo) if is_demo(&demo) => self.load(Wanted::Demo(demo, None, 0.0), false),
            level => self.load(Wanted::Level(level), false),
        }
    }

    fn load(&mut self, wanted: Wanted, keeps_eye: bool) {
        let mut args = self.args.clone();
        args.picture.view.size = self.told.as_ref().map_or((64, 64), |[_, full]| {
            (full.width.min(64), full.height.min(64))
        });
        let order = Order {
            gpu: self.gpu.clone(),
            global: self.global.clone(),
            args,
            eye: keeps_eye.then_some(self.eye),
        };
        self.loading = Some(Loading::start(wanted, order));
        self.considered = Some(self.args.clone());
    }

    /// Whether nothing is being loaded, traced or written.
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.loading.is_none()
            && self.writing.is_none()
            && !self.is_saving
            && !self.player.as_ref().is_some_and(|p| p.plays)
            && self.stage.is_some()
            && self.is_still()
            && !self.needs_turning()
            && self.considered.as_ref() == Some(&self.args)
            && self.pace.samples() >= self.args.picture.spp
    }

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
    pub(super) fn is_still(&self) -> bool {
        self.told.as_ref().is_some_and(|[told, full]| told == full)
    }

    /// What the renderer is told, at full size.
    #[must_use]
    pub fn settings(&self) -> Option<&Settings> {
        self.told.as_ref().map(|[_, full]| full)
    }

    /// The level's name, of what is shown.
    #[must_use]
    pub fn title(&self) -> String {
        self.stage.as_ref().map_or("runelight".into(), |stage| {
            let scene = &stage.scene;
            if scene.title.is_empty() {
                format!("{} - runelight", scene.name)
            } else {
                format!("{} ({}) - runelight", scene.title, scene.name)
            }
        })
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

    /// One frame.
    ///
    /// # Errors
    /// When the device fails.
    pub fn frame(&mut self, screen: &mut Screen, input: Input) -> Result<Output> {
        let mut wishes = Vec::new();
        self.receive();
        let ctx = self.ctx.clone();
        let full = ctx.run(input.raw, |ctx| {
            panels::show(self, ctx);
            self.act(ctx, input.seconds, &mut wishes);
        });
        let scale = full.pixels_per_point;
        let size = ctx.input(|i| i.viewport_rect().size());
        let size = [size.x, size.y].map(|n| (n * scale).round() as u32);
        let traced = if size.contains(&0) {
            false
        } else {
            self.consider();
            self.trace(size, input.seconds)?
        };
        self.write(&ctx)?;

        self.textures.set(screen, &full.textures_delta)?;
        let primitives = ctx.tessellate(full.shapes, scale);
        let meshes = draw::meshes(&primitives);
        let (exposure, curve) = (self.args.picture.exposure as f32, self.args.picture.tonemap);
        let has_film = self.pace.samples() > 0;
        let is_new = traced || self.shown_as != Some((exposure, curve));
        let film = (self.stage.as_ref()).filter(|_| has_film && is_new);
        let film = film.map(|stage| (&stage.tracer, tone_curve(curve), exposure));
        let shows_film = film.is_some();
        let shown = screen.draw(film, self.filter(), &meshes, scale)?;
        if shown == Shown::Yes {
            if shows_film {
                self.shown_as = Some((exposure, curve));
            }
        } else {
            self.shown_as = None;
        }
        self.textures.free(screen, &full.textures_delta);
        self.statistics.frame(input.seconds, screen.timings());
        self.notices.pass(input.seconds);
        let root = egui::ViewportId::ROOT;
        let asked =
            (full.viewport_output.get(&root)).map_or(1.0, |v| v.repaint_delay.as_secs_f32());
        let busy = !self.is_done() || !wishes.is_empty();
        Ok(Output {
            platform: full.platform_output,
            wishes,
            shown,
            next: if busy { 0.0 } else { asked.min(1.0) },
        })
    }

    /// Coarse pictures are shown in squares where they are twice as coarse and more.
    fn filter(&self) -> Filter {
        if self.is_still() {
            Filter::Nearest
        } else {
            Filter::Linear
        }
    }

    /// Takes what was loaded and written meanwhile.
    fn receive(&mut self) {
        if let Some(loading) = &mut self.loading
            && let Some(result) = loading.poll()
        {
            let (is_new, name) = (loading.is_new(), loading.name());
            self.loading = None;
            match result {
                Ok(stage) => self.take(stage, is_new),
                // What was shown stays.
                Err(error) => self.notices.error(format!("{name}: {error:#}")),
            }
        }
        if let Some(Ok(result)) = self.writing.as_ref().map(Receiver::try_recv) {
            self.writing = None;
            match result {
                Ok(saved) => {
                    if !saved.command.is_empty() {
                        self.ctx.copy_text(saved.command.clone());
                    }
                    let names: Vec<_> = saved
                        .files
                        .iter()
                        .map(|f| f.display().to_string())
                        .collect();
                    let names = names.join(" and ");
                    self.notices.say(if saved.command.is_empty() {
                        format!("saved {names}")
                    } else {
                        format!(
                            "saved {names}; the clipboard has the command that makes them again:\n{}",
                            saved.command
                        )
                    });
                    self.saved = Some(saved);
                }
                Err(error) => self
                    .notices
                    .error(format!("the picture is not saved: {error:#}")),
            }
        }
    }

    fn take(&mut self, stage: Stage, is_new: bool) {
        let name = stage.level.clone();
        self.watch = match &stage.showing {
            None => name.as_ref().and_then(|name| Watch::new(name.as_ref())),
            Some(_) => None,
        };
        (self.moment, self.frame) = (None, None);
        self.player = stage
            .showing
            .as_ref()
            .map(|showing| match self.player.take() {
                Some(player) if Arc::ptr_eq(&player.timeline, &showing.timeline) => player,
                _ => Player::new(name.unwrap_or_default(), showing.timeline.clone(), 0.0),
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
    }

    /// Does what keys and pointer ask for.
    fn act(&mut self, ctx: &egui::Context, seconds: f32, wishes: &mut Vec<Wish>) {
        let typing = ctx.wants_keyboard_input();
        let bindings = self.bindings.clone();
        let pressed = |action| !typing && ctx.input(|i| i.key_pressed(bindings.key(action)));
        let held = |action| !typing && ctx.input(|i| i.key_down(bindings.key(action)));
        let axis = |plus, minus| f32::from(i8::from(held(plus)) - i8::from(held(minus)));
        let controls = Controls {
            forward: axis(Action::Forward, Action::Back),
            right: axis(Action::Right, Action::Left),
            up: axis(Action::Up, Action::Down),
            fast: ctx.input(|i| i.modifiers.shift),
        };
        let over_panel = ctx.wants_pointer_input() || ctx.is_pointer_over_area();
        let (look, wheel) = ctx.input(|i| {
            let drag = if over_panel || !i.pointer.any_down() {
                egui::Vec2::ZERO
            } else {
                i.pointer.delta()
            };
            let look = if self.holds_mouse {
                i.pointer.motion().unwrap_or_default()
            } else {
                drag
            };
            (
                look,
                if over_panel {
                    0.0
                } else {
                    i.smooth_scroll_delta.y / 50.0
                },
            )
        });
        if wheel != 0.0 {
            self.flight.turn_wheel(wheel);
        }
        let moves = controls.forward != 0.0 || controls.right != 0.0 || controls.up != 0.0;
        let still = self.loading.as_ref().is_some_and(Loading::is_new);
        match &mut self.player {
            Some(player) => {
                // Who takes the view in hand leaves the player's eye.
                player.follows &= !moves && look == egui::Vec2::ZERO;
                if !still {
                    player.pass(seconds);
                }
                let step = f64::from(
                    i8::from(pressed(Action::Later)) - i8::from(pressed(Action::Earlier)),
                );
                if step != 0.0 {
                    player.seek(player.time + 5.0 * step);
                }
                player.plays ^= pressed(Action::Play);
            }
            None => {
                let written = self.watch.as_mut().is_some_and(|w| w.pass(seconds));
                if written && self.loading.is_none() {
                    self.reload();
                }
            }
        }
        self.eye = self.eye.turned([look.x, look.y]);
        self.go(&controls, seconds);

        if pressed(Action::Walk) {
            self.set_walking(self.walker.is_none());
        }
        if pressed(Action::NextCamera) {
            self.go_to_camera(self.camera + 1);
        }
        if pressed(Action::Save) {
            self.save();
        }
        if pressed(Action::Reload) {
            self.reload();
        }
        if pressed(Action::Panels) {
            self.panels.hidden = !self.panels.hidden;
        }
        if pressed(Action::Help) {
            self.panels.keys = !self.panels.keys;
        }
        let escape = ctx.input(|i| i.key_pressed(egui::Key::Escape));
        if pressed(Action::MouseLook) || escape && self.holds_mouse {
            self.holds_mouse = !self.holds_mouse;
            wishes.push(Wish::HoldMouse(self.holds_mouse));
        }
        if pressed(Action::FullScreen) {
            self.full_screen = !self.full_screen;
            wishes.push(Wish::FullScreen(self.full_screen));
        }
        if ctx.input(|i| i.modifiers.command && i.key_pressed(egui::Key::Q)) {
            wishes.push(Wish::Quit);
        }
        let dropped = ctx.input(|i| i.raw.dropped_files.first().and_then(|f| f.path.clone()));
        if let Some(path) = dropped {
            self.open_file(&path);
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
            other => {
                let name = path.display();
                let why = format!(
                    "{name}: a level ends in .bsp, a demo in .dem, an archive in .pak, not .{other}"
                );
                self.notices.error(why);
            }
        }
    }

    /// Reads the level's files anew; the eye stays.
    pub fn reload(&mut self) {
        if let Some(player) = &self.player {
            self.load(Wanted::Demo(player.demo.clone(), None, player.time), true);
            return;
        }
        let level = self.stage.as_ref().map(|s| s.level.clone());
        let level = level.unwrap_or_else(|| self.args.level.clone());
        self.load(Wanted::Level(level), true);
    }

    /// Takes the picture as it is when its samples are whole, and writes it.
    pub fn save(&mut self) {
        self.is_saving = true;
    }

    /// Walks from where the eye is, or flies.
    pub fn set_walking(&mut self, walks: bool) {
        self.flight.stop();
        let there = (self.stage.as_ref())
            .is_some_and(|s| Walls::of(&s.loaded.level.bsp, &s.loaded.level.entities).is_some());
        if walks && !there {
            self.notices
                .error("nobody can walk here: the level has no hull for players".into());
        }
        self.walker = (walks && there).then(|| Walker::at(&self.eye));
    }

    /// Whether the eye is a walking player's.
    #[must_use]
    pub fn is_walking(&self) -> bool {
        self.walker.is_some()
    }

    /// Jumps to one of the level's cameras, counted round.
    pub fn go_to_camera(&mut self, index: usize) {
        if let Some(stage) = &self.stage
            && !stage.scene.cameras.is_empty()
        {
            self.camera = index % stage.scene.cameras.len();
            self.go_to(Eye::of(&stage.scene.cameras[self.camera]));
        }
    }

    /// Makes sharp what is in the middle of the view, by the level's own planes.
    pub fn focus_on_middle(&mut self) {
        /// Farther than any level is large, in units.
        const FAR: f32 = 65536.0;
        let Some(stage) = &self.stage else { return };
        let [forward, ..] = self.eye.axes();
        let [from, to] = [0.0, FAR].map(|d| (self.eye.position + forward * d).to_array());
        let hit = stage.loaded.level.bsp.trace(0, 0, from, to);
        match hit.filter(|t| t.fraction > 0.0 && t.fraction < 1.0) {
            Some(trace) => {
                self.args.picture.view.focus = Some((trace.fraction * f64::from(FAR)).max(1.0));
            }
            None => (self.notices).error("there is nothing in the middle to focus on".into()),
        }
    }

    /// Jumps.
    pub fn go_to(&mut self, eye: Eye) {
        self.eye = eye;
        self.flight.stop();
        if self.walker.is_some() {
            self.walker = Some(Walker::at(&eye));
        }
    }

    fn go(&mut self, controls: &Controls, seconds: f32) {
        if let (Some(walker), Some(stage)) = (&mut self.walker, &self.stage) {
            let level = &stage.loaded.level;
            if let Some(walls) = Walls::of(&level.bsp, &level.entities)
                && walker.walk(&walls, &mut self.eye, controls, seconds)
            {
                return;
            }
            // Stuck: fly out, and walk on from there.
            self.flight.fly(&mut self.eye, controls, seconds);
            *walker = Walker::at(&self.eye);
            return;
        }
        self.flight.fly(&mut self.eye, controls, seconds);
    }

    /// Whether sprites look elsewhere than at the eye: they are turned when it rests.
    fn needs_turning(&self) -> bool {
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
    fn consider(&mut self) {
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
        match self.args.picture.import_options() {
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

    /// Traces what fits into this frame of a window of `size` pixels. Whether the film has changed.
    fn trace(&mut self, size: [u32; 2], seconds: f32) -> Result<bool> {
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
        } else if busy {
            self.told = Some([now, full]);
            return Ok(false);
        }
        let size = [now.width, now.height];
        let is_whole = now == full;
        self.told = Some([now, full]);
        // Coarse pictures have one sample; while the eye moves it must be there with the frame.
        let goal = if is_whole { self.args.picture.spp } else { 1 };
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

    /// Makes the frame of the demo's time; `false` while its level is not there.
    fn moment_of_demo(&mut self, args: &Render) -> Result<bool> {
        let (Some(player), Some(stage)) = (&self.player, &self.stage) else {
            return Ok(false);
        };
        let (Some(showing), Some(state)) = (&stage.showing, player.state()) else {
            return Ok(false);
        };
        if state.level != showing.index {
            if self.loading.is_none() {
                let timeline = Some(player.timeline.clone());
                self.load(
                    Wanted::Demo(player.demo.clone(), timeline, player.time),
                    true,
                );
            }
            return Ok(false);
        }
        let view = &args.picture.view;
        let eye = if player.follows {
            playback::Eye::Player {
                fov_deg: view.fov.map_or(DEFAULT_FOV_DEG, |fov| fov as f32),
                lens: view.lens_of(None)?,
            }
        } else {
            playback::Eye::Free(view.camera_of(&stage.scene, 0.0)?)
        };
        let moment = (player.time, eye);
        if self.moment.as_ref() != Some(&moment) {
            let level = &showing.timeline.levels()[state.level];
            let frame = playback::frame(&state, level, &stage.scene, &showing.cast, &moment.1);
            if player.follows {
                self.eye = Eye::of(&frame.camera);
            }
            (self.moment, self.frame) = (Some(moment), Some(frame));
        }
        Ok(true)
    }

    /// Writes the picture, if that was asked for and it is at a whole sample.
    fn write(&mut self, ctx: &egui::Context) -> Result<()> {
        let ready = self.is_still() && self.pace.is_even() && self.pace.samples() > 0;
        let ready = ready && !self.needs_turning();
        if !self.is_saving || !ready || self.writing.is_some() || self.loading.is_some() {
            return Ok(());
        }
        let (Some(stage), Some([_, settings])) = (&mut self.stage, &self.told) else {
            return Ok(());
        };
        self.is_saving = false;
        let picture = Picture {
            args: self.args.clone(),
            global: self.global.clone(),
            settings: settings.clone(),
            scene: stage.scene.clone(),
            film: stage.tracer.film()?,
            device: self.device.clone(),
            folder: self.folder.clone(),
            is_demo: stage.showing.is_some(),
        };
        let (sender, receiver) = channel();
        let ctx = ctx.clone();
        std::thread::spawn(move || {
            // Nobody waits any more if the receiver is gone.
            let _ = sender.send(save::save(picture));
            ctx.request_repaint();
        });
        self.writing = Some(receiver);
        Ok(())
    }
}

fn tone_curve(curve: Tonemap) -> ToneCurve {
    match curve {
        Tonemap::Agx => ToneCurve::Agx,
        Tonemap::Aces => ToneCurve::Aces,
        Tonemap::Reinhard => ToneCurve::Reinhard,
        Tonemap::Clip => ToneCurve::Clip,
    }
}
