//! Scenes that more than one test needs.

use crate::builder::{Builder, camera};
use glam::{Affine3A, EulerRot, Quat, Vec3};
use scene::sky::SkyKind;
use scene::{Scene, Sky};
use std::sync::Arc;

/// Two layers, each with two colours, the front one with holes.
pub fn scrolling(b: &mut Builder) -> Sky {
    let back = b.texture(2, vec![[200, 120, 60, 255], [60, 60, 160, 255]]);
    let front = b.texture(2, vec![[0, 0, 0, 0], [220, 220, 230, 255]]);
    Sky {
        kind: SkyKind::Scrolling { back, front },
        scale: 1.5,
    }
}

/// A room with a skylight, a lamp with bright and dark texels, a glowing two-sided warped sheet, and
/// a bench that casts shadows; `Vec3::ZERO` is free.
#[must_use]
pub fn room() -> Arc<Scene> {
    let mut b = Builder::new();
    let (wall, sky) = (b.plain(170, 0.0), b.sky(0.5));
    let colours = vec![
        [255, 200, 90, 255],
        [0, 0, 0, 255],
        [0, 0, 0, 255],
        [90, 160, 255, 255],
    ];
    let (base, glow) = (b.texture(2, colours.clone()), b.texture(2, colours));
    let lamp = b.material(base, Some(glow), 6.0);
    let lava = b.material(base, Some(glow), 1.0);
    b.edit(lava).two_sided = true;
    b.edit(lava).warped = true;
    let walls = [wall, wall, wall, wall, wall, sky];
    b.cuboid(Vec3::splat(-40.0), Vec3::splat(40.0), true, walls);
    b.slab(
        Vec3::new(15., 10., 20.),
        [12.0, 9.0],
        false,
        lamp,
        [5.0, 4.0],
    );
    b.slab(
        Vec3::new(-20., 5., -20.),
        [15.0, 15.0],
        true,
        lava,
        [128.0, 128.0],
    );
    let (min, max) = (Vec3::new(5., -25., -40.), Vec3::new(30., 0., -25.));
    b.cuboid(min, max, false, [wall; 6]);
    b.transform(Affine3A::from_quat(Quat::from_euler(
        EulerRot::XYZ,
        0.2,
        -0.1,
        0.4,
    )));
    b.scene.sky = scrolling(&mut b);
    b.build()
}

/// A view of most of the [`room`].
#[must_use]
pub fn room_view() -> scene::Camera {
    camera(Vec3::new(0.0, -30.0, 5.0), 20.0, 80.0, 100.0)
}
