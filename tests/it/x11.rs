//! The window as its display has it: destroyed, filling the screen, counted by other points, clicked on.

use crate::tour::{Step, now, step, tap, walk_through};
use crate::window::on_a_display;
use egui::{Id, Key, Pos2, Rect, Vec2};
use rt::{Error, Filter, Mesh, Screen, Shown, Vertex};
use runelight::device::Device;
use runelight::view::app::{App, Wish};
use runelight::view::panels::Panels;
use runelight::view::window::PilotWish;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;
use std::sync::Arc;
use std::time::{Duration, Instant};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, EventLoop};
use winit::platform::x11::EventLoopBuilderExtX11 as _;
use winit::window::{Window, WindowId};
use x11rb::connection::Connection as _;
use x11rb::protocol::Event;
use x11rb::protocol::xproto::{
    AtomEnum, BUTTON_PRESS_EVENT, BUTTON_RELEASE_EVENT, CONFIGURE_NOTIFY_EVENT,
    ChangeWindowAttributesAux, ClientMessageEvent, ConfigureNotifyEvent, ConfigureWindowAux,
    ConnectionExt as _, EventMask, ImageFormat, MOTION_NOTIFY_EVENT, MapState, PropMode,
};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;
use x11rb::wrapper::ConnectionExt as _;

/// A display, as another of its clients sees it.
struct Server {
    connection: RustConnection,
    root: u32,
}

impl Server {
    fn connect() -> Self {
        let (connection, screen) = x11rb::connect(None).expect("the display");
        let root = connection.setup().roots[screen].root;
        Self { connection, root }
    }

    /// Waits until the server has done what was asked.
    fn settle(&self) {
        self.connection.sync().expect("the display");
    }

    /// Windows that are shown.
    fn windows(&self) -> Vec<u32> {
        let tree = self.connection.query_tree(self.root).expect("the display");
        let all = tree.reply().expect("windows").children;
        let is_shown = |window: &u32| {
            let asked = self.connection.get_window_attributes(*window);
            let attributes = asked.expect("the display").reply();
            attributes.is_ok_and(|a| a.map_state == MapState::VIEWABLE)
        };
        all.into_iter().filter(is_shown).collect()
    }

    /// The one window that is shown.
    fn window(&self) -> u32 {
        match self.windows()[..] {
            [window] => window,
            ref all => panic!("{} windows", all.len()),
        }
    }

    fn size(&self, window: u32) -> [u32; 2] {
        let asked = self.connection.get_geometry(window).expect("the display");
        let found = asked.reply().expect("a window");
        [found.width.into(), found.height.into()]
    }

    /// What a window shows: red, green, blue of each pixel.
    fn picture(&self, window: u32) -> ([u32; 2], Vec<[u8; 3]>) {
        let [width, height] = self.size(window);
        let (format, all) = (ImageFormat::Z_PIXMAP, !0);
        let (w, h) = (width as u16, height as u16);
        let asked = (self.connection).get_image(format, window, 0, 0, w, h, all);
        let image = asked.expect("the display").reply().expect("a picture");
        let pixels = image.data.chunks_exact(4);
        (
            [width, height],
            pixels.map(|p| [p[2], p[1], p[0]]).collect(),
        )
    }

    fn destroy(&self, window: u32) {
        self.connection.destroy_window(window).expect("the display");
        self.settle();
    }

    /// Sets dots per inch as desktops do; 96 are one pixel to a point.
    fn set_dpi(&self, dpi: u32) {
        let text = format!("Xft.dpi:\t{dpi}\n");
        let (replace, name) = (PropMode::REPLACE, AtomEnum::RESOURCE_MANAGER);
        // Windows hear of properties of their own.
        for window in [self.root].into_iter().chain(self.windows()) {
            let bytes = text.as_bytes();
            let set =
                (self.connection).change_property8(replace, window, name, AtomEnum::STRING, bytes);
            set.expect("the display");
        }
        self.settle();
    }

    /// Tells a window where it is, as window managers do when it is moved.
    fn tell_place(&self, window: u32) {
        let [width, height] = self.size(window).map(|n| n as u16);
        let event = ConfigureNotifyEvent {
            response_type: CONFIGURE_NOTIFY_EVENT,
            event: window,
            window,
            width,
            height,
            ..ConfigureNotifyEvent::default()
        };
        let sent = (self.connection).send_event(false, window, EventMask::STRUCTURE_NOTIFY, event);
        sent.expect("the display");
        self.settle();
    }

    /// Does with the pointer as a hand would.
    fn hand(&self, kind: u8, detail: u8, [x, y]: [i16; 2]) {
        let done = (self.connection).xtest_fake_input(kind, detail, 0, self.root, x, y, 0);
        done.expect("the display");
        self.settle();
    }

