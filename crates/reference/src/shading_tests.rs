use super::*;
use crate::rng::Rng;
use scene::render::Sampler;

const CELLS: usize = 16;

/// Samples directions and compares their counts over a grid of the sphere, equal in area, with the
/// integral of the density over each cell (Pearson's chi-square). `pdf` is per steradian.
fn check_directions(what: &str, sample: impl Fn([f64; 2]) -> DVec3, pdf: impl Fn(DVec3) -> f64) {
    let n = 400_000;
    let mut counts = [[0.0; CELLS]; CELLS];
    let mut rng = Rng::new(Sampler::Independent, 7, 8, 9);
    for _ in 0..n {
        let d = sample(rng.next2());
        assert!((d.length() - 1.0).abs() < 1e-12);
        let row = ((d.z + 1.0) / 2.0 * CELLS as f64) as usize;
        let column = (d.y.atan2(d.x) / TAU + 0.5) * CELLS as f64;
        counts[row.min(CELLS - 1)][(column as usize).min(CELLS - 1)] += 1.0;
    }
    let fine = 32;
    let direction = |i: usize, j: usize, k: usize, l: usize| {
        let place = |cell: usize, sub: usize| {
            (cell as f64 + (sub as f64 + 0.5) / fine as f64) / CELLS as f64
        };
        let z = place(i, k) * 2.0 - 1.0;
        let (s, c) = ((place(j, l) - 0.5) * TAU).sin_cos();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * c, r * s, z)
    };
    let (mut total, mut chi2, mut freedom) = (0.0, 0.0, -1.0);
    for (i, row) in counts.iter().enumerate() {
        for (j, &count) in row.iter().enumerate() {
            let mean = (0..fine * fine)
                .map(|s| pdf(direction(i, j, s / fine, s % fine)))
                .sum::<f64>()
                / (fine * fine) as f64;
            let probability = mean * 2.0 * TAU / (CELLS * CELLS) as f64;
            total += probability;
            let expected = probability * f64::from(n);
            if expected > 10.0 {
                chi2 += (count - expected) * (count - expected) / expected;
                freedom += 1.0;
            } else {
                assert!(
                    count < 40.0,
                    "{what}: {count} samples where {expected} belong"
                );
            }
        }
    }
    assert!(
        (total - 1.0).abs() < 5e-3,
        "{what}: density integrates to {total}"
    );
    // The square root of twice a chi-square is nearly normal with variance 1 (Fisher).
    let z = (2.0 * chi2).sqrt() - (2.0 * freedom - 1.0_f64).sqrt();
    assert!(
        z < 4.0,
        "{what}: chi-square {chi2} with {freedom} degrees of freedom"
    );
}

fn axes() -> [DVec3; 3] {
    [DVec3::Z, DVec3::NEG_Z, DVec3::new(0.48, -0.6, 0.64)]
}

#[test]
fn directions_follow_their_densities() {
    for n in axes() {
        check_directions(
            "cosine",
            |u| sample_cosine_hemisphere(n, u),
            |d| pdf_cosine_hemisphere(d.dot(n)),
        );
        let upper = |d: DVec3| f64::from(d.dot(n) > 0.0);
        check_directions(
            "uniform",
            |u| sample_uniform_hemisphere(n, u),
            |d| upper(d) * pdf_uniform_hemisphere(),
        );
    }
    check_directions("sphere", sample_sphere, |_| 0.5 / TAU);
}

#[test]
fn cone_directions_are_uniform_in_the_cap() {
    for axis in axes() {
        let height = sphere_cone_height(0.5_f64.sin().powi(2));
        assert!((height - (1.0 - 0.5_f64.cos())).abs() < 1e-15);
        // The cap's area is 2 pi height (Archimedes), so the density integrates to 1.
        assert!((pdf_sphere_cone(height) * TAU * height - 1.0).abs() < 1e-15);
        let (tangent, bitangent) = orthonormal_basis(axis);
        let n = 100_000;
        let mut counts = [0.0_f64; 64];
        let mut rng = Rng::new(Sampler::Independent, 4, 5, 6);
        for _ in 0..n {
            let (d, _) = sample_sphere_cone(axis, height, rng.next2());
            let row = (1.0 - d.dot(axis)) / height;
            assert!(row < 1.0 + 1e-12);
            let column = d.dot(bitangent).atan2(d.dot(tangent)) / TAU + 0.5;
            let [i, j] = [row, column].map(|x| ((x * 8.0) as usize).min(7));
            counts[i * 8 + j] += 1.0;
        }
        let expected = f64::from(n) / 64.0;
        let chi2: f64 = (counts.iter())
            .map(|c| (c - expected).powi(2) / expected)
            .sum();
        // 63 degrees of freedom: mean 63, standard deviation 11.
        assert!(chi2 < 120.0, "chi-square {chi2}");
    }
}

