//! Triangles that come and go together, in world space: one instance, or all that stands still.

use crate::Error;
use crate::bvh::Bvh;
use crate::shading::point_error;
use crate::triangle::PackedTriangle;
use glam::{DMat3, DVec3, Vec3};
use scene::baked::BakedTriangle;
use scene::emitter::NO_EMITTER;
use scene::{Instance, Mesh, SeenBy, Triangle};

/// Kinds of rays, as bits of what they meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Sight(u8);

impl Sight {
    /// From the camera.
    pub const CAMERA: Self = Self(1);
    /// From a surface.
    pub const OTHERS: Self = Self(2);
    /// From a surface that only the camera sees.
    pub const APART: Self = Self(4);
    /// What all of them meet.
    pub const ALL: Self = Self(7);

    /// The rays that meet what is seen by `seen_by`.
    pub fn of(seen_by: SeenBy) -> Self {
        match (seen_by.camera(), seen_by.others()) {
            (true, true) => Self::ALL,
            (true, false) => Self::CAMERA,
            (false, _) => Self::OTHERS,
        }
    }

    /// Whether the two have a bit in common.
    pub fn meets(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }
}

/// What a triangle looks like, in world space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TriangleInfo {
    /// Unit normal to the front.
    pub normal: DVec3,
    /// Bound of the error of a point on it, world units.
    pub error: f64,
    pub uv: [[f32; 2]; 3],
    pub material: u32,
    pub face: u32,
    /// Corners are clockwise seen from the front: a mirrored instance, or a sliver whose winding
    /// was lost to rounding.
    pub clockwise: bool,
}

/// Which emitters lie on a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Emitting {
    /// Those of the scene.
    Own,
    /// Those of a list of `Scene::moving`.
    List(u32),
    /// None.
    Nothing,
}

/// Triangles with a hierarchy of their own.
#[derive(Debug)]
pub(crate) struct Part {
    pub bvh: Bvh,
    /// By slot, what the test of the ray does not need.
    pub infos: Vec<TriangleInfo>,
    /// By slot, the grid of baked light; empty if the scene has none.
    pub baked: Vec<BakedTriangle>,
    /// By slot, the normals that its corners are shaded with, to the front, world space, of any length; 0 where it is
    /// flat. Empty if all are.
    pub smooth: Vec<[DVec3; 3]>,
    /// By triangle in the order of instances and triangles, the slot.
    pub slots: Vec<u32>,
    /// By slot, the triangle in that order.
    pub triangles: Vec<u32>,
    /// By slot, the number among the sources of what emits; [`NO_EMITTER`] if it does not.
    pub sources: Vec<u32>,
    pub emitting: Emitting,
    /// Rays that meet it.
    pub seen: Sight,
}

/// A mesh, its placement, and its baked light if it has some.
pub(crate) type Placed<'a> = (&'a Mesh, &'a Instance, Option<&'a [BakedTriangle]>);

