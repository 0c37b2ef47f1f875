//! What a sky face shows.

use crate::material::TextureId;
use glam::Vec3;

/// Radiance seen through sky faces, by direction. A ray that hits nothing is black, not sky.
#[derive(Clone, Debug, Default)]
pub struct Sky {
    /// The kind of sky.
    pub kind: SkyKind,
    /// Radiance of a white texel.
    pub scale: f32,
}

/// Kinds of sky.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum SkyKind {
    /// The same radiance in every direction, linear RGB.
    Flat(Vec3),
    /// No sky.
    #[default]
    None,
    /// Quake's two scrolling layers; see [`scroll_uv`].
    Scrolling {
        /// Opaque back layer.
        back: TextureId,
        /// Front layer; alpha 0 shows the back.
        front: TextureId,
    },
}

/// Speed of the back layer in texels per second.
pub const BACK_SPEED: f64 = 8.0;
/// Speed of the front layer in texels per second.
pub const FRONT_SPEED: f64 = 16.0;

/// Texture coordinates of a sky layer, in texels of a 128-texel tile.
///
/// `direction` is the ray's direction (any length), `time` in seconds, `speed` in texels per second.
/// The sky is a flattened dome: `z` is tripled, the direction is scaled to length 378, and `x`, `y`
/// plus the scroll are the coordinates (Quake's `EmitSkyPolys`).
#[must_use]
pub fn scroll_uv(direction: [f64; 3], time: f64, speed: f64) -> [f64; 2] {
    let [x, y, z] = [direction[0], direction[1], direction[2] * 3.0];
    let k = 378.0 / (x * x + y * y + z * z).sqrt();
    [time * speed + x * k, time * speed + y * k]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_back_layer_matches_the_engine() {
        let [u, v] = scroll_uv([1.0, 1.0, 1.0], 0.0, BACK_SPEED);
        assert!((u / 128.0 - 0.8904).abs() < 1e-4 && (v / 128.0 - 0.8904).abs() < 1e-4);
        assert_eq!(scroll_uv([0.0, 0.0, 1.0], 0.0, BACK_SPEED), [0.0, 0.0]);
    }
}
