//! Which part of the picture the window shows.

use egui::{Pos2, Rect, Vec2, pos2, vec2};

/// How near the picture is, and what is in the middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Zoom {
    /// 1 shows all of it, 2 the half across and down.
    pub scale: f32,
    /// What is in the middle, as a share of the picture from the left and from the top.
    middle: Vec2,
}

/// Nearest that one can go.
pub const MOST: f32 = 64.0;

impl Default for Zoom {
    fn default() -> Self {
        Self {
            scale: 1.0,
            middle: vec2(0.5, 0.5),
        }
    }
}

impl Zoom {
    /// The part that is shown, in shares of the picture.
    #[must_use]
    pub fn part(&self) -> Rect {
        Rect::from_center_size(self.middle.to_pos2(), Vec2::splat(1.0 / self.scale))
    }

    /// Goes nearer by a factor; what is under `at` stays there, which is in shares of the window.
    pub fn approach(&mut self, factor: f32, at: Vec2) {
        let scale = (self.scale * factor).clamp(1.0, MOST);
        let from_middle = at - vec2(0.5, 0.5);
        self.middle += from_middle / self.scale - from_middle / scale;
        self.scale = scale;
        self.stay_inside();
    }

    /// Moves the picture by a share of the window.
    pub fn shift(&mut self, by: Vec2) {
        self.middle -= by / self.scale;
        self.stay_inside();
    }

    fn stay_inside(&mut self) {
        let half = Vec2::splat(0.5 / self.scale);
        self.middle = self.middle.clamp(half, vec2(1.0, 1.0) - half);
    }

    /// The pixel of a picture of `size` pixels that a point of the window shows; `None` beside it.
    #[must_use]
    pub fn pixel(&self, at: Pos2, window: Rect, size: [u32; 2]) -> Option<[u32; 2]> {
        let on = self.at(at, window);
        let pixel = [on.x * size[0] as f32, on.y * size[1] as f32];
        let inside = window.contains(at) && pixel.iter().all(|&p| p >= 0.0);
        let pixel = pixel.map(|p| p as u32);
        (inside && pixel[0] < size[0] && pixel[1] < size[1]).then_some(pixel)
    }

    /// What of the picture a point of the window shows, in shares of it.
    #[must_use]
    pub fn at(&self, at: Pos2, window: Rect) -> Pos2 {
        let share = (at - window.min) / window.size();
        let part = self.part();
        part.min + share * part.size()
    }

    /// Where the window shows a point of the picture, in shares of it.
    #[must_use]
    pub fn place(&self, on: Pos2, window: Rect) -> Pos2 {
        let part = self.part();
        let share = (on - part.min) / part.size();
        pos2(
            window.left() + share.x * window.width(),
            window.top() + share.y * window.height(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_under_the_pointer_stays_there() {
        let window = Rect::from_min_size(pos2(0.0, 0.0), vec2(400.0, 200.0));
        let size = [800, 400];
        let at = pos2(300.0, 50.0);
        let mut zoom = Zoom::default();
        assert_eq!(zoom.pixel(at, window, size), Some([600, 100]));
        for _ in 0..4 {
            zoom.approach(2.0, vec2(300.0 / 400.0, 50.0 / 200.0));
            let [x, y] = zoom.pixel(at, window, size).expect("inside");
            assert!(x.abs_diff(600) <= 1 && y.abs_diff(100) <= 1, "{x} {y}");
        }
        assert_eq!(zoom.scale, 16.0);
        let on = pos2(600.5 / 800.0, 100.5 / 400.0);
        assert!((zoom.place(on, window) - at).length() < 10.0);
        zoom.approach(1e-9, vec2(0.1, 0.9));
        assert_eq!(
            zoom,
            Zoom::default(),
            "all of it again, and nothing beside it"
        );
        zoom.approach(1e9, vec2(0.5, 0.5));
        assert_eq!(zoom.scale, MOST);
        zoom.shift(vec2(1e6, -1e6));
        assert_eq!(zoom.part().min.x, 0.0);
        assert!((zoom.part().max.y - 1.0).abs() < 1e-6);
        assert_eq!(zoom.pixel(pos2(-1.0, 5.0), window, size), None);
    }
}