impl Part {
    /// Places meshes in the world and builds the hierarchy over all their triangles.
    pub fn new(placed: &[Placed<'_>], emitting: Emitting, seen: Sight) -> Result<Self, Error> {
        let count = placed.iter().map(|(m, ..)| m.triangles.len()).sum();
        let mut packed = Vec::with_capacity(count);
        let mut infos = Vec::with_capacity(count);
        let mut baked = Vec::new();
        let mut smooth = Vec::new();
        for (mesh, instance, grids) in placed {
            if !mesh.normals.is_empty() {
                smooth.resize(infos.len(), [DVec3::ZERO; 3]);
                smooth.extend(corner_normals(mesh, instance));
            }
            place(mesh, instance, &mut packed, &mut infos)?;
            baked.extend_from_slice(grids.unwrap_or_default());
        }
        let (bvh, order) = Bvh::build(&packed);
        let mut slots = vec![0; count];
        for (slot, &index) in (0..).zip(&order) {
            slots[index as usize] = slot;
        }
        if !smooth.is_empty() {
            smooth.resize(count, [DVec3::ZERO; 3]);
            smooth = order.iter().map(|&i| smooth[i as usize]).collect();
        }
        let has_light = baked.len() == count;
        let grids = order.iter().take(if has_light { count } else { 0 });
        Ok(Self {
            baked: grids.map(|&i| baked[i as usize]).collect(),
            infos: order.iter().map(|&i| infos[i as usize]).collect(),
            sources: vec![NO_EMITTER; count],
            smooth,
            triangles: order,
            bvh,
            slots,
            emitting,
            seen,
        })
    }
}

/// Normals that the corners of an instance's triangles are shaded with, world space, of any length.
fn corner_normals(mesh: &Mesh, instance: &Instance) -> impl Iterator<Item = [DVec3; 3]> {
    let normal_matrix = linear(instance).inverse().transpose();
    (0..mesh.triangles.len()).map(move |triangle| {
        let local = mesh.corner_normals(triangle, instance.pose);
        local.map_or([DVec3::ZERO; 3], |n| {
            n.map(|n| normal_matrix * n.as_dvec3())
        })
    })
}

/// The transform without its translation.
fn linear(instance: &Instance) -> DMat3 {
    DMat3::from_cols(
        instance.transform.matrix3.x_axis.as_dvec3(),
        instance.transform.matrix3.y_axis.as_dvec3(),
        instance.transform.matrix3.z_axis.as_dvec3(),
    )
}

/// Adds the triangles of an instance.
fn place(
    mesh: &Mesh,
    instance: &Instance,
    packed: &mut Vec<PackedTriangle>,
    infos: &mut Vec<TriangleInfo>,
) -> Result<(), Error> {
    let matrix = linear(instance);
    let translation = Vec3::from(instance.transform.translation).as_dvec3();
    let normal_matrix = matrix.inverse().transpose();
    // Rounded to f32 once per vertex, so that neighbours still share it.
    let positions: Vec<Vec3> = (mesh.posed(instance.pose).iter())
        .map(|p| (matrix * p.as_dvec3() + translation).as_vec3())
        .collect();
    if !positions.iter().all(|p| p.is_finite()) {
        return Err(Error::InvalidScene("a vertex is not finite"));
    }
    let front = (!mesh.poses.is_empty()).then(|| matrix.determinant().signum());
    let extent = (positions.iter())
        .map(|p| f64::from(p.abs().max_element()))
        .fold(1.0, f64::max);
    for (i, triangle) in mesh.triangles.iter().enumerate() {
        let corners = triangle.vertices.map(|v| positions[v as usize]);
        packed.push(PackedTriangle::new(
            corners.map(|p| p.to_array()),
            i >= mesh.first_see_through,
        ));
        let points = corners.map(Vec3::as_dvec3);
        let mut info = info(triangle, points, normal_matrix, extent, front);
        info.material = instance.material_of(triangle).0;
        infos.push(info);
    }
    Ok(())
}

/// `front` says of posed triangles whether the front is where their corners are counter-clockwise (1)
/// or clockwise (-1).
fn info(
    triangle: &Triangle,
    points: [DVec3; 3],
    normal_matrix: DMat3,
    extent: f64,
    front: Option<f64>,
) -> TriangleInfo {
    let wound = (points[1] - points[0]).cross(points[2] - points[0]);
    let placed = || (normal_matrix * triangle.normal.as_dvec3()).try_normalize();
    let normal = match front {
        Some(front) => (wound * front).try_normalize().or_else(placed),
        None => placed().or_else(|| wound.try_normalize()),
    };
    let normal = normal.unwrap_or(DVec3::Z);
    TriangleInfo {
        normal,
        error: point_error(points, extent),
        uv: triangle.uv,
        material: triangle.material.0,
        face: triangle.face,
        clockwise: wound.dot(normal) < 0.0,
    }
}
