//! One path: the loop of `docs/transport.md`.

use crate::bsdf::Bsdf;
use crate::bvh::Stack;
use crate::choice::Choice;
use crate::fog::Met;
use crate::lights::{LightSample, Place, Scattering, sample_light};
use crate::part::Sight;
use crate::passage::{Depth, Event, MAX_PASSAGES, sample_event};
use crate::rng::Rng;
use crate::shading::mis_weight;
use crate::sums::light_of_styles;
use crate::triangle::Ray;
use crate::world::{SurfacePoint, World};
use glam::{DVec2, DVec3};
use scene::render::{Estimator, ROULETTE_GAIN, ROULETTE_MAX_SURVIVAL, ROULETTE_START, Settings};
use scene::{Finish, Surface};

/// What a path found.
#[derive(Clone, Debug, Default)]
pub(crate) struct PathSample {
    /// Radiance emitted at path vertex 1.
    pub emission: DVec3,
    /// Radiance reflected once.
    pub direct: DVec3,
    /// Radiance reflected more than once.
    pub indirect: DVec3,
    /// Of these, the light of styles that are told apart: its style, and its radiance at brightness 1.
    pub styled: Vec<(usize, DVec3)>,
    /// What the camera ray hit.
    pub first: Option<FirstHit>,
    /// Rays traced.
    pub rays: u64,
    /// The ray that left the scene, if one did.
    pub escaped: Option<Ray>,
}

/// What the camera ray hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FirstHit {
    pub albedo: DVec3,
    /// Unit normal towards the camera.
    pub normal: DVec3,
    pub position: DVec3,
    /// Where it was in the picture before, less where it is, on the image plane.
    pub motion: DVec2,
    pub face: u32,
}

impl PathSample {
    /// Adds light of a style that was sampled at path vertex `k - 1`, at brightness 1 if the styles are
    /// told apart.
    pub fn add_sampled(&mut self, k: u32, throughput: DVec3, light: &LightSample, world: &World) {
        self.rays += u64::from(light.rays);
        let (radiance, style) = (throughput * light.radiance, light.style);
        if style == 0 || radiance == DVec3::ZERO {
            self.add(k, radiance);
            return;
        }
        self.add(k, radiance * f64::from(world.styles[style].brightness));
        self.styled.push((style, radiance));
    }

    /// Darkens what was reflected to `limit` in its largest channel, and returns what that takes.
    pub fn clamp(&mut self, limit: f64) -> DVec3 {
        let reflected = self.direct + self.indirect;
        let largest = reflected.max_element();
        if largest.is_nan() || largest <= limit {
            return DVec3::ZERO;
        }
        let kept = limit / largest;
        self.direct *= kept;
        self.indirect *= kept;
        reflected * (1.0 - kept)
    }

    /// Adds radiance emitted at path vertex `k`.
    fn add(&mut self, k: u32, radiance: DVec3) {
        match k {
            1 => self.emission += radiance,
            2 => self.direct += radiance,
            _ => self.indirect += radiance,
        }
    }
}

/// A path as it is walked.
pub(crate) struct Walk<'a> {
    pub ray: Ray,
    /// Number of the vertex that the ray leads to.
    pub k: u32,
    pub throughput: DVec3,
    /// Density of the ray's direction at the vertex before.
    pub pdf_direction: f64,
    /// How lights were chosen at the vertex before; at the camera they were not.
    pub choice: Choice<'a>,
    /// What the ray meets.
    pub sight: Sight,
    /// Whether light that the ray finds was not sampled at the vertex before.
    pub is_found_alone: bool,
    /// What absorbs along the ray.
    pub depth: Depth,
    /// Distance of the last interface that the ray passed straight through, and how many it passed.
    pub passed: f64,
    passages: u32,
    /// Whether the path was scattered in fog, which it is once at most.
    pub is_scattered: bool,
}