    /// Puts the pointer on a pixel of a window.
    fn point(&self, window: u32, [x, y]: [i16; 2]) {
        let there = (self.connection).translate_coordinates(window, self.root, x, y);
        let there = there.expect("the display").reply().expect("a window");
        self.hand(MOTION_NOTIFY_EVENT, 0, [there.dst_x, there.dst_y]);
    }

    fn press(&self) {
        self.hand(BUTTON_PRESS_EVENT, 1, [0; 2]);
    }

    fn release(&self) {
        self.hand(BUTTON_RELEASE_EVENT, 1, [0; 2]);
    }

    /// Manages the windows of the display from now on, as little as that can be done: they are where and as large as they
    /// ask to be, and fill the screen when they ask for that.
    fn manage() {
        let server = Self::connect();
        let wants = EventMask::SUBSTRUCTURE_REDIRECT | EventMask::SUBSTRUCTURE_NOTIFY;
        let wants = ChangeWindowAttributesAux::new().event_mask(wants);
        let asked = (server.connection).change_window_attributes(server.root, &wants);
        (asked.expect("the display").check()).expect("no other manager");
        // Ends with the process: there is one for each test.
        std::thread::spawn(move || server.serve());
    }

    fn serve(&self) {
        let to = &self.connection;
        let screen = self.size(self.root);
        let atom = |name: &str| {
            let asked = to.intern_atom(false, name.as_bytes()).expect("the display");
            asked.reply().expect("an atom").atom
        };
        let [state, full] = ["_NET_WM_STATE", "_NET_WM_STATE_FULLSCREEN"].map(atom);
        let mut before = None;
        while let Ok(event) = to.wait_for_event() {
            match event {
                Event::MapRequest(e) => _ = to.map_window(e.window),
                Event::ConfigureRequest(e) => {
                    let asked = ConfigureWindowAux::from_configure_request(&e);
                    // Not where there are frames, nor siblings, to be put between.
                    let asked = asked.sibling(None).stack_mode(None);
                    _ = to.configure_window(e.window, &asked);
                }
                Event::ClientMessage(ClientMessageEvent {
                    window,
                    type_,
                    data,
                    ..
                }) if type_ == state && data.as_data32()[1] == full => {
                    let fills = data.as_data32()[0] == 1;
                    let size = if fills {
                        before = Some(self.size(window));
                        screen
                    } else {
                        before.take().unwrap_or(screen)
                    };
                    let size = ConfigureWindowAux::new().width(size[0]).height(size[1]);
                    _ = to.configure_window(window, &size);
                    let states: &[u32] = if fills { &[full] } else { &[] };
                    let replace = PropMode::REPLACE;
                    _ = to.change_property32(replace, window, state, AtomEnum::ATOM, states);
                }
                _ => {}
            }
            self.settle();
        }
    }
}

/// Something that is kept from one step for another.
fn kept<T>() -> Rc<RefCell<Option<T>>> {
    Rc::default()
}

/// The level is there, in a window of so many points.
fn begins(size: [u32; 2]) -> [Step; 3] {
    let first = move |app: &mut App| {
        app.panels = Panels::none();
        app.panels.percent = 20;
        vec![PilotWish::Resize(size)]
    };
    [
        step("the level is there", first, |app| app.samples() > 0),
        still("it is whole"),
        // Panels tell of the frame before.
        still("and shown"),
    ]
}

/// Nothing is done, until all is as it will be.
fn still(what: &str) -> Step {
    let mut waits = now(what, |_| {});
    // The display has shown what was drawn.
    waits.frames = 8;
    waits
}

fn quits() -> Step {
    let quit = |_: &mut App| vec![PilotWish::App(Wish::Quit)];
    step("leaves", quit, |_| false)
}

/// A surface whose window is destroyed is lost, says Vulkan; another window shows what that one did.
#[test]
fn a_screen_moves_to_another_window_when_its_surface_is_lost() {
    on_a_display(
        "x11::a_screen_moves_to_another_window_when_its_surface_is_lost",
        moves,
        "1",
    );
}

/// Whoever has windows for a moment.
struct Moves {
    is_done: bool,
}

impl ApplicationHandler for Moves {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if !std::mem::replace(&mut self.is_done, true) {
            move_from_window_to_window(events);
        }
        events.exit();
    }

    fn window_event(&mut self, _: &ActiveEventLoop, _: WindowId, _: WindowEvent) {}
}

