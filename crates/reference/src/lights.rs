//! Light sampling: one emitter, one point of it, one shadow ray.

use crate::bsdf::Bsdf;
use crate::bvh::Stack;
use crate::choice::{Choice, sample_alias};
use crate::compiler::eval_compiler_light;
use crate::rng::Rng;
use crate::shading::{
    mis_weight, pdf_area_to_solid_angle, pdf_sphere_cone, sample_sphere_cone, spawn_origin,
    sphere_cone_height, sphere_near_distance, sphere_radiance, spot_factor,
};
use crate::triangle::Ray;
use crate::world::{SurfacePoint, World};
use glam::DVec3;
use scene::PointLight;
use scene::emitter::MovingLight;
use scene::light::CompilerLight;
use scene::render::{Estimator, MOST_CANDIDATES, Settings};

/// A light sample at a vertex.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LightSample {
    /// Radiance reflected towards the viewer.
    pub radiance: DVec3,
    /// Which of the scene's styles it shines in; its brightness is not in the radiance.
    pub style: usize,
    /// Rays that were traced.
    pub rays: u32,
}

/// A light sample before it is known whether anything is between.
struct Candidate {
    /// Emitted radiance over the density, weighted.
    radiance: DVec3,
    /// Unit direction to it.
    direction: DVec3,
    end: End,
}

/// Where the light comes from.
enum End {
    /// A point, world space: nothing may be between.
    At(DVec3),
    /// Far away: a sky face must be the first thing in its direction.
    Sky,
}

/// A path vertex that light is sampled at.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vertex<'a> {
    /// Where it is.
    pub point: SurfacePoint<'a>,
    /// What it reflects.
    pub bsdf: Bsdf,
    /// Absorption of what it lies in, per world unit.
    pub absorption: DVec3,
}

impl Vertex<'_> {
    /// Weight of a light sample in `direction` that a ray could have found, too.
    fn light_weight(&self, estimator: Estimator, pdf_light: f64, direction: DVec3) -> f64 {
        match estimator {
            Estimator::Mis => mis_weight(pdf_light, self.bsdf.pdf(direction)),
            _ => 1.0,
        }
    }
}

/// Samples one light as seen from a vertex, out of several candidates by the choice there: in
/// proportion to the luminance that each would add, and for the mean of all (Talbot, Cline and Egbert
/// 2005). The weights against hitting the light are those of a single candidate.
pub(crate) fn sample_light(
    world: &World,
    settings: &Settings,
    choice: &Choice<'_>,
    vertex: &Vertex<'_>,
    rng: &mut Rng,
    stack: &mut Stack,
) -> LightSample {
    if world.scene.emitters.total_weight <= 0.0 && world.moving.share <= 0.0 {
        return LightSample::default();
    }
    let count = settings.candidates.clamp(1, MOST_CANDIDATES);
    let (mut kept, mut sum) = (None, 0.0);
    for _ in 0..count {
        let candidate = sample_candidate(world, settings.estimator, choice, vertex, rng);
        if let Some((candidate, style)) = candidate {
            let reflected = candidate.radiance * vertex.bsdf.eval(candidate.direction);
            // Compilers know lights that take light away.
            let target = luminance(reflected.abs());
            sum += target;
            if rng.next() * sum < target {
                kept = Some((candidate, style, reflected, target));
            }
        }
    }
    let Some((Candidate { direction, end, .. }, style, reflected, target)) = kept else {
        return LightSample::default();
    };
    let radiance = reflected * (sum / (target * f64::from(count)));
    let origin = vertex.point.spawn_origin();
    let sight = world.sight_from(&vertex.point);
    let (arriving, rays) = match end {
        End::At(end) => {
            let arriving = world.transmittance(vertex.absorption, origin, end, sight, stack);
            (arriving, 1)
        }
        End::Sky => {
            let ray = Ray::new(origin, direction);
            world.transmittance_of_sky(vertex.absorption, &ray, sight, stack)
        }
    };
    LightSample {
        radiance: if arriving == DVec3::ZERO {
            DVec3::ZERO
        } else {
            radiance * arriving
        },
        style,
        rays,
    }
}

