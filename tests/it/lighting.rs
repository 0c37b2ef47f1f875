//! Light by the compilers' formulas, by lightmaps, and none: closed forms, and both renderers alike.

use glam::{Vec2, Vec3};
use runelight_tests::builder::{Builder, list_emitters, mean_and_error, probe, settings};
use runelight_tests::devices::{Device, render};
use runelight_tests::levels;
use runelight_tests::stats::ZTest;
use scene::Scene;
use scene::baked::{BakedLight, BakedTriangle};
use scene::import::{ImportOptions, Lighting};
use scene::light::{CompilerLight, Falloff, LightSums, PointLight, Spot, StyleSum};
use scene::material::srgb_to_linear;
use scene::render::{Estimator, Selection};
use std::f64::consts::PI;
use std::sync::Arc;

const GREY: u8 = 180;

/// A plane under the light, in a box of sky if `sky`.
fn plane_under(light: PointLight, sky: bool) -> Arc<Scene> {
    let mut b = Builder::new();
    let ground = b.plain(GREY, 0.0);
    b.slab(Vec3::ZERO, [500.0; 2], true, ground, [1.0; 2]);
    if sky {
        let sky = b.sky(0.0);
        b.cuboid(Vec3::splat(-900.0), Vec3::splat(900.0), true, [sky; 6]);
    }
    b.light(light);
    b.build()
}

#[test]
fn a_compiler_light_gives_the_irradiance_of_its_formula() {
    let at = Vec3::new(3.0, -7.0, 100.0);
    let spot = Spot {
        direction: Vec3::NEG_Z,
        cos_inner: 0.95,
        cos_outer: 0.6,
    };
    type Share = fn(f64) -> f64;
    let cases: [(Falloff, Share); 5] = [
        (Falloff::Linear { reach: 160.0 }, |d| {
            (1.0 - d / 160.0).max(0.0)
        }),
        (Falloff::Inverse { scale: 2.0 }, |d| 128.0 / (2.0 * d)),
        (Falloff::InverseSquare { scale: 0.5 }, |d| {
            (128.0 / (0.5 * d)).powi(2)
        }),
        (Falloff::InverseSquareShifted { scale: 1.0 }, |d| {
            (128.0 / (d + 128.0)).powi(2)
        }),
        (Falloff::Constant, |_| 1.0),
    ];
    for (i, (falloff, share)) in cases.into_iter().enumerate() {
        let spot = (i % 2 == 0).then_some(spot);
        // One that takes light away among them.
        let intensity = Vec3::new(0.9, 0.5, -0.3);
        let scene = plane_under(
            PointLight {
                position: at,
                intensity,
                spot,
                compiler: Some(CompilerLight {
                    falloff,
                    angle_scale: 0.25,
                }),
                ..PointLight::default()
            },
            false,
        );
        for point in [Vec3::new(3.0, -7.0, 0.0), Vec3::new(90., 20., 0.)] {
            let to_light = (at - point).as_dvec3();
            let cos = to_light.normalize().z;
            let cone = spot.map_or(1.0, |_| ((cos - 0.6) / 0.35).clamp(0.0, 1.0));
            let lit = share(to_light.length()) * (0.75 + 0.25 * cos) * cone;
            let view = probe(point + Vec3::new(-50.0, -200.0, 50.0), point);
            for (device, estimator) in [
                (Device::Cpu, Estimator::Nee),
                (Device::Cpu, Estimator::Mis),
                (Device::Vulkan, Estimator::Nee),
            ] {
                let film = render(device, &scene, &settings(view.clone(), 4, estimator, 2), 4);
                let (mean, _) = mean_and_error(&film);
                for c in 0..3 {
                    let expected = f64::from(intensity[c]) * lit * srgb_to_linear(GREY) / PI;
                    // The camera's f32 angles limit how well the place is known.
                    let off = (mean[c] - expected).abs();
                    assert!(
                        off <= 2e-3 * expected.abs() + 1e-9,
                        "{falloff:?} at {point} on {device:?}: {} for {expected}",
                        mean[c]
                    );
                }
            }
        }
    }
}

