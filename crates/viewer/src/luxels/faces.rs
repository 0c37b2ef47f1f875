//! Where the light compilers take the samples of a face's lightmap.
//!
//! A sample's point is where its luxel coordinates are on the face's plane, 1 unit before it. Points
//! beside the face go to a neighbour in the same plane; failing that to the nearest point of the
//! face's border, if that is less than a luxel away. A point in solid is tried half a unit away along
//! all three axes. What is then still in solid or far from the face gets no light.

use super::shadows::Shadows;
use bsp::Bsp;
use bsp::bsp::{Face, Lightmap};
use glam::{DMat3, DVec2, DVec3};
use std::collections::HashMap;

/// How far before its face a sample's point is, world units.
const BEFORE: f64 = 1.0;
/// How far a point may be beyond an edge and still be inside, world units.
const ON_EDGE: f64 = 0.05;
/// Neighbours that are looked through, one after the other.
const MAX_STEPS: u32 = 3;

/// A face as a polygon in its plane.
#[derive(Clone, Debug)]
pub struct Polygon {
    /// Corners, clockwise seen from the front.
    points: Vec<DVec3>,
    /// Unit normal to the front.
    pub normal: DVec3,
    distance: f64,
}

impl Polygon {
    /// The polygon of a face; `None` without a plane.
    #[must_use]
    pub fn of(bsp: &Bsp, face: &Face) -> Option<Self> {
        let plane = bsp.face_plane(face)?;
        let points: Vec<DVec3> = (bsp.face_points(face)?)
            .map(|p| DVec3::from(p.map(f64::from)))
            .collect();
        Some(Self {
            points,
            normal: DVec3::from(plane.normal.map(f64::from)),
            distance: f64::from(plane.distance),
        })
    }

    /// A point moved to lie before the plane.
    fn before(&self, point: DVec3) -> DVec3 {
        point + self.normal * (BEFORE + self.distance - self.normal.dot(point))
    }

    fn edges(&self) -> impl Iterator<Item = (DVec3, DVec3)> {
        let next = self.points.iter().cycle().skip(1);
        self.points.iter().copied().zip(next.copied())
    }

    /// How far a point is inside of an edge; `None` for an edge without length.
    fn inside_of(&self, (a, b): (DVec3, DVec3), point: DVec3) -> Option<f64> {
        let inward = (b - a).cross(self.normal).try_normalize()?;
        Some(inward.dot(point - a))
    }

    fn contains(&self, point: DVec3) -> bool {
        self.edges()
            .filter_map(|e| self.inside_of(e, point))
            .all(|d| d >= -ON_EDGE)
    }

    /// The point of the border that is nearest to a point.
    fn nearest_on_border(&self, point: DVec3) -> Option<DVec3> {
        self.edges()
            .map(|(a, b)| {
                let along = b - a;
                let t = (point - a).dot(along) / along.length_squared().max(f64::MIN_POSITIVE);
                a + along * t.clamp(0.0, 1.0)
            })
            .min_by(|a, b| {
                let [a, b] = [a, b].map(|q| q.distance_squared(point));
                a.total_cmp(&b)
            })
    }
}

/// The faces of a level, and which ones share an edge.
#[derive(Debug)]
pub struct Faces<'a> {
    bsp: &'a Bsp,
    /// Faces on the other side of an edge, by its vertices as those faces have them.
    by_edge: HashMap<(u32, u32), Vec<usize>>,
}

impl<'a> Faces<'a> {
    /// All faces of a level.
    #[must_use]
    pub fn new(bsp: &'a Bsp) -> Self {
        let mut by_edge: HashMap<(u32, u32), Vec<usize>> = HashMap::new();
        for (index, face) in bsp.faces.iter().enumerate() {
            let vertices: Vec<u32> = bsp.face_vertices(face).into_iter().flatten().collect();
            for (i, &a) in vertices.iter().enumerate() {
                let b = vertices[(i + 1) % vertices.len()];
                by_edge.entry((a, b)).or_default().push(index);
            }
        }
        Self { bsp, by_edge }
    }

