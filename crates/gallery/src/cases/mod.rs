//! The cases.

mod boxes;
mod cameras;
mod fog;
mod gloss;
mod imported;
mod lamps;
mod water;

use crate::builder::Builder;
use crate::case::Case;
use glam::{Affine3A, EulerRot, Quat, Vec3};
use scene::MaterialId;
use scene::material::srgb_to_linear;

/// All cases, in a fixed order: boxes, cameras, water, fog, gloss, lamps, levels.
#[must_use]
pub fn cases() -> Vec<Case> {
    let mut all = boxes::cases();
    all.extend(cameras::cases());
    all.extend(water::cases());
    all.extend(fog::cases());
    all.extend(gloss::cases());
    all.extend(lamps::cases());
    all.extend(imported::cases());
    all
}

/// sRGB byte of most surfaces built by hand.
const GREY: u8 = 188;

/// The share of light that [`GREY`] reflects.
fn rho() -> f64 {
    srgb_to_linear(GREY)
}

/// Rays of 10^9 that devices may lead astray where [`CROSSING`] says why. An H200 was seen to lose 7 to 20
/// in such scenes, and none in those whose surfaces share their edges.
const ASTRAY: f64 = 30.0;
/// What no intersection test in single precision is sure about.
const CROSSING: &str = "surfaces cross or touch without sharing an edge: devices test them without knowing \
    of each other, and a ray within rounding of where they meet may find either or none";

/// A turn that leaves no coordinate simple.
fn odd_turn() -> Affine3A {
    Affine3A::from_quat(Quat::from_euler(EulerRot::XYZ, 0.3, 0.5, 0.7))
}

/// A material that emits what it does not reflect, to both sides if `two_sided`: where all are
/// such, radiance is 1 everywhere.
fn balanced(b: &mut Builder, grey: u8, two_sided: bool) -> MaterialId {
    let material = b.plain(grey, 1.0 - srgb_to_linear(grey) as f32);
    b.edit(material).two_sided = two_sided;
    material
}

/// A box of one material that faces inwards, `half` units around `centre`.
fn box_around(b: &mut Builder, centre: Vec3, half: f32, material: MaterialId) {
    let half = Vec3::splat(half);
    b.cuboid(centre - half, centre + half, true, [material; 6]);
}

#[cfg(test)]
mod tests {
    use super::cases;
    use std::collections::HashSet;

    #[test]
    fn every_scene_can_be_made_and_holds_its_facts() {
        let all = cases();
        let names: HashSet<&str> = all.iter().map(|c| c.name).collect();
        assert_eq!(names.len(), all.len(), "names are unique");
        for case in &all {
            let scene = case.scene();
            assert!(scene.triangle_count() > 0, "{}", case.name);
            (case.facts)(scene).unwrap_or_else(|e| panic!("{}: {e}", case.name));
            assert!(!case.estimators.is_empty() && case.tests.ends_with('.'));
        }
    }
}
