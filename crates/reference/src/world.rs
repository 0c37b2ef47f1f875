//! A scene made ready for rays: triangles in world space, and what is at a hit.

use crate::Error;
use crate::bsdf::{Bsdf, GlossHere};
use crate::bvh::{self, Stack, Tree};
use crate::check::check;
use crate::motion::Seen;
use crate::part::{Part, Sight, TriangleInfo};
use crate::passage::{Depth, eval_passage};
use crate::shading::{spawn_origin, srgb_to_linear, texel_index, warp};
use crate::triangle::{Ray, TriangleHit};
use glam::{DMat2, DVec2, DVec3, Vec3};
use scene::emitter::MovingLights;
use scene::material::{MAX_ALBEDO, WARP_TILE};
use scene::{
    Camera, Fog, Instance, LightStyle, Material, MaterialId, PointLight, Scene, Surface, Texture,
    TextureId,
};
use std::cell::Cell;
use std::ops::ControlFlow;
use std::sync::Arc;

/// Least part of a normal in a picture that points away from the face.
const LEAST_RISE: f64 = 0.05;

/// The scene with its triangles in world space.
#[derive(Debug)]
pub(crate) struct World {
    pub scene: Arc<Scene>,
    /// Level time in seconds.
    pub time: f64,
    /// What stands still, then what is apart: of scenes that frames are shown of every instance, in
    /// the frame's order, and the loose triangles.
    pub(crate) parts: Vec<Arc<Part>>,
    /// What the parts after the first were made of.
    pub(crate) shown: Vec<Instance>,
    /// Over the bounds of the parts after the first.
    pub(crate) top: Tree,
    /// Parts in the order of its leaves.
    pub(crate) top_order: Vec<u32>,
    /// By index into `Emitters::sources`, where the scene's own are.
    pub source_places: Vec<Place>,
    /// The scene's own lights, as bright as they are.
    pub lights: Vec<PointLight>,
    /// The light styles that the film tells apart, as bright as they are.
    pub styles: Vec<LightStyle>,
    /// The choice among what moves.
    pub moving: MovingLights,
    /// The lights of the frame.
    pub frame_lights: Vec<PointLight>,
    /// By part, the probability with which `moving` chooses it.
    pub moving_probabilities: Vec<f64>,
    /// By material, the one that it shows.
    pub looks: Vec<MaterialId>,
    /// Fog.
    pub fog: Option<Fog>,
    /// Factor of the sky's picture, and what is before it, by halves.
    pub sky: [[Vec3; 2]; 2],
    /// What the picture before showed, and the views of both.
    pub before: Option<Seen>,
    /// `srgb_to_linear` of each byte.
    linear: [f64; 256],
}

/// Where a triangle is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Place {
    /// Number of its part.
    pub part: u32,
    /// Its place in the part's hierarchy.
    pub slot: u32,
}

/// What a ray hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hit {
    pub place: Place,
    /// Where on the triangle.
    pub at: TriangleHit,
}

/// A point on a surface, seen from somewhere.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfacePoint<'a> {
    /// World space.
    pub position: DVec3,
    /// Unit normal to the front.
    pub normal: DVec3,
    /// Whether it is seen from the front.
    pub front: bool,
    /// Bound of the position's error, world units.
    pub error: f64,
    pub material: &'a Material,
    /// Texture coordinates as stored: texels, or world units if the material is warped.
    pub uv: DVec2,
    /// The level's number of the face.
    pub face: u32,
    /// Where its triangle is.
    pub place: Place,
    /// Barycentric weights in the triangle.
    pub weights: [f64; 3],
    /// Area of the triangle, square world units.
    pub area: f64,
    /// Its area in texture coordinates.
    pub uv_area: f64,
    /// Its number among the sources of what emits on its part, or `NO_EMITTER`.
    pub source: u32,
    /// Baked light; 1 if the scene has none.
    pub baked: DVec3,
}

impl SurfacePoint<'_> {
    /// The normal on the side the point is seen from.
    pub fn facing_normal(&self) -> DVec3 {
        if self.front {
            self.normal
        } else {
            -self.normal
        }
    }

    /// Where rays to that side start.
    pub fn spawn_origin(&self) -> DVec3 {
        spawn_origin(self.position, self.facing_normal(), self.error)
    }
}

