//! The window around the viewer.

use super::app::{App, Input, Wish};
use super::preferences::Preferences;
use crate::cli::{Global, Render};
use crate::device::Device;
use anyhow::{Result, anyhow, bail};
use rt::Screen;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};
use winit::application::ApplicationHandler;
use winit::dpi::{LogicalSize, PhysicalSize, Size};
use winit::event::{DeviceEvent, DeviceId, StartCause, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::window::{CursorGrabMode, Fullscreen, WindowAttributes, WindowId};

/// Someone who flies instead of a person: called before each frame with the viewer and the frame's
/// number; what it answers is done besides.
pub type Pilot = Box<dyn FnMut(&mut App, u64) -> Vec<PilotWish>>;

/// What a pilot asks for.
#[derive(Clone, Debug, PartialEq)]
pub enum PilotWish {
    /// What the viewer might ask for itself.
    App(Wish),
    /// Another size, in points.
    Resize([u32; 2]),
    /// What somebody does with keys and mouse.
    Input(egui::Event),
    /// The device to be lost, as drivers lose it.
    LoseDevice,
}

/// How the window is opened.
#[derive(Default)]
pub struct Options {
    /// With the validation layer.
    pub validation: bool,
    /// Who flies.
    pub pilot: Option<Pilot>,
    /// Where settings are kept instead of in the platform's directory; of a pilot's flight nothing is kept
    /// without it.
    pub settings: Option<PathBuf>,
}

/// Pixels across and down at first, where the screen has them.
const SIZE: [u32; 2] = [1280, 720];

/// Shows the window until it is closed. Returns what the validation layer said.
///
/// # Errors
/// When there is no display, nothing that draws on it, or the device fails.
pub fn run(global: &Global, args: &Render, options: Options) -> Result<Vec<String>> {
    let no_display = |why: String| {
        anyhow!(
            "there is no display to open a window on ({why}); `runelight render` makes pictures without one"
        )
    };
    if cfg!(all(unix, not(target_os = "macos"))) {
        let has = |name| std::env::var_os(name).is_some_and(|v| !v.is_empty());
        if !has("DISPLAY") && !has("WAYLAND_DISPLAY") {
            return Err(no_display(
                "neither DISPLAY nor WAYLAND_DISPLAY is set".into(),
            ));
        }
    }
    let mut builder = EventLoop::builder();
    // Tests have threads of their own.
    #[cfg(all(unix, not(target_os = "macos")))]
    if options.pilot.is_some() {
        winit::platform::x11::EventLoopBuilderExtX11::with_any_thread(&mut builder, true);
    }
    // Drivers go on to show pictures on a window that was just destroyed, and winit takes what the display says of that for
    // the answer to a request of its own, and panics.
    #[cfg(all(unix, not(target_os = "macos")))]
    winit::platform::x11::register_xlib_error_hook(Box::new(|_, _| true));
    let events = builder.build().map_err(|e| no_display(e.to_string()))?;
    let mut handler = Handler {
        global,
        args,
        options,
        running: None,
        failure: None,
        lost: None,
    };
    events.run_app(&mut handler)?;
    if let Some(running) = &handler.running
        && let Some(file) = &running.file
        && let Err(error) = running.preferences().write(file)
    {
        tracing::warn!("the settings are not kept: {error:#}");
    }
    match (handler.failure, handler.running) {
        (Some(error), _) => Err(error),
        (None, Some(mut running)) => {
            running.screen.settle()?;
            Ok(running.app.gpu.validation_messages())
        }
        (None, None) => bail!("the window closed before it opened"),
    }
}

struct Handler<'a> {
    global: &'a Global,
    args: &'a Render,
    options: Options,
    running: Option<Running>,
    failure: Option<anyhow::Error>,
    /// When the device was lost last.
    lost: Option<Instant>,
}

/// A device that is lost again within this time is not opened once more.
const LOST_AGAIN: Duration = Duration::from_secs(20);

