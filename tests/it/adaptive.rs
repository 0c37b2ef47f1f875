//! Samples spread by a pilot: the mean stays what it is, and the error falls.

use reference::Reference;
use runelight::adaptive::Adaptive;
use runelight::job::AnyRenderer as _;
use runelight_tests::builder::settings;
use runelight_tests::scenes::{room, room_view};
use runelight_tests::stats::ZTest;
use scene::render::{Estimator, Film, Renderer};

/// The mean of `count` pictures with their own seeds, and its variance over the pictures.
fn mean_of(count: u64, picture: impl Fn(u64) -> Film) -> Film {
    let films: Vec<Film> = (0..count).map(picture).collect();
    let (n, pixels) = (count as f64, films[0].beauty.len());
    let mut mean = Film {
        beauty: vec![[0.0; 3]; pixels],
        variance: vec![[0.0; 3]; pixels],
        ..films[0].clone()
    };
    for i in 0..pixels {
        for c in 0..3 {
            let values = || films.iter().map(|f| f64::from(f.beauty[i][c]));
            let m = values().sum::<f64>() / n;
            let squares = values().map(|v| (v - m).powi(2)).sum::<f64>();
            mean.beauty[i][c] = m as f32;
            mean.variance[i][c] = (squares / (n - 1.0) / n) as f32;
        }
    }
    mean
}

#[test]
fn spread_samples_are_unbiased() {
    let scene = room();
    let picture = |seed: u64, pilot: Option<u32>| {
        let mut view = settings(room_view(), 12, Estimator::Naive, 3);
        view.seed = 1000 + seed;
        let mut renderer = Reference::new(scene.clone(), &view).expect("a reference");
        let Some(pilot) = pilot else {
            Renderer::accumulate(&mut renderer, 20).expect("samples");
            return Renderer::film(&mut renderer).expect("a film");
        };
        let mut adaptive = Adaptive::new(Box::new(renderer), pilot);
        adaptive.accumulate(20).expect("samples");
        adaptive.film().expect("a film")
    };
    // A pilot of 4: what a pixel has found by then is far from its mean, and would decide much.
    let even = mean_of(400, |seed| picture(seed, None));
    let spread = mean_of(400, |seed| picture(500 + seed, Some(4)));
    ZTest::new(&spread, &even).assert("spread samples against even ones");
    let counts = picture(0, Some(4)).sample_counts;
    let (least, most) = (counts.iter().min(), counts.iter().max());
    assert!(
        most.zip(least)
            .is_some_and(|(most, least)| 2 * most > 3 * least)
    );
}
