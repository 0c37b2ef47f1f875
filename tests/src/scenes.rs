//! Scenes that more than one test needs.

use crate::builder::{Builder, camera, list_emitters};
use glam::{Affine3A, EulerRot, Quat, Vec3};
use scene::sky::{SkyKind, Sun};
use scene::{Scene, Sky};
use std::sync::Arc;

/// Two layers, each with two colours, the front one with holes.
pub fn scrolling(b: &mut Builder) -> Sky {
    let back = b.texture(2, vec![[200, 120, 60, 255], [60, 60, 160, 255]]);
    let front = b.texture(2, vec![[0, 0, 0, 0], [220, 220, 230, 255]]);
    Sky {
        kind: SkyKind::Scrolling { back, front },
        scale: [Vec3::new(1.5, 1.4, 1.3), Vec3::new(0.5, 0.7, 0.9)],
        ..Sky::default()
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

/// The [`room`] with suns: wide ones, so that they are found by chance.
#[must_use]
pub fn sunny_room() -> Arc<Scene> {
    let mut scene = Arc::unwrap_or_clone(room());
    let sun =
        |direction: Vec3, radius, irradiance| Sun::new(direction.normalize(), radius, irradiance);
    scene.sky.suns = vec![
        sun(Vec3::new(0.4, 0.1, 1.0), 0.35, Vec3::new(1.5, 1.2, 0.8)),
        sun(Vec3::new(-0.3, 0.5, 1.0), 0.25, Vec3::new(0.2, 0.3, 0.6)),
    ];
    list_emitters(&mut scene);
    Arc::new(scene.completed())
}

/// A view of most of the [`room`].
#[must_use]
pub fn room_view() -> scene::Camera {
    camera(Vec3::new(0.0, -30.0, 5.0), 20.0, 80.0, 100.0)
}

/// The camera's space is filled with what this material absorbs, below the height `top`.
pub fn fill_below(b: &mut Builder, top: f32, material: scene::MaterialId) {
    b.scene.media.nodes = vec![scene::cells::CellNode {
        normal: Vec3::Z,
        distance: top,
        children: [scene::cells::CELL, scene::cells::CELL | (material.0 + 1)],
    }];
}

/// A room half full of water: a lamp below the surface and one above, a skylight with a sun, a pane of coloured
/// glass, a glowing sheet that light passes, and bars in the water.
#[must_use]
pub fn pool() -> Arc<Scene> {
    let mut b = Builder::new();
    let (wall, sky, lamp) = (b.plain(170, 0.0), b.sky(0.5), b.plain(90, 5.0));
    let colours = vec![[200, 160, 90, 255], [90, 160, 200, 255]];
    let (base, glow) = (b.texture(2, colours.clone()), b.texture(2, colours));
    let water = b.material(base, None, 0.0);
    *b.edit(water) = scene::Material {
        warped: true,
        two_sided: true,
        finish: scene::Finish {
            alpha: 0.25,
            ior: 1.33,
            tint: Vec3::ONE,
            absorption: Vec3::new(0.02, 0.01, 0.004),
            ..scene::Finish::default()
        },
        ..b.edit(water).clone()
    };
    let glass = b.plain(200, 0.0);
    b.edit(glass).finish = scene::Finish {
        alpha: 0.1,
        ior: 1.5,
        tint: Vec3::new(0.5, 0.9, 0.7),
        ..scene::Finish::default()
    };
    let sheet = b.material(base, Some(glow), 1.0);
    b.edit(sheet).two_sided = true;
    b.edit(sheet).finish = scene::Finish {
        alpha: 0.5,
        ior: 1.33,
        ..scene::Finish::default()
    };
    let holes = b.texture(
        2,
        vec![[150, 140, 130, 255], [0; 4], [0; 4], [150, 140, 130, 255]],
    );
    let bars = b.material(holes, None, 0.0);
    b.edit(bars).alpha_tested = true;
    let walls = [wall, wall, wall, wall, wall, sky];
    b.cuboid(Vec3::splat(-40.0), Vec3::splat(40.0), true, walls);
    b.slab(Vec3::ZERO, [40.0; 2], true, water, [128.0; 2]);
    b.slab(Vec3::new(20., 10., -25.), [9.0, 7.0], false, lamp, [1.0; 2]);
    b.slab(Vec3::new(-20., 15., 30.), [8.0; 2], false, lamp, [1.0; 2]);
    b.slab(Vec3::new(0., 10., -12.), [20.0; 2], true, bars, [9.0; 2]);
    b.slab(Vec3::new(10., 20., 15.), [12.0; 2], true, sheet, [3.0; 2]);
    let (min, max) = (Vec3::new(-30., -5., -15.), Vec3::new(0., -2., 25.));
    b.cuboid(min, max, false, [glass; 6]);
    fill_below(&mut b, 0.0, water);
    b.scene.sky = scrolling(&mut b);
    let direction = Vec3::new(0.1, 0.4, 1.0).normalize();
    b.scene.sky.suns = vec![Sun::new(direction, 0.3, Vec3::new(1.0, 0.9, 0.6))];
    b.build()
}

/// Views of the [`pool`] from above the water and from below.
#[must_use]
pub fn pool_views() -> [scene::Camera; 2] {
    [
        camera(Vec3::new(5.0, -35.0, 20.0), 35.0, 95.0, 100.0),
        camera(Vec3::new(-25.0, -30.0, -20.0), -10.0, 60.0, 100.0),
    ]
}

/// A room with a glossy floor of uneven roughness, walls of metal and of bumps, a lamp and a skylight.
#[must_use]
pub fn polished() -> Arc<Scene> {
    let mut b = Builder::new();
    let (wall, sky, lamp) = (b.plain(170, 0.0), b.sky(0.5), b.plain(90, 6.0));
    let colours = vec![
        [200, 160, 90, 255],
        [90, 160, 200, 255],
        [30, 30, 30, 255],
        [220; 4],
    ];
    let base = b.texture(2, colours);
    let scales = b.texture(2, vec![[255; 4], [140; 4], [200; 4], [100; 4]]);
    let tilts = [
        [200, 128, 230],
        [60, 160, 225],
        [128, 60, 230],
        [128, 128, 255],
    ];
    let normals = b.texture(2, tilts.map(|[x, y, z]| [x, y, z, 255]).to_vec());
    let [floor, metal, bumps, shiny_bumps] = [(); 4].map(|()| b.material(base, None, 0.0));
    let gloss = |roughness, metallic, roughness_map| {
        Some(scene::gloss::Gloss {
            roughness,
            metallic,
            specular: 0.6,
            roughness_map,
        })
    };
    b.edit(floor).finish.gloss = gloss(0.6, 0.0, Some(scales));
    b.edit(metal).finish.gloss = gloss(0.4, 1.0, None);
    b.edit(bumps).finish.normals = Some(normals);
    b.edit(shiny_bumps).finish.normals = Some(normals);
    b.edit(shiny_bumps).finish.gloss = gloss(0.5, 0.4, None);
    let (min, max) = (Vec3::splat(-40.0), Vec3::splat(40.0));
    let walls = [metal, bumps, wall, shiny_bumps, floor, sky];
    for (corners, material) in crate::builder::cuboid_sides(min, max, true)
        .into_iter()
        .zip(walls)
    {
        b.quad(corners, material, [7.0, 5.0]);
    }
    b.slab(Vec3::new(15., 10., 20.), [10.0, 8.0], false, lamp, [1.0; 2]);
    b.cuboid(
        Vec3::new(-20., 5., -40.),
        Vec3::new(0., 25., -15.),
        false,
        [shiny_bumps; 6],
    );
    b.transform(Affine3A::from_rotation_x(0.3));
    b.scene.sky = scrolling(&mut b);
    b.build()
}

/// A scene filled with fog; its sky, if it has one, is veiled by half.
#[must_use]
pub fn in_fog(scene: Arc<Scene>, extinction: f32, albedo: Vec3) -> Arc<Scene> {
    let mut scene = Arc::unwrap_or_clone(scene);
    scene.fog = Some(scene::Fog { extinction, albedo });
    for (veil, scale) in scene.sky.veil.iter_mut().zip(&mut scene.sky.scale) {
        *scale *= 0.5;
        *veil = *scale * 0.3;
    }
    list_emitters(&mut scene);
    Arc::new(scene.completed())
}