/// The picture is made no coarser than so many percent of the window, where there is no memory.
const LEAST_PERCENT: u32 = 10;

/// Whether another device, or the same opened anew, could go on.
fn is_of_device(error: &anyhow::Error) -> bool {
    use rt::Error::{Call, DeviceLost, Memory};
    let error: Option<&rt::Error> = error.downcast_ref();
    matches!(error, Some(DeviceLost { .. } | Memory { .. } | Call { .. }))
}

/// Whether Vulkan has nothing to draw on any more.
fn is_of_surface(error: &anyhow::Error) -> bool {
    matches!(error.downcast_ref(), Some(rt::Error::SurfaceLost))
}

/// After so many surfaces that were lost without a picture between them there is no hope.
const MOST_LOSSES: u32 = 4;

/// What every window of the viewer has.
fn attributes(size: impl Into<Size>) -> WindowAttributes {
    winit::window::Window::default_attributes()
        .with_title("runelight")
        .with_inner_size(size)
}

struct Running {
    app: App,
    screen: Screen,
    egui: egui_winit::State,
    window: Arc<winit::window::Window>,
    /// Pixels of the window, as it said them last: asked about a window that is gone, winit panics.
    size: [u32; 2],
    /// Pixels to a point, as the window said them last: on X11 winit tells a new scale, and keeps the old one as its
    /// own until the window is moved.
    scale: f64,
    /// The same for the panels, in the frame before.
    points: f32,
    /// Where the pointer was last, as the window said it.
    pointer: Option<WindowEvent>,
    begun: Instant,
    /// Whether it fills the screen and keeps the pointer, which another window in its place has to do, too.
    is_full: bool,
    holds_mouse: bool,
    /// Surfaces that were lost since a picture was shown.
    losses: u32,
    /// Where preferences are kept.
    file: Option<PathBuf>,
    last: Instant,
    frames: u64,
    title: String,
    /// What a pilot does besides what the window says.
    inputs: Vec<egui::Event>,
}

