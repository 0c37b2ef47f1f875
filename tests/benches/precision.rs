//! Which error does each stage add?
//!
//! `cargo bench -p runelight-tests --bench precision -- [--device TEXT]` prints a Markdown table: texture
//! decoding, intersection, densities and solid angles, accumulation, half-float files, each measured
//! against double precision. Pictures come from the Vulkan device; formulas are the shaders', in
//! single precision on the processor. `cargo xtask accuracy` puts the table into
//! `docs/accuracy.md`.

use glam::{DVec3, Vec3};
use rt::{Gpu, PathTracer};
use runelight::output::{Layer, Outputs, Style};
use runelight_tests::builder::{Builder, camera, settings, unit};
use runelight_tests::devices::open_named;
use runelight_tests::levels;
use scene::Scene;
use scene::import::LightMode;
use scene::material::srgb_to_linear;
use scene::render::{Estimator, Film, Renderer, Settings};
use std::error::Error;
use std::sync::Arc;

type Anything<T> = Result<T, Box<dyn Error>>;

fn main() -> Anything<()> {
    let gpu = gpu()?;
    println!(
        "Device: {}, {}.\n\n\
         | stage | what is measured | median | 99 % | worst |\n|---|---|---|---|---|",
        gpu.info().name,
        gpu.info().driver
    );
    row(
        "texture decoding",
        "albedo of all 256 codes, relative",
        decoding(&gpu)?,
    );
    let scene = levels::sample(LightMode::Auto);
    row(
        "intersection, off the plane",
        "hit to the face's plane, world units (sample level, 1,150 units across)",
        off_the_plane(&gpu, &scene)?,
    );
    row(
        "intersection, whole",
        "hit to that of the f64 reference along the same ray, world units",
        beside_the_ray(&gpu, &scene)?,
    );
    let [difference, absolute] = density();
    row(
        "light density, as it is",
        "d^2 / (A cos) of a 1-unit triangle 4,096 units away, relative",
        difference,
    );
    row(
        "light density, normalised triple product",
        "solid angle of the same triangle, relative (not used)",
        absolute,
    );
    let [stable, naive] = sphere();
    row(
        "sphere's cone, as it is",
        "s^2 / (1 + sqrt(1 - s^2)), radius 0.8 at 1,000 to 5,000 units, relative",
        stable,
    );
    row(
        "sphere's cone, 1 - sqrt(1 - s^2)",
        "the same spheres, relative (not used)",
        naive,
    );
    let [kahan, plain, running] = accumulation();
    row(
        "accumulation, as it is",
        "compensated f32 sum of 2^20 samples, 1 in 1,000 bright, relative",
        kahan,
    );
    row(
        "accumulation, plain f32 sum",
        "the same samples, relative (not used)",
        plain,
    );
    row(
        "accumulation, running f32 mean",
        "the same samples, relative (not used)",
        running,
    );
    let (errors, relmse) = half_float(&gpu, &scene)?;
    row(
        "half-float EXR",
        "radiance of a picture of the sample level, relative",
        errors,
    );
    println!("\nThe half-float file's relMSE against the float file is {relmse:.1e}.");
    Ok(())
}

/// The device named by `--device`, else the best one.
fn gpu() -> Anything<Gpu> {
    let mut wanted = String::new();
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        match word.as_str() {
            "--bench" => {}
            "--device" => wanted = words.next().ok_or("--device needs a value")?,
            other => return Err(format!("unknown option {other}").into()),
        }
    }
    Ok(open_named(&wanted)?.0)
}

/// Prints a row: quantiles of the errors' sizes.
fn row(stage: &str, what: &str, errors: Vec<f64>) {
    let mut sizes: Vec<f64> = errors.into_iter().map(f64::abs).collect();
    sizes.sort_by(f64::total_cmp);
    let quantile = |q: f64| sizes[((sizes.len() - 1) as f64 * q).round() as usize];
    println!(
        "| {stage} | {what} | {:.1e} | {:.1e} | {:.1e} |",
        quantile(0.5),
        quantile(0.99),
        quantile(1.0)
    );
}

/// A picture with all layers from the Vulkan device.
fn picture(gpu: &Gpu, scene: &Arc<Scene>, settings: &Settings, samples: u32) -> Anything<Film> {
    let mut tracer = PathTracer::new(gpu, scene, settings)?;
    tracer.accumulate(samples)?;
    Ok(tracer.film()?)
}