fn moves() {
    let mut builder = EventLoop::builder();
    let events = builder.with_any_thread(true).build().expect("a display");
    let mut moves = Moves { is_done: false };
    events.run_app(&mut moves).expect("windows");
    assert!(moves.is_done);
}

fn move_from_window_to_window(events: &ActiveEventLoop) {
    let device = std::env::var("RUNELIGHT_TEST_DEVICE").unwrap_or_else(|_| "llvmpipe".into());
    let (_, gpu) = Device::for_window(&device, true).expect("a device");
    let server = Server::connect();
    let opens = |[width, height]: [u32; 2]| {
        let before = server.windows();
        let size = PhysicalSize::new(width, height);
        let attributes = Window::default_attributes().with_inner_size(size);
        let window = Arc::new(events.create_window(attributes).expect("a window"));
        let number = loop {
            let now = server.windows();
            if let Some(new) = now.iter().find(|w| !before.contains(w)) {
                break *new;
            }
            std::thread::yield_now();
        };
        (window, number)
    };
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let vertices = corners.map(|at: [f32; 2]| Vertex {
        position: at.map(|n| n * 1000.0),
        texture_at: at,
        color: [255; 4],
    });
    let mesh = Mesh {
        texture: 7,
        clip: [0.0, 0.0, 1000.0, 1000.0],
        vertices: &vertices,
        indices: &[0, 1, 2, 0, 2, 3],
    };
    let draw = |screen: &mut Screen| screen.draw(None, Filter::Nearest, &[mesh], 1.0);
    let [red, green, blue] = [200, 120, 40];
    // Until the display has it: showing goes on by itself.
    let shows = |screen: &mut Screen, window: u32, size: [u32; 2]| {
        let begun = Instant::now();
        while begun.elapsed() < Duration::from_secs(60) {
            assert_eq!(draw(screen).expect("a frame"), Shown::Yes);
            let (found, pixels) = server.picture(window);
            if found == size && pixels.iter().all(|p| *p == [red, green, blue]) {
                return;
            }
        }
        panic!("the window does not show what was drawn");
    };

    let sizes = [[200, 100], [160, 120], [90, 70]];
    let (window, mut number) = opens(sizes[0]);
    let mut screen = Screen::of_window(&gpu, window, sizes[0]).expect("a screen");
    let texel = [[red, green, blue, 255]];
    (screen.set_texture(7, [1, 1], &texel, Filter::Nearest)).expect("a texture");
    shows(&mut screen, number, sizes[0]);
    for size in &sizes[1..] {
        server.destroy(number);
        // Drivers notice when they ask the window something, as for another size.
        screen.resize([50, 50]).expect("a size");
        match draw(&mut screen) {
            Err(Error::SurfaceLost) => {}
            other => panic!("{other:?}"),
        }
        // A window that is gone stays so.
        assert!(matches!(draw(&mut screen), Err(Error::SurfaceLost)));
        let (window, another) = opens(*size);
        screen.move_to(window, *size).expect("another window");
        shows(&mut screen, another, *size);
        number = another;
    }
    drop(screen);
    assert_eq!(gpu.validation_messages(), [""; 0]);
}

/// A window that is destroyed under the viewer is one of another number that shows the same, once more when it happens
/// once more, and takes another size.
#[test]
fn another_window_takes_the_place_of_one_that_is_gone() {
    on_a_display(
        "x11::another_window_takes_the_place_of_one_that_is_gone",
        is_replaced,
        "1",
    );
}

fn is_replaced() {
    let server = Rc::new(Server::connect());
    let mut steps = VecDeque::from(begins([320, 200]));
    let shown = kept();
    let (from, keep) = (Rc::clone(&server), Rc::clone(&shown));
    steps.push_back(now("its picture", move |_| {
        let window = from.window();
        *keep.borrow_mut() = Some((window, from.picture(window)));
    }));
    for _ in 0..2 {
        let (from, keep) = (Rc::clone(&server), Rc::clone(&shown));
        let (seen, before) = (Rc::clone(&server), Rc::clone(&shown));
        let destroy = move |_: &mut App| {
            let (window, _) = keep.borrow().clone().expect("a picture");
            from.destroy(window);
            Vec::new()
        };
        let is_there = move |app: &App| {
            let Some((old, picture)) = before.borrow().clone() else {
                return false;
            };
            match seen.windows()[..] {
                [new] if app.is_done() && seen.picture(new) == picture => {
                    assert_ne!(new, old, "a window of its own");
                    *before.borrow_mut() = Some((new, picture));
                    true
                }
                _ => false,
            }
        };
        steps.push_back(step("it is destroyed", destroy, is_there));
    }
    let seen = Rc::clone(&server);
    let other = |_: &mut App| vec![PilotWish::Resize([260, 180])];
    let is_so_large = move |app: &App| {
        let size = app.egui().viewport_rect().size();
        app.is_done() && seen.size(seen.window()) == [260, 180] && size == Vec2::new(260.0, 180.0)
    };
    steps.push_back(step("another size", other, is_so_large));
    steps.push_back(quits());
    walk_through(steps);
}