#[test]
fn disc_points_are_uniform() {
    const RINGS: usize = 8;
    let n = 100_000;
    let mut counts = [[0.0_f64; RINGS]; RINGS];
    let mut rng = Rng::new(Sampler::Independent, 3, 5, 7);
    for _ in 0..n {
        let [x, y] = sample_disk(rng.next2());
        let squared = x * x + y * y;
        assert!(squared < 1.0 + 1e-12);
        let ring = squared * RINGS as f64;
        let slice = (y.atan2(x) / TAU + 0.5) * RINGS as f64;
        counts[(ring as usize).min(RINGS - 1)][(slice as usize).min(RINGS - 1)] += 1.0;
    }
    // Rings between equally spaced squares of radii have equal areas, of pi together.
    let cells = (RINGS * RINGS) as f64;
    let expected = f64::from(n) * pdf_disk() * PI / cells;
    assert!((pdf_disk() * PI - 1.0).abs() < 1e-15);
    let chi2: f64 = (counts.iter().flatten())
        .map(|c| (c - expected).powi(2) / expected)
        .sum();
    // 63 degrees of freedom: mean 63, standard deviation 11.
    assert!(chi2 < 120.0, "chi-square {chi2}");
    // Neighbours stay together: a grid's cells map to cells of like size.
    let step = 1.0 / 64.0;
    for (i, j) in (0..64).flat_map(|i| (0..64).map(move |j| (i, j))) {
        let at = |i: i32, j: i32| sample_disk([f64::from(i) * step, f64::from(j) * step]);
        let (a, b) = (at(i, j), at(i, j + 1));
        let distance = (a[0] - b[0]).hypot(a[1] - b[1]);
        assert!(distance < 4.0 * step, "{distance} at {i}, {j}");
    }
}

#[test]
fn triangle_points_are_uniform() {
    // Four triangles of equal area make up the triangle.
    let mut counts = [0.0; 4];
    let n = 100_000;
    let mut rng = Rng::new(Sampler::Independent, 1, 2, 3);
    for _ in 0..n {
        let w = sample_triangle(rng.next2());
        assert!((w.iter().sum::<f64>() - 1.0).abs() < 1e-12 && w.iter().all(|&x| x >= 0.0));
        counts[w.iter().position(|&x| x > 0.5).unwrap_or(3)] += 1.0;
    }
    let expected = f64::from(n) / 4.0;
    let chi2: f64 = counts
        .iter()
        .map(|c: &f64| (c - expected).powi(2) / expected)
        .sum();
    assert!(chi2 < 25.0, "counts {counts:?}");
}

#[test]
fn small_and_far_spheres_keep_their_solid_angle() {
    for (radius, distance) in [(0.8, 3000.0), (0.4, 100_000.0_f64)] {
        let sin2 = (radius / distance) * (radius / distance);
        // Series of 1 - sqrt(1 - x).
        let expected = sin2 / 2.0 + sin2 * sin2 / 8.0;
        assert!((sphere_cone_height(sin2) / expected - 1.0).abs() < 1e-14);
    }
    assert_eq!(sphere_cone_height(1.0), 1.0);
}

#[test]
fn the_near_surface_of_a_sphere_is_on_the_sphere() {
    let (distance, radius) = (10.0, 3.0);
    let height = sphere_cone_height((radius / distance) * (radius / distance));
    let axis = DVec3::new(0.6, 0.0, 0.8);
    let mut rng = Rng::new(Sampler::Independent, 1, 1, 1);
    for _ in 0..1000 {
        let (direction, h) = sample_sphere_cone(axis, height, rng.next2());
        assert!((1.0 - direction.dot(axis) - h).abs() < 1e-12);
        let point = direction * sphere_near_distance(distance, radius, h);
        assert!((point.distance(axis * distance) - radius).abs() < 1e-6);
        assert!(point.length() <= distance);
    }
}

#[test]
fn bases_are_orthonormal_and_right_handed() {
    for n in axes() {
        let (t, b) = orthonormal_basis(n);
        assert!(t.cross(b).distance(n) < 1e-12);
        assert!((t.length() - 1.0).abs() < 1e-12 && (b.length() - 1.0).abs() < 1e-12);
    }
}

#[test]
fn spotlights_fade_between_their_cones() {
    let spot = Spot {
        direction: glam::Vec3::X,
        cos_inner: 0.75,
        cos_outer: 0.5,
    };
    let factors = [1.0, 0.75, 0.625, 0.5, -1.0].map(|cos| spot_factor(&spot, cos));
    assert_eq!(factors, [1.0, 1.0, 0.5, 0.0, 0.0]);
    let sharp = Spot {
        cos_outer: 0.75,
        ..spot
    };
    assert_eq!([0.76, 0.74].map(|cos| spot_factor(&sharp, cos)), [1.0, 0.0]);
}

#[test]
fn texels_are_nearest_and_wrap() {
    let texture = Texture {
        name: String::new(),
        width: 3,
        height: 2,
        rgba: vec![[0; 4]; 6],
    };
    let at = |u: f64, v: f64| texel_index(&texture, DVec2::new(u, v));
    assert_eq!([at(0.0, 0.0), at(2.99, 0.0), at(3.0, 1.5)], [0, 2, 3]);
    assert_eq!([at(-0.01, 0.0), at(-3.0, -1.0), at(7.5, 2.0)], [2, 3, 1]);
    // Numbers that can't be texture coordinates still find a texel.
    for odd in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
        assert!(at(odd, odd) < 6);
    }
}
