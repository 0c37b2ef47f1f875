//! What light passes straight through: interfaces, and what absorbs between them.

use crate::shading::fresnel_dielectric;
use glam::DVec3;
use scene::Finish;

/// Straight passages between two path vertices at most: a path that needs more ends.
pub(crate) const MAX_PASSAGES: u32 = 256;

/// What happens to a path at an interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Event {
    /// It meets the painted part, which scatters as any surface.
    Paint,
    /// It is mirrored.
    Reflect,
    /// It goes straight on.
    Pass,
}

/// Chooses what happens at an interface met under the cosine `cos`, each with its share of the light.
pub(crate) fn sample_event(finish: &Finish, cos: f64, u: f64) -> Event {
    let alpha = f64::from(finish.alpha);
    let mirrored = (1.0 - alpha) * fresnel_dielectric(cos, f64::from(finish.ior));
    if u < alpha {
        Event::Paint
    } else if u < alpha + mirrored {
        Event::Reflect
    } else {
        Event::Pass
    }
}

/// Light that passes an interface straight on, of what comes.
pub(crate) fn eval_passage(finish: &Finish, cos: f64) -> DVec3 {
    let passing = 1.0 - fresnel_dielectric(cos, f64::from(finish.ior));
    finish.tint.as_dvec3() * ((1.0 - f64::from(finish.alpha)) * passing)
}

/// Absorption along a straight ray, which may enter and leave media in any order.
///
/// Media are counted, not nested: an interface adds its absorption where the ray enters by its
/// front and takes it off where it leaves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Depth {
    /// Absorption at the ray's origin, per world unit.
    start: DVec3,
    /// Sum over the interfaces passed: absorption behind each.
    changes: DVec3,
    /// The same, times the distance.
    moments: DVec3,
}

impl Depth {
    /// For a ray that begins where `absorption` is.
    pub fn new(absorption: DVec3) -> Self {
        Self {
            start: absorption,
            changes: DVec3::ZERO,
            moments: DVec3::ZERO,
        }
    }

    /// The ray passes an interface at `distance`, from its front or its back.
    pub fn pass(&mut self, finish: &Finish, front: bool, distance: f64) {
        let behind = finish.absorption.as_dvec3();
        let change = if front { behind } else { -behind };
        self.changes += change;
        self.moments += change * distance;
    }

    /// What is left of light that travels from `distance` to the origin. Interfaces that enclose
    /// nothing may sum to a negative depth, which counts as none.
    pub fn transmittance(&self, distance: f64) -> DVec3 {
        let depth = (self.start + self.changes) * distance - self.moments;
        (-depth.max(DVec3::ZERO)).exp()
    }

    /// Absorption where the ray is after all it passed.
    pub fn absorption(&self) -> DVec3 {
        (self.start + self.changes).max(DVec3::ZERO)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn water(absorption: f32) -> Finish {
        Finish {
            alpha: 0.25,
            ior: 1.33,
            tint: Vec3::ONE,
            absorption: Vec3::splat(absorption),
            ..Finish::default()
        }
    }

    #[test]
    fn events_come_as_often_as_light_is_shared() {
        let finish = water(0.0);
        for cos in [0.05, 0.3, 1.0] {
            let n = 100_000;
            let share = |event| {
                let hits = (0..n)
                    .filter(|&i| {
                        sample_event(&finish, cos, (f64::from(i) + 0.5) / f64::from(n)) == event
                    })
                    .count();
                hits as f64 / f64::from(n)
            };
            let passing = eval_passage(&finish, cos).x;
            assert!((share(Event::Paint) - 0.25).abs() < 2e-5);
            assert!((share(Event::Pass) - passing).abs() < 2e-5);
            assert!((share(Event::Reflect) - (0.75 - passing)).abs() < 2e-5);
        }
    }

    #[test]
    fn depth_is_what_lies_inside_whatever_the_order() {
        let finish = water(0.1);
        // In at 2, out at 5, in at 7, seen from 10: six units of water.
        let crossings = [(true, 2.0), (false, 5.0), (true, 7.0)];
        for order in [[0, 1, 2], [2, 0, 1], [1, 2, 0]] {
            let mut depth = Depth::new(DVec3::ZERO);
            for i in order {
                let (front, at) = crossings[i];
                depth.pass(&finish, front, at);
            }
            assert!((depth.transmittance(10.0).x - (-0.6_f64).exp()).abs() < 1e-7);
            assert!((depth.absorption().x - 0.1).abs() < 1e-7);
        }
        // From inside, out at 4.
        let mut depth = Depth::new(DVec3::splat(f64::from(0.1_f32)));
        depth.pass(&finish, false, 4.0);
        assert!((depth.transmittance(9.0).x - (-0.4_f64).exp()).abs() < 1e-7);
        assert_eq!(depth.absorption(), DVec3::ZERO);
        // Out of what it never was in: no light comes of nothing.
        depth.pass(&finish, false, 5.0);
        assert_eq!(depth.transmittance(1e6), DVec3::ONE);
        assert_eq!(depth.absorption(), DVec3::ZERO);
    }
}