/// With a window manager the window fills the screen and has its size again afterwards, one that takes its place does the
/// same; without one it goes on as it is.
#[test]
fn the_window_fills_the_screen() {
    on_a_display("x11::the_window_fills_the_screen", fills, "1");
}

fn fills() {
    const USUAL: [u32; 2] = [320, 200];
    let server = Rc::new(Server::connect());
    let screen = server.size(server.root);
    // Window, panels and picture have that size, and the picture is all over it.
    let has = |size: [u32; 2]| {
        let server = Rc::clone(&server);
        move |app: &App| {
            let points = app.egui().viewport_rect().size();
            let told = app.settings().map(|s| [s.width, s.height]);
            let windows = server.windows();
            let [window] = windows[..] else { return false };
            let fits = app.is_done()
                && server.size(window) == size
                && points == Vec2::from(size.map(|n| n as f32))
                && told == Some(size.map(|n| n / 5));
            if !fits {
                return false;
            }
            let (_, pixels) = server.picture(window);
            let corner = pixels.chunks_exact(size[0] as usize).rev().take(20);
            corner
                .flat_map(|row| row[row.len() - 20..].iter())
                .any(|p| p.iter().any(|&c| c > 8))
        }
    };
    let mut steps = VecDeque::from(begins(USUAL));
    for _ in 0..2 {
        steps.extend(tap(Key::F11, has(USUAL)));
        steps.push_back(still("nobody makes it larger"));
    }
    steps.push_back(now("somebody manages windows", |_| Server::manage()));
    for _ in 0..2 {
        steps.extend(tap(Key::F11, has(screen)));
        steps.extend(tap(Key::F11, has(USUAL)));
    }
    steps.extend(tap(Key::F11, has(screen)));
    let destroys = Rc::clone(&server);
    let destroy = move |_: &mut App| {
        destroys.destroy(destroys.window());
        Vec::new()
    };
    steps.push_back(step("it is destroyed", destroy, has(screen)));
    steps.push_back(quits());
    walk_through(steps);
}

/// While the window is open the display counts by points of another size, and by the old ones again: words, picture and
/// pointer follow.
#[test]
fn the_window_follows_the_scale_of_its_display() {
    // No scale that is there for good.
    on_a_display(
        "x11::the_window_follows_the_scale_of_its_display",
        follows,
        "",
    );
}

/// Of the window, in points.
const POINTS: [u32; 2] = [600, 400];

/// Whether window, panels and picture are as large as so many pixels to a point make them.
fn has_scale(server: &Rc<Server>, scale: u32) -> impl Fn(&App) -> bool + use<> {
    let server = Rc::clone(server);
    move |app: &App| {
        let pixels = POINTS.map(|n| n * scale);
        app.is_done()
            && server.size(server.window()) == pixels
            && app.egui().pixels_per_point() == scale as f32
            && app.egui().viewport_rect().size() == Vec2::from(POINTS.map(|n| n as f32))
            && app.settings().map(|s| [s.width, s.height]) == Some(pixels.map(|n| n / 5))
    }
}

/// A click on a place of the window, in pixels, without moving there first if `rests`.
fn click(server: &Rc<Server>, at: [i16; 2], rests: bool) -> [Step; 3] {
    let [points, presses, lets_go] = [(); 3].map(|()| Rc::clone(server));
    [
        now("points", move |_| {
            if !rests {
                points.point(points.window(), at);
            }
        }),
        now("presses", move |_| presses.press()),
        now("lets go", move |_| lets_go.release()),
    ]
}

/// Asks what is at a pixel, and looks whether that was asked.
fn asks(steps: &mut VecDeque<Step>, server: &Rc<Server>, at: [i16; 2], scale: u32, rests: bool) {
    steps.push_back(now("the inspector", |app| {
        app.panels.inspector = true;
        app.inspected = None;
    }));
    steps.extend(click(server, at, rests));
    let answered = |app: &App| app.inspected.is_some() && !app.is_inspecting();
    steps.push_back(step("an answer", |_| Vec::new(), answered));
    steps.push_back(now("of that place", move |app| {
        let report = app.inspected.take().expect("a wall");
        for (i, share) in report.at.into_iter().enumerate() {
            let expected = f64::from(at[i]) / f64::from(POINTS[i] * scale);
            let near = (share - expected).abs() < 1e-3;
            assert!(
                near,
                "{:?} of {at:?} at {scale} pixels to a point",
                report.at
            );
        }
    }));
}

