//! Sprites as quads that turn to the viewer.

use crate::camera::Camera;
use crate::material::MaterialId;
use crate::mesh::{Mesh, Triangle};
use bsp::spr::{ANGLES, Spr, SprPicture, SpriteType, Times};
use glam::{Affine3A, Mat3A, Vec3};

/// Cosine beyond which a viewer looks straight along a sprite that stays upright: it has no width then.
const ALONG: f32 = 0.999_848;

/// A sprite: a quad for each of its pictures.
#[derive(Clone, Debug)]
pub struct SpriteModel {
    /// How it turns.
    pub kind: SpriteType,
    /// Quads of all pictures in order of the frames, in a plane that [`placement`] places: x to the
    /// right, y up, z to the viewer. Pictures without texels have quads without triangles.
    pub quads: Vec<Mesh>,
    /// At least one.
    pub frames: Vec<SpriteFrame>,
    /// Whether its groups begin at another time for each entity.
    pub random_start: bool,
}

/// The pictures of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct SpriteFrame {
    /// Index into [`SpriteModel::quads`].
    pub first: usize,
    /// Which one is shown.
    pub times: Times,
}

impl SpriteModel {
    /// The sprite called `name`. `paint` gives the material of a picture: its number, and itself.
    #[must_use]
    pub fn new(
        name: &str,
        sprite: &Spr,
        mut paint: impl FnMut(usize, &SprPicture) -> MaterialId,
    ) -> Self {
        let mut frames = Vec::with_capacity(sprite.frames.len());
        let mut quads = Vec::with_capacity(sprite.picture_count());
        for frame in &sprite.frames {
            frames.push(SpriteFrame {
                first: quads.len(),
                times: frame.times.clone(),
            });
            for picture in &frame.pictures {
                let number = quads.len();
                quads.push(if picture.pixels.is_empty() {
                    Mesh::default()
                } else {
                    quad(name, picture, paint(number, picture))
                });
            }
        }
        Self {
            kind: sprite.header.sprite_type,
            quads,
            frames,
            random_start: sprite.header.sync_type != 0,
        }
    }

    /// Number of the quad that a frame shows at `time` (seconds) to a viewer who sees its entity from
    /// `direction_deg`: degrees that the way from it to the viewer is left of where it faces. Frames that
    /// do not exist are the first.
    #[must_use]
    pub fn quad(&self, frame: usize, time: f64, direction_deg: f32) -> usize {
        let Some(frame) = self.frames.get(frame).or(self.frames.first()) else {
            return 0;
        };
        let part = match &frame.times {
            Times::Single => 0,
            Times::Group(cycle) => cycle.at(time).0,
            Times::Angled => direction_of(direction_deg),
        };
        frame.first + part
    }
}

fn quad(name: &str, picture: &SprPicture, material: MaterialId) -> Mesh {
    let [left, top] = picture.origin.map(|o| o as f32);
    let (w, h) = (picture.width as f32, picture.height as f32);
    let corner = |x: f32, y: f32| Vec3::new(left + x, top - y, 0.0);
    let triangle = |vertices: [u32; 3], uv: [[f32; 2]; 3]| Triangle {
        vertices,
        uv,
        normal: Vec3::Z,
        material,
        face: 0,
    };
    Mesh {
        name: name.to_owned(),
        positions: vec![
            corner(0.0, h),
            corner(w, h),
            corner(w, 0.0),
            corner(0.0, 0.0),
        ],
        triangles: vec![
            triangle([0, 1, 2], [[0.0, h], [w, h], [w, 0.0]]),
            triangle([0, 2, 3], [[0.0, h], [w, 0.0], [0.0, 0.0]]),
        ],
        // Its holes are tested.
        first_see_through: 0,
        ..Mesh::default()
    }
}

/// Where a sprite is and how its entity lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stance {
    /// How it turns.
    pub kind: SpriteType,
    /// The entity's origin, world space.
    pub origin: Vec3,
    /// The entity's pitch, yaw and roll, degrees.
    pub angles_deg: [f32; 3],
    /// Units of the world per unit of the sprite.
    pub scale: f32,
}

/// A sprite of a scene that does not move.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedSprite {
    /// Index into `Scene::instances`.
    pub instance: usize,
    /// Where it is.
    pub stance: Stance,
    /// Meshes that it shows by direction, as [`SpriteModel::quad`] numbers them: one, or eight.
    pub meshes: Vec<usize>,
}

/// Turns a sprite to a camera: from the plane of its quads to the world. Upright sprites that are looked
/// at straight along their height lie in the view plane; engines show nothing then.
#[must_use]
pub fn placement(stance: &Stance, camera: &Camera) -> Affine3A {
    let view = axes([camera.pitch_deg, camera.yaw_deg, camera.roll_deg]);
    let upright = |forward: Vec3| {
        if forward.z.abs() > ALONG {
            return [view[1], view[2]];
        }
        let right = Vec3::new(forward.y, -forward.x, 0.0).normalize();
        [right, Vec3::Z]
    };
    let [right, up] = match stance.kind {
        SpriteType::ParallelUpright => upright(view[0]),
        SpriteType::FacingUpright => {
            upright((stance.origin - camera.position).normalize_or(Vec3::Z))
        }
        SpriteType::Parallel => [view[1], view[2]],
        SpriteType::Oriented => {
            let [_, right, up] = axes(stance.angles_deg);
            [right, up]
        }
        SpriteType::ParallelOriented => {
            let (sin, cos) = stance.angles_deg[2].to_radians().sin_cos();
            [view[1] * cos + view[2] * sin, view[2] * cos - view[1] * sin]
        }
    };
    let matrix = Mat3A::from_cols(right.into(), up.into(), right.cross(up).into());
    Affine3A {
        matrix3: matrix * stance.scale,
        translation: stance.origin.into(),
    }
}

