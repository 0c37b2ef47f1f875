//! How often pictures are shown, and how bright.

use rt::{Pace, Screen};
use scene::render::Film;
use std::time::{Duration, Instant};

/// How often frames are shown.
#[derive(Clone, Debug, PartialEq)]
pub struct Display {
    /// With the display, or at once.
    pub pace: Pace,
    /// Frames per second at most; without one as many as there can be.
    pub most_fps: Option<f64>,
    /// What the window knows; nothing off-screen.
    pub paces: Vec<Pace>,
}

impl Default for Display {
    fn default() -> Self {
        Self {
            pace: Pace::Vsync,
            most_fps: None,
            paces: Vec::new(),
        }
    }
}

/// A pace with the name it has in the settings file, and a hint.
pub const PACES: [(Pace, &str, &str); 3] = [
    (
        Pace::Vsync,
        "vsync",
        "every picture in turn, with the display",
    ),
    (
        Pace::Mailbox,
        "mailbox",
        "with the display, always the newest picture: more frames are made than shown",
    ),
    (Pace::Immediate, "immediate", "at once, with tearing"),
];

impl Display {
    /// Tells the screen, and learns what it knows.
    pub fn apply(&mut self, screen: &mut Screen) {
        if self.paces != screen.paces() {
            self.paces = screen.paces().to_vec();
        }
        // Every window knows vsync.
        let known = self.paces.contains(&self.pace);
        screen.set_pace(if known { self.pace } else { Pace::Vsync });
    }

    /// Seconds to wait after a frame that began at a time, so that there are not too many.
    #[must_use]
    pub fn wait(&self, begun: Instant) -> f32 {
        let least = self.most_fps.map_or(0.0, |fps| 1.0 / fps.max(1.0));
        (least as f32 - begun.elapsed().as_secs_f32()).max(0.0)
    }
}

/// Radiance that a picture's middle has on display: 18 % grey.
const GREY: f64 = 0.18;
/// Stops that are set by themselves, at most.
const MOST: f64 = 10.0;
/// Seconds in which two thirds of a change are made.
const ADAPTS_IN: f64 = 0.4;
/// Time between two looks at the picture.
const EVERY: Duration = Duration::from_millis(300);

/// The stops at which a picture's middle is grey: the mean of its pixels' logarithms, but for the darkest
/// tenth and the brightest fiftieth, which are corners and lamps. `None` of black pictures.
#[must_use]
pub fn stops_for(film: &Film) -> Option<f64> {
    let luminance = |c: &[f32; 3]| {
        0.2126 * f64::from(c[0]) + 0.7152 * f64::from(c[1]) + 0.0722 * f64::from(c[2])
    };
    let mut logs: Vec<f64> = (film.beauty.iter())
        .map(luminance)
        .filter(|l| *l > 1e-9 && l.is_finite())
        .map(f64::log2)
        .collect();
    // A picture that is nearly all black says nothing of what is lit.
    if logs.len() < film.beauty.len() / 50 + 1 {
        return None;
    }
    logs.sort_by(f64::total_cmp);
    let (dark, bright) = (logs.len() / 10, logs.len() - logs.len() / 50);
    let middle = &logs[dark..bright.max(dark + 1)];
    let mean = middle.iter().sum::<f64>() / middle.len() as f64;
    Some((GREY.log2() - mean).clamp(-MOST, MOST))
}

/// Exposure that follows the picture.
#[derive(Debug, Default)]
pub struct AutoExposure {
    /// Whether it does.
    pub on: bool,
    target: Option<f64>,
    looked: Option<Instant>,
}

impl AutoExposure {
    /// Whether it wants to see the picture now.
    #[must_use]
    pub fn is_due(&self) -> bool {
        self.on && self.looked.is_none_or(|at| at.elapsed() > EVERY)
    }

    /// Sees the picture.
    pub fn look(&mut self, film: &Film) {
        self.looked = Some(Instant::now());
        self.target = stops_for(film).or(self.target);
    }

    /// Time passes: the exposure goes where it belongs.
    pub fn pass(&mut self, seconds: f32, exposure: &mut f64) {
        let Some(target) = self.target.filter(|_| self.on) else {
            return;
        };
        let rest = target - *exposure;
        // Less than anybody sees: it stands, so that the picture is done.
        if rest.abs() < 0.02 {
            self.target = None;
            return;
        }
        *exposure += rest * (1.0 - (-f64::from(seconds) / ADAPTS_IN).exp());
        // A number that a command line can say.
        *exposure = (*exposure * 1000.0).round() / 1000.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn film(values: &[f32]) -> Film {
        Film {
            width: values.len() as u32,
            height: 1,
            samples: 1,
            beauty: values.iter().map(|&v| [v; 3]).collect(),
            ..Film::default()
        }
    }

    #[test]
    fn a_picture_of_one_brightness_becomes_grey() {
        let stops = |values: &[f32]| stops_for(&film(values));
        assert!(stops(&[0.18; 100]).unwrap().abs() < 1e-5);
        assert!((stops(&[0.045; 100]).unwrap() - 2.0).abs() < 1e-5);
        // A lamp and a black corner change nothing.
        let mut values = vec![0.045; 100];
        (values[0], values[1]) = (1e4, 0.0);
        assert!((stops(&values).unwrap() - 2.0).abs() < 1e-3);
        assert_eq!(stops(&[0.0; 100]), None);
        assert_eq!(stops(&[f32::NAN; 100]), None);
        assert_eq!(stops(&[1e-8; 100]), Some(MOST));
    }

    #[test]
    fn exposure_follows_and_comes_to_rest() {
        let mut auto = AutoExposure {
            on: true,
            ..AutoExposure::default()
        };
        assert!(auto.is_due());
        auto.look(&film(&[0.045; 10]));
        assert!(!auto.is_due());
        let mut exposure = 0.0;
        let mut before = -1.0;
        for _ in 0..100 {
            auto.pass(0.05, &mut exposure);
            assert!(exposure >= before && exposure <= 2.0);
            before = exposure;
        }
        assert!((exposure - 2.0).abs() < 0.03, "{exposure}");
        auto.on = false;
        exposure = 5.0;
        auto.pass(1.0, &mut exposure);
        assert_eq!(exposure, 5.0);
    }

    #[test]
    fn frames_wait_for_their_turn() {
        let mut display = Display::default();
        assert_eq!(display.wait(Instant::now()), 0.0);
        display.most_fps = Some(10.0);
        let wait = display.wait(Instant::now());
        assert!(wait > 0.05 && wait <= 0.1, "{wait}");
    }
}
