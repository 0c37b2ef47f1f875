//! Where the picture is taken from.

use glam::{DMat3, DVec3, Vec3};

/// A pinhole camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// For people: `info_player_start`, `info_intermission`, `--camera`.
    pub name: String,
    /// Eye, world space.
    pub position: Vec3,
    /// Degrees; positive looks down, as the engine's `viewpos` prints it.
    pub pitch_deg: f32,
    /// Degrees about +Z; 0 looks along +X, 90 along +Y.
    pub yaw_deg: f32,
    /// Degrees about the view direction; positive tilts the head to the right.
    pub roll_deg: f32,
    /// Horizontal field of view at an aspect ratio of 4:3, in degrees (Hor+: the vertical field
    /// stays the same at any other aspect).
    pub fov_deg: f32,
}

/// The engine's default field of view.
pub const DEFAULT_FOV_DEG: f32 = 90.0;

/// A camera prepared for rays: the direction through a point of the image plane is
/// `forward + x * right + y * up` with `x`, `y` in -1..=1 (`y` upwards), not normalised.
#[derive(Clone, Copy, Debug)]
pub struct ViewBasis {
    /// Eye, world space.
    pub origin: DVec3,
    /// Unit view direction.
    pub forward: DVec3,
    /// To the right, scaled by the tangent of half the horizontal field of view.
    pub right: DVec3,
    /// Upwards, scaled by the tangent of half the vertical field of view.
    pub up: DVec3,
}

impl Camera {
    /// Prepares the camera for an image of `width` by `height` pixels.
    ///
    /// Axes are Quake's `AngleVectors`.
    #[must_use]
    pub fn view_basis(&self, width: u32, height: u32) -> ViewBasis {
        let [pitch, yaw, roll] =
            [self.pitch_deg, self.yaw_deg, self.roll_deg].map(|a| f64::from(a).to_radians());
        let axes = DMat3::from_rotation_z(yaw)
            * DMat3::from_rotation_y(pitch)
            * DMat3::from_rotation_x(roll);
        let tan_y = (f64::from(self.fov_deg).to_radians() / 2.0).tan() * 0.75;
        let tan_x = tan_y * f64::from(width) / f64::from(height);
        ViewBasis {
            origin: self.position.as_dvec3(),
            forward: axes * DVec3::X,
            right: axes * DVec3::NEG_Y * tan_x,
            up: axes * DVec3::Z * tan_y,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(pitch_deg: f32, yaw_deg: f32, roll_deg: f32) -> Camera {
        Camera {
            name: String::new(),
            position: Vec3::ZERO,
            pitch_deg,
            yaw_deg,
            roll_deg,
            fov_deg: DEFAULT_FOV_DEG,
        }
    }

    #[test]
    fn angles_mean_what_the_engine_means() {
        let near = |a: DVec3, b: DVec3| (a.normalize() - b).length() < 1e-6;
        assert!(near(
            camera(0.0, 90.0, 0.0).view_basis(4, 3).forward,
            DVec3::Y
        ));
        assert!(near(
            camera(90.0, 0.0, 0.0).view_basis(4, 3).forward,
            DVec3::NEG_Z
        ));
        assert!(near(
            camera(0.0, 0.0, 0.0).view_basis(4, 3).right,
            DVec3::NEG_Y
        ));
        // Rolled to the right by 90 degrees, the top of the head points to the right.
        assert!(near(
            camera(0.0, 0.0, 90.0).view_basis(4, 3).up,
            DVec3::NEG_Y
        ));
    }

    #[test]
    fn the_vertical_field_stays_when_the_picture_grows_wider() {
        let narrow = camera(0.0, 0.0, 0.0).view_basis(640, 480);
        let wide = camera(0.0, 0.0, 0.0).view_basis(1280, 720);
        assert!((narrow.right.length() - 1.0).abs() < 1e-6);
        assert!((narrow.up.length() - wide.up.length()).abs() < 1e-12);
        assert!((wide.right.length() / wide.up.length() - 16.0 / 9.0).abs() < 1e-6);
    }
}
