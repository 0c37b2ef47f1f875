//! What a display shows of a film: the tone curve, and what the game does to the whole screen.
//!
//! Tints and the wobble under water are the game's, not light: they are in display images alone, and
//! EXRs note them.

use super::Style;
use crate::tonemap::display;
use rayon::prelude::*;
use scene::render::Film;

/// What the game does to the whole screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Screen {
    /// Colour and opacity over the picture, display values 0 to 1.
    pub tint: [f32; 4],
    /// How much of the picture is shown across and down, about its middle: 1 is all of it.
    pub shown: [f32; 2],
}

impl Default for Screen {
    fn default() -> Self {
        Self {
            tint: [0.0; 4],
            shown: [1.0; 2],
        }
    }
}

impl Screen {
    /// How much is shown under water at a time of the server's clock. The engine takes the tangents of
    /// its field of view times `0.97 + 0.03 sin 1.5 t` across and `1.03 - 0.03 sin 1.5 t` down; here
    /// both are divided by 1.06, so that nothing beyond the picture is asked for.
    #[must_use]
    pub fn under_water(clock: f64) -> [f32; 2] {
        const SWAY: f64 = 0.03;
        let sway = SWAY * (1.5 * clock).sin();
        [1.0 - SWAY + sway, 1.0 + SWAY - sway].map(|x| (x / (1.0 + 2.0 * SWAY)) as f32)
    }
}

/// The display codes of the film's picture, rows from the top.
#[must_use]
pub fn codes(film: &Film, style: &Style) -> Vec<[u8; 3]> {
    let shade = |radiance: &[f32; 3]| display(*radiance, style.exposure, style.tonemap);
    let Screen {
        tint: [r, g, b, opacity],
        shown,
    } = style.screen;
    let byte = |code: f32, over: f32| {
        let tinted = code + (over - code) * opacity;
        (tinted.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
    };
    let tinted = |c: [f32; 3]| [byte(c[0], r), byte(c[1], g), byte(c[2], b)];
    if shown == [1.0; 2] {
        return film
            .picture()
            .par_iter()
            .map(|p| tinted(shade(p)))
            .collect();
    }
    let plain: Vec<[f32; 3]> = film.picture().par_iter().map(shade).collect();
    let (width, height) = (film.width as usize, film.height as usize);
    let across = Weights::of(width, shown[0]);
    let down = Weights::of(height, shown[1]);
    let mut out = Vec::with_capacity(plain.len());
    for (y, below) in &down.0 {
        for (x, beside) in &across.0 {
            let at = |x: usize, y: usize| plain[y.min(height - 1) * width + x.min(width - 1)];
            let corners = [at(*x, *y), at(x + 1, *y), at(*x, y + 1), at(x + 1, y + 1)];
            let mixed = [0, 1, 2].map(|c| {
                let [a, b, d, e] = corners.map(|p| p[c]);
                let (top, bottom) = (a + (b - a) * beside, d + (e - d) * beside);
                top + (bottom - top) * below
            });
            out.push(tinted(mixed));
        }
    }
    out
}

/// For each pixel of a row the pixel that it begins at, and the share of the next one.
struct Weights(Vec<(usize, f32)>);

impl Weights {
    /// Of `count` pixels the middle `shown`.
    fn of(count: usize, shown: f32) -> Self {
        let middle = (count as f32 - 1.0) / 2.0;
        let weight = |i| {
            let at = (middle + (i as f32 - middle) * shown).clamp(0.0, count as f32 - 1.0);
            (at as usize, at.fract())
        };
        Self((0..count).map(weight).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tonemap::Tonemap;

    fn film() -> Film {
        Film {
            width: 5,
            height: 3,
            beauty: (0..15).map(|i| [i as f32 / 15.0, 0.5, 0.0]).collect(),
            ..Film::default()
        }
    }

    fn shown(screen: Screen) -> Vec<[u8; 3]> {
        let style = Style {
            tonemap: Tonemap::Clip,
            screen,
            ..Style::default()
        };
        codes(&film(), &style)
    }

    #[test]
    fn a_screen_without_effects_is_the_tone_mapped_picture() {
        let plain: Vec<[u8; 3]> = (film().beauty.iter())
            .map(|p| crate::tonemap::display_u8(*p, 0.0, Tonemap::Clip))
            .collect();
        assert_eq!(shown(Screen::default()), plain);
    }

    #[test]
    fn tints_lie_over_the_codes() {
        let half = Screen {
            tint: [1.0, 0.0, 0.0, 0.5],
            ..Screen::default()
        };
        for (plain, tinted) in shown(Screen::default()).iter().zip(shown(half)) {
            let mean = |c: u8, over: f32| ((f32::from(c) + 255.0 * over) / 2.0 + 0.5) as i32;
            for (c, over) in [1.0, 0.0, 0.0].into_iter().enumerate() {
                assert!((i32::from(tinted[c]) - mean(plain[c], over)).abs() <= 1);
            }
        }
    }

    #[test]
    fn the_wobble_keeps_the_middle_and_asks_for_nothing_outside() {
        for clock in [0.0, 1.0, 3.2, 100.7] {
            let parts = Screen::under_water(clock);
            assert!(parts.iter().all(|p| (0.88..=1.0).contains(p)), "{parts:?}");
            let all = shown(Screen {
                shown: parts,
                ..Screen::default()
            });
            let plain = shown(Screen::default());
            assert_eq!(all[7], plain[7]);
            assert!(all[0][0] > plain[0][0] && all[14][0] < plain[14][0]);
        }
    }
}