fn follows() {
    let server = Rc::new(Server::connect());
    server.set_dpi(96);
    let mut steps = VecDeque::from(begins(POINTS));
    let [seen, keeps] = [(); 2].map(|()| Rc::clone(&server));
    let plain = kept();
    let keep = Rc::clone(&plain);
    steps.push_back(step("usual", |_| Vec::new(), has_scale(&seen, 1)));
    steps.push_back(still("it is shown"));
    steps.push_back(now("its picture", move |_| {
        *keep.borrow_mut() = Some(keeps.picture(keeps.window()).1);
    }));
    // It lies where the pointer will still be over the picture when there are more pixels to a point.
    let rests = [580, 390];
    asks(&mut steps, &server, rests, 1, false);

    let scales = Rc::clone(&server);
    let twice = move |app: &mut App| {
        app.panels.inspector = false;
        scales.set_dpi(192);
        Vec::new()
    };
    steps.push_back(step("more pixels", twice, has_scale(&server, 2)));
    steps.push_back(still("they are shown"));
    let (looks, before) = (Rc::clone(&server), Rc::clone(&plain));
    steps.push_back(now("words are twice as large", move |app| {
        let before = before.borrow().clone().expect("a picture");
        let (size, now) = looks.picture(looks.window());
        let bar = egui::containers::panel::PanelState::load(app.egui(), Id::new("bar"));
        let bar = bar.expect("a bar").rect;
        let [mut same, mut other] = [0.0; 2];
        let [width, height] = [bar.width(), bar.height()].map(|n| n as usize);
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let at = |x: usize, y: usize| f64::from(now[y * size[0] as usize + x][1]);
            let old = f64::from(before[y * POINTS[0] as usize + x][1]);
            let four = [(0, 0), (1, 0), (0, 1), (1, 1)];
            let mean = four
                .map(|(i, j)| at(2 * x + i, 2 * y + j))
                .iter()
                .sum::<f64>()
                / 4.0;
            same += (mean - old).abs();
            other += (at(x, y) - old).abs();
        }
        let [same, other] = [same, other].map(|sum| sum / (width * height) as f64);
        // Small letters have other edges than large ones.
        assert!(same < 0.5 * other, "{same}, {other}");
    }));
    // The pointer is where it was, and that is another place of the picture.
    asks(&mut steps, &server, rests, 2, true);
    asks(&mut steps, &server, [1100, 700], 2, false);
    // What winit says when a window manager moves it.
    let moved = Rc::clone(&server);
    steps.push_back(now("it is moved", move |_| {
        moved.tell_place(moved.window())
    }));
    steps.push_back(still("it stays so"));
    steps.push_back(step("as large", |_| Vec::new(), has_scale(&server, 2)));
    asks(&mut steps, &server, [1100, 700], 2, false);
    // A panel is closed by its own button.
    let place = kept::<Rect>();
    let (find, presses) = (Rc::clone(&place), Rc::clone(&server));
    steps.push_back(now("a panel", move |app| {
        let id = Id::new(("panel", "Inspector"));
        *find.borrow_mut() = app.egui().memory(|m| m.area_rect(id));
    }));
    steps.push_back(now("its button", move |_| {
        let rect = place.borrow().expect("a panel");
        let at: Pos2 = rect.right_top() + Vec2::new(-14.0, 15.0);
        presses.point(presses.window(), [2.0 * at.x, 2.0 * at.y].map(|n| n as i16));
    }));
    steps.extend(click(&server, [0; 2], true));
    steps.push_back(step(
        "it is closed",
        |_| Vec::new(),
        |app| !app.panels.inspector,
    ));

    let scales = Rc::clone(&server);
    let once = move |app: &mut App| {
        app.panels.inspector = false;
        scales.set_dpi(96);
        Vec::new()
    };
    steps.push_back(step("fewer pixels", once, has_scale(&server, 1)));
    let away = Rc::clone(&server);
    steps.push_back(now("nothing is pointed at", move |_| {
        away.point(away.root, [1200, 900]);
    }));
    let again = Rc::clone(&server);
    let is_same = move |_: &App| {
        let before = plain.borrow();
        before.as_ref() == Some(&again.picture(again.window()).1)
    };
    steps.push_back(step("the picture of before", |_| Vec::new(), is_same));
    asks(&mut steps, &server, rests, 1, false);
    steps.push_back(quits());
    walk_through(steps);
}
