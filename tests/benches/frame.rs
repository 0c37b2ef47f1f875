//! How fast is a frame? GPU timestamps on one level at the thesis's settings.
//!
//! `cargo bench -p runelight-tests --bench frame -- [--data DIR] [--level NAME] [--device TEXT]
//! [--size WxH]` prints a Markdown report: milliseconds per frame, paths and rays per second, the
//! ratio to a pipeline that only traces the same rays, and the acceleration structures' times.

use clap::Parser as _;
use rt::{Gpu, PathTracer, Yardstick};
use runelight_tests::devices::{open_named, parse_size};
use runelight_tests::levels;
use scene::Scene;
use scene::import::LightMode;
use scene::render::{CANDIDATES, Estimator, Renderer, Sampler, Selection, Settings};
use std::error::Error;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

const DEPTH: u32 = 3;
const REPEATS: usize = 5;

#[derive(clap::Parser)]
struct Args {
    /// The Quake directory: the test data otherwise.
    #[arg(long, default_value_os_t = levels::data())]
    data: PathBuf,
    /// Level of it.
    #[arg(long, default_value = "lq_e3m6")]
    level: String,
    /// Part of a Vulkan device's name; the first that can do it otherwise.
    #[arg(long, default_value = "")]
    device: String,
    /// Picture size.
    #[arg(long, default_value = "1280x720", value_parser = parse_size)]
    size: [u32; 2],
    /// Cargo says that this is a benchmark.
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() -> Result<(), Box<dyn Error>> {
    let args = Args::parse();
    let (gpu, device) = open_named(&args.device)?;

    let start = Instant::now();
    let game = levels::open(&args.data)?;
    let scene = levels::load(&game, &args.level, LightMode::default())?;
    let import_ms = start.elapsed().as_secs_f64() * 1e3;
    let [width, height] = args.size;
    println!("Device: {device}");
    println!(
        "Level: {}, {} triangles, {} instances, {} emitters, {} point lights",
        scene.name,
        scene.triangle_count(),
        scene.instances.len(),
        scene.emitters.list.len(),
        scene.lights.len()
    );
    println!("Image: {width}x{height}, depth {DEPTH}; GPU timestamps, median of {REPEATS}\n");
    acceleration_structures(&gpu, &scene, args.size, import_ms)?;

    println!(
        "| estimator | choice | spp | ms | frames/s | Mpaths/s | Mrays/s | traced alone, ms | ratio |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let naive = (Estimator::Naive, Selection::Power);
    let mis = [Selection::Power, Selection::Leaf].map(|s| (Estimator::Mis, s));
    for how in [naive, mis[0], mis[1]] {
        for spp in [2, 16, 64] {
            row(&gpu, &scene, &settings(&scene, args.size, how), spp)?;
        }
    }
    Ok(())
}

fn settings(
    scene: &Scene,
    [width, height]: [u32; 2],
    (estimator, selection): (Estimator, Selection),
) -> Settings {
    Settings {
        width,
        height,
        camera: scene.cameras[0].clone(),
        estimator,
        selection,
        candidates: CANDIDATES,
        sampler: Sampler::Independent,
        depth: DEPTH,
        time: 0.0,
        seed: 0,
        aovs: false,
        clamp: None,
    }
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn acceleration_structures(
    gpu: &Gpu,
    scene: &Arc<Scene>,
    size: [u32; 2],
    import_ms: f64,
) -> Result<(), Box<dyn Error>> {
    let settings = settings(scene, size, (Estimator::Naive, Selection::Power));
    let start = Instant::now();
    let tracer = PathTracer::new(gpu, scene, &settings)?;
    let upload_ms = start.elapsed().as_secs_f64() * 1e3;
    println!("| stage | ms |\n|---|---|");
    println!("| load and import (host clock) | {import_ms:.1} |");
    println!("| upload, acceleration structures, pipeline (host clock) | {upload_ms:.1} |");
    for t in tracer.upload_timings() {
        println!("| {} | {:.3} |", t.name, t.milliseconds);
    }
    println!(
        "\nBottom-level structures, compacted: {} bytes\n",
        tracer.blas_bytes()
    );
    Ok(())
}

fn row(gpu: &Gpu, scene: &Arc<Scene>, settings: &Settings, spp: u32) -> Result<(), Box<dyn Error>> {
    let mut tracer = PathTracer::new(gpu, scene, settings)?;
    tracer.accumulate(spp)?;
    let mut times = Vec::new();
    for _ in 0..REPEATS {
        tracer.clear()?;
        tracer.accumulate(spp)?;
        times.push(tracer.trace_ms()?);
    }
    let counters = tracer.film()?.counters;
    let ms = median(times);
    let rate = |n: u64| n as f64 / ms / 1e3;
    // The log of all rays must fit into memory: the ratio is taken at few samples.
    let alone = if spp <= 2 {
        let mut yardstick = Yardstick::new(gpu, scene, settings, spp)?;
        assert_eq!(yardstick.rays()?, counters.rays, "the log has every ray");
        yardstick.run()?;
        let times = (0..REPEATS)
            .map(|_| yardstick.run())
            .collect::<Result<Vec<_>, _>>()?;
        let alone = median(times);
        format!("{alone:.2} | {:.2}", alone / ms)
    } else {
        "- | -".into()
    };
    println!(
        "| {} | {} | {spp} | {ms:.2} | {:.1} | {:.1} | {:.0} | {alone} |",
        settings.estimator.name(),
        settings.selection.name(),
        1e3 / ms,
        rate(counters.paths),
        rate(counters.rays),
    );
    Ok(())
}