impl Handler<'_> {
    fn open(&self, events: &ActiveEventLoop, args: &Render) -> Result<Running> {
        // A pilot's flight is no person's: nothing is remembered of it.
        let usual = || Preferences::path().filter(|_| self.options.pilot.is_none());
        let file = self.options.settings.clone().or_else(usual);
        let read = file.as_deref().map(Preferences::read);
        let known = read.as_ref().and_then(|read| read.as_ref().ok());
        let size = known.and_then(|p| p.size).unwrap_or(SIZE);
        // Neither too small to be found nor larger than any screen.
        let [width, height] = size.map(|n| n.clamp(200, 16_384));
        let attributes = attributes(LogicalSize::new(width, height))
            .with_maximized(known.is_some_and(|p| p.maximized));
        let window = Arc::new(events.create_window(attributes)?);
        let opened = Device::for_window(&self.global.device, self.options.validation)?;
        tracing::info!("{}", opened.0.name);
        let size = window.inner_size();
        let size = [size.width, size.height];
        let screen = Screen::of_window(&opened.1, Arc::clone(&window), size)?;
        let mut app = App::new(opened, self.global.clone(), args.clone());
        app.gamepad.search();
        let file = match (file, read) {
            (Some(path), Some(Ok(preferences))) => {
                app.prefer(preferences);
                Some(path)
            }
            (_, Some(Err(error))) => {
                // Not written over: it is a person's, who made a mistake.
                app.notices.error(format!("{error:#}"));
                None
            }
            (_, None) | (None, _) => None,
        };
        let scale = window.scale_factor();
        let egui = egui_winit::State::new(
            app.egui().clone(),
            egui::ViewportId::ROOT,
            &*window,
            Some(scale as f32),
            window.theme(),
            None,
        );
        Ok(Running {
            app,
            screen,
            egui,
            window,
            size,
            scale,
            points: scale as f32,
            pointer: None,
            begun: Instant::now(),
            is_full: false,
            holds_mouse: false,
            losses: 0,
            file,
            last: Instant::now(),
            frames: 0,
            title: String::new(),
            inputs: Vec::new(),
        })
    }

    /// The device is gone, or has no memory: what is set is kept, and the window opened anew on the same
    /// place of the same level, half as fine where it was memory. Where that does not help, says so.
    fn open_anew(&mut self, events: &ActiveEventLoop, error: anyhow::Error) {
        let Some(mut running) = self.running.take() else {
            return self.fail(events, error);
        };
        running.app.remember_place();
        let mut kept = String::new();
        if let Some(file) = &running.file {
            match running.preferences().write(file) {
                Ok(()) => kept = format!("; settings and the place are kept in {}", file.display()),
                Err(error) => tracing::warn!("the settings are not kept: {error:#}"),
            }
        }
        let again = self.lost.is_some_and(|at| at.elapsed() < LOST_AGAIN);
        self.lost = Some(Instant::now());
        let no_memory = (error.downcast_ref()).is_some_and(rt::Error::lacks_memory);
        // As long as the picture can be made coarser, that may help.
        if again && !(no_memory && running.app.panels.percent > LEAST_PERCENT) {
            let why = format!("it was opened anew, and that did not help{kept}");
            self.running = Some(running);
            return self.fail(events, error.context(why));
        }
        let (args, moment) = running.app.to_go_on();
        let panels = running.app.panels.clone();
        let percent = if no_memory {
            (panels.percent / 2).max(LEAST_PERCENT)
        } else {
            panels.percent
        };
        tracing::warn!("{error:#}; the device is opened anew{kept}");
        // What is on the old device must go before the new one is asked for as much.
        drop(running);
        match self.open(events, &args) {
            Ok(mut running) => {
                let app = &mut running.app;
                app.panels = panels;
                app.panels.percent = percent;
                app.go_on_at(moment);
                app.notices
                    .error(format!("{error:#}: the device was opened anew{kept}"));
                running.window.request_redraw();
                self.running = Some(running);
            }
            Err(other) => self.fail(events, other.context(format!("{error:#}"))),
        }
    }

    fn fail(&mut self, events: &ActiveEventLoop, error: anyhow::Error) {
        self.failure.get_or_insert(error);
        events.exit();
    }

    fn frame(&mut self, events: &ActiveEventLoop) {
        let Some(running) = &mut self.running else {
            return;
        };
        let is_flown = self.options.pilot.is_some();
        let asked = match &mut self.options.pilot {
            Some(pilot) => pilot(&mut running.app, running.frames),
            None => Vec::new(),
        };
        match running.frame(asked) {
            // Pilots wait for nobody.
            Ok(Some(next)) => events.set_control_flow(if next > 0.0 && !is_flown {
                ControlFlow::WaitUntil(Instant::now() + Duration::from_secs_f32(next))
            } else {
                ControlFlow::Poll
            }),
            Ok(None) => events.exit(),
            Err(error) if is_of_surface(&error) => {
                running.losses += 1;
                let moved = match running.losses {
                    // The window may still be there: only what Vulkan drew on is gone. Of one that is not there some
                    // drivers make no surface, and others one that is lost at once.
                    1 => (running.stay()).or_else(|_| running.move_to_another(events)),
                    2..MOST_LOSSES => running.move_to_another(events),
                    _ => Err(error),
                };
                self.go_on(events, moved);
            }
            Err(error) if is_of_device(&error) => self.open_anew(events, error),
            Err(error) => self.fail(events, error),
        }
    }

    fn go_on(&mut self, events: &ActiveEventLoop, moved: Result<()>) {
        match moved {
            Ok(()) => events.set_control_flow(ControlFlow::Poll),
            Err(error) => self.fail(events, error),
        }
    }
}