    /// The point of the sample at luxel coordinates `luxel` of face `index`, which belongs to
    /// `model`; `None` if it gets no light.
    #[must_use]
    pub fn sample_point(
        &self,
        index: usize,
        map: &Lightmap,
        luxel: DVec2,
        model: usize,
        shadows: &Shadows<'_>,
    ) -> Option<DVec3> {
        let face = self.bsp.faces.get(index)?;
        let polygon = Polygon::of(self.bsp, face)?;
        let [s, t] = map.axes.map(|[x, y, z, w]| (DVec3::new(x, y, z), w));
        // Three planes meet where luxel coordinates are as wanted, on the face's plane.
        let rows = DMat3::from_cols(s.0, t.0, polygon.normal).transpose();
        let at = DVec3::new(luxel.x - s.1, luxel.y - t.1, polygon.distance + BEFORE);
        let point = rows.inverse() * at;
        if !point.is_finite() {
            return None;
        }
        self.place(index, polygon, point, map, model, shadows, 0)
    }

    #[expect(
        clippy::too_many_arguments,
        reason = "a recursion whose state is its arguments"
    )]
    fn place(
        &self,
        index: usize,
        polygon: Polygon,
        point: DVec3,
        map: &Lightmap,
        model: usize,
        shadows: &Shadows<'_>,
        step: u32,
    ) -> Option<DVec3> {
        let point = polygon.before(point);
        if polygon.contains(point) {
            return out_of_solid(point, model, shadows);
        }
        if step < MAX_STEPS
            && let Some(next) = self.neighbour(index, &polygon, point)
            && let Some(other) = Polygon::of(self.bsp, self.bsp.faces.get(next)?)
        {
            return self.place(next, other, point, map, model, shadows, step + 1);
        }
        let nearest = polygon.nearest_on_border(point)?;
        let luxel = |p: DVec3| {
            let [s, t] = map.axes.map(|[x, y, z, w]| DVec3::new(x, y, z).dot(p) + w);
            DVec2::new(s, t)
        };
        let is_near = luxel(point).distance(luxel(nearest)) <= 1.0;
        is_near
            .then(|| out_of_solid(nearest + polygon.normal * BEFORE, model, shadows))
            .flatten()
    }

    /// The face of the same plane across the edge that a point is beyond of; of several the one
    /// whose ends it is least past.
    fn neighbour(&self, index: usize, polygon: &Polygon, point: DVec3) -> Option<usize> {
        let face = self.bsp.faces.get(index)?;
        let vertices: Vec<u32> = self.bsp.face_vertices(face)?.collect();
        let past = |(a, b): (DVec3, DVec3)| {
            let length = (b - a).length();
            let t = (point - a).dot(b - a) / (length * length);
            if t < 0.0 {
                -t * length
            } else if t > 1.0 {
                t * length
            } else {
                0.0
            }
        };
        let (edge, _) = (polygon.edges().enumerate())
            .filter(|(_, e)| polygon.inside_of(*e, point).is_some_and(|d| d < ON_EDGE))
            .map(|(i, e)| (i, past(e)))
            .min_by(|a, b| a.1.total_cmp(&b.1))?;
        let (a, b) = (vertices[edge], vertices[(edge + 1) % vertices.len()]);
        let is_coplanar = |other: &&usize| {
            let other = &self.bsp.faces[**other];
            other.plane == face.plane && other.side == face.side
        };
        let across = self.by_edge.get(&(b, a))?;
        (across.iter().filter(|&&n| n != index))
            .find(is_coplanar)
            .copied()
    }
}

/// A point in solid is tried half a unit away along all axes.
fn out_of_solid(point: DVec3, model: usize, shadows: &Shadows<'_>) -> Option<DVec3> {
    let corners = (0..8).map(|i| {
        let sign = |bit: u32| if i >> bit & 1 == 0 { -0.5 } else { 0.5 };
        point + DVec3::new(sign(2), sign(1), sign(0))
    });
    std::iter::once(point)
        .chain(corners)
        .find(|&p| !shadows.is_in_solid(p, model))
}