#[test]
fn least_light_negative_light_and_gamma_are_in_the_compilers_order() {
    let light = |style, falloff, z, intensity: [f32; 3]| PointLight {
        position: Vec3::new(3.0, -7.0, z),
        intensity: intensity.into(),
        style,
        compiler: Some(CompilerLight {
            falloff,
            angle_scale: 0.0,
        }),
        ..PointLight::default()
    };
    let lights = [
        light(0, Falloff::Constant, 100.0, [0.2, 0.9, 0.1]),
        light(0, Falloff::Constant, 50.0, [0.1, 0.1, 0.1]),
        light(0, Falloff::Least, 90.0, [0.5, 0.5, 0.0]),
        light(0, Falloff::Constant, 80.0, [-0.05, -0.05, -0.6]),
        // The ground hides what lies under it.
        light(5, Falloff::Constant, 100.0, [0.1, 0.2, 0.0]),
        light(5, Falloff::Least, -10.0, [0.7; 3]),
    ];
    let style = |style, brightness, least: f32, first, count| StyleSum {
        style,
        brightness,
        least: Vec3::splat(least),
        first,
        count,
    };
    let styles = vec![style(0, 1.0, 0.3, 0, 4), style(5, 0.5, 0.0, 4, 2)];
    for (gamma, own) in [(1.0, 0.0), (1.6, 0.0), (1.0, 0.7)] {
        let dim = if own > 0.0 {
            [0.65, 0.95, 0.1]
        } else {
            [0.45, 0.95, 0.0]
        };
        let found = [(dim, 1.0), ([0.1, 0.2, 0.0], 0.5)];
        let mut scene = Arc::unwrap_or_clone(plane_under(PointLight::default(), false));
        scene.lights = lights.to_vec();
        scene.materials[0].least_light = Vec3::splat(own);
        let styles = styles.clone();
        scene.light_sums = Some(LightSums { gamma, styles });
        list_emitters(&mut scene);
        let scene = Arc::new(scene.completed());
        assert!(scene.features.light_sums);
        let view = probe(Vec3::new(-50.0, -200.0, 50.0), Vec3::ZERO);
        for device in Device::ALL {
            for estimator in [Estimator::Nee, Estimator::Mis] {
                let view = settings(view.clone(), 4, estimator, 2);
                let (mean, _) = mean_and_error(&render(device, &scene, &view, 4));
                for c in 0..3 {
                    let shown = found.map(|(sum, brightness): ([f64; 3], f64)| {
                        let white = 255.0 * PI / 128.0 * brightness;
                        white * (sum[c] / white).powf(1.0 / f64::from(gamma))
                    });
                    let expected = (shown[0] + shown[1]) * srgb_to_linear(GREY) / PI;
                    assert!(
                        (mean[c] - expected).abs() < 1e-5 * expected + 1e-9,
                        "{device:?}, gamma {gamma}: {mean:?}, {expected} in channel {c}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_sun_lights_what_sees_the_sky_in_its_direction() {
    let along = Vec3::new(0.6, 0.0, -0.8);
    let sun = PointLight {
        intensity: Vec3::ONE,
        compiler: Some(CompilerLight {
            falloff: Falloff::Sun(along),
            angle_scale: 1.0,
        }),
        ..PointLight::default()
    };
    for (sky, lit) in [(true, 0.8), (false, 0.0)] {
        let scene = plane_under(sun, sky);
        let view = probe(Vec3::new(-50.0, -200.0, 50.0), Vec3::ZERO);
        for device in Device::ALL {
            let film = render(
                device,
                &scene,
                &settings(view.clone(), 4, Estimator::Nee, 2),
                4,
            );
            let (mean, _) = mean_and_error(&film);
            let expected = lit * srgb_to_linear(GREY) / PI;
            assert!(
                (mean[0] - expected).abs() < 1e-5,
                "{device:?}: {mean:?} for {expected}"
            );
        }
    }
}

#[test]
fn baked_light_is_bilinear_between_its_samples_and_not_on_fullbright_texels() {
    // A ground of 8 x 8 units with 3 x 2 samples; the left half of its texture is fullbright.
    let build = || {
        let mut b = Builder::new();
        let texels = vec![[GREY, GREY, GREY, 0], [GREY, GREY, GREY, 255]];
        let shown = b.texture(2, texels);
        let ground = b.material(shown, Some(shown), 1.0);
        b.slab(Vec3::ZERO, [4.0; 2], true, ground, [2.0, 1.0]);
        let mut scene = Arc::unwrap_or_clone(b.build());
        let mesh = &scene.meshes[0];
        let grids = (mesh.triangles.iter())
            .map(|t| BakedTriangle {
                first: 0,
                width: 3,
                height: 2,
                uv: t.vertices.map(|v| {
                    let p = mesh.positions[v as usize];
                    (Vec2::new(p.x + 4.0, p.y + 4.0) / Vec2::new(4.0, 8.0)).to_array()
                }),
            })
            .collect();
        scene.baked = Some(BakedLight {
            meshes: vec![grids],
            samples: [0.0, 1.0, 2.0, 4.0, 5.0, 6.0].map(|v| [v; 3]).to_vec(),
        });
        Arc::new(scene.completed())
    };
    let scene = build();
    assert!(scene.features.baked_light);
    for (x, y, light) in [
        (1.0, -2.0, 1.0 + 0.25 + 4.0 * 0.25),
        (3.0, 3.0, 1.75 + 4.0 * 0.875),
        (-2.0, 0.0, 1.0),
    ] {
        let point = Vec3::new(x, y, 0.0);
        let view = probe(point + Vec3::new(0.0, -3.0, 9.0), point);
        for device in Device::ALL {
            let film = render(
                device,
                &scene,
                &settings(view.clone(), 4, Estimator::Nee, 1),
                4,
            );
            let (mean, _) = mean_and_error(&film);
            let expected = srgb_to_linear(GREY) * light;
            assert!(
                (mean[1] / expected - 1.0).abs() < 1e-3,
                "{device:?} at {point}: {mean:?} for {expected}"
            );
        }
    }
}

/// Formulas and styles of all kinds; suns and a dome; a level whose lightmaps have 8-unit luxels in
/// a BSPX lump, and one with decoupled lightmaps in E5BGR9.
#[test]
fn the_devices_agree_in_every_light_on_real_levels() {
    let Some(game) = levels::game() else { return };
    let loose = levels::data().join("loose/bsp");
    let file = |name: &str| loose.join(name).display().to_string();
    for (name, lighting) in [
        (file("light_general.bsp"), Lighting::Compiler),
        ("start".to_owned(), Lighting::Compiler),
        (file("light_general.bsp"), Lighting::Lightmap),
        (file("slope_decoupled.bsp"), Lighting::Lightmap),
        (file("lq_e0m7_bsp2.bsp"), Lighting::Lightmap),
        ("start".to_owned(), Lighting::Fullbright),
    ] {
        let options = ImportOptions {
            lighting,
            time: 0.45,
            ..ImportOptions::default()
        };
        let scene = levels::load_with(&game, &name, &options).expect("a level");
        let depth = lighting.max_depth().unwrap_or(2);
        let films = Device::ALL.map(|device| {
            let mut view = settings(scene.cameras[0].clone(), 40, Estimator::Nee, depth);
            view.seed = device as u64;
            view.selection = Selection::Power;
            render(device, &scene, &view, 64)
        });
        let lit = films[1].mean_radiance();
        assert!(lit.iter().sum::<f64>() > 1e-3, "{name} is dark: {lit:?}");
        let what = format!("{name} in {} light", lighting.name());
        ZTest::new(&films[0], &films[1]).assert(&what);
    }
}