impl Running {
    /// What is to be remembered of the viewer and of its window.
    fn preferences(&self) -> Preferences {
        let window = &self.window;
        let (maximized, full) = (window.is_maximized(), window.fullscreen().is_some());
        let size = PhysicalSize::<u32>::from(self.size).to_logical::<u32>(self.scale);
        let mut preferences = self.app.preferences();
        preferences.maximized = maximized;
        // What it had before it filled the screen is what it will have after that.
        if !maximized && !full && size.width > 0 && size.height > 0 {
            preferences.size = Some([size.width, size.height]);
        }
        preferences
    }

    /// Draws on the same window anew.
    fn stay(&mut self) -> Result<()> {
        Ok((self.screen).move_to(Arc::clone(&self.window), self.size)?)
    }

    /// Goes on in another window, for one that is gone.
    fn move_to_another(&mut self, events: &ActiveEventLoop) -> Result<()> {
        let attributes = attributes(PhysicalSize::<u32>::from(self.size))
            .with_title(&self.title)
            .with_fullscreen(self.is_full.then_some(Fullscreen::Borderless(None)));
        self.window = Arc::new(events.create_window(attributes)?);
        (self.size, self.scale) = (self.window.inner_size().into(), self.window.scale_factor());
        self.pointer = None;
        // What this window was not told yet.
        self.egui.set_allow_ime(false);
        if self.holds_mouse {
            self.hold_mouse(true);
        }
        tracing::warn!("the window is gone: another takes its place");
        self.stay()
    }

    /// The window has so many pixels to a point now. Whether it should keep its size in pixels.
    fn rescale(&mut self, scale: f64) -> bool {
        // On X11 winit tells the same scale once more when the window is moved, and would make it larger once more.
        let is_known = scale == self.scale;
        self.scale = scale;
        self.point_again();
        is_known
    }

    /// Says again where the pointer is, which may be elsewhere in points while it rests.
    fn point_again(&mut self) {
        if let Some(event) = &self.pointer {
            _ = self.egui.on_window_event(&self.window, event);
        }
    }

    /// What happened since the last frame.
    fn take_input(&mut self) -> egui::RawInput {
        let zoom = self.app.egui().zoom_factor();
        let points = self.scale as f32 * zoom;
        if points != self.points {
            self.points = points;
            self.point_again();
        }
        let [width, height] = self.size.map(|n| n as f32 / points);
        let raw = self.egui.egui_input_mut();
        raw.time = Some(self.begun.elapsed().as_secs_f64());
        // Minimised, it keeps its panels where they are.
        raw.screen_rect = (width > 0.0 && height > 0.0)
            .then(|| egui::Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(width, height)));
        let root = raw.viewports.entry(egui::ViewportId::ROOT).or_default();
        root.native_pixels_per_point = Some(self.scale as f32);
        let mut raw = raw.take();
        let counted_by = self.window.scale_factor();
        if counted_by != self.scale {
            count_by(&mut raw.events, (counted_by / self.scale) as f32);
        }
        raw.events.append(&mut self.inputs);
        raw
    }

    /// One frame; in so many seconds the next is wanted, `None` to end.
    fn frame(&mut self, asked: Vec<PilotWish>) -> Result<Option<f32>> {
        let now = Instant::now();
        let raw = self.take_input();
        let input = Input {
            raw,
            seconds: (now - self.last).as_secs_f32(),
        };
        (self.last, self.frames) = (now, self.frames + 1);
        self.screen.resize(self.size)?;
        let output = self.app.frame(&mut self.screen, input)?;
        if output.shown == rt::Shown::Yes {
            self.losses = 0;
        }
        (self.egui).handle_platform_output(&self.window, output.platform);
        let mut wishes = output.wishes;
        for wish in asked {
            match wish {
                PilotWish::App(wish) => wishes.push(wish),
                PilotWish::Resize([width, height]) => {
                    let size = LogicalSize::new(width, height).to_physical::<u32>(self.scale);
                    // Where it has that at once, the window says no more of it.
                    if let Some(size) = self.window.request_inner_size(size) {
                        self.size = size.into();
                    }
                }
                PilotWish::Input(event) => self.inputs.push(event),
                PilotWish::LoseDevice => {
                    return Err(rt::Error::DeviceLost { call: "a pilot" }.into());
                }
            }
        }
        for wish in wishes {
            match wish {
                Wish::Quit => return Ok(None),
                Wish::FullScreen(on) => {
                    let full = on.then_some(Fullscreen::Borderless(None));
                    self.window.set_fullscreen(full);
                    self.is_full = on;
                }
                Wish::HoldMouse(on) => {
                    self.hold_mouse(on);
                    self.holds_mouse = on;
                }
            }
        }
        let title = self.app.title();
        if title != self.title {
            self.window.set_title(&title);
            self.title = title;
        }
        // Hidden windows have nothing to hurry for.
        let hidden = output.shown == rt::Shown::No;
        Ok(Some(if hidden { 0.05 } else { output.next }))
    }

    fn hold_mouse(&self, on: bool) {
        let window = &self.window;
        let held = if on {
            // Window systems know one or the other.
            (window.set_cursor_grab(CursorGrabMode::Locked))
                .or_else(|_| window.set_cursor_grab(CursorGrabMode::Confined))
        } else {
            window.set_cursor_grab(CursorGrabMode::None)
        };
        if let Err(error) = held {
            tracing::warn!("the window system does not hand over the mouse: {error}");
        }
        window.set_cursor_visible(!on);
    }
}

