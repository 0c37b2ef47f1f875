//! What happens in a frame, whatever it is shown on: hands move the eye, the device traces as much as
//! fits, panels lie over the picture.

mod hands;
mod levels;
mod looking;
mod saving;
mod tracing;

use super::convergence::Convergence;
use super::dialog::Dialog;
use super::display::{AutoExposure, Display};
use super::draw::{self, Textures};
use super::export::Export;
use super::fly::{Eye, Flight, Journey};
use super::gamepad::Gamepad;
use super::hot::Hot;
use super::inspect::{Inspection, Report};
use super::keys::Bindings;
use super::looking::Looking;
use super::looking::survey::Probes;
use super::notices::Notices;
use super::pace::Pace;
use super::panels::{self, Panels};
use super::path::FlightPath;
use super::player::Player;
use super::preferences::Preferences;
use super::save::{Saved, Writing};
use super::stage::{Loading, Stage};
use super::statistics::Statistics;
use super::titles::Titles;
use super::walk::Walker;
use super::watch::Watch;
use crate::cli::{Global, Render};
use crate::denoise::Denoise;
use crate::device::Device;
use crate::tonemap::Tonemap;
use anyhow::Result;
use egui::{Theme, Visuals};
use rt::{Gpu, Look, Screen, Shown, ToneCurve};
use scene::playback;
use scene::render::Settings;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

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