impl Walk<'_> {
    /// Sets out along a camera ray, in the liquid that the camera is in: a lens does not reach out of it.
    fn from_eye(world: &World, settings: &Settings, ray: Ray) -> Self {
        Self {
            k: 1,
            throughput: DVec3::ONE,
            pdf_direction: 0.0,
            choice: Choice::NONE,
            sight: Sight::CAMERA,
            is_found_alone: true,
            depth: Depth::new(world.absorption_at(settings.camera.position.as_dvec3())),
            passed: 0.0,
            passages: 0,
            is_scattered: false,
            ray,
        }
    }

    /// Goes straight on through an interface at distance `at`, from its front or its back. Not if there
    /// were too many of them.
    fn pass(&mut self, finish: &Finish, front: bool, at: f64) -> bool {
        self.passages += 1;
        self.throughput *= finish.tint.as_dvec3();
        self.depth.pass(finish, front, at);
        self.passed = at;
        self.passages <= MAX_PASSAGES
    }

    /// Chooses the direction of the next ray; `None` if it would carry nothing.
    fn scatter(&mut self, estimator: Estimator, bsdf: &Bsdf, rng: &mut Rng) -> Option<DVec3> {
        let u = rng.next2();
        let next = match estimator {
            Estimator::Uniform => bsdf.sample_uniformly(u),
            _ => bsdf.sample(u, || rng.next()),
        };
        self.pdf_direction = next.pdf;
        self.throughput *= next.weight;
        (next.weight != DVec3::ZERO).then_some(next.direction)
    }

    /// Goes on from a vertex. Not if Russian roulette ends the path.
    pub fn go_on(
        &mut self,
        (origin, sight): (DVec3, Sight),
        direction: DVec3,
        settings: &Settings,
        rng: &mut Rng,
    ) -> bool {
        let survival = survival(settings, self.throughput.max_element(), self.k);
        if survival < 1.0 {
            if rng.next() >= survival {
                return false;
            }
            self.throughput /= survival;
        }
        self.ray = Ray::new(origin, direction);
        self.sight = sight;
        self.depth = Depth::new(self.depth.absorption());
        (self.passed, self.passages) = (0.0, 0);
        self.k += 1;
        rng.begin_vertex(self.k);
        true
    }

    /// Adds what is emitted towards the ray at `point`, which is `distance` away, times `arriving`.
    fn add_emission(
        &self,
        world: &World,
        estimator: Estimator,
        point: &SurfacePoint<'_>,
        distance: f64,
        arriving: DVec3,
        sample: &mut PathSample,
    ) {
        // Of emission that light sampling would have found with this density.
        let weight = |pdf_light: f64| match estimator {
            _ if self.is_found_alone => 1.0,
            Estimator::Naive | Estimator::Uniform => 1.0,
            Estimator::Nee => 0.0,
            Estimator::Mis => mis_weight(self.pdf_direction, pdf_light),
        };
        let direction = self.ray.direction;
        let emitted = world.emitted(point, direction);
        if emitted != DVec3::ZERO {
            let pdf_light = world.pdf_light(&self.choice, point, direction, distance);
            sample.add(self.k, arriving * emitted * weight(pdf_light));
        }
        if point.material.surface == Surface::Sky {
            let suns = world.suns(&self.choice, direction, weight);
            sample.add(self.k, arriving * suns);
        }
    }
}