fn decoding(gpu: &Gpu) -> Anything<Vec<f64>> {
    let mut b = Builder::new();
    let codes = b.texture(256, (0..=255).map(|c| [c, c, c, 255]).collect());
    let wall = b.material(codes, None, 0.0);
    let corners = [[0.0, -8.0], [256.0, -8.0], [256.0, 8.0], [0.0, 8.0]];
    b.quad(
        corners.map(|[x, y]| Vec3::new(x, y, 0.0)),
        wall,
        [256.0, 1.0],
    );
    let scene = b.build();
    let mut view = settings(
        camera(Vec3::new(128.0, 0.0, 100.0), 90.0, 0.0, 120.0),
        128,
        Estimator::Naive,
        1,
    );
    (view.aovs, view.height) = (true, 1024);
    let film = picture(gpu, &scene, &view, 1)?;
    let errors = (0..film.albedo.len())
        .filter(|&i| film.id[i] != 0)
        .filter_map(|i| {
            // Texels are a unit wide; at their borders the position may be rounded to the other one.
            let x = f64::from(film.position[i][0]);
            let inside = (x - x.round()).abs() > 1e-3 && (0.0..256.0).contains(&x);
            let code = inside.then_some(x as u8)?;
            let truth = srgb_to_linear(code).min(f64::from(scene::material::MAX_ALBEDO));
            (truth > 0.0).then(|| f64::from(film.albedo[i][0]) / truth - 1.0)
        })
        .collect();
    Ok(errors)
}

/// Corners of a triangle of the scene in world space, in double precision.
fn corners(scene: &Scene, instance: &scene::Instance, t: &scene::Triangle) -> [DVec3; 3] {
    let mesh = &scene.meshes[instance.mesh];
    t.vertices.map(|v| {
        (instance.transform)
            .transform_point3(mesh.positions[v as usize])
            .as_dvec3()
    })
}

fn off_the_plane(gpu: &Gpu, scene: &Arc<Scene>) -> Anything<Vec<f64>> {
    let mut errors = Vec::new();
    for view in &scene.cameras {
        let mut settings = settings(view.clone(), 160, Estimator::Naive, 1);
        settings.aovs = true;
        let film = picture(gpu, scene, &settings, 1)?;
        for (id, position) in film.id.iter().zip(&film.position) {
            let position = Vec3::from(*position).as_dvec3();
            let distances = scene.instances.iter().flat_map(|instance| {
                let triangles = scene.meshes[instance.mesh].triangles.iter();
                triangles
                    .filter(|t| t.face + 1 == *id)
                    .map(move |t| (corners(scene, instance, t), t.normal))
            });
            let nearest = distances
                .map(|([p, ..], normal)| ((position - p).dot(normal.as_dvec3())).abs())
                .min_by(f64::total_cmp);
            errors.extend(nearest);
        }
    }
    Ok(errors)
}

fn beside_the_ray(gpu: &Gpu, scene: &Arc<Scene>) -> Anything<Vec<f64>> {
    let eye = scene.cameras[0].position;
    let mut errors = Vec::new();
    for i in 0..200 {
        let (u, v) = (
            f64::from(i) * 0.618_033_988_7 % 1.0,
            (f64::from(i) + 0.5) / 200.0,
        );
        let d = unit(v, u);
        let (pitch, yaw) = ((-d.z).asin().to_degrees(), d.y.atan2(d.x).to_degrees());
        // The narrowest picture there is: all its rays are one.
        let view = camera(eye, pitch as f32, yaw as f32, 1e-7);
        let mut settings = settings(view, 1, Estimator::Naive, 1);
        settings.aovs = true;
        let ours = picture(gpu, scene, &settings, 1)?;
        let mut judge = reference::Reference::new(scene.clone(), &settings)?;
        judge.accumulate(1)?;
        let theirs = judge.film()?;
        if ours.id == theirs.id {
            let [a, b] = [&ours, &theirs].map(|f| Vec3::from(f.position[0]).as_dvec3());
            errors.push(a.distance(b));
        }
    }
    Ok(errors)
}

