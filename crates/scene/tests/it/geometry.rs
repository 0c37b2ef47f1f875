//! Triangulation and T-junctions, by their invariants.

use crate::common::Random;
use glam::{DVec2, DVec3, Vec3};
use scene::import::tjunction::{EdgeSplitter, open_edges, simple_loops};
use scene::import::triangulate::triangulate;
use scene::import::weld::Welder;

/// A convex polygon on an ellipse with points added on its sides.
fn polygon(random: &mut Random) -> Vec<DVec2> {
    let corners = 3 + random.below(9);
    let size = DVec2::new(1.0 + 500.0 * random.next(), 1.0 + 500.0 * random.next());
    let turn = random.next() * std::f64::consts::TAU;
    let corner = |i: usize| {
        let angle = turn + i as f64 / corners as f64 * std::f64::consts::TAU;
        DVec2::new(angle.cos(), angle.sin()) * size
    };
    let mut out = Vec::new();
    for i in 0..corners {
        let (a, b) = (corner(i), corner((i + 1) % corners));
        let extra = [0, 0, 1, 2, 5, 30][random.below(6)];
        let mut parts: Vec<f64> = (0..extra).map(|_| 0.001 + 0.998 * random.next()).collect();
        parts.sort_by(f64::total_cmp);
        out.push(a);
        out.extend(parts.into_iter().map(|t| a.lerp(b, t)));
    }
    out
}

fn area(points: &[DVec2]) -> f64 {
    let n = points.len();
    (0..n)
        .map(|i| points[i].perp_dot(points[(i + 1) % n]))
        .sum::<f64>()
        / 2.0
}

#[test]
fn triangles_cover_the_polygon_and_keep_its_border() {
    let mut random = Random(7);
    let mut largest = 0;
    for _ in 0..400 {
        let points = polygon(&mut random);
        let n = points.len();
        largest = largest.max(n);
        let triangles = triangulate(&points);
        assert_eq!(triangles.len(), n - 2);
        let mut sum = 0.0;
        for t in &triangles {
            let triangle = area(&t.map(|i| points[i]));
            assert!(triangle > 0.0, "{t:?} of {points:?}");
            sum += triangle;
        }
        let whole = area(&points);
        assert!((sum / whole - 1.0).abs() < 1e-9);
        // With the border walked backwards every edge has its opposite: each corner and each side
        // of the border is used, and none but those is open.
        let border: Vec<u32> = (0..n as u32).rev().collect();
        let triangles: Vec<[u32; 3]> = triangles.iter().map(|t| t.map(|i| i as u32)).collect();
        let all = triangles.iter().map(|t| &t[..]).chain([&border[..]]);
        assert!(open_edges(all).is_empty());
    }
    assert!(largest > 64, "no polygon was halved");
}

#[test]
fn a_side_with_many_points_gives_no_slivers_where_none_need_be() {
    // The far corner sees all pieces of the side at good angles.
    let mut points = vec![DVec2::new(50.0, 100.0)];
    points.extend((0..=10).map(|i| DVec2::new(f64::from(i) * 10.0, 0.0)));
    for t in triangulate(&points) {
        let [a, b, c] = t.map(|i| points[i]);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        assert!(2.0 * area(&[a, b, c]) / longest > 5.0, "{t:?}");
    }
}

/// Cuts a rectangle of a box's side into random smaller ones, counter-clockwise.
fn cut(random: &mut Random, lo: [f64; 2], hi: [f64; 2], depth: u32, out: &mut Vec<[[f64; 2]; 4]>) {
    if depth == 0 {
        out.push([lo, [hi[0], lo[1]], hi, [lo[0], hi[1]]]);
        return;
    }
    let axis = random.below(2);
    let at = lo[axis] + (hi[axis] - lo[axis]) * (0.2 + 0.6 * random.next());
    let (mut left, mut right) = (hi, lo);
    left[axis] = at;
    right[axis] = at;
    cut(random, lo, left, depth - 1, out);
    cut(random, right, hi, depth - 1, out);
}

#[test]
fn a_box_full_of_t_junctions_becomes_closed() {
    let mut random = Random(3);
    for round in 0..20 {
        let size = DVec3::new(256.0, 320.0, 128.0);
        let mut faces: Vec<Vec<DVec3>> = Vec::new();
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for high in [false, true] {
                let mut parts = Vec::new();
                cut(&mut random, [0.0; 2], [size[u], size[v]], 5, &mut parts);
                for part in parts {
                    let mut face: Vec<DVec3> = part
                        .iter()
                        .map(|p| {
                            let mut q = DVec3::ZERO;
                            q[u] = p[0];
                            q[v] = p[1];
                            q[axis] = if high { size[axis] } else { 0.0 };
                            q
                        })
                        .collect();
                    if !high {
                        face.reverse();
                    }
                    faces.push(face);
                }
            }
        }
        // A slanted box: nothing is exact any more, as in a level with rotated brushes; and every
        // corner is written a little wrong.
        let turn = glam::DMat3::from_euler(glam::EulerRot::XYZ, 0.3, 0.7, f64::from(round));
        let mut welder = Welder::default();
        let polygons: Vec<Vec<u32>> = faces
            .iter()
            .map(|face| {
                face.iter()
                    .map(|&p| {
                        let error = DVec3::new(random.next(), random.next(), random.next()) - 0.5;
                        welder.weld((turn * p + 1000.0 + error * 0.005).as_vec3())
                    })
                    .collect()
            })
            .collect();
        let positions = welder.into_positions();
        assert!(!open_edges(polygons.iter().map(Vec::as_slice)).is_empty());
        let corners = polygons.iter().map(Vec::len).sum();
        let mut splitter = EdgeSplitter::new(&positions, corners);
        let loops: Vec<Vec<u32>> = polygons
            .iter()
            .flat_map(|p| simple_loops(&splitter.split_polygon(p)))
            .collect();
        assert!(open_edges(loops.iter().map(Vec::as_slice)).is_empty());
        assert!(splitter.inserted() > 0 && !splitter.exhausted());
        // Nothing of the surface is lost.
        let surface: f64 = loops.iter().map(|l| area_of(l, &positions)).sum();
        let whole = 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x);
        assert!((surface / whole - 1.0).abs() < 1e-3, "{surface} of {whole}");
    }
}

fn area_of(corners: &[u32], positions: &[Vec3]) -> f64 {
    let p = |i: usize| {
        positions[corners[i] as usize].as_dvec3() - positions[corners[0] as usize].as_dvec3()
    };
    let sum: DVec3 = (1..corners.len() - 1).map(|i| p(i).cross(p(i + 1))).sum();
    sum.length() / 2.0
}

#[test]
fn a_file_made_to_take_time_is_given_up() {
    // Tens of thousands of vertices crowd around one edge that thousands of faces share.
    let positions: Vec<Vec3> = (0..40_000)
        .map(|i| Vec3::new((i % 200) as f32 * 0.011, (i / 200) as f32 * 0.011, 0.0))
        .collect();
    let mut splitter = EdgeSplitter::new(&positions, 3 * 10_000);
    for i in 0..10_000_u32 {
        splitter.split_polygon(&[i, 39_999 - i, (i * 7) % 40_000]);
    }
    assert!(splitter.exhausted());
}
