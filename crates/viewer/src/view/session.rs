//! The viewer without a window: the same frames, drawn off-screen, with hands that are told what to do.
//! Tests and the pictures of the manual are made with it.

use super::app::{App, Input, Output, Wish};
use anyhow::{Result, bail};
use egui::{Event, Key, Modifiers, Pos2, Rect, Vec2};
use rt::Screen;
use std::time::{Duration, Instant};

/// A viewer off-screen.
pub struct Session {
    /// The viewer.
    pub app: App,
    screen: Screen,
    size: [u32; 2],
    /// Pixels per point.
    scale: f32,
    seconds: f64,
    events: Vec<Event>,
    held: Modifiers,
    clipboard: String,
    wishes: Vec<Wish>,
}

/// Seconds that a frame stands for: what is done off-screen does not depend on the clock.
const FRAME: f32 = 1.0 / 30.0;

impl Session {
    /// Shows a viewer off-screen, `size` pixels large and `scale` pixels to a point.
    ///
    /// # Errors
    /// When the device can't draw.
    pub fn new(app: App, size: [u32; 2], scale: f32) -> Result<Self> {
        Ok(Self {
            screen: Screen::off_screen(&app.gpu, size)?,
            app,
            size,
            scale,
            seconds: 0.0,
            events: Vec::new(),
            held: Modifiers::default(),
            clipboard: String::new(),
            wishes: Vec::new(),
        })
    }

    /// One frame.
    ///
    /// # Errors
    /// When the device fails.
    pub fn frame(&mut self) -> Result<Output> {
        self.seconds += f64::from(FRAME);
        let scale = self.scale * self.app.egui().zoom_factor();
        let size = Vec2::new(self.size[0] as f32, self.size[1] as f32) / scale;
        let mut raw = egui::RawInput {
            screen_rect: Some(Rect::from_min_size(Pos2::ZERO, size)),
            time: Some(self.seconds),
            modifiers: self.held,
            events: std::mem::take(&mut self.events),
            ..egui::RawInput::default()
        };
        if let Some(viewport) = raw.viewports.get_mut(&egui::ViewportId::ROOT) {
            viewport.native_pixels_per_point = Some(self.scale);
        }
        let input = Input {
            raw,
            seconds: FRAME,
        };
        let output = self.app.frame(&mut self.screen, input)?;
        for command in &output.platform.commands {
            if let egui::OutputCommand::CopyText(text) = command {
                self.clipboard.clone_from(text);
            }
        }
        self.wishes.extend(output.wishes.iter().cloned());
        Ok(output)
    }

    /// So many frames.
    ///
    /// # Errors
    /// When the device fails.
    pub fn frames(&mut self, count: u32) -> Result<()> {
        (0..count).try_for_each(|_| self.frame().map(drop))
    }

    /// Frames until `done`.
    ///
    /// # Errors
    /// When the device fails, or after `limit`.
    pub fn until(&mut self, limit: Duration, done: impl Fn(&App) -> bool) -> Result<()> {
        let start = Instant::now();
        loop {
            self.frame()?;
            if done(&self.app) {
                return Ok(());
            }
            if start.elapsed() > limit {
                bail!("not done after {} s", limit.as_secs());
            }
        }
    }

    /// Takes another size, in pixels.
    ///
    /// # Errors
    /// When there is no memory.
    pub fn resize(&mut self, size: [u32; 2]) -> Result<()> {
        self.size = size;
        Ok(self.screen.resize(size)?)
    }

    /// Has so many pixels to a point from now on, as on another display.
    pub fn rescale(&mut self, scale: f32) {
        self.scale = scale;
    }

    /// Something happens before the next frame.
    pub fn event(&mut self, event: Event) {
        self.events.push(event);
    }

    /// A key goes down or up.
    pub fn key(&mut self, key: Key, pressed: bool) {
        self.event(Event::Key {
            key,
            physical_key: None,
            pressed,
            repeat: false,
            modifiers: self.held,
        });
    }

    /// A key is pressed for one frame.
    ///
    /// # Errors
    /// When the device fails.
    pub fn tap(&mut self, key: Key) -> Result<()> {
        self.key(key, true);
        self.frame()?;
        self.key(key, false);
        self.frame().map(drop)
    }

    /// The pointer is pressed at one place, in points, and let go at another.
    ///
    /// # Errors
    /// When the device fails.
    pub fn drag(&mut self, from: Pos2, to: Pos2) -> Result<()> {
        let button = |pos, pressed| Event::PointerButton {
            pos,
            button: egui::PointerButton::Primary,
            pressed,
            modifiers: Modifiers::default(),
        };
        self.event(Event::PointerMoved(from));
        self.frame()?;
        self.event(button(from, true));
        self.frame()?;
        self.event(Event::PointerMoved(to));
        self.frame()?;
        self.event(button(to, false));
        self.frame()?;
        self.event(Event::PointerGone);
        self.frame().map(drop)
    }

    /// What was copied last.
    #[must_use]
    pub fn clipboard(&self) -> &str {
        &self.clipboard
    }

    /// What was asked of the window so far.
    #[must_use]
    pub fn wishes(&self) -> &[Wish] {
        &self.wishes
    }

    /// The last frame: size, and red, green, blue of each pixel, rows from the top.
    ///
    /// # Errors
    /// When the device fails, or there was none.
    pub fn picture(&mut self) -> Result<([u32; 2], Vec<[u8; 3]>)> {
        match self.screen.read()? {
            Some((size, pixels)) => {
                Ok((size, pixels.iter().map(|&[r, g, b, _]| [r, g, b]).collect()))
            }
            None => bail!("no frame was drawn yet"),
        }
    }
}