impl World {
    /// Places every instance's triangles in the world and builds the hierarchies over them.
    pub fn new(scene: Arc<Scene>, camera: &Camera, time: f32) -> Result<Self, Error> {
        check(&scene)?;
        let mut world = Self {
            time: f64::from(time),
            parts: Vec::new(),
            shown: Vec::new(),
            top: Tree::default(),
            top_order: Vec::new(),
            source_places: Vec::new(),
            lights: scene.lights_now(&scene.brightness),
            styles: scene.styles.clone(),
            moving: MovingLights::default(),
            frame_lights: Vec::new(),
            moving_probabilities: Vec::new(),
            fog: scene.fog,
            sky: [scene.sky.scale, scene.sky.veil],
            before: None,
            looks: (0..scene.materials.len() as u32).map(MaterialId).collect(),
            linear: std::array::from_fn(|i| srgb_to_linear(i as u8)),
            scene,
        };
        if world.scene.features.frames {
            let frame = world.scene.as_frame(camera, time);
            world.show(&frame)?;
        } else {
            world.stand_still()?;
        }
        Ok(world)
    }

    /// Calls `visit` for the parts that a ray may meet before `t_max`; it answers as in
    /// [`Tree::visit`].
    #[inline]
    fn visit_parts(
        &self,
        ray: &Ray,
        mut t_max: f64,
        sight: Sight,
        stack: &mut Stack,
        mut visit: impl FnMut(u32, f64, &mut Stack) -> ControlFlow<(), f64>,
    ) {
        match visit(0, t_max, stack) {
            ControlFlow::Continue(t) => t_max = t,
            ControlFlow::Break(()) => return,
        }
        (self.top).visit(ray, t_max, true, stack, |leaf, mut t_max, stack| {
            for &part in &self.top_order[leaf.start as usize..leaf.end as usize] {
                if self.parts[part as usize].seen.meets(sight) {
                    t_max = visit(part, t_max, stack)?;
                }
            }
            ControlFlow::Continue(t_max)
        });
    }

    /// The nearest surface along a ray of this kind. Of those that light passes through, the nearest
    /// beyond `passed`: the ray has passed all before.
    pub fn closest_hit(
        &self,
        ray: &Ray,
        passed: f64,
        sight: Sight,
        stack: &mut Stack,
    ) -> Option<Hit> {
        let mut nearest = None;
        self.visit_parts(ray, f64::INFINITY, sight, stack, |part, t_max, stack| {
            let found = |hit: &bvh::Hit| Hit {
                place: Place {
                    part,
                    slot: hit.slot,
                },
                at: hit.at,
            };
            let bvh = &self.parts[part as usize].bvh;
            let hit = bvh.closest_hit(ray, t_max, stack, |hit| {
                hit.at.t > passed && !self.is_hole(&found(hit))
            });
            nearest = hit.as_ref().map(found).or(nearest);
            ControlFlow::Continue(hit.map_or(t_max, |hit| hit.at.t))
        });
        nearest
    }

    /// What of the light from one point arrives at another, whose space has this absorption and whose
    /// rays are of this kind.
    pub fn transmittance(
        &self,
        absorption: DVec3,
        from: DVec3,
        to: DVec3,
        sight: Sight,
        stack: &mut Stack,
    ) -> DVec3 {
        let distance = from.distance(to);
        let ray = Ray::new(from, (to - from) / distance);
        let passed = Cell::new((DVec3::ONE, Depth::new(absorption)));
        let mut is_blocked = false;
        self.visit_parts(&ray, distance, sight, stack, |part, t_max, stack| {
            let bvh = &self.parts[part as usize].bvh;
            is_blocked = bvh.any_hit(&ray, t_max, stack, |hit| {
                let hit = Hit {
                    place: Place {
                        part,
                        slot: hit.slot,
                    },
                    at: hit.at,
                };
                let info = self.info(hit.place);
                let finish = &self.material(info).finish;
                if self.is_hole(&hit) {
                    return false;
                }
                if finish.alpha >= 1.0 {
                    return true;
                }
                let (mut surfaces, mut depth) = passed.get();
                surfaces *= eval_passage(finish, info.normal.dot(ray.direction).abs());
                depth.pass(finish, self.is_front(&hit), hit.at.t);
                passed.set((surfaces, depth));
                false
            });
            match is_blocked {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(t_max),
            }
        });
        if is_blocked {
            return DVec3::ZERO;
        }
        let (surfaces, depth) = passed.get();
        surfaces * depth.transmittance(distance) * self.clear(distance)
    }

    /// What a triangle looks like now.
    fn material(&self, info: &TriangleInfo) -> &Material {
        &self.scene.materials[self.looks[info.material as usize].0 as usize]
    }

    fn info(&self, place: Place) -> &TriangleInfo {
        &self.parts[place.part as usize].infos[place.slot as usize]
    }

    /// Corners of a triangle, exact.
    fn corners(&self, place: Place) -> [DVec3; 3] {
        let bvh = &self.parts[place.part as usize].bvh;
        bvh.triangle(place.slot).corners()
    }

