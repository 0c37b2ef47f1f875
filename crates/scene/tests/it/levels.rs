//! Every real level there is.

use crate::common::{data, for_each_level};
use glam::{DVec2, DVec3, Vec3};
use scene::import::tjunction::open_edges;
use scene::material::{luminance, srgb_to_linear};
use scene::{MaterialId, PointLight, Scene, Surface};
use std::collections::HashMap;

/// Levels that are closed and have every face. The others lack faces that their makers had the
/// compiler strip, or have slivers that it lost: the report of each says where.
const SEALED: [&str; 19] = [
    "dev",
    "dm3",
    "dm4",
    "gpl_e1m1",
    "gpl_start",
    "id96_dm5",
    "id96_e1m7",
    "light_general",
    "lq_e0m1",
    "lq_end",
    "lq_end_noclip",
    "lqdm12_2psb",
    "lqdm13",
    "q1_hdrtest",
    "q1_litwater",
    "q1_missing_texture",
    "q1_tjunc_matrix",
    "slope",
    "start",
];

#[test]
fn meshes_are_closed_where_the_level_is() {
    for_each_level(|level, scene| {
        let name = &level.name;
        let report = &scene.report;
        assert_eq!(report.sealed, report.holes == 0, "{name}");
        assert!(report.sealed || report.warnings.iter().any(|w| w.contains("solid without")));
        if SEALED.contains(&name.as_str()) {
            assert!(report.sealed, "{name} has {} holes", report.holes);
        }
        // The triangles have the border that the report counts: triangulation tore nothing open.
        // Brush entities that are part of the world's mesh have vertices of their own.
        let world = &scene.meshes[0];
        let own = |t: &&scene::Triangle| {
            let first_other = level.bsp.models[0].faces().end as u32;
            t.face < first_other && !scene.materials[t.material.0 as usize].warped
        };
        let triangles = world.triangles.iter().filter(own);
        let open = open_edges(triangles.map(|t| &t.vertices[..]));
        assert_eq!(open.len(), report.open_edges, "{name}");
    });
}

#[test]
fn triangles_agree_with_their_faces() {
    for_each_level(|level, scene| {
        let mut turned = 0;
        for mesh in &scene.meshes {
            assert!(mesh.positions.iter().all(|p| p.is_finite()));
            for t in &mesh.triangles {
                let [a, b, c] = t.vertices.map(|v| mesh.positions[v as usize].as_dvec3());
                let normal = t.normal.as_dvec3();
                assert!((normal.length() - 1.0).abs() < 1e-4);
                let area = (b - a).cross(c - a);
                if area.dot(normal) <= 0.0 {
                    // Only what rounding can turn over: less than the distance within which
                    // vertices are put on edges.
                    let sides = [a.distance(b), b.distance(c), c.distance(a)];
                    let longest = sides.into_iter().fold(0.0, f64::max);
                    assert!(
                        area.length() / longest < 0.2,
                        "{} face {}",
                        level.name,
                        t.face
                    );
                    turned += 1;
                }
                let material = &scene.materials[t.material.0 as usize];
                let texture = &scene.textures[material.base.0 as usize];
                if material.surface == Surface::Diffuse && !material.warped {
                    let size = [texture.width as f32, texture.height as f32];
                    let mut least = [f32::INFINITY; 2];
                    for corner in t.uv {
                        least = [least[0].min(corner[0]), least[1].min(corner[1])];
                    }
                    // Rebased by face, so a triangle can start some tiles later, never earlier.
                    assert!(
                        least[0] > -0.01 && least[1] > -0.01,
                        "{least:?} of {size:?}"
                    );
                }
            }
        }
        assert!(
            turned * 1000 <= scene.triangle_count(),
            "{}: {turned}",
            level.name
        );
    });
}

