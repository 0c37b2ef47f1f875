//! What does it cost to show a frame? Either a hall with models in poses, each another one, with loose
//! triangles and lights, or the busiest second of a demo.
//!
//! `cargo bench -p runelight-tests --bench moving -- [--device TEXT] [--size WxH] [--frames N]` and
//! `[--models N] [--triangles N] [--loose N] [--lights N]` or `--demo FILE [--data DIR]` prints a
//! Markdown table: GPU milliseconds of each part of a frame, median over the frames, the host's time to
//! show one, and tracing with and without what moves.

use clap::Parser as _;
use glam::{Affine3A, Vec3};
use rt::{Gpu, PathTracer, Timing};
use runelight::cli::{Cli, Command};
use runelight::clip::{Show, Stage};
use runelight::demo;
use runelight_tests::builder::{Builder, camera, settings};
use runelight_tests::devices::{open_named, parse_size};
use runelight_tests::levels;
use scene::render::{CANDIDATES, Estimator, Renderer, Settings};
use scene::timeline::Unseen;
use scene::{Frame, Instance, MaterialId, Mesh, PointLight, PoseBlend, Scene, Triangle};
use std::error::Error;
use std::f32::consts::{PI, TAU};
use std::ffi::OsStr;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

/// Half the side of the hall, world units.
const HALF: f32 = 1024.0;
const POSES: u32 = 16;
const KINDS: usize = 8;
const DEPTH: u32 = 3;
/// Parts that make up the update of what moves.
const UPDATE: [&str; 4] = ["pose", "refit BLAS", "build loose BLAS", "rebuild TLAS"];

#[derive(clap::Parser)]
struct Args {
    /// Part of a Vulkan device's name; the first that can do it otherwise.
    #[arg(long, default_value = "")]
    device: String,
    /// Picture size.
    #[arg(long, default_value = "1280x720", value_parser = parse_size)]
    size: [u32; 2],
    /// Models in the hall.
    #[arg(long, default_value_t = 64)]
    models: u32,
    /// Triangles of each of them, about.
    #[arg(long, default_value_t = 800)]
    triangles: u32,
    /// Loose triangles in the hall.
    #[arg(long, default_value_t = 2000)]
    loose: u32,
    /// Lights that move in the hall.
    #[arg(long, default_value_t = 8)]
    lights: u32,
    /// Frames, a quarter of which warm up.
    #[arg(long, default_value_t = 32)]
    frames: u32,
    /// A demo in place of the hall: a file or a name.
    #[arg(long)]
    demo: Option<String>,
    /// The Quake directory of the demo: the test data otherwise.
    #[arg(long, default_value_os_t = levels::data())]
    data: PathBuf,
    /// Cargo says that this is a benchmark.
    #[arg(long, hide = true)]
    bench: bool,
}

/// A ball of about so many triangles that pulsates in waves, another for each kind.
fn model(kind: usize, triangles: u32, material: MaterialId) -> Mesh {
    let rows = ((triangles as f32 / 4.0).sqrt() as u32).max(2);
    let columns = 2 * rows;
    let pose = |pose: u32| -> Vec<Vec3> {
        let phase = TAU * pose as f32 / POSES as f32;
        (0..=rows)
            .flat_map(|row| (0..columns).map(move |column| (row, column)))
            .map(|(row, column)| {
                let (v, u) = (
                    PI * row as f32 / rows as f32,
                    TAU * column as f32 / columns as f32,
                );
                let wave = (3.0 * u + phase).sin() * (kind as f32 + 2.0 * v).cos();
                let direction = Vec3::new(v.sin() * u.cos(), v.sin() * u.sin(), v.cos());
                direction * (28.0 + 8.0 * wave)
            })
            .collect()
    };
    let poses: Vec<Vec<Vec3>> = (0..POSES).map(pose).collect();
    let positions = poses[0].clone();
    let mut faces = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let at = |row: u32, column: u32| row * columns + column % columns;
            let [a, b] = [at(row, column), at(row, column + 1)];
            let [c, d] = [at(row + 1, column), at(row + 1, column + 1)];
            faces.extend([[a, c, b], [b, c, d]]);
        }
    }
    let triangle = |vertices: [u32; 3]| {
        let [a, b, c] = vertices.map(|v| positions[v as usize]);
        Triangle {
            vertices,
            uv: [[0.0; 2]; 3],
            normal: (b - a).cross(c - a).normalize_or(Vec3::Z),
            material,
            face: 0,
        }
    };
    let triangles: Vec<Triangle> = faces.into_iter().map(triangle).collect();
    Mesh {
        name: format!("ball {kind}"),
        first_see_through: triangles.len(),
        triangles,
        positions,
        poses,
        skins: Vec::new(),
        ..Mesh::default()
    }
}