    /// The rays that begin at a point of a surface.
    pub fn sight_from(&self, point: &SurfacePoint<'_>) -> Sight {
        match self.parts[point.place.part as usize].seen {
            Sight::CAMERA => Sight::APART,
            _ => Sight::OTHERS,
        }
    }

    /// Absorption of what fills the space at a point, per world unit.
    pub fn absorption_at(&self, point: DVec3) -> DVec3 {
        let material = self.scene.media.at(point.as_vec3());
        material.map_or(DVec3::ZERO, |id| {
            self.scene.materials[id.0 as usize]
                .finish
                .absorption
                .as_dvec3()
        })
    }

    /// Whether a triangle is seen from its front.
    fn is_front(&self, hit: &Hit) -> bool {
        // By the sign of the determinant that decided the hit, not by `dot(n, wo)`: the two differ
        // where a ray grazes a triangle whose rounded corners are a hair off its plane, and there
        // only this one keeps the path on the side it came from.
        hit.at.counter_clockwise != self.info(hit.place).clockwise
    }

    /// What is at a hit.
    pub fn surface_point(&self, hit: &Hit) -> SurfacePoint<'_> {
        self.point_on(hit.place, hit.at.weights, self.is_front(hit))
    }

    /// Texture coordinates of a triangle's corners.
    pub fn uv_of(&self, place: Place) -> [DVec2; 3] {
        corners_uv(&self.info(place).uv)
    }

    /// The point of a triangle with these barycentric weights.
    pub fn point_on(&self, place: Place, weights: [f64; 3], front: bool) -> SurfacePoint<'_> {
        let info = self.info(place);
        let [a, b, c] = self.corners(place);
        SurfacePoint {
            position: a * weights[0] + b * weights[1] + c * weights[2],
            normal: info.normal,
            front,
            error: info.error,
            material: self.material(info),
            uv: interpolate_uv(&info.uv, weights),
            face: info.face,
            place,
            weights,
            area: (b - a).cross(c - a).length() / 2.0,
            uv_area: uv_area(&info.uv),
            source: self.parts[place.part as usize].sources[place.slot as usize],
            baked: self.baked_light(place, weights),
        }
    }

    /// Baked light at a point of a triangle: bilinear between the samples, constant beyond them.
    fn baked_light(&self, place: Place, weights: [f64; 3]) -> DVec3 {
        let grid = (self.parts[place.part as usize].baked).get(place.slot as usize);
        let (Some(grid), Some(baked)) = (grid, &self.scene.baked) else {
            return DVec3::ONE;
        };
        let at = interpolate_uv(&grid.uv, weights);
        let axis = |at: f64, count: u32| {
            let at = at.clamp(0.0, f64::from(count - 1));
            let low = at.floor();
            let next = (low as u32 + 1).min(count - 1);
            (low as u32, next, at - low)
        };
        let ((x0, x1, fx), (y0, y1, fy)) = (axis(at.x, grid.width), axis(at.y, grid.height));
        let sample = |x: u32, y: u32| {
            let index = grid.first as usize + y as usize * grid.width as usize + x as usize;
            DVec3::from(baked.samples[index].map(f64::from))
        };
        let row = |y| sample(x0, y).lerp(sample(x1, y), fx);
        row(y0).lerp(row(y1), fy)
    }

    /// Radiance that leaves a point towards where it is seen from, but for that of suns; `direction`
    /// is the view's direction to the point.
    pub fn emitted(&self, point: &SurfacePoint<'_>, direction: DVec3) -> DVec3 {
        let material = point.material;
        if material.surface == Surface::Sky {
            return self.sky_radiance(direction);
        }
        let Some(id) = material.emission else {
            return DVec3::ZERO;
        };
        // Light sampling can choose a point in a hole; rays never end there.
        let shines = point.front || material.two_sided;
        if !shines
            || (material.alpha_tested && self.texel(material.base, material, point.uv)[3] == 0)
        {
            return DVec3::ZERO;
        }
        let texel = self.texel(id, material, point.uv);
        let emitted = self.decode(texel) * f64::from(material.emission_scale);
        if self.scene.baked.is_none() || texel[3] == 0 {
            emitted
        } else {
            emitted * point.baked
        }
    }

    /// Share of light that a surface reflects; none for the sky.
    pub fn albedo(&self, point: &SurfacePoint<'_>) -> DVec3 {
        if point.material.surface == Surface::Sky {
            return DVec3::ZERO;
        }
        self.decode(self.texel(point.material.base, point.material, point.uv))
            .min(DVec3::splat(f64::from(MAX_ALBEDO)))
    }

    /// How a point of this albedo scatters light towards `wo`.
    pub fn bsdf(&self, point: &SurfacePoint<'_>, albedo: DVec3, wo: DVec3) -> Bsdf {
        let material = point.material;
        let texel = |id: TextureId| self.texel(id, material, point.uv);
        let gloss = material.finish.gloss.map(|gloss| GlossHere {
            roughness: f64::from(gloss.roughness)
                * (gloss.roughness_map).map_or(1.0, |id| f64::from(texel(id)[0]) / 255.0),
            metallic: f64::from(gloss.metallic),
            specular: f64::from(gloss.specular),
        });
        let face = point.facing_normal();
        let smooth = self.smooth_normal(point);
        let bent = material.finish.normals.and_then(|id| {
            let [x, y, z, _] = texel(id).map(|byte| (f64::from(byte) - 128.0) / 127.0);
            let up = smooth.unwrap_or(point.normal);
            self.along_texture(point, up, DVec3::new(x, -y, z.max(LEAST_RISE)))
        });
        let normal = bent.or(smooth);
        let facing = |n: DVec3| if point.front { n } else { -n };
        let normal = normal.map_or(face, facing);
        Bsdf::new(albedo, gloss, face, normal, wo).rounded(smooth.map(facing))
    }

    /// Unit normal to the front that a facet of a model is shaded with, in world space; `None` if it is flat.
    fn smooth_normal(&self, point: &SurfacePoint<'_>) -> Option<DVec3> {
        let part = &self.parts[point.place.part as usize];
        let corners = part.smooth.get(point.place.slot as usize)?;
        let [a, b, c] = point.weights;
        (corners[0] * a + corners[1] * b + corners[2] * c).try_normalize()
    }

    /// A unit vector along `u`, `v` of a point's triangle and the unit normal `up` to its front, in world space; `None`
    /// if its texture coordinates span nothing.
    fn along_texture(&self, point: &SurfacePoint<'_>, up: DVec3, v: DVec3) -> Option<DVec3> {
        let [a, b, c] = self.corners(point.place);
        let [p, q, r] = self.uv_of(point.place);
        let (uv, wx) = (DMat2::from_cols(q - p, r - p), [b - a, c - a]);
        if uv.determinant() == 0.0 {
            return None;
        }
        // Rows: how the corners' weights change along u and along v.
        let inverse = uv.inverse();
        let [along, down] = [inverse.x_axis, inverse.y_axis].map(|w| {
            let direction = wx[0] * w.x + wx[1] * w.y;
            (direction - up * direction.dot(up)).try_normalize()
        });
        (along? * v.x + down? * v.y + up * v.z).try_normalize()
    }

    fn is_hole(&self, hit: &Hit) -> bool {
        let info = self.info(hit.place);
        let material = self.material(info);
        if !material.alpha_tested {
            return false;
        }
        let uv = interpolate_uv(&info.uv, hit.at.weights);
        self.texel(material.base, material, uv)[3] == 0
    }

    /// The texel of a texture of `material` at stored coordinates.
    fn texel(&self, id: TextureId, material: &Material, uv: DVec2) -> [u8; 4] {
        let texture = self.texture(id);
        let uv = if material.warped {
            DVec2::from(warp(uv.to_array(), self.time)) / WARP_TILE * size(texture)
        } else {
            uv
        };
        texture.rgba[texel_index(texture, uv)]
    }

    pub fn texture(&self, id: TextureId) -> &Texture {
        &self.scene.textures[id.0 as usize]
    }

    /// Linear RGB of a texel.
    pub fn decode(&self, texel: [u8; 4]) -> DVec3 {
        let [r, g, b, _] = texel.map(|byte| self.linear[usize::from(byte)]);
        DVec3::new(r, g, b)
    }
}

pub(crate) fn size(texture: &Texture) -> DVec2 {
    DVec2::new(f64::from(texture.width), f64::from(texture.height))
}

fn corners_uv(uv: &[[f32; 2]; 3]) -> [DVec2; 3] {
    uv.map(|[u, v]| DVec2::new(f64::from(u), f64::from(v)))
}

/// Area of a triangle in texture coordinates.
fn uv_area(uv: &[[f32; 2]; 3]) -> f64 {
    let [a, b, c] = corners_uv(uv);
    (b - a).perp_dot(c - a).abs() / 2.0
}

fn interpolate_uv(uv: &[[f32; 2]; 3], weights: [f64; 3]) -> DVec2 {
    let [a, b, c] = corners_uv(uv);
    a * weights[0] + b * weights[1] + c * weights[2]
}
