//! Questions about single points of a scene: what a ray meets, and which lights reach a point with how
//! much. For people who ask where light comes from; pictures are not made with it.

use crate::Error;
use crate::bsdf::Bsdf;
use crate::bvh::Stack;
use crate::choice::Choice;
use crate::lights::{Light, Place as LitPlace, Scattering, arriving};
use crate::part::Sight;
use crate::rng::Rng;
use crate::shading::warp;
use crate::triangle::Ray;
use crate::world::{Place, SurfacePoint, World};
use glam::{DVec2, DVec3};
use scene::camera::DEFAULT_FOV_DEG;
use scene::emitter::Shape;
use scene::material::WARP_TILE;
use scene::render::{Estimator, Sampler, Selection};
use scene::{Camera, Frame, MaterialId, Scene, TextureId};
use std::cell::RefCell;
use std::collections::HashMap;
use std::sync::Arc;

/// Lights that get [`REFINING`] samples of their own after the first ones have found them.
const REFINED: usize = 24;
/// Samples of a light that is looked at by itself.
const REFINING: u32 = 512;

/// A scene that can be asked.
#[derive(Debug)]
pub struct Probe {
    world: World,
    /// By part, its instances: where their triangles begin, and their numbers. Empty of scenes that frames
    /// are shown of: there a part is an instance.
    instances: Vec<Vec<(u32, u32)>>,
}

/// What a ray met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// World space.
    pub position: DVec3,
    /// Unit normal of the face, towards where the ray came from.
    pub normal: DVec3,
    /// From the ray's origin, world units.
    pub distance: f64,
    /// Whether the face was met from its front.
    pub is_front: bool,
    /// The file's number of the face; of models their triangle's.
    pub face: u32,
    /// Index into `Scene::instances`, or of the frame's; `None` of what frames have besides.
    pub instance: Option<usize>,
    /// What it looks like at this moment.
    pub material: MaterialId,
    /// The texel of its textures, from the left and from the top.
    pub texel: [u32; 2],
    /// Share of light that is reflected, linear RGB.
    pub albedo: DVec3,
    /// Radiance that it sends along the ray by itself, linear RGB: emission and sky.
    pub emitted: DVec3,
    /// Baked light there, where 1 shows the texture as it is stored; 1 if the scene has none.
    pub baked: DVec3,
    /// Number of its emitter on its part, if it can be chosen as a light.
    pub emitter: Option<u32>,
    place: Place,
    weights: [f64; 3],
}

/// Something that gives light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Luminary {
    /// A light entity, by its index into `Scene::lights`.
    Lamp(usize),
    /// A light of the frame, by its index into `Frame::lights`.
    Moving(usize),
    /// Bright texels of a face: the number among the emitters of the scene's own (`Scene::emitters`) or,
    /// with the index of what moves, of its own list.
    Texels {
        /// Instance of the frame, if it is one that moves.
        instance: Option<usize>,
        /// Number of the emitter.
        number: u32,
    },
    /// All that shines of a material that is no picture of lamps: sky, liquids.
    Surface(MaterialId),
    /// A sun, by its index into `Sky::suns`.
    Sun(usize),
}

/// A light that reaches a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Share {
    /// Which one.
    pub luminary: Luminary,
    /// Number of its light style.
    pub style: u16,
    /// Irradiance that it gives, linear RGB, in units of radiance: what a surface that reflects all light in
    /// all directions would show of it (irradiance divided by pi).
    pub light: DVec3,
    /// Luminance of that.
    pub luminance: f64,
    /// Standard error of the luminance.
    pub error: f64,
    /// A point of it, world space; of a sun, a direction to it.
    pub at: DVec3,
}

/// The direct light of a point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lighting {
    /// The lights that reach it, the strongest first. What no sample found is not there.
    pub shares: Vec<Share>,
    /// Luminance of all of them together, and its standard error.
    pub total: [f64; 2],
    /// Shadow rays behind it.
    pub rays: u32,
}

/// Sums over the samples of one light.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    light: DVec3,
    squares: f64,
    /// The light itself, to be looked at again.
    alone: Option<Light>,
}

