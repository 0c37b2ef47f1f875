//! Rays per core-second, one line per case:
//! `cargo bench -p runelight-tests --bench rays [-- LEVEL]`, where `LEVEL` names a level of the test
//! data.

use reference::Reference;
use runelight_tests::{builder as common, levels};
use scene::import::LightMode;
use scene::render::{Estimator, Renderer};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time spent on each case.
const BUDGET: Duration = Duration::from_secs(3);

fn main() {
    let wanted = std::env::args().skip(1).find(|arg| !arg.starts_with('-'));
    let name = wanted.as_deref().unwrap_or("lq_e3m6");
    if wanted.is_none() {
        let view = common::camera(glam::Vec3::ZERO, 5.0, 30.0, 90.0);
        measure("hall", &common::hall(60), view);
    }
    if let Some(game) = levels::game() {
        let scene = levels::load(&game, name, LightMode::Auto).expect("a level");
        measure(name, &scene, scene.cameras[0].clone());
    }
}

/// Processor time of all threads so far, where the system tells (Linux).
fn processor_seconds() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    let after_name = stat.rsplit(')').next()?;
    let mut ticks = after_name.split_whitespace().skip(11);
    let mut next = || ticks.next()?.parse::<f64>().ok();
    // The kernel shows ticks of 1/100 s to programs, whatever its own clock.
    Some((next()? + next()?) / 100.0)
}

fn measure(name: &str, scene: &Arc<scene::Scene>, camera: scene::Camera) {
    let threads = rayon::current_num_threads();
    for depth in [3, 8] {
        let mut settings = common::settings(camera.clone(), 1, Estimator::Mis, depth);
        (settings.width, settings.height) = (320, 180);
        let start = Instant::now();
        let mut renderer = Reference::new(scene.clone(), &settings).expect("the scene is valid");
        let build_ms = start.elapsed().as_secs_f64() * 1e3;
        renderer.accumulate(1).expect("the first sample");
        let warm = renderer.film().expect("a film").counters.rays;
        let (start, start_processor) = (Instant::now(), processor_seconds());
        let mut samples = 0;
        while start.elapsed() < BUDGET {
            renderer.accumulate(1).expect("another sample");
            samples += 1;
        }
        let wall = start.elapsed().as_secs_f64();
        let processor = (processor_seconds().zip(start_processor)).map_or(f64::NAN, |(b, a)| b - a);
        let counters = renderer.film().expect("a film").counters;
        let rays = (counters.rays - warm) as f64 / 1e6;
        println!(
            "{name}: {} triangles, prepared in {build_ms:.0} ms, mis, depth {depth}, {samples} spp \
             of 320x180: {:.2} Mrays per core-second ({:.2} Mrays/s on {threads} threads), \
             {:.2} rays per path, escaped {}",
            scene.triangle_count(),
            rays / processor,
            rays / wall,
            counters.rays as f64 / counters.paths as f64,
            counters.escaped,
        );
    }
}
