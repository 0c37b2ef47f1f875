//! Where what is seen was in the picture before.

use crate::world::{SurfacePoint, World};
use glam::{DMat3, DVec2, DVec3, Vec3};
use scene::camera::ViewBasis;
use scene::frame::{Before, Past};
use scene::{Frame, Surface, Triangle};

/// Farthest from the middle of the picture before that a point is said to have been, in halves of the
/// picture: what was beside the eye has no place, and would spoil means.
const REACH: DVec2 = DVec2::splat(8.0);

/// Two pictures, one after the other.
#[derive(Debug)]
pub(crate) struct Seen {
    now: ViewBasis,
    then: ViewBasis,
    /// By instance of the frame, where it was if it moved.
    instances: Vec<Option<Past>>,
    /// By loose triangle, where its corners were; empty if all stood still.
    loose: Vec<[Vec3; 3]>,
}

impl Seen {
    /// What a frame says of the picture before, seen as pictures of this size.
    pub fn new(frame: &Frame, [width, height]: [u32; 2]) -> Option<Self> {
        let Before {
            camera,
            instances,
            loose,
        } = frame.before.as_deref()?;
        let triangles = frame.loose.triangles.iter().filter(|_| !loose.is_empty());
        Some(Self {
            now: frame.camera.view_basis(width, height),
            then: camera.view_basis(width, height),
            instances: instances.clone(),
            loose: triangles
                .map(|t| t.vertices.map(|v| loose[v as usize]))
                .collect(),
        })
    }
}

impl World {
    /// How far the picture before has a point beside where it is now, on the image plane. The sky is
    /// infinitely far: it moves with the camera's direction alone.
    pub fn motion(&self, point: &SurfacePoint<'_>, direction: DVec3) -> DVec2 {
        let Some(seen) = &self.before else {
            return DVec2::ZERO;
        };
        let [now, then] = if point.material.surface == Surface::Sky {
            [direction; 2]
        } else {
            let was = match seen.instances.get(point.place.part as usize) {
                Some(past) => past.as_ref().map(|past| self.position_before(point, past)),
                // The part behind all instances.
                None => self.loose_before(point, &seen.loose),
            };
            let then = was.unwrap_or(point.position) - seen.then.origin;
            [point.position - seen.now.origin, then]
        };
        match (seen.now.project(now), seen.then.project(then)) {
            (Some(now), Some(then)) => then.clamp(-REACH, REACH) - now,
            _ => DVec2::ZERO,
        }
    }

    /// Where a point of a loose triangle was.
    fn loose_before(&self, point: &SurfacePoint<'_>, before: &[[Vec3; 3]]) -> Option<DVec3> {
        let part = &self.parts[point.place.part as usize];
        let number = part.triangles[point.place.slot as usize];
        let corners = before.get(number as usize)?.iter().zip(point.weights);
        Some(
            corners
                .map(|(corner, weight)| corner.as_dvec3() * weight)
                .sum(),
        )
    }

    /// Where a point of an instance was.
    fn position_before(&self, point: &SurfacePoint<'_>, past: &Past) -> DVec3 {
        let part = &self.parts[point.place.part as usize];
        let instance = &self.shown[point.place.part as usize - 1];
        let mesh = &self.scene.meshes[instance.mesh];
        let number = part.triangles[point.place.slot as usize];
        let triangle: &Triangle = &mesh.triangles[number as usize];
        let matrix = past.transform.matrix3;
        let [x, y, z] = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|c| c.as_dvec3());
        let translation = past.transform.translation.as_dvec3();
        (triangle.vertices.iter().zip(point.weights))
            .map(|(&vertex, weight)| {
                let local = mesh.vertex(past.pose, vertex).as_dvec3();
                let placed = DMat3::from_cols(x, y, z) * local + translation;
                // Rounded as those of now are.
                placed.as_vec3().as_dvec3() * weight
            })
            .sum()
    }
}
