//! Where the picture is taken from.

use glam::{DMat3, DVec2, DVec3, Vec3};

/// A camera: a pinhole, or a thin lens.
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
    /// The lens; without one everything is sharp.
    pub lens: Option<Lens>,
}

/// A thin lens around the eye, across the view direction: what lies in the plane of focus is sharp.
///
/// A point at the depth d along the view direction blurs into an even disc. Where the picture of a
/// pinhole is at the depth 1, its radius is `radius * |1 / focus - 1 / d|`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Radius in world units, > 0.
    pub radius: f32,
    /// Distance of the plane of focus along the view direction, world units, > 0.
    pub focus: f32,
}

impl Lens {
    /// A lens, or none where its radius is 0.
    #[must_use]
    pub fn new(radius: f32, focus: f32) -> Option<Self> {
        (radius > 0.0).then_some(Self { radius, focus })
    }

    /// Whether both numbers are finite and above 0.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        [self.radius, self.focus]
            .iter()
            .all(|x| x.is_finite() && *x > 0.0)
    }
}

/// The engine's default field of view.
pub const DEFAULT_FOV_DEG: f32 = 90.0;

/// A camera prepared for rays: the direction through a point of the image plane is
/// `forward + x * right + y * up` with `x`, `y` in -1..=1 (`y` upwards), not normalised. From a point
/// `o` off the middle of a lens it is that less `o / focus`.
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
    /// The camera's lens.
    pub lens: Option<Lens>,
}

impl ViewBasis {
    /// Where a pinhole at the eye shows what lies in a direction, as `x` and `y` of the image plane;
    /// `None` behind the eye.
    #[must_use]
    pub fn project(&self, direction: DVec3) -> Option<DVec2> {
        let depth = direction.dot(self.forward);
        let on = |axis: DVec3| direction.dot(axis) / (axis.length_squared() * depth);
        (depth > 0.0).then(|| DVec2::new(on(self.right), on(self.up)))
    }
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
            lens: self.lens,
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
            lens: None,
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