/// Luminance that all surfaces emit, integrated over their areas, texel by texel: the area of each
/// triangle within each texel times what the texel emits. Liquids move, so theirs is the mean.
fn brute_force(scene: &Scene) -> f64 {
    let mut lights: HashMap<u32, Vec<f64>> = HashMap::new();
    let mut sum = 0.0;
    for instance in scene.instances.iter().filter(|i| i.seen_by.others()) {
        let mesh = &scene.meshes[instance.mesh];
        for t in &mesh.triangles {
            let material = &scene.materials[t.material.0 as usize];
            let Some(emission) = material.emission else {
                continue;
            };
            let texture = &scene.textures[emission.0 as usize];
            let light = lights.entry(emission.0).or_insert_with(|| {
                (texture.rgba.iter())
                    .map(|t| [t[0], t[1], t[2]].map(|c| srgb_to_linear(c) as f32))
                    .map(|rgb| f64::from(luminance(rgb)))
                    .collect()
            });
            let [a, b, c] = t.vertices.map(|v| {
                let p = mesh.positions[v as usize];
                instance.transform.transform_point3(p).as_dvec3()
            });
            let sides = if material.two_sided { 2.0 } else { 1.0 };
            let scale = f64::from(material.emission_scale) * sides;
            let area = DVec3::length((b - a).cross(c - a)) / 2.0;
            if material.warped {
                sum += scale * area * light.iter().sum::<f64>() / light.len() as f64;
                continue;
            }
            let uv = t.uv.map(|[u, v]| DVec2::new(f64::from(u), f64::from(v)));
            let uv_area = (uv[1] - uv[0]).perp_dot(uv[2] - uv[0]).abs() / 2.0;
            let min = uv[0].min(uv[1]).min(uv[2]).floor();
            let max = uv[0].max(uv[1]).max(uv[2]).ceil();
            for y in min.y as i64..max.y as i64 {
                for x in min.x as i64..max.x as i64 {
                    let column = x.rem_euclid(i64::from(texture.width)) as usize;
                    let row = y.rem_euclid(i64::from(texture.height)) as usize;
                    let light = light[row * texture.width as usize + column];
                    if light > 0.0 {
                        let cell = DVec2::new(x as f64, y as f64);
                        let inside = area_in_unit_square(uv.map(|p| p - cell));
                        sum += scale * light * area * inside / uv_area;
                    }
                }
            }
        }
    }
    sum
}

/// Area of a triangle within the unit square, by cutting it at each side.
fn area_in_unit_square(triangle: [DVec2; 3]) -> f64 {
    let mut polygon = triangle.to_vec();
    for (axis, side) in [
        (DVec2::X, 0.0),
        (-DVec2::X, -1.0),
        (DVec2::Y, 0.0),
        (-DVec2::Y, -1.0),
    ] {
        let before = std::mem::take(&mut polygon);
        for (i, &p) in before.iter().enumerate() {
            let q = before[(i + 1) % before.len()];
            let (dp, dq) = (p.dot(axis) - side, q.dot(axis) - side);
            if dp >= 0.0 {
                polygon.push(p);
            }
            if dp * dq < 0.0 {
                polygon.push(p.lerp(q, dp / (dp - dq)));
            }
        }
    }
    let n = polygon.len();
    let doubled: f64 = (0..n)
        .map(|i| polygon[i].perp_dot(polygon[(i + 1) % n]))
        .sum();
    doubled.abs() / 2.0
}

#[test]
fn listed_power_is_that_of_the_texels() {
    let mut shining = 0;
    for_each_level(|level, scene| {
        let is_sky = |m: MaterialId| scene.materials[m.0 as usize].surface == Surface::Sky;
        let listed: f64 = (scene.emitters.list.iter())
            .filter(|e| !is_sky(e.material))
            .map(|e| f64::from(e.weight))
            .sum();
        let truth = brute_force(scene);
        assert!(
            (listed - truth).abs() <= 1e-5 * truth,
            "{}: {listed} {truth}",
            level.name
        );
        shining += usize::from(truth > 0.0);
        let lights: f32 = scene.lights.iter().map(PointLight::weight).sum();
        assert!(f64::from(scene.emitters.total_weight) >= 0.999 * (listed + f64::from(lights)));
    });
    assert!(data().is_none() || shining > 20, "{shining}");
}