/// A hall with a grid of lamps, and the models that frames place in it.
fn hall(args: &Args) -> (Arc<Scene>, MaterialId) {
    let mut b = Builder::new();
    let (wall, lamp, spark) = (b.plain(170, 0.0), b.plain(90, 8.0), b.plain(0, 3.0));
    let clay = b.plain(140, 0.0);
    let corner = Vec3::new(HALF, HALF, 256.0);
    b.cuboid(-corner, corner, true, [wall; 6]);
    for i in 0..64 {
        let at = |i: u32| (i as f32 - 3.5) * HALF / 4.0;
        let place = Vec3::new(at(i % 8), at(i / 8), 250.0);
        b.slab(place, [16.0; 2], false, lamp, [1.0; 2]);
    }
    let mut scene = Arc::unwrap_or_clone(b.build());
    (scene.meshes).extend((0..KINDS).map(|kind| model(kind, args.triangles, clay)));
    scene.brightness = vec![1.0; 64];
    (Arc::new(scene.for_frames()), spark)
}

/// A number in 0..1 that two numbers decide.
fn hash(a: u32, b: u32) -> f32 {
    let mut x = a.wrapping_mul(0x9e37_79b9) ^ b.wrapping_mul(0x85eb_ca6b);
    for _ in 0..2 {
        x = (x ^ (x >> 15)).wrapping_mul(0x2c1b_3c6d);
    }
    (x >> 8) as f32 / (1 << 24) as f32
}

fn frame(scene: &Scene, spark: MaterialId, number: u32, args: &Args) -> Frame {
    let eye = camera(Vec3::new(-0.9 * HALF, 0.0, 0.0), 5.0, 0.0, 90.0);
    let mut frame = scene.as_frame(&eye, number as f32 / 60.0);
    let place = |of: u32| {
        let along = |axis: u32| 2.0 * hash(of, axis) - 1.0;
        Vec3::new(along(0) * HALF, along(1) * HALF, along(2) * 256.0) * 0.9
    };
    for i in 0..args.models {
        let from = (hash(i, 7) * POSES as f32) as u32 + number / 6;
        let pose = PoseBlend {
            from: from % POSES,
            to: (from + 1) % POSES,
            // No two alike, so that each has corners of its own.
            fraction: ((number % 6) as f32 + hash(i, 9)) / 7.0,
        };
        let turned = Affine3A::from_rotation_z(number as f32 * 0.05 + i as f32);
        let transform = Affine3A::from_translation(place(i)) * turned;
        frame.instances.push(Instance {
            pose,
            ..Instance::new(1 + i as usize % KINDS, transform, "ball")
        });
    }
    let loose = &mut frame.loose;
    for i in 0..args.loose {
        let at = place(1000 + i) + Vec3::Z * (number as f32 * 0.5 % 8.0);
        let first = loose.positions.len() as u32;
        loose
            .positions
            .extend([at, at + Vec3::Y * 1.5, at + Vec3::Z * 1.5]);
        loose.triangles.push(Triangle {
            vertices: [first, first + 2, first + 1],
            uv: [[0.0; 2]; 3],
            normal: Vec3::NEG_X,
            material: spark,
            face: 0,
        });
    }
    loose.first_see_through = loose.triangles.len();
    frame.lights = (0..args.lights)
        .map(|i| PointLight {
            position: place(5000 + i),
            radius: 8.0,
            intensity: Vec3::new(4e5, 2e5, 5e4),
            ..PointLight::default()
        })
        .collect();
    frame
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or(0.0)
}

/// By frame the timings of its parts, and the host's milliseconds.
type Run = (Vec<Vec<Timing>>, Vec<f64>);

/// Shows the frames, one sample each; by frame the timings of its parts, and the host's times.
fn run(
    gpu: &Gpu,
    scene: &Arc<Scene>,
    settings: &Settings,
    frames: &[Frame],
) -> Result<Run, Box<dyn Error>> {
    let mut tracer = PathTracer::new(gpu, scene, settings)?;
    let (mut timings, mut host) = (Vec::new(), Vec::new());
    for frame in frames {
        let start = Instant::now();
        tracer.show(frame)?;
        tracer.accumulate(1)?;
        host.push(start.elapsed().as_secs_f64() * 1e3);
        timings.push(tracer.take_timings()?);
    }
    // The first ones make room.
    let warm = frames.len() / 4;
    Ok((timings.split_off(warm), host.split_off(warm)))
}

