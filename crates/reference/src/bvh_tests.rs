use super::*;

/// A generator of its own, so that the test does not lean on what it tests.
fn numbers() -> impl FnMut() -> f64 {
    let mut state = 1_u64;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Triangles of many sizes, some flat in an axis, up to 65536 units away from the origin.
fn soup(next: &mut impl FnMut() -> f64) -> Vec<PackedTriangle> {
    (0..2000)
        .map(|i| {
            let mut point =
                |scale: f64| DVec3::new(next() - 0.5, next() - 0.5, next() - 0.5) * scale;
            let far = if i % 4 == 0 { 131_072.0 } else { 500.0 };
            let size = [1.0, 10.0, 100.0][i % 3];
            let centre = point(far);
            let corners = [0; 3].map(|_| {
                let mut p = centre + point(size);
                if i % 5 < 3 {
                    p[i % 5] = centre[i % 5].round();
                }
                p.as_vec3().to_array()
            });
            PackedTriangle::new(corners, i % 7 == 0)
        })
        .collect()
}

fn brute_force(triangles: &[PackedTriangle], ray: &Ray, accept: impl Fn(usize) -> bool) -> f64 {
    (triangles.iter().enumerate())
        .filter(|&(i, t)| !t.alpha_tested() || accept(i))
        .filter_map(|(_, t)| intersect(ray, t, f64::INFINITY))
        .fold(f64::INFINITY, |nearest, hit| nearest.min(hit.t))
}

#[test]
fn traversal_finds_what_testing_every_triangle_finds() {
    let mut next = numbers();
    let triangles = soup(&mut next);
    let (bvh, order) = Bvh::build(&triangles);
    let mut stack = Stack::new();
    let mut hits = 0;
    for i in 0..4000 {
        // Rays at a corner, an edge or the middle of a triangle, some of them along an axis.
        let corners = triangles[i % triangles.len()].corners();
        let weights = [[1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.3, 0.3, 0.4]][i % 3];
        let target = corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2];
        let mut direction = DVec3::new(next() - 0.5, next() - 0.5, next() - 0.5).normalize();
        if i % 10 < 3 {
            direction = DVec3::AXES[i % 10] * if next() < 0.5 { -1.0 } else { 1.0 };
        }
        let ray = Ray::new(target - direction * (next() * 1000.0), direction);
        let solid = |index: usize| index.is_multiple_of(2);
        let accept = |hit: &Hit| solid(order[hit.slot as usize] as usize);
        let expected = brute_force(&triangles, &ray, solid);
        let nearest = bvh.closest_hit(&ray, f64::INFINITY, &mut stack, accept);
        assert_eq!(
            nearest.map_or(f64::INFINITY, |hit| hit.at.t),
            expected,
            "ray {i}"
        );
        if expected.is_finite() {
            hits += 1;
            assert!(bvh.any_hit(&ray, expected.next_up(), &mut stack, accept));
            assert!(!bvh.any_hit(&ray, expected, &mut stack, accept));
        }
    }
    assert!(hits > 2000, "only {hits} rays hit anything");
}

#[test]
fn every_triangle_has_one_slot() {
    let triangles = soup(&mut numbers());
    let (bvh, mut order) = Bvh::build(&triangles);
    assert_eq!(bvh.triangles.len(), triangles.len());
    order.sort_unstable();
    assert!(order.iter().enumerate().all(|(i, &o)| i == o as usize));
}

#[test]
fn none_one_and_many_equal_triangles_are_fine() {
    let one = PackedTriangle::new([[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]], false);
    let ray = Ray::new(DVec3::new(0.2, 0.2, 1.0), DVec3::NEG_Z);
    for count in [0, 1, 2, 3, 5000] {
        let (bvh, _) = Bvh::build(&vec![one; count]);
        let hit = bvh.closest_hit(&ray, 10.0, &mut Stack::new(), |_| true);
        assert_eq!(hit.map(|h| h.at.t), (count > 0).then_some(1.0));
    }
}
