//! Rays per second and core, printed as one line per case: `cargo bench -p reference`.

#[path = "../tests/common/mod.rs"]
mod common;

use reference::Reference;
use scene::render::{Estimator, Renderer};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time spent on each case.
const BUDGET: Duration = Duration::from_secs(3);

fn main() {
    measure(
        "hall",
        &common::hall(60),
        common::camera(glam::Vec3::ZERO, 5.0, 30.0, 90.0),
    );
}

fn measure(name: &str, scene: &Arc<scene::Scene>, camera: scene::Camera) {
    let threads = rayon::current_num_threads();
    for depth in [3, 8] {
        let mut settings = common::settings(camera.clone(), 256, Estimator::Mis, depth);
        (settings.width, settings.height) = (320, 180);
        let start = Instant::now();
        let mut renderer = Reference::new(scene.clone(), &settings).expect("the scene is valid");
        let build = start.elapsed();
        renderer.accumulate(1).expect("the first sample");
        let warm = renderer.film().expect("a film").counters.rays;
        let start = Instant::now();
        let mut samples = 0;
        while start.elapsed() < BUDGET {
            renderer.accumulate(1).expect("another sample");
            samples += 1;
        }
        let elapsed = start.elapsed().as_secs_f64();
        let counters = renderer.film().expect("a film").counters;
        let rays = (counters.rays - warm) as f64;
        println!(
            "{name}: {} triangles, build {:.0} ms, mis depth {depth}, {samples} spp of 320x180, \
             {threads} threads: {:.2} Mrays/s, {:.2} Mrays/s per core, {:.2} rays/path, escaped {}",
            scene.triangle_count(),
            build.as_secs_f64() * 1e3,
            rays / elapsed / 1e6,
            rays / elapsed / 1e6 / threads as f64,
            counters.rays as f64 / counters.paths as f64,
            counters.escaped,
        );
    }
}