/// Follows one path from the camera ray `ray`.
pub(crate) fn trace_path(
    world: &World,
    settings: &Settings,
    ray: Ray,
    rng: &mut Rng,
    stack: &mut Stack,
) -> PathSample {
    let Settings {
        estimator,
        selection,
        depth,
        ..
    } = *settings;
    let mut sample = PathSample::default();
    let mut walk = Walk::from_eye(world, settings, ray);
    rng.begin_vertex(1);
    loop {
        sample.rays += 1;
        let Some(hit) = world.closest_hit(&walk.ray, walk.passed, walk.sight, stack) else {
            sample.escaped = Some(walk.ray);
            return sample;
        };
        let point = world.surface_point(&hit);
        let at = hit.at.t;
        let clear = world.clear(at - walk.passed);
        let mut arriving = walk.throughput * walk.depth.transmittance(at) * clear;
        walk.add_emission(world, estimator, &point, at, arriving, &mut sample);

        let direction = walk.ray.direction;
        let first = || FirstHit {
            albedo: world.albedo(&point),
            normal: point.facing_normal(),
            position: point.position,
            motion: world.motion(&point, direction),
            face: point.face,
        };
        match walk.meet_fog(world, settings, at, &mut sample, rng, stack) {
            Met::Nothing => arriving /= clear,
            Met::Absorption => walk.throughput *= clear,
            Met::Scattering(goes_on) => {
                sample.first.get_or_insert_with(first);
                if goes_on {
                    continue;
                }
                return sample;
            }
        }

        let finish = &point.material.finish;
        let normal = point.facing_normal();
        let event = if finish.alpha < 1.0 {
            let cos = normal.dot(walk.ray.direction).abs();
            sample_event(finish, cos, rng.next())
        } else {
            Event::Paint
        };
        if event == Event::Pass {
            if walk.pass(finish, point.front, at) {
                continue;
            }
            return sample;
        }
        walk.throughput = arriving;
        sample.first.get_or_insert_with(first);
        // Black surfaces, the sky among them, end the path.
        let bsdf = world.bsdf(&point, world.albedo(&point), -walk.ray.direction);
        if walk.k == depth || (event == Event::Paint && bsdf.is_black()) {
            return sample;
        }

        walk.is_found_alone = event == Event::Reflect;
        let (origin, sight) = (point.spawn_origin(), world.sight_from(&point));
        if event == Event::Paint && estimator.samples_lights() {
            walk.choice = Choice::at(&world.scene, selection, origin, normal, world.moving.share);
            let place = Place {
                position: point.position,
                origin,
                sight,
                scattering: Scattering::Surface(normal, bsdf),
            };
            let absorption = walk.depth.absorption();
            let lights = match &world.scene.light_sums {
                Some(sums) => {
                    let own = point.material.least_light.as_dvec3();
                    light_of_styles(world, sums, &place, (normal, own), absorption, stack)
                }
                None => {
                    let choice = &walk.choice;
                    vec![sample_light(
                        world, settings, choice, &place, absorption, rng, stack,
                    )]
                }
            };
            for light in &lights {
                sample.add_sampled(walk.k + 1, walk.throughput, light, world);
            }
        }

        let direction = match event {
            Event::Reflect => Some(reflected(walk.ray.direction, normal)),
            _ => walk.scatter(estimator, &bsdf, rng),
        };
        let Some(direction) = direction else {
            return sample;
        };
        if !walk.go_on((origin, sight), direction, settings, rng) {
            return sample;
        }
    }
}

/// A direction towards a surface as a mirror sends it back; the normal is on the side that it comes from.
fn reflected(direction: DVec3, normal: DVec3) -> DVec3 {
    (direction + normal * (2.0 * normal.dot(direction).abs())).normalize()
}

/// Probability with which a path goes on from vertex `k` (Russian roulette, Arvo and Kirk 1990);
/// `throughput` is the largest component. Paths that find light by hitting it alone are the walk that
/// others are compared with, and end by chance only where nothing else ends them.
fn survival(settings: &Settings, throughput: f64, k: u32) -> f64 {
    let by_throughput = match settings.estimator {
        Estimator::Nee | Estimator::Mis => ROULETTE_GAIN * throughput,
        _ if settings.depth == 0 && k >= ROULETTE_START => throughput,
        _ => 1.0,
    };
    let most = match settings.depth {
        0 if k >= ROULETTE_START => ROULETTE_MAX_SURVIVAL,
        _ => 1.0,
    };
    by_throughput.min(most)
}