/// Counts places by points of another size.
fn count_by(events: &mut [egui::Event], factor: f32) {
    use egui::{Event, MouseWheelUnit};
    for event in events {
        match event {
            Event::PointerMoved(at)
            | Event::PointerButton { pos: at, .. }
            | Event::Touch { pos: at, .. } => *at *= factor,
            Event::MouseWheel {
                unit: MouseWheelUnit::Point,
                delta,
                ..
            } => *delta *= factor,
            _ => {}
        }
    }
}

impl ApplicationHandler for Handler<'_> {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if self.running.is_none() {
            match self.open(events, self.args) {
                Ok(running) => self.running = Some(running),
                Err(error) => self.fail(events, error),
            }
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, of: WindowId, event: WindowEvent) {
        // What becomes of a window that another has taken the place of is nobody's business.
        let Some(running) = self.running.as_mut().filter(|r| r.window.id() == of) else {
            return;
        };
        match event {
            WindowEvent::CloseRequested => events.exit(),
            WindowEvent::RedrawRequested => self.frame(events),
            WindowEvent::Destroyed => {
                let moved = running.move_to_another(events);
                self.go_on(events, moved);
            }
            WindowEvent::ScaleFactorChanged {
                scale_factor,
                mut inner_size_writer,
            } => {
                if running.rescale(scale_factor) {
                    // Fails where the event was waited for too long; then the window has its own size.
                    _ = inner_size_writer.request_inner_size(running.size.into());
                }
                running.window.request_redraw();
            }
            event => {
                match &event {
                    WindowEvent::Resized(size) => running.size = (*size).into(),
                    WindowEvent::CursorMoved { .. } => running.pointer = Some(event.clone()),
                    WindowEvent::CursorLeft { .. } => running.pointer = None,
                    _ => {}
                }
                let response = running.egui.on_window_event(&running.window, &event);
                if response.repaint {
                    running.window.request_redraw();
                }
            }
        }
    }

    fn device_event(&mut self, _: &ActiveEventLoop, _: DeviceId, event: DeviceEvent) {
        if let (Some(running), DeviceEvent::MouseMotion { delta }) = (&mut self.running, event) {
            running.egui.on_mouse_motion(delta);
        }
    }

    fn new_events(&mut self, _: &ActiveEventLoop, cause: StartCause) {
        let due = matches!(
            cause,
            StartCause::Poll | StartCause::ResumeTimeReached { .. }
        );
        if let Some(running) = self.running.as_ref().filter(|_| due) {
            running.window.request_redraw();
        }
    }
}
