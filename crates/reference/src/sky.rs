//! What sky faces show, and the light of suns.

use crate::bvh::Stack;
use crate::choice::Choice;
use crate::lights::Light;
use crate::part::Sight;
use crate::passage::{Depth, MAX_PASSAGES, eval_passage};
use crate::shading::{pdf_sphere_cone, scroll_uv, sky_half, sun_is_seen, texel_index};
use crate::triangle::Ray;
use crate::world::{World, size};
use glam::{DVec2, DVec3};
use scene::sky::{BACK_SPEED, FRONT_SPEED, SkyKind, box_texel, box_uv};
use scene::{Surface, TextureId};

/// Texels of a sky layer's tile, whatever the picture's size.
const SKY_TILE: f64 = 128.0;

impl World {
    /// Radiance of the sky's picture in a direction.
    pub fn sky_radiance(&self, direction: DVec3) -> DVec3 {
        let sky = &self.scene.sky;
        let shown = match sky.kind {
            SkyKind::None => DVec3::ZERO,
            SkyKind::Flat(radiance) => radiance.as_dvec3(),
            SkyKind::Box(first) => {
                let (side, place) = box_uv(direction.to_array());
                let texture = self.texture(TextureId(first.0 + side as u32));
                self.decode(texture.rgba[box_texel(texture, place)])
            }
            SkyKind::Scrolling { back, front } => {
                let layer = |id: TextureId, speed| {
                    let texture = self.texture(id);
                    let uv = DVec2::from(scroll_uv(direction.to_array(), self.time, speed));
                    texture.rgba[texel_index(texture, uv / SKY_TILE * size(texture))]
                };
                let over = layer(front, FRONT_SPEED);
                self.decode(if over[3] == 0 {
                    layer(back, BACK_SPEED)
                } else {
                    over
                })
            }
        };
        let half = sky_half(direction);
        let [scale, veil] = self.sky.map(|halves| halves[half].as_dvec3());
        shown * scale + veil
    }

    /// Radiance of all suns in a direction, each times what `weight` says of the density with which
    /// it would have been sampled by `choice`.
    pub fn suns(
        &self,
        choice: &Choice<'_>,
        direction: DVec3,
        weight: impl Fn(f64) -> f64,
    ) -> DVec3 {
        let seen =
            (self.scene.sky.suns.iter().enumerate()).filter(|(_, sun)| sun_is_seen(sun, direction));
        seen.map(|(i, sun)| sun.radiance.as_dvec3() * weight(self.pdf_sun(choice, i)))
            .sum()
    }

    /// Density per steradian with which light sampling chooses a direction to a sun.
    pub fn pdf_sun(&self, choice: &Choice<'_>, sun: usize) -> f64 {
        let height = f64::from(self.scene.sky.suns[sun].one_minus_cos);
        Light::Sun(sun).probability(self, choice) * pdf_sphere_cone(height)
    }

    /// Share of the light that arrives at a ray's origin from the sky, and how many rays were traced
    /// to know: none unless a sky face is the first thing that lets no light pass straight through.
    /// `absorption` is that at the origin.
    pub fn transmittance_of_sky(
        &self,
        absorption: DVec3,
        ray: &Ray,
        sight: Sight,
        stack: &mut Stack,
    ) -> (DVec3, u32) {
        let (mut surfaces, mut depth) = (DVec3::ONE, Depth::new(absorption));
        let mut passed = 0.0;
        for rays in 1..=MAX_PASSAGES + 1 {
            let Some(hit) = self.closest_hit(ray, passed, sight, stack) else {
                return (DVec3::ZERO, rays);
            };
            let point = self.surface_point(&hit);
            if point.material.surface == Surface::Sky {
                let clear = self.clear(hit.at.t);
                return (surfaces * depth.transmittance(hit.at.t) * clear, rays);
            }
            let finish = &point.material.finish;
            if finish.alpha >= 1.0 {
                return (DVec3::ZERO, rays);
            }
            surfaces *= eval_passage(finish, point.normal.dot(ray.direction).abs());
            depth.pass(finish, point.front, hit.at.t);
            passed = hit.at.t;
        }
        (DVec3::ZERO, MAX_PASSAGES + 1)
    }
}