/// Which of eight pictures shows a sprite from a direction in degrees.
#[must_use]
pub fn direction_of(direction_deg: f32) -> usize {
    let step = 360.0 / ANGLES as f32;
    let turned = (direction_deg + step / 2.0).rem_euclid(360.0);
    ((turned / step) as usize).min(ANGLES - 1)
}

/// Degrees that the way from a sprite to a camera is left of where its entity faces.
#[must_use]
pub fn direction_deg(stance: &Stance, camera: &Camera) -> f32 {
    let way = camera.position - stance.origin;
    way.y.atan2(way.x).to_degrees() - stance.angles_deg[1]
}

/// Forward, right and up of pitch, yaw and roll in degrees, as a camera's.
fn axes([pitch_deg, yaw_deg, roll_deg]: [f32; 3]) -> [Vec3; 3] {
    let camera = Camera {
        name: String::new(),
        position: Vec3::ZERO,
        pitch_deg,
        yaw_deg,
        roll_deg,
        fov_deg: crate::camera::DEFAULT_FOV_DEG,
        lens: None,
    };
    let basis = camera.view_basis(1, 1);
    [basis.forward, basis.right, basis.up].map(|a| a.normalize().as_vec3())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(position: Vec3, [pitch_deg, yaw_deg, roll_deg]: [f32; 3]) -> Camera {
        Camera {
            name: String::new(),
            position,
            pitch_deg,
            yaw_deg,
            roll_deg,
            fov_deg: 90.0,
            lens: None,
        }
    }

    fn stance(kind: SpriteType, angles_deg: [f32; 3]) -> Stance {
        Stance {
            kind,
            origin: Vec3::new(10.0, 20.0, 30.0),
            angles_deg,
            scale: 2.0,
        }
    }

    /// To the right, up, and to the viewer.
    fn turned(kind: SpriteType, angles: [f32; 3], camera: &Camera) -> [Vec3; 3] {
        let stance = stance(kind, angles);
        let place = placement(&stance, camera);
        assert_eq!(Vec3::from(place.translation), stance.origin);
        let m = place.matrix3;
        [m.x_axis, m.y_axis, m.z_axis].map(|a| Vec3::from(a) / 2.0)
    }

    #[test]
    fn sprites_turn_as_their_kind_says() {
        use SpriteType::*;
        let near = |a: [Vec3; 3], b: [Vec3; 3]| {
            for (a, b) in a.into_iter().zip(b) {
                assert!((a - b).length() < 1e-5, "{a} {b}");
            }
        };
        // Looks along +Y from the side, head to the right.
        let tilted = camera(Vec3::new(0.0, 20.0, 30.0), [0.0, 90.0, 90.0]);
        let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
        near(turned(ParallelUpright, [5.0; 3], &tilted), [x, z, -y]);
        near(turned(FacingUpright, [5.0; 3], &tilted), [-y, z, -x]);
        near(turned(Parallel, [5.0; 3], &tilted), [-z, x, -y]);
        near(turned(Oriented, [0.0, 180.0, 0.0], &tilted), [y, z, x]);
        near(
            turned(ParallelOriented, [0.0, 0.0, 90.0], &tilted),
            [x, z, -y],
        );
        let down = camera(Vec3::new(10.0, 20.0, 90.0), [90.0, 0.0, 0.0]);
        near(turned(ParallelUpright, [0.0; 3], &down), [-y, x, z]);
        near(turned(FacingUpright, [0.0; 3], &down), [-y, x, z]);
        near(turned(Parallel, [0.0; 3], &down), [-y, x, z]);
    }

    #[test]
    fn quads_lie_where_the_file_says_and_face_the_viewer() {
        let picture = SprPicture {
            origin: [-28, 28],
            width: 56,
            height: 56,
            pixels: vec![0; 56 * 56],
        };
        let quad = quad("x", &picture, MaterialId(0));
        assert_eq!(quad.positions[0], Vec3::new(-28.0, -28.0, 0.0));
        assert_eq!(quad.positions[2], Vec3::new(28.0, 28.0, 0.0));
        for t in &quad.triangles {
            let [a, b, c] = t.vertices.map(|v| quad.positions[v as usize]);
            assert_eq!((b - a).cross(c - a).normalize(), Vec3::Z);
            // Texture coordinates grow to the right and downwards.
            for (v, [s, t]) in t.vertices.into_iter().zip(t.uv) {
                let p = quad.positions[v as usize];
                assert_eq!([p.x + 28.0, 28.0 - p.y], [s, t]);
            }
        }
    }

    #[test]
    fn sprites_by_direction_show_one_of_eight() {
        let sprite = SpriteModel {
            kind: SpriteType::Parallel,
            quads: vec![Mesh::default(); 8],
            frames: vec![SpriteFrame {
                first: 0,
                times: Times::Angled,
            }],
            random_start: false,
        };
        for (direction, quad) in [
            (0.0, 0),
            (22.0, 0),
            (23.0, 1),
            (180.0, 4),
            (-30.0, 7),
            (359.0, 0),
        ] {
            assert_eq!(sprite.quad(0, 0.0, direction), quad, "{direction}");
        }
        let facing_east = stance(SpriteType::Parallel, [0.0, 90.0, 0.0]);
        let from = camera(facing_east.origin - Vec3::X, [0.0; 3]);
        assert_eq!(direction_deg(&facing_east, &from), 90.0);
    }
}