/// Triangles of a unit's size in all directions about a point 4,096 units away: the relative errors
/// of the density as the shader computes it, and of the solid angle from normalised directions.
fn density() -> [Vec<f64>; 2] {
    let mut errors = [Vec::new(), Vec::new()];
    for i in 0..2000 {
        let [u, v] = [0.618_033_988_7, 0.754_877_666_2].map(|k| f64::from(i) * k % 1.0);
        let from = Vec3::new(1000.5, -700.25, 300.0 + (i % 7) as f32);
        let centre = from + (unit(u, v) * 4096.0).as_vec3();
        let (e1, e2) = (
            unit(v, u).as_vec3(),
            unit(1.0 - v, (u + 0.3) % 1.0).as_vec3(),
        );
        let p: [Vec3; 3] = [centre, centre + e1, centre + e2];
        let normal = (p[1] - p[0]).cross(p[2] - p[0]);
        let area = normal.length() / 2.0;
        let normal = normal.normalize();
        let b = [0.3f32, 0.3];
        let towards =
            (p[0] - from) * (1.0 - b[0] - b[1]) + (p[1] - from) * b[0] + (p[2] - from) * b[1];
        let squared = towards.dot(towards);
        let cos = -normal.dot(towards / squared.sqrt());
        let ours = squared / (area * cos.abs());
        // The same in double precision.
        let q = p.map(|p| p.as_dvec3() - from.as_dvec3());
        let wound = (q[1] - q[0]).cross(q[2] - q[0]);
        let to = q[0] * (1.0 - 0.3f32 as f64 - 0.3f32 as f64) + (q[1] + q[2]) * f64::from(0.3f32);
        let cosine = wound.normalize().dot(to.normalize()).abs();
        // Seen edge-on, or without area.
        if cosine.is_nan() || cosine < 0.05 {
            continue;
        }
        let truth = to.length_squared() / (wound.length() / 2.0 * cosine);
        errors[0].push(f64::from(ours) / truth - 1.0);
        let d = p.map(|p| (p - from).normalize());
        let angle = d[0].dot(d[1].cross(d[2])).abs()
            / (1.0 + d[0].dot(d[1]) + d[1].dot(d[2]) + d[2].dot(d[0]));
        let volume = q[0].dot(q[1].cross(q[2])).abs();
        let [a, b, c] = q.map(DVec3::length);
        let exact =
            volume / (a * b * c + q[0].dot(q[1]) * c + q[1].dot(q[2]) * a + q[2].dot(q[0]) * b);
        errors[1].push(f64::from(angle) / exact - 1.0);
    }
    errors
}

/// Relative errors of the height of the cone that a sphere subtends.
fn sphere() -> [Vec<f64>; 2] {
    let mut errors = [Vec::new(), Vec::new()];
    for i in 0..4000 {
        let distance = 1000.0 + i as f32;
        let sin2 = 0.8f32 * 0.8 / (distance * distance);
        let exact = f64::from(0.8f32).powi(2) / f64::from(distance).powi(2);
        let exact = exact / (1.0 + (1.0 - exact).sqrt());
        let stable = sin2 / (1.0 + (1.0 - sin2).sqrt());
        let naive = 1.0 - (1.0 - sin2).sqrt();
        errors[0].push(f64::from(stable) / exact - 1.0);
        errors[1].push(f64::from(naive) / exact - 1.0);
    }
    errors
}

/// Relative errors of sums of a sparse signal, as the film keeps it and in two simpler ways.
fn accumulation() -> [Vec<f64>; 3] {
    let mut errors = [Vec::new(), Vec::new(), Vec::new()];
    let mut state = 1u64;
    let mut uniform = || {
        state = (state.wrapping_mul(6_364_136_223_846_793_005)).wrapping_add(1);
        (state >> 40) as f32 / (1u64 << 24) as f32
    };
    for _ in 0..20 {
        let (mut sum, mut lost, mut plain, mut mean, mut exact) = (0f32, 0f32, 0f32, 0f32, 0f64);
        for n in 1..=1 << 20 {
            let value = if uniform() < 1e-3 {
                40.0 * uniform()
            } else {
                0.01 * uniform()
            };
            let term = value - lost;
            let next = sum + term;
            lost = (next - sum) - term;
            sum = next;
            plain += value;
            mean += (value - mean) / n as f32;
            exact += f64::from(value);
        }
        errors[0].push(f64::from(sum) / exact - 1.0);
        errors[1].push(f64::from(plain) / exact - 1.0);
        errors[2].push(f64::from(mean) * f64::from(1 << 20) / exact - 1.0);
    }
    errors
}

/// Relative errors of what a half-float file holds, and its relMSE.
fn half_float(gpu: &Gpu, scene: &Arc<Scene>) -> Anything<(Vec<f64>, f64)> {
    let view = settings(scene.cameras[0].clone(), 96, Estimator::Mis, 4);
    let film = picture(gpu, scene, &view, 64)?;
    let folder = std::env::temp_dir().join(format!("runelight-precision-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let read = |half: bool| -> Anything<_> {
        let path = folder.join(if half { "half.exr" } else { "float.exr" });
        let style = Style {
            layers: vec![Layer::Beauty],
            half,
            ..Style::default()
        };
        Outputs::open(std::slice::from_ref(&path))?.write(&film, &style)?;
        Ok(runelight::picture::read(&path, "beauty")?)
    };
    let (half, float) = (read(true)?, read(false)?);
    std::fs::remove_dir_all(&folder)?;
    let pairs = half
        .radiance
        .iter()
        .flatten()
        .zip(float.radiance.iter().flatten());
    let errors = pairs
        .filter(|(_, truth)| **truth > 0.0)
        .map(|(half, truth)| f64::from(*half) / f64::from(*truth) - 1.0)
        .collect();
    let (metrics, _) = runelight::metrics::compare(&float, &half)?;
    Ok((errors, metrics.relmse))
}