/// What is shown: frames with what moves, and the same views without.
struct Played {
    scene: Arc<Scene>,
    frames: Vec<Frame>,
    bare: Vec<Frame>,
    told: String,
}

/// The hall with its models.
fn generated(args: &Args) -> Played {
    let (scene, spark) = hall(args);
    let frames: Vec<Frame> = (0..args.frames)
        .map(|i| frame(&scene, spark, i, args))
        .collect();
    let bare = (frames.iter())
        .map(|f| scene.as_frame(&f.camera, f.time))
        .collect();
    let told = format!("{} models in poses, {} lights", args.models, args.lights);
    Played {
        scene,
        frames,
        bare,
        told,
    }
}

/// A demo from its busiest moment on, at 60 frames a second; without its entities only doors and lifts
/// are left.
fn played(name: &str, args: &Args) -> Result<Played, Box<dyn Error>> {
    let words = ["runelight", "demo", name, "--basedir"].map(OsStr::new);
    let cli = Cli::try_parse_from(words.into_iter().chain([args.data.as_os_str()]))?;
    let Some(Command::Demo(asked)) = &cli.command else {
        return Err("not a demo".into());
    };
    let timeline = demo::timeline(&demo::read(Some(name), &cli.global)?, &cli.global)?;
    let busiest = timeline.busiest();
    let level = timeline.level_at(busiest).ok_or("an empty demo")?;
    let stage = Stage::load(&timeline, level, None, &asked.picture, &cli.global)?;
    let frames = |bare: bool| -> Result<Vec<Frame>, Box<dyn Error>> {
        let show = Show {
            timeline: &timeline,
            unseen: Unseen::Hidden,
            bare,
        };
        (0..args.frames)
            .map(|i| {
                let state = show.state(busiest + f64::from(i) / 60.0, level)?;
                Ok(stage.frame(&state, &timeline)?)
            })
            .collect()
    };
    Ok(Played {
        frames: frames(false)?,
        bare: frames(true)?,
        scene: stage.scene,
        told: format!("{name} from {busiest:.2} s"),
    })
}

fn main() -> Result<(), Box<dyn Error>> {
    let args = Args::parse();
    let (gpu, device) = open_named(&args.device)?;
    let played = match &args.demo {
        Some(name) => played(name, &args)?,
        None => generated(&args),
    };
    let (scene, first) = (&played.scene, &played.frames[0]);
    let [width, height] = args.size;
    let settings = Settings {
        width,
        height,
        candidates: CANDIDATES,
        ..settings(first.camera.clone(), 1, Estimator::Mis, DEPTH)
    };
    let posed = (first.instances.iter()).filter(|i| !scene.meshes[i.mesh].poses.is_empty());
    let triangles: usize = (posed.clone())
        .map(|i| scene.meshes[i.mesh].triangles.len())
        .sum();
    println!("Device: {device}\n");
    println!(
        "{}: {} instances, {} of them in poses with {triangles} triangles; {} loose triangles, {} \
         lights; {width}x{height}, depth {DEPTH}, 1 sample; medians of {} frames\n",
        played.told,
        first.instances.len(),
        posed.count(),
        first.loose.triangles.len(),
        first.lights.len(),
        args.frames - args.frames / 4,
    );
    let (timings, host) = run(&gpu, scene, &settings, &played.frames)?;
    let of = |timings: &[Vec<Timing>], wanted: &dyn Fn(&str) -> bool| {
        let sum = |parts: &Vec<Timing>| {
            let wanted = parts.iter().filter(|t| wanted(t.name));
            wanted.map(|t| t.milliseconds).sum::<f64>()
        };
        median(timings.iter().map(sum).collect())
    };
    println!("| part | ms |\n|---|---|");
    for part in UPDATE {
        println!("| {part} | {:.3} |", of(&timings, &|name| name == part));
    }
    let update = of(&timings, &|name| UPDATE.contains(&name));
    println!("| **update** | {update:.3} |");
    let upload = of(&timings, &|name| name == "upload moment");
    println!("| upload moment | {upload:.3} |");
    let trace = |name: &str| name == "path trace";
    println!("| path trace | {:.3} |", of(&timings, &trace));
    println!("| host: show and record | {:.3} |", median(host));
    let whole = of(&timings, &|_| true);
    println!("| **whole frame** | {whole:.3} |");
    let (timings, _) = run(&gpu, scene, &settings, &played.bare)?;
    println!(
        "| path trace without what moves | {:.3} |",
        of(&timings, &trace)
    );
    let bare = of(&timings, &|_| true);
    println!("| **whole frame without what moves** | {bare:.3} |");
    println!(
        "\nThe whole frame takes {:.2} times the one without.",
        whole / bare
    );
    Ok(())
}
