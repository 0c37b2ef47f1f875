//! One path: the loop of `docs/transport.md`.

use crate::bvh::Stack;
use crate::choice::Choice;
use crate::lights::{Vertex, sample_light};
use crate::part::Sight;
use crate::passage::{Depth, Event, MAX_PASSAGES, sample_event};
use crate::rng::Rng;
use crate::shading::mis_weight;
use crate::triangle::Ray;
use crate::world::World;
use glam::DVec3;
use scene::Surface;
use scene::render::{Estimator, ROULETTE_MAX_SURVIVAL, ROULETTE_START, Settings};

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
    pub face: u32,
}

impl PathSample {
    /// Adds light of a style that was sampled at path vertex `k - 1`, at brightness 1 if the styles are
    /// told apart.
    fn add_sampled(&mut self, k: u32, radiance: DVec3, style: usize, world: &World) {
        if style == 0 || radiance == DVec3::ZERO {
            self.add(k, radiance);
            return;
        }
        self.add(k, radiance * f64::from(world.styles[style].brightness));
        self.styled.push((style, radiance));
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

/// Follows one path from the camera ray `ray`.
pub(crate) fn trace_path(
    world: &World,
    settings: &Settings,
    mut ray: Ray,
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
    let mut throughput = DVec3::ONE;
    // Density of the ray's direction at the vertex before.
    let mut pdf_direction = 0.0;
    // How lights were chosen at the vertex before; at the camera they were not.
    let mut choice = Choice::NONE;
    // Whether light that the ray finds was not sampled at the vertex before.
    let mut is_found_alone = true;
    let mut depth_along = Depth::new(world.absorption_at(ray.origin));
    // Distance of the last interface that the ray passed straight through, and how many it passed.
    let (mut passed, mut passages) = (0.0, 0);
    let mut sight = Sight::CAMERA;
    let mut k = 1_u32;
    loop {
        rng.begin_vertex(k);
        sample.rays += 1;
        let Some(hit) = world.closest_hit(&ray, passed, sight, stack) else {
            sample.escaped = Some(ray);
            return sample;
        };
        let point = world.surface_point(&hit);
        let arriving = throughput * depth_along.transmittance(hit.at.t);

        // Of emission that light sampling would have found with this density.
        let weight = |pdf_light: f64| match estimator {
            _ if is_found_alone => 1.0,
            Estimator::Naive | Estimator::Uniform => 1.0,
            Estimator::Nee => 0.0,
            Estimator::Mis => mis_weight(pdf_direction, pdf_light),
        };
        let emitted = world.emitted(&point, ray.direction);
        if emitted != DVec3::ZERO {
            let pdf_light = world.pdf_light(&choice, &point, ray.direction, hit.at.t);
            sample.add(k, arriving * emitted * weight(pdf_light));
        }
        if point.material.surface == Surface::Sky {
            sample.add(k, arriving * world.suns(&choice, ray.direction, weight));
        }

        let finish = &point.material.finish;
        let normal = point.facing_normal();
        let event = if finish.alpha < 1.0 {
            let cos = normal.dot(ray.direction).abs();
            sample_event(finish, cos, rng.next())
        } else {
            Event::Paint
        };
        if event == Event::Pass {
            passages += 1;
            if passages > MAX_PASSAGES {
                return sample;
            }
            throughput *= finish.tint.as_dvec3();
            depth_along.pass(finish, point.front, hit.at.t);
            passed = hit.at.t;
            continue;
        }
        throughput = arriving;
        (passed, passages) = (0.0, 0);
        depth_along = Depth::new(depth_along.absorption());

        let albedo = world.albedo(&point);
        if k == 1 {
            sample.first = Some(FirstHit {
                albedo,
                normal,
                position: point.position,
                face: point.face,
            });
        }
        // Black surfaces, the sky among them, end the path.
        let bsdf = world.bsdf(&point, albedo, -ray.direction);
        if k == depth || (event == Event::Paint && bsdf.is_black()) {
            return sample;
        }

        is_found_alone = event == Event::Reflect;
        if event == Event::Paint && estimator.samples_lights() {
            let moving = world.moving.share;
            choice = Choice::at(&world.scene, selection, point.spawn_origin(), moving);
            let vertex = Vertex {
                point,
                bsdf,
                absorption: depth_along.absorption(),
            };
            let light = sample_light(world, settings, &choice, &vertex, rng, stack);
            sample.rays += u64::from(light.rays);
            sample.add_sampled(k + 1, throughput * light.radiance, light.style, world);
        }

        let direction = if event == Event::Reflect {
            let cos = normal.dot(ray.direction).abs();
            (ray.direction + normal * (2.0 * cos)).normalize()
        } else {
            let u = rng.next2();
            let next = match estimator {
                Estimator::Uniform => bsdf.sample_uniformly(u),
                _ => bsdf.sample(u, || rng.next()),
            };
            if next.weight == DVec3::ZERO {
                return sample;
            }
            pdf_direction = next.pdf;
            throughput *= next.weight;
            next.direction
        };
        if depth == 0 && k >= ROULETTE_START {
            let survival = throughput.max_element().min(ROULETTE_MAX_SURVIVAL);
            if rng.next() >= survival {
                return sample;
            }
            throughput /= survival;
        }
        ray = Ray::new(point.spawn_origin(), direction);
        sight = world.sight_from(&point);
        k += 1;
    }
}
