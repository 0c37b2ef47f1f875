use super::*;
use scene::render::Sampler;

/// Compares samples of a distance in `0..end` with their density: the integral over each of 64 cells
/// (Pearson's chi-square), and over all.
fn check_distances(what: &str, end: f64, sample: impl Fn(f64) -> f64, pdf: impl Fn(f64) -> f64) {
    const CELLS: usize = 64;
    let (n, fine) = (200_000, 512);
    let mut rng = Rng::new(Sampler::Independent, 3, 1, 4);
    let mut counts = [0.0; CELLS];
    for _ in 0..n {
        let t = sample(rng.next());
        assert!((0.0..=end * (1.0 + 1e-9)).contains(&t), "{what}: {t}");
        counts[((t / end * CELLS as f64) as usize).min(CELLS - 1)] += 1.0;
    }
    let step = end / (CELLS * fine) as f64;
    let (mut total, mut chi2, mut freedom) = (0.0, 0.0, -1.0);
    for (cell, count) in counts.into_iter().enumerate() {
        let at = |i: usize| ((cell * fine + i) as f64 + 0.5) * step;
        let probability = (0..fine).map(|i| pdf(at(i))).sum::<f64>() * step;
        total += probability;
        let expected: f64 = probability * f64::from(n);
        if expected > 10.0 {
            chi2 += (count - expected) * (count - expected) / expected;
            freedom += 1.0;
        } else {
            assert!(
                count < 40.0,
                "{what}: {count} samples, {expected} belong there"
            );
        }
    }
    assert!(
        (total - 1.0).abs() < 1e-3,
        "{what}: density integrates to {total}"
    );
    let z = (2.0 * chi2).sqrt() - (2.0 * freedom - 1.0_f64).max(0.0).sqrt();
    assert!(
        z < 4.0,
        "{what}: chi-square {chi2}, {freedom} degrees of freedom"
    );
}

#[test]
fn free_paths_follow_their_density() {
    for (extinction, end) in [(0.01, 30.0), (1.0, 8.0), (1e-9, 100.0), (0.3, 2.0)] {
        check_distances(
            &format!("extinction {extinction} up to {end}"),
            end,
            |u| sample_free_path(extinction, end, u),
            |t| pdf_free_path(extinction, end, t),
        );
    }
    // Without end: by the law itself.
    let n = 100_000;
    let beyond = |t: f64| {
        let longer = |&i: &u32| {
            sample_free_path(0.02, f64::INFINITY, (f64::from(i) + 0.5) / f64::from(n)) > t
        };
        (0..n).filter(longer).count() as f64 / f64::from(n)
    };
    for t in [10.0, 100.0, 300.0] {
        assert!((beyond(t) - (-0.02 * t).exp()).abs() < 2e-5);
    }
}

#[test]
fn equiangular_places_follow_their_density() {
    let (origin, direction) = (DVec3::new(1.0, -2.0, 3.0), DVec3::new(0.48, -0.6, 0.64));
    let beside = direction.any_orthonormal_vector();
    for (along, off, end) in [
        (20.0, 5.0, 60.0),
        (-30.0, 10.0, 25.0),
        (500.0, 1.0, 80.0),
        (7.0, 0.0, 10.0),
    ] {
        let point = origin + direction * along + beside * off;
        let places = Equiangular::new(origin, direction, end, point, 0.5);
        check_distances(
            &format!("point at {along}, {off} beside"),
            end,
            |u| places.sample(u),
            |t| places.pdf(t),
        );
    }
}