thread_local! {
    static STACK: RefCell<Stack> = RefCell::default();
}

fn luminance(rgb: DVec3) -> f64 {
    rgb.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

impl Probe {
    /// Makes a scene ready for rays, at a level time in seconds.
    ///
    /// # Errors
    /// If the scene contradicts itself.
    pub fn new(scene: Arc<Scene>, time: f32) -> Result<Self, Error> {
        let nobody = Camera {
            name: String::new(),
            position: glam::Vec3::ZERO,
            pitch_deg: 0.0,
            yaw_deg: 0.0,
            roll_deg: 0.0,
            fov_deg: DEFAULT_FOV_DEG,
            lens: None,
        };
        let camera = scene.cameras.first().cloned().unwrap_or(nobody);
        let world = World::new(Arc::clone(&scene), &camera, time)?;
        let mut instances = Vec::new();
        if !scene.features.frames {
            // As the world gathers them: what everyone sees in one part, each other one by itself.
            let mut common = (Vec::new(), 0);
            let mut apart = Vec::new();
            for (number, instance) in (0..).zip(&scene.instances) {
                if instance.seen_by == scene::SeenBy::ALL {
                    common.0.push((common.1, number));
                    common.1 += scene.meshes[instance.mesh].triangles.len() as u32;
                } else {
                    apart.push(vec![(0, number)]);
                }
            }
            instances.push(common.0);
            instances.append(&mut apart);
        }
        Ok(Self { world, instances })
    }

    /// Shows a moment of a scene that frames are shown of.
    ///
    /// # Errors
    /// When the frame contradicts the scene.
    pub fn show(&mut self, frame: &Frame) -> Result<(), Error> {
        self.world.show(frame)
    }

    /// The scene.
    #[must_use]
    pub fn scene(&self) -> &Arc<Scene> {
        &self.world.scene
    }

    /// What the camera's ray through a point of a picture of `size` pixels meets, from the middle of its
    /// lens; `at` counts pixels from the left and from the top, and may lie between them.
    #[must_use]
    pub fn look(&self, camera: &Camera, size: [u32; 2], at: [f64; 2]) -> Option<Seen> {
        let basis = camera.view_basis(size[0], size[1]);
        let [x, y] = [0, 1].map(|i| at[i] / f64::from(size[i]) * 2.0 - 1.0);
        let direction = basis.forward + basis.right * x - basis.up * y;
        self.look_along(basis.origin, direction.normalize())
    }

    /// What a camera's ray in a unit direction meets first, interfaces that light passes included.
    #[must_use]
    pub fn look_along(&self, origin: DVec3, direction: DVec3) -> Option<Seen> {
        let ray = Ray::new(origin, direction);
        let world = &self.world;
        let hit = STACK.with_borrow_mut(|s| world.closest_hit(&ray, 0.0, Sight::CAMERA, s))?;
        let point = world.surface_point(&hit);
        let material = self.material_of(point.place);
        let base = world.texture(point.material.base);
        let uv = self.texel_uv(&point, point.material.base);
        let wrap = |x: f64, n: u32| (x.floor().rem_euclid(f64::from(n)) as u32).min(n - 1);
        Some(Seen {
            position: point.position,
            normal: point.facing_normal(),
            distance: hit.at.t,
            is_front: point.front,
            face: point.face,
            instance: self.instance_of(point.place),
            material,
            texel: [wrap(uv.x, base.width), wrap(uv.y, base.height)],
            albedo: world.albedo(&point),
            emitted: world.emitted(&point, direction),
            baked: point.baked,
            emitter: world.emitter_at(&point),
            place: point.place,
            weights: point.weights,
        })
    }

    /// The direct light of a point, light by light: each light's irradiance over pi, as a white surface
    /// there would show it.
    ///
    /// First `samples` lights are chosen as a path would choose them, each with one shadow ray: which of
    /// them reach the point. Then the strongest get samples of their own, so that a light's error is that of its
    /// own shadow alone. What light does on its way is what [`crate::Reference`] says.
    #[must_use]
    pub fn lights(&self, seen: &Seen, samples: u32, seed: u64) -> Lighting {
        let world = &self.world;
        if !world.has_lights() {
            return Lighting::default();
        }
        let point = world.point_on(seen.place, seen.weights, seen.is_front);
        let normal = point.facing_normal();
        let origin = point.spawn_origin();
        let white = Bsdf::new(DVec3::ONE, None, normal, normal, normal);
        let place = LitPlace {
            position: point.position,
            origin,
            sight: world.sight_from(&point),
            scattering: Scattering::Surface(normal, white),
        };
        let absorption = world.absorption_at(origin);
        let (scene, share) = (&world.scene, world.moving.share);
        let choice = Choice::at(scene, Selection::Leaf, origin, normal, share);
        let mut rays = 0;
        let mut sample = |light: Light, probability: f64, u: [f64; 2]| {
            let found = light.sample(world, Estimator::Nee, &place, probability, u)?;
            let radiance = found.radiance * place.scattering.eval(found.direction);
            let (arrives, traced) =
                STACK.with_borrow_mut(|s| arriving(world, &found, absorption, &place, s));
            rays += traced;
            let style = world.styles.get(found.style).filter(|_| found.style > 0);
            let brightness = style.map_or(1.0, |s| f64::from(s.brightness));
            let value = radiance * arrives * brightness;
            (value != DVec3::ZERO).then_some(value)
        };

        let mut sums: HashMap<Luminary, Sums> = HashMap::new();
        for i in 0..samples {
            let mut rng = Rng::new(Sampler::Independent, seed, 0, i);
            let Some(light) = Light::choose(world, &choice, &mut rng) else {
                continue;
            };
            let u = rng.next2();
            let probability = light.probability(world, &choice);
            if let Some(value) = sample(light, probability, u) {
                let (key, alone) = self.key_of(light);
                let entry = sums.entry(key).or_default();
                let y = luminance(value);
                entry.light += value;
                entry.squares += y * y;
                entry.alone = alone.then_some(light);
            }
        }
        let n = f64::from(samples.max(1));
        let mean_of = |light: DVec3, squares: f64, n: f64| {
            let mean = light / n;
            let y = luminance(mean);
            let variance = (squares / n - y * y).max(0.0) / (n - 1.0).max(1.0);
            (mean, y, variance.sqrt())
        };
        let mut shares: Vec<(Share, Option<Light>)> = (sums.into_iter())
            .map(|(luminary, s)| {
                let (light, y, error) = mean_of(s.light, s.squares, n);
                let (style, at) = self.about(luminary);
                let share = Share {
                    luminary,
                    style,
                    light,
                    luminance: y,
                    error,
                    at,
                };
                (share, s.alone)
            })
            .collect();
        // Lights that take light away are ranked by how much they matter.
        let by_rank = |a: &(Share, _), b: &(Share, _)| {
            let rank = |s: &Share| (s.luminance.abs(), s.luminary);
            let ((x, i), (y, j)) = (rank(&a.0), rank(&b.0));
            y.total_cmp(&x).then_with(|| order(i).cmp(&order(j)))
        };
        shares.sort_by(by_rank);
        for (k, (share, light)) in (0..).zip(shares.iter_mut().take(REFINED)) {
            let Some(light) = *light else { continue };
            let (mut sum, mut squares) = (DVec3::ZERO, 0.0);
            for i in 0..REFINING {
                let mut rng = Rng::new(Sampler::Independent, seed, 1 + k, i);
                if let Some(value) = sample(light, 1.0, rng.next2()) {
                    sum += value;
                    squares += luminance(value).powi(2);
                }
            }
            (share.light, share.luminance, share.error) =
                mean_of(sum, squares, f64::from(REFINING));
        }
        shares.retain(|(share, _)| share.light != DVec3::ZERO);
        shares.sort_by(by_rank);
        let shares: Vec<Share> = shares.into_iter().map(|(share, _)| share).collect();
        let total = shares.iter().map(|s| s.luminance).sum();
        let variance: f64 = shares.iter().map(|s| s.error * s.error).sum();
        Lighting {
            shares,
            total: [total, variance.sqrt()],
            rays,
        }
    }

    /// What a chosen light is called, and whether it is all of what is called so.
    fn key_of(&self, light: Light) -> (Luminary, bool) {
        match light {
            Light::Entity(index) => (Luminary::Lamp(index), true),
            Light::Moving { number, .. } => (Luminary::Moving(number), true),
            Light::Sun(index) => (Luminary::Sun(index), true),
            Light::Emitter { part, number } => {
                let own = |list: &scene::Emitters| list.list[number as usize];
                let emitter = self.world.emitters_of(part).map(own);
                match emitter.map(|e| (e.shape, e.material)) {
                    Some((Shape::Part { .. }, material)) => (Luminary::Surface(material), false),
                    _ => {
                        let instance = self.moves(part).then_some(part as usize);
                        (Luminary::Texels { instance, number }, true)
                    }
                }
            }
        }
    }

    /// Whether what emits on a part has a list of its own.
    fn moves(&self, part: u32) -> bool {
        let parts = &self.world.parts;
        (parts.get(part as usize))
            .is_some_and(|p| matches!(p.emitting, crate::part::Emitting::List(_)))
    }

    /// Number of a light's style, and a point of it.
    fn about(&self, luminary: Luminary) -> (u16, DVec3) {
        let (world, scene) = (&self.world, &self.world.scene);
        match luminary {
            Luminary::Lamp(i) => (scene.lights[i].style, scene.lights[i].position.as_dvec3()),
            Luminary::Moving(i) => (0, world.frame_lights[i].position.as_dvec3()),
            Luminary::Sun(i) => (0, scene.sky.suns[i].direction.as_dvec3()),
            Luminary::Texels { instance, number } => {
                let part = instance.unwrap_or(0) as u32;
                let emitter = (world.emitters_of(part)).map(|e| e.list[number as usize]);
                let middle = emitter.map_or(DVec3::ZERO, |e| {
                    let [min, max] = e.bounds();
                    (min + max).as_dvec3() / 2.0
                });
                let place = instance.and_then(|i| world.shown.get(i.wrapping_sub(1)));
                let moved = place.map_or(middle, |i| {
                    (i.transform.transform_point3(middle.as_vec3())).as_dvec3()
                });
                (0, moved)
            }
            Luminary::Surface(material) => {
                let of_it = |e: &&scene::Emitter| e.material == material;
                let first = scene.emitters.list.iter().find(of_it);
                (0, first.map_or(DVec3::ZERO, |e| e.corners[0].as_dvec3()))
            }
        }
    }

    /// The material that a triangle shows at this moment.
    fn material_of(&self, place: Place) -> MaterialId {
        let info = &self.world.parts[place.part as usize].infos[place.slot as usize];
        self.world.looks[info.material as usize]
    }

    /// The instance that a triangle belongs to.
    fn instance_of(&self, place: Place) -> Option<usize> {
        if self.instances.is_empty() {
            let part = place.part as usize;
            return (part <= self.world.shown.len()).then_some(part);
        }
        let list = self.instances.get(place.part as usize)?;
        let triangle = self.world.parts[place.part as usize].triangles[place.slot as usize];
        let after = list.partition_point(|&(begin, _)| begin <= triangle);
        Some(list[after.checked_sub(1)?].1 as usize)
    }

    /// Texture coordinates of a point in texels of a texture.
    fn texel_uv(&self, point: &SurfacePoint<'_>, id: TextureId) -> DVec2 {
        if !point.material.warped {
            return point.uv;
        }
        let texture = self.world.texture(id);
        let size = DVec2::new(f64::from(texture.width), f64::from(texture.height));
        DVec2::from(warp(point.uv.to_array(), self.world.time)) / WARP_TILE * size
    }
}

/// Any order that does not depend on chance, for lights that are alike.
fn order(luminary: Luminary) -> (u8, usize, u32) {
    match luminary {
        Luminary::Lamp(i) => (0, i, 0),
        Luminary::Moving(i) => (1, i, 0),
        Luminary::Texels { instance, number } => (2, instance.map_or(0, |i| i + 1), number),
        Luminary::Surface(MaterialId(id)) => (3, id as usize, 0),
        Luminary::Sun(i) => (4, i, 0),
    }
}

#[cfg(test)]
#[path = "probe_tests.rs"]
mod tests;