/// Luminance of linear RGB.
fn luminance(rgb: DVec3) -> f64 {
    rgb.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

/// One light sample as seen from a point, and which of the scene's styles it shines in; `None` if it
/// can add nothing.
fn sample_candidate(
    world: &World,
    estimator: Estimator,
    choice: &Choice<'_>,
    vertex: &Vertex<'_>,
    rng: &mut Rng,
) -> Option<(Candidate, usize)> {
    let emitters = &world.scene.emitters;
    let moves = world.moving.share > 0.0 && rng.next() < f64::from(world.moving.share);
    if moves {
        let candidate = sample_moving(world, estimator, choice, vertex, rng);
        return candidate.map(|candidate| (candidate, 0));
    }
    let entry = choice.sample(rng)?;
    let u = rng.next2();
    let (listed, lights) = (emitters.list.len(), world.scene.lights.len());
    let mut style = 0;
    let candidate = if entry < listed {
        sample_emitter(world, estimator, choice, vertex, (0, entry as u32), u)
    } else if entry < listed + lights {
        let light = &world.lights[entry - listed];
        style = world.scene.style_of(light);
        // A style that is dark now does not change the choice.
        let weight = world.scene.lights[entry - listed].weight();
        let power = f64::from(weight) / f64::from(emitters.total_weight);
        let pdf_choice = choice.probability(entry as u32, power);
        match &light.compiler {
            None => sample_point_light(&vertex.point, light, pdf_choice, u),
            Some(compiler) => compiler_candidate(&vertex.point, light, compiler, pdf_choice),
        }
    } else {
        sample_sun(world, estimator, choice, vertex, entry - listed - lights, u)
    };
    candidate.map(|candidate| (candidate, style))
}

/// One light sample of what moves.
fn sample_moving(
    world: &World,
    estimator: Estimator,
    choice: &Choice<'_>,
    vertex: &Vertex<'_>,
    rng: &mut Rng,
) -> Option<Candidate> {
    let moving = &world.moving;
    let entry = sample_alias(&moving.alias, rng.next());
    match moving.lights[entry] {
        MovingLight::Point(number) => {
            let pdf_choice = f64::from(moving.share) * f64::from(moving.probabilities[entry]);
            let light = &world.frame_lights[number as usize];
            sample_point_light(&vertex.point, light, pdf_choice, rng.next2())
        }
        MovingLight::Instance { number, list } => {
            let list = &world.scene.moving.lists[list as usize];
            let emitter = sample_alias(&list.alias, rng.next()) as u32;
            let u = rng.next2();
            sample_emitter(world, estimator, choice, vertex, (number, emitter), u)
        }
    }
}

/// Estimate of the light from a point of an emitter: part and number there.
fn sample_emitter(
    world: &World,
    estimator: Estimator,
    choice: &Choice<'_>,
    vertex: &Vertex<'_>,
    (part, number): (u32, u32),
    u: [f64; 2],
) -> Option<Candidate> {
    let point = &vertex.point;
    let emitter = &world.emitters_of(part)?.list[number as usize];
    let light = world.sample_emitter_point(part, emitter, u, point.position)?;
    let to_light = light.position - point.position;
    let distance2 = to_light.length_squared();
    let direction = to_light / distance2.sqrt();
    let cos = direction.dot(point.facing_normal());
    let cos_light = light.normal.dot(direction);
    // Not the complement: none of this must pass if it is not a number.
    if !(cos > 0.0 && cos_light != 0.0) {
        return None;
    }
    let emitted = world.emitted(&light, direction);
    if emitted == DVec3::ZERO {
        return None;
    }
    let pdf_area = world.pdf_light_area(choice, number, &light);
    let pdf_light = pdf_area_to_solid_angle(pdf_area, distance2, cos_light);
    let weight = vertex.light_weight(estimator, pdf_light, direction);
    Some(Candidate {
        radiance: emitted * (weight / pdf_light),
        direction,
        end: End::At(spawn_origin(
            light.position,
            light.facing_normal(),
            light.error,
        )),
    })
}

/// Estimate of the light from a uniform direction to a sphere; `pdf_choice` is the probability with
/// which it was chosen among the lights.
fn sample_point_light(
    point: &SurfacePoint<'_>,
    light: &PointLight,
    pdf_choice: f64,
    u: [f64; 2],
) -> Option<Candidate> {
    let radius = f64::from(light.radius);
    let to_centre = light.position.as_dvec3() - point.position;
    let distance = to_centre.length();
    if distance <= radius {
        return None;
    }
    let axis = to_centre / distance;
    let factor = light.spot.as_ref().map_or(1.0, |spot| {
        spot_factor(spot, spot.direction.as_dvec3().dot(-axis))
    });
    let height = sphere_cone_height((radius / distance).powi(2));
    let (direction, h) = sample_sphere_cone(axis, height, u);
    let cos = direction.dot(point.facing_normal());
    if !(cos > 0.0 && factor > 0.0) {
        return None;
    }
    let pdf_light = pdf_choice * pdf_sphere_cone(height);
    let emitted = sphere_radiance(light.intensity.as_dvec3(), radius) * factor;
    Some(Candidate {
        radiance: emitted / pdf_light,
        direction,
        end: End::At(point.position + direction * sphere_near_distance(distance, radius, h)),
    })
}

/// Irradiance from a light by a compiler's formula, which was chosen with probability `pdf_choice`.
fn compiler_candidate(
    point: &SurfacePoint<'_>,
    light: &PointLight,
    compiler: &CompilerLight,
    pdf_choice: f64,
) -> Option<Candidate> {
    let at = point.position;
    let normal = point.facing_normal();
    let sample = eval_compiler_light(light, compiler, at, normal)?;
    Some(Candidate {
        // The irradiance counts the cosine in its own way.
        radiance: sample.irradiance / (normal.dot(sample.direction) * pdf_choice),
        direction: sample.direction,
        end: match sample.distance {
            Some(distance) => End::At(at + sample.direction * distance),
            None => End::Sky,
        },
    })
}

/// Estimate of the light from a uniform direction to a sun.
fn sample_sun(
    world: &World,
    estimator: Estimator,
    choice: &Choice<'_>,
    vertex: &Vertex<'_>,
    index: usize,
    u: [f64; 2],
) -> Option<Candidate> {
    let sun = &world.scene.sky.suns[index];
    let axis = sun.direction.as_dvec3().normalize();
    let (direction, _) = sample_sphere_cone(axis, f64::from(sun.one_minus_cos), u);
    let cos = direction.dot(vertex.point.facing_normal());
    let pdf_light = world.pdf_sun(choice, index);
    if !(cos > 0.0 && pdf_light > 0.0) {
        return None;
    }
    let weight = vertex.light_weight(estimator, pdf_light, direction);
    Some(Candidate {
        radiance: sun.radiance.as_dvec3() * (weight / pdf_light),
        direction,
        end: End::Sky,
    })
}