/// What a frame of a demo depends on besides the demo and its level.
#[derive(Clone, Debug, PartialEq)]
struct Moment {
    /// Seconds of the demo.
    time: f64,
    eye: playback::Eye,
    /// Whether only doors, lifts and the like are shown.
    bare: bool,
    /// Whether it knows where all was a frame before.
    moves: bool,
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
    /// Sticks and triggers.
    pub gamepad: Gamepad,
    /// Where pictures go.
    pub folder: PathBuf,
    /// What is remembered.
    pub preferences: Preferences,
    /// What the levels of the search path call themselves.
    pub titles: Titles,
    /// The next click says what is to be sharp.
    pub focus_by_click: bool,
    /// The rays that are under way say what is to be sharp.
    focuses: bool,
    /// Where the player was when the eye went along.
    along: Option<glam::Vec3>,
    pub(super) stage: Option<Stage>,
    pub(super) loading: Option<Loading>,
    /// Levels that nobody waits for any more.
    given_up: Vec<Loading>,
    /// The demo that is shown.
    pub player: Option<Player>,
    /// Where the demo that is being loaded goes on, and whether from the player's eye.
    seeks: Option<(f64, bool)>,
    /// Level and sky of the demo that were loaded last, or could not be.
    asked: Option<(usize, Option<String>)>,
    /// What `frame` is of.
    moment: Option<Moment>,
    /// What is shown of the demo.
    frame: Option<scene::Frame>,
    watch: Option<Watch>,
    hot: Option<Hot>,
    /// What `stage` was asked for, so that files of materials are not read in every frame.
    considered: Option<Render>,
    walker: Option<Walker>,
    /// Where the eye is being taken.
    journey: Option<Journey>,
    camera: usize,
    holds_mouse: bool,
    full_screen: bool,
    /// What the tracer is told, and the same at full size.
    told: Option<[Settings; 2]>,
    /// The device was too busy to be told what this frame is of.
    is_behind: bool,
    still_for: f32,
    coarseness: u32,
    is_saving: bool,
    writing: Option<Writing>,
    /// The last picture that was saved.
    pub saved: Option<Saved>,
    /// The system's dialog for files, while it is open.
    pub dialog: Option<Dialog>,
    /// A film of the demo.
    pub export: Export,
    /// A flight that is recorded.
    pub flight_path: FlightPath,
    /// How often pictures are shown.
    pub display: Display,
    /// Exposure that follows the picture.
    pub auto_exposure: AutoExposure,
    /// How good the picture is.
    pub convergence: Convergence,
    /// How the picture was shown.
    shown_as: Option<Look>,
    ctx: egui::Context,
    textures: Textures,
    /// What is looked at.
    pub looking: Looking,
    /// Scenes that rays on the processor are sent at.
    probes: Arc<Probes>,
    inspection: Option<Inspection>,
    /// What was found at the pixel that was clicked last, and its textures.
    pub inspected: Option<Report>,
    pub(super) inspected_pictures: [Option<egui::TextureHandle>; 2],
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
        let ctx = egui::Context::default();
        // What is said by the way is too pale as egui has it.
        for (theme, usual, weak) in [
            (Theme::Light, Visuals::light(), 105),
            (Theme::Dark, Visuals::dark(), 132),
        ] {
            let weak_text_color = Some(egui::Color32::from_gray(weak));
            let visuals = Visuals {
                weak_text_color,
                ..usual
            };
            ctx.set_visuals_of(theme, visuals);
        }
        let mut app = Self {
            ctx,
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
            gamepad: Gamepad::default(),
            folder: PathBuf::new(),
            preferences: Preferences::default(),
            titles: Titles::default(),
            focus_by_click: false,
            focuses: false,
            along: None,
            stage: None,
            loading: None,
            given_up: Vec::new(),
            player: None,
            asked: None,
            moment: None,
            frame: None,
            watch: None,
            hot: Hot::new(),
            considered: None,
            walker: None,
            journey: None,
            camera: 0,
            holds_mouse: false,
            full_screen: false,
            told: None,
            is_behind: false,
            still_for: 0.0,
            coarseness: super::pace::COARSEST,
            is_saving: false,
            writing: None,
            saved: None,
            dialog: None,
            export: Export::default(),
            flight_path: FlightPath::default(),
            display: Display::default(),
            auto_exposure: AutoExposure::default(),
            seeks: None,
            convergence: Convergence::default(),
            shown_as: None,
            textures: Textures::default(),
            looking: Looking::new(),
            probes: Arc::default(),
            inspection: None,
            inspected: None,
            inspected_pictures: [None, None],
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

    /// Whether nothing is being loaded, traced or written.
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.loading.is_none()
            && self.writing.is_none()
            && !self.is_saving
            && !self.player.as_ref().is_some_and(|p| p.plays)
            && self.journey.is_none()
            && self.stage.is_some()
            && self.is_still()
            && !self.needs_turning()
            && self.considered.as_ref() == Some(&self.args)
            && self.stopped().is_some()
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

    /// One frame.
    ///
    /// # Errors
    /// When the device fails.
    pub fn frame(&mut self, screen: &mut Screen, input: Input) -> Result<Output> {
        let begun = Instant::now();
        let mut wishes = Vec::new();
        self.display.apply(screen);
        self.receive_level();
        self.receive_picture();
        self.receive_film();
        self.receive_dialog();
        self.receive_shaders(input.seconds);
        self.receive_inspection();
        self.look(input.seconds)?;
        let ctx = self.ctx.clone();
        let mut laid_out = Instant::now();
        let full = ctx.run(input.raw, |ctx| {
            panels::show(self, ctx);
            self.act(ctx, input.seconds, &mut wishes);
        });
        let mut panels_ms = 1e3 * laid_out.elapsed().as_secs_f64();
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
        let exposure = &mut self.args.picture.exposure;
        self.auto_exposure.pass(input.seconds, exposure);

        laid_out = Instant::now();
        self.textures.set(screen, &full.textures_delta)?;
        let primitives = ctx.tessellate(full.shapes, scale);
        let meshes = draw::meshes(&primitives);
        panels_ms += 1e3 * laid_out.elapsed().as_secs_f64();
        let picture = &self.args.picture;
        let look = Look {
            curve: tone_curve(picture.tonemap),
            ev: picture.exposure as f32,
            denoise: picture.denoise == Denoise::Svgf,
        };
        let has_film = self.pace.samples() > 0;
        let is_new = traced || self.shown_as != Some(look);
        let film = (self.stage.as_ref()).filter(|_| has_film && is_new);
        let film = film.map(|stage| (&stage.tracer, look));
        let shows_film = film.is_some();
        let shown = screen.draw(film, self.filter(), &meshes, scale);
        if !matches!(shown, Ok(Shown::Yes)) {
            // The screen may have made room for the film and nothing in it.
            self.shown_as = None;
        } else if shows_film {
            self.shown_as = Some(look);
        }
        self.textures.free(screen, &full.textures_delta);
        let shown = shown?;
        let mut traced = Vec::new();
        if let Some(stage) = &mut self.stage {
            traced = stage.tracer.settled_timings();
            self.statistics.sampled(stage.tracer.sample_ms());
        }
        (self.statistics).frame(input.seconds, panels_ms, &traced, screen.timings());
        self.notices.pass(input.seconds);
        let root = egui::ViewportId::ROOT;
        let asked =
            (full.viewport_output.get(&root)).map_or(1.0, |v| v.repaint_delay.as_secs_f32());
        // Sticks are looked at with frames.
        let asked = if self.gamepad.is_there() {
            asked.min(1.0 / 30.0)
        } else {
            asked
        };
        let busy =
            !self.is_done() || self.looking.is_busy() || self.is_inspecting() || !wishes.is_empty();
        Ok(Output {
            platform: full.platform_output,
            wishes,
            shown,
            next: if busy { 0.0 } else { asked.min(1.0) }.max(self.display.wait(begun)),
        })
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
