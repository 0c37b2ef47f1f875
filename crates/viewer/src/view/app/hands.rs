//! What a person does with keys and pointer, and where that takes the eye.

use super::{App, Wish};
use crate::view::fly::{Controls, Eye, Journey};
use crate::view::gamepad::Pad;
use crate::view::keys::Action;
use crate::view::stage::Loading;
use crate::view::walk::{Walker, Walls};

impl App {
    /// Does what keys and pointer ask for.
    pub(super) fn act(&mut self, ctx: &egui::Context, seconds: f32, wishes: &mut Vec<Wish>) {
        let typing = ctx.wants_keyboard_input();
        let bindings = self.bindings.clone();
        let pressed = |action| !typing && ctx.input(|i| i.key_pressed(bindings.key(action)));
        let held = |action| !typing && ctx.input(|i| i.key_down(bindings.key(action)));
        let axis = |plus, minus| f32::from(i8::from(held(plus)) - i8::from(held(minus)));
        let pad = self.gamepad.poll();
        let pad = if ctx.input(|i| i.focused) {
            pad
        } else {
            Pad::default()
        };
        let (sticks, turned) = pad.hands(seconds);
        let both = |keys: f32, stick: f32| (keys + stick).clamp(-1.0, 1.0);
        let controls = Controls {
            forward: both(axis(Action::Forward, Action::Back), sticks.forward),
            right: both(axis(Action::Right, Action::Left), sticks.right),
            up: both(axis(Action::Up, Action::Down), sticks.up),
            fast: ctx.input(|i| i.modifiers.shift),
        };
        let over_panel = ctx.wants_pointer_input() || ctx.is_pointer_over_area();
        let (look, wheel) = ctx.input(|i| {
            let drag = if over_panel || !i.pointer.any_down() || i.modifiers.command {
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
        let look = look + egui::Vec2::from(turned);
        if !over_panel {
            self.zoom(ctx);
            self.click(ctx);
        }
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
                if pressed(Action::Play) {
                    player.play_or_stop();
                }
                for (action, begins) in [(Action::MarkBegin, true), (Action::MarkEnd, false)] {
                    if pressed(action) {
                        player.mark_here(begins);
                    }
                }
            }
            None => {
                let written = self.watch.as_mut().is_some_and(|w| w.pass(seconds));
                if written && self.loading.is_none() {
                    self.reload();
                }
            }
        }
        self.eye = self.eye.turned([look.x, look.y]);
        let taken = moves || look != egui::Vec2::ZERO;
        // Whoever moves is no longer taken anywhere.
        let follows = self.player.as_ref().is_some_and(|p| p.follows);
        let journey = self.journey.take().filter(|_| !taken && !follows);
        match journey {
            Some(journey) => self.travel(journey, seconds),
            None => self.go(&controls, seconds),
        }
        self.pass_path(if still { 0.0 } else { seconds }, taken);

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

    /// Walks from where the eye is, or flies.
    pub fn set_walking(&mut self, walks: bool) {
        self.flight.stop();
        self.journey = None;
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
        self.journey = None;
        self.flight.stop();
        if self.walker.is_some() {
            self.walker = Some(Walker::at(&eye));
        }
    }

    /// Flies to a place by itself, unless somebody moves.
    pub(super) fn fly_to(&mut self, eye: Eye) {
        self.journey = Some(Journey::new(self.eye, eye));
    }

    fn travel(&mut self, mut journey: Journey, seconds: f32) {
        let (eye, there) = journey.pass(seconds);
        self.go_to(eye);
        self.journey = (!there).then_some(journey);
    }

    pub(super) fn go(&mut self, controls: &Controls, seconds: f32) {
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

    /// Goes nearer to the picture, or moves it, without moving the eye.
    fn zoom(&mut self, ctx: &egui::Context) {
        let window = ctx.viewport_rect();
        ctx.input(|i| {
            let factor = i.zoom_delta();
            if factor != 1.0
                && let Some(at) = i.pointer.latest_pos()
            {
                let share = (at - window.min) / window.size();
                self.looking.zoom.approach(factor, share);
            }
            if i.modifiers.command && i.pointer.any_down() {
                self.looking.zoom.shift(i.pointer.delta() / window.size());
            }
        });
    }

    /// A click on the picture asks what is there, where the panel for that is open, or makes it sharp.
    fn click(&mut self, ctx: &egui::Context) {
        if self.focus_by_click {
            ctx.set_cursor_icon(egui::CursorIcon::Crosshair);
        }
        let asks = self.panels.inspector && !self.panels.hidden || self.focus_by_click;
        let clicked = asks && ctx.input(|i| i.pointer.primary_clicked() && !i.modifiers.command);
        if let Some(at) = ctx.pointer_interact_pos().filter(|_| clicked) {
            let on = self.looking.zoom.at(at, ctx.viewport_rect());
            let at = [on.x, on.y].map(f64::from);
            if std::mem::take(&mut self.focus_by_click) {
                self.focus_on(at);
            } else {
                self.inspect(at);
            }
        }
    }
}
