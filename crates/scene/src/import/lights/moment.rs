//! How bright light styles are at a moment, and which of them are told apart.

use crate::import::ImportOptions;
use crate::import::notes::Notes;
use crate::light::{LightStyle, MAX_STYLES, PointLight};
use bsp::Level;
use bsp::styles::{Blend, LightStyles};

/// A moment of a level's time.
pub struct Moment<'a> {
    styles: &'a LightStyles,
    /// Brightnesses that were asked for, whatever the level says.
    set: &'a [(u16, f32)],
    time: f64,
    apart: bool,
    frames: bool,
}

impl<'a> Moment<'a> {
    /// The moment of an import.
    pub fn of(level: &'a Level, options: &'a ImportOptions) -> Self {
        Self {
            styles: &level.styles,
            set: &options.style_brightness,
            time: f64::from(options.time),
            apart: options.styles_apart,
            frames: options.frames,
        }
    }

    /// Whether lights of a style lack its brightness: they shine in a layer of their own, or frames
    /// say how bright they are.
    pub fn is_apart(&self, style: u16) -> bool {
        self.apart && style != 0 || self.frames
    }

    /// Whether frames say how bright styles are.
    pub fn is_of_frames(&self) -> bool {
        self.frames
    }

    /// Whether a brightness of the style was asked for.
    pub fn is_set(&self, style: u16) -> bool {
        self.set.iter().any(|&(s, _)| s == style)
    }

    /// What lights of a style are multiplied with.
    pub fn brightness(&self, style: u16) -> f32 {
        if self.is_apart(style) {
            1.0
        } else {
            self.now(style)
        }
    }

    /// Brightness of the styles by number, if frames say how bright they are: of all that the engine
    /// has and `lights` use.
    pub fn table(&self, lights: &[PointLight]) -> Vec<f32> {
        /// Styles of the engine.
        const STYLES: u16 = 64;
        if !self.frames {
            return Vec::new();
        }
        let used = lights.iter().map(|l| l.style.saturating_add(1)).max();
        let count = used.unwrap_or(0).max(STYLES);
        (0..count).map(|style| self.now(style)).collect()
    }

    /// Brightness of a style at the moment: the one asked for, or the level's.
    pub fn now(&self, style: u16) -> f32 {
        let set = self.set.iter().rev().find(|&&(s, _)| s == style);
        set.map_or_else(
            || self.styles.brightness(style, self.time, Blend::Step),
            |&(_, brightness)| brightness,
        )
    }

    /// The styles of `lights` that a film tells apart, the steady one first; empty if it does not.
    /// Lights of styles beyond the limit become steady.
    pub fn told_apart(&self, lights: &mut Vec<PointLight>, notes: &mut Notes) -> Vec<LightStyle> {
        if !self.apart {
            return Vec::new();
        }
        let mut numbers: Vec<u16> = lights.iter().map(|l| l.style).collect();
        numbers.push(0);
        numbers.sort_unstable();
        numbers.dedup();
        if numbers.len() > MAX_STYLES {
            notes.add("too many styles", || {
                format!(
                    "lights have {} light styles: {MAX_STYLES} are told apart, the others are part \
                     of style 0",
                    numbers.len()
                )
            });
            numbers.truncate(MAX_STYLES);
            for light in lights.iter_mut() {
                if !numbers.contains(&light.style) {
                    light.intensity *= self.now(light.style);
                    light.style = 0;
                }
            }
            lights.retain(|l| l.intensity.abs().max_element() > 0.0);
        }
        (numbers.into_iter())
            .map(|number| LightStyle {
                number,
                brightness: if number == 0 { 1.0 } else { self.now(number) },
            })
            .collect()
    }
}
