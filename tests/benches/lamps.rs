//! How do time and error grow with the number of lamps? A hall with pillars under 80 to 80,000 lamps
//! that shine alike together.
//!
//! `cargo bench -p runelight-tests --bench lamps -- [--device TEXT|cpu] [--size WxH] [--spp N]
//! [--reference N] [--most N]` prints a Markdown table: milliseconds per sample of the whole picture,
//! and relMSE at equal samples against a picture of many more.

use clap::Parser as _;
use glam::Vec3;
use reference::Reference;
use rt::{Gpu, PathTracer};
use runelight_tests::builder::{Builder, camera, settings};
use runelight_tests::devices::{open_named, parse_size};
use scene::Scene;
use scene::render::{CANDIDATES, Estimator, Film, RELMSE_EPSILON, Renderer, Selection, Settings};
use std::error::Error;
use std::sync::Arc;
use std::time::Instant;

const SIDE: f32 = 4096.0;
const HEIGHT: f32 = 384.0;
/// Radiance of a white ceiling of lamps that would light the hall as much.
const CEILING: f32 = 0.5;
const LAMP: f32 = 4.0;
/// Runs with other seeds, whose errors are averaged and of whose times the least is told.
const RUNS: u64 = 4;

#[derive(clap::Parser)]
struct Args {
    /// Part of a Vulkan device's name, or `cpu`; the first that can do it otherwise.
    #[arg(long, default_value = "")]
    device: String,
    /// Picture size.
    #[arg(long, default_value = "320x180", value_parser = parse_size)]
    size: [u32; 2],
    /// Samples per pixel.
    #[arg(long, default_value_t = 64)]
    spp: u32,
    /// Samples per pixel of the picture measured against.
    #[arg(long, default_value_t = 4096)]
    reference: u32,
    /// Lamps at most.
    #[arg(long, default_value_t = 80_000)]
    most: u32,
    /// Cargo says that this is a benchmark.
    #[arg(long, hide = true)]
    bench: bool,
}

/// The hall with `count` lamps below its ceiling, in a grid out of step with the pillars.
fn hall(count: u32) -> Arc<Scene> {
    let mut b = Builder::new();
    let stone = b.plain(140, 0.0);
    let radiance = CEILING * SIDE * SIDE / (count as f32 * (2.0 * LAMP).powi(2));
    // Lamps are not alike: every third has twice the light of the others.
    let [dim, bright] = [0.75, 1.5].map(|share| b.plain(0, share * radiance));
    b.cuboid(Vec3::ZERO, Vec3::new(SIDE, SIDE, HEIGHT), true, [stone; 6]);
    for i in 0..12 {
        for j in 0..12 {
            let at = Vec3::new(i as f32 + 0.5, j as f32 + 0.5, 0.0) * (SIDE / 12.0);
            let half = Vec3::new(24.0, 24.0, 0.0);
            b.cuboid(at - half, at + half + Vec3::Z * HEIGHT, false, [stone; 6]);
        }
    }
    let columns = (f64::from(count).sqrt().ceil()) as u32;
    let step = SIDE / columns as f32;
    for i in 0..count {
        let (x, y) = ((i % columns) as f32 + 0.31, (i / columns) as f32 + 0.37);
        let at = Vec3::new(x * step, y * step, HEIGHT - 16.0);
        b.slab(
            at,
            [LAMP; 2],
            false,
            if i % 3 == 0 { bright } else { dim },
            [1.0; 2],
        );
    }
    b.build()
}

/// Renders `spp` samples; the picture and milliseconds per sample.
fn render(
    gpu: Option<&Gpu>,
    scene: &Arc<Scene>,
    settings: &Settings,
    spp: u32,
) -> Result<(Film, f64), Box<dyn Error>> {
    fn timed<R: Renderer>(mut renderer: R, spp: u32) -> Result<(Film, f64), Box<dyn Error>> {
        // The first sample warms up.
        renderer.accumulate(1)?;
        renderer.finish()?;
        let start = Instant::now();
        renderer.accumulate(spp - 1)?;
        let film = renderer.film()?;
        Ok((
            film,
            start.elapsed().as_secs_f64() * 1e3 / f64::from(spp - 1),
        ))
    }
    match gpu {
        Some(gpu) => timed(PathTracer::new(gpu, scene, settings)?, spp),
        None => timed(Reference::new(scene.clone(), settings)?, spp),
    }
}

fn relmse(film: &Film, truth: &Film) -> f64 {
    let pairs = (film.beauty.iter().flatten()).zip(truth.beauty.iter().flatten());
    let sum: f64 = pairs
        .map(|(&i, &r)| (f64::from(i), f64::from(r)))
        .map(|(i, r)| (i - r).powi(2) / (r * r + RELMSE_EPSILON))
        .sum();
    sum / (3 * film.beauty.len()) as f64
}

fn main() -> Result<(), Box<dyn Error>> {
    let args = Args::parse();
    let gpu = if args.device == "cpu" {
        println!("Device: cpu");
        None
    } else {
        let (gpu, device) = open_named(&args.device)?;
        println!("Device: {device}");
        Some(gpu)
    };
    let [width, height] = args.size;
    println!(
        "Image: {width}x{height}, depth 3, {} samples, {CANDIDATES} candidates; reference of {} samples\n",
        args.spp, args.reference
    );
    println!("| lamps | choice | ms per sample | relMSE | prepare, ms |");
    println!("|---|---|---|---|---|");
    let eye = camera(Vec3::new(340.0, 340.0, 100.0), -2.0, 40.0, 90.0);
    for count in [80, 800, 8_000, 80_000]
        .into_iter()
        .filter(|&n| n <= args.most)
    {
        let start = Instant::now();
        let scene = hall(count);
        let prepare = start.elapsed().as_secs_f64() * 1e3;
        let mut view = Settings {
            width,
            height,
            candidates: CANDIDATES,
            selection: Selection::Tree,
            seed: RUNS,
            ..settings(eye.clone(), 1, Estimator::Mis, 3)
        };
        let truth = render(gpu.as_ref(), &scene, &view, args.reference)?.0;
        for selection in [Selection::Power, Selection::Tree] {
            view.selection = selection;
            let (mut ms, mut error) = (f64::INFINITY, 0.0);
            for run in 0..RUNS {
                view.seed = run;
                let (film, once) = render(gpu.as_ref(), &scene, &view, args.spp)?;
                ms = ms.min(once);
                error += relmse(&film, &truth) / RUNS as f64;
            }
            println!(
                "| {count} | {} | {ms:.3} | {error:.5} | {prepare:.0} |",
                selection.name(),
            );
        }
    }
    Ok(())
}