#[test]
fn cameras_are_where_an_engine_had_them() {
    let Some(dir) = data() else { return };
    let mut compared = 0;
    for_each_level(|level, scene| {
        let views = dir.join(format!("ref/maps/{}_views.json", level.name));
        let Ok(text) = std::fs::read_to_string(views) else {
            return;
        };
        let json: serde_json::Value = serde_json::from_str(&text).expect("views");
        let list = |v: &serde_json::Value| -> [f32; 3] {
            std::array::from_fn(|i| v[i].as_f64().expect("a number") as f32)
        };
        for view in json["views"].as_array().expect("views") {
            let name = view["name"].as_str().expect("a name");
            let class = match name {
                "start" => "info_player",
                _ if name.starts_with("inter") => "info_intermission",
                _ => continue,
            };
            let at = Vec3::from(list(&view["camera"]));
            let angles = Vec3::from(list(&view["angles"]));
            let nearest = scene
                .cameras
                .iter()
                .filter(|c| c.name.starts_with(class))
                .min_by(|a, b| {
                    let d = |c: &scene::Camera| c.position.distance(at);
                    d(a).total_cmp(&d(b))
                });
            let Some(camera) = nearest else { continue };
            let off = camera.position - at;
            assert!(off.length() < 0.1, "{} {name}: off by {off}", level.name);
            // Pictures were taken at multiples of 360/256 degrees.
            let mine = Vec3::new(camera.pitch_deg, camera.yaw_deg, camera.roll_deg);
            let turn = (mine - angles).map(|d| (d + 180.0).rem_euclid(360.0) - 180.0);
            assert!(
                turn.abs().max_element() < 1.5,
                "{} {name}: {turn}",
                level.name
            );
            compared += 1;
        }
    });
    assert!(compared >= 20, "{compared}");
}

#[test]
fn of_the_two_sides_of_each_liquid_one_is_left() {
    let area = |[a, b, c]: [DVec3; 3]| DVec3::length((b - a).cross(c - a)) / 2.0;
    let mut liquid_levels = 0;
    for_each_level(|level, scene| {
        let bsp = &level.bsp;
        let is_liquid = |t: usize| {
            let name = bsp.textures[t]
                .as_ref()
                .map(|t| t.name.to_ascii_lowercase());
            name.is_some_and(|n| n.starts_with('*') && !n.ends_with("skip"))
        };
        let in_file: f64 = bsp
            .drawable_faces(0)
            .filter(|(_, face)| bsp.face_texture(face).is_some_and(is_liquid))
            .map(|(_, face)| {
                let points: Vec<DVec3> = (bsp.face_points(face).into_iter().flatten())
                    .map(|p| Vec3::from(p).as_dvec3())
                    .collect();
                let fan = (1..points.len() - 1).map(|i| [points[0], points[i], points[i + 1]]);
                fan.map(area).sum::<f64>()
            })
            .sum();
        let world = &scene.meshes[0];
        let left: f64 = world
            .triangles
            .iter()
            .filter(|t| bsp.models[0].faces().contains(&(t.face as usize)))
            .filter(|t| scene.materials[t.material.0 as usize].warped)
            .map(|t| area(t.vertices.map(|v| world.positions[v as usize].as_dvec3())))
            .sum();
        let off = (2.0 * left - in_file).abs();
        assert!(off <= 1e-4 * in_file, "{}: {left} of {in_file}", level.name);
        liquid_levels += usize::from(in_file > 0.0);
    });
    assert!(data().is_none() || liquid_levels > 20, "{liquid_levels}");
}
