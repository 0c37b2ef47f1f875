//! `runelight bench`: what it writes, what it refuses, and that it finds an error of 1 %.

use anyhow::Result;
use gallery::builder::{Builder, camera};
use runelight::bench::bias::judge;
use runelight::bench::identity::{REFERENCE_SEED, level_hash};
use runelight::bench::plan::Plan;
use runelight::bench::result::{Bias, Budget};
use runelight::bench::view::Job;
use runelight::bench::watch::Watch;
use runelight::cli::{Lights, SceneArgs};
use runelight::job::AnyRenderer;
use scene::Frame;
use scene::render::{Estimator, Film, Selection, Settings};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;

/// A renderer with a wrong weight: reflected light is multiplied by `factor`.
struct Wrong {
    right: reference::Reference,
    factor: f32,
}

impl AnyRenderer for Wrong {
    fn accumulate(&mut self, samples: u32) -> Result<()> {
        AnyRenderer::accumulate(&mut self.right, samples)
    }

    fn finish(&mut self) -> Result<()> {
        AnyRenderer::finish(&mut self.right)
    }

    fn film(&mut self) -> Result<Film> {
        let mut film = AnyRenderer::film(&mut self.right)?;
        for i in 0..film.beauty.len() {
            for c in 0..3 {
                let reflected = film.direct[i][c] + film.indirect[i][c];
                film.beauty[i][c] = film.emission[i][c] + self.factor * reflected;
            }
        }
        Ok(film)
    }

    fn accumulate_per_pixel(&mut self, samples: &[u32]) -> Result<()> {
        AnyRenderer::accumulate_per_pixel(&mut self.right, samples)
    }

    fn show(&mut self, frame: &Frame) -> Result<()> {
        AnyRenderer::show(&mut self.right, frame)
    }

    fn restart(&mut self, seed: u64) -> Result<()> {
        AnyRenderer::restart(&mut self.right, seed)
    }
}

/// A room under a bright ceiling, measured with a renderer that is wrong by `factor`, against a
/// reference from the one that is not. The camera sees reflected light alone.
fn bias_of(factor: f32, cache: &Path) -> Bias {
    let mut builder = Builder::new();
    let wall = builder.plain(160, 0.0);
    let lamp = builder.plain(160, 1.0);
    let (min, max) = ([0.0; 3].into(), [256.0, 256.0, 128.0].into());
    builder.cuboid(min, max, true, [wall, wall, wall, wall, wall, lamp]);
    let scene = builder.build();
    let plan = Plan {
        levels: Vec::new(),
        may_lack_levels: false,
        curves: vec![(Estimator::Mis, Selection::Power)],
        candidates: 1,
        sampler: scene::render::Sampler::Independent,
        budgets: [8, 16, 32].map(Budget::Samples).to_vec(),
        size: (32, 18),
        depth: 3,
        repeats: 4,
        // The error wanted decides, not the clock.
        reference_seconds: 1e6,
        scene: SceneArgs {
            styles: Vec::new(),
            fog: None,
            skyfog: None,
            entities: Default::default(),
            surfaces: Default::default(),
            at: 0.0,
            lights: Lights::Textures,
            threshold: 0.5,
            emission_scale: 4.0,
        },
        seed: 0,
    };
    let job = Job {
        plan: &plan,
        scene: &scene,
        level_hash: &level_hash(&scene),
        camera: camera([32.0, 32.0, 96.0].into(), 35.0, 45.0, 60.0),
        device: ("cpu", "test"),
        maker: &|settings: &Settings| {
            let settings = Settings {
                aovs: true,
                clamp: None,
                ..settings.clone()
            };
            let is_reference = settings.seed & REFERENCE_SEED != 0;
            Ok(Box::new(Wrong {
                right: reference::Reference::new(Arc::clone(&scene), &settings)?,
                factor: if is_reference { 1.0 } else { factor },
            }))
        },
        given: None,
        cache,
        watch: &Watch::new(false),
        stop: &|| false,
        deadline: None,
    };
    let view = job.run().unwrap().unwrap();
    assert!(view.reference.is_good(), "{:?}", view.reference);
    let mut bias = view.curves[0].bias.clone().unwrap();
    judge([&mut bias]);
    bias
}

#[test]
fn a_weight_that_is_wrong_by_one_percent_is_found_and_a_right_one_is_not() {
    let cache = tempfile::tempdir().unwrap();
    let right = bias_of(1.0, cache.path());
    assert!(!right.biased, "{right:?}");
    // So many samples were chosen that a shift below 1 % is found nine times in ten.
    assert!(right.detects < 0.009, "{right:?}");
    let wrong = bias_of(1.01, cache.path());
    assert!(wrong.biased && wrong.mean_p < 1e-3, "{wrong:?}");
    assert!(
        (wrong.mean_ratio.value / right.mean_ratio.value - 1.01).abs() < 1e-4,
        "{wrong:?}"
    );
}

/// Runs the program on the processor with a cache of its own.
fn bench(dir: &Path, args: &[&str]) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_runelight"))
        .arg("bench")
        .args(args)
        .args(["--device", "cpu"])
        .current_dir(dir)
        .env_remove("RUNELIGHT_BASEDIR")
        .env("XDG_CACHE_HOME", dir.join("cache"))
        .output()
        .unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (
        output.status.code().unwrap_or(-1),
        text(output.stdout),
        text(output.stderr),
    )
}

/// Options of a bench that is over at once.
const TINY: [&str; 14] = [
    "--size",
    "16x9",
    "--depth",
    "3",
    "--spp",
    "4,8,16",
    "--estimators",
    "naive,mis",
    "--lights",
    "textures",
    "--repeats",
    "3",
    "--reference-seconds",
    "1000",
];

fn tiny<'a>(more: &[&'a str]) -> Vec<&'a str> {
    TINY.iter().chain(more).copied().collect()
}

fn files(dir: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = (std::fs::read_dir(dir).unwrap())
        .map(|e| e.unwrap().path())
        .collect();
    files.sort();
    files
}

fn read(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn a_bench_writes_tables_and_plots_and_keeps_its_reference() {
    let temp = tempfile::tempdir().unwrap();
    let dir = temp.path();
    let (code, out, err) = bench(dir, &tiny(&["-o", "out"]));
    assert_eq!(code, 0, "{err}");
    for words in [
        "speed-up",
        "mis leaf",
        "unbiased within noise",
        "escaped/1e9",
    ] {
        assert!(out.contains(words), "no {words:?} in {out}");
    }
    let names: Vec<String> = (files(&dir.join("out")).iter())
        .map(|p| p.file_name().unwrap().to_str().unwrap().to_owned())
        .collect();
    let wanted = [
        "00-sample-samples.svg",
        "00-sample-time.svg",
        "bench.csv",
        "bench.json",
        "speedup.svg",
    ];
    assert_eq!(names, wanted);
    let svg = std::fs::read_to_string(dir.join("out/00-sample-samples.svg")).unwrap();
    assert!(svg.starts_with("<svg") && svg.contains("mis power") && svg.ends_with("</svg>\n"));

    let json = read(&dir.join("out/bench.json"));
    let view = &json["views"][0];
    assert_eq!(view["curves"].as_array().unwrap().len(), 3);
    assert_eq!(json["complete"], true);
    assert!(view["reference"]["batches"].as_u64().unwrap() >= 8);
    let point = &view["curves"][1]["points"][2];
    assert_eq!(point["budget"]["samples"], 16);
    assert_eq!(point["paths"], 16.0 * 144.0);
    let (raw, corrected) = (
        point["metrics"]["relmse"]["value"].as_f64().unwrap(),
        point["corrected"]["relmse"]["value"].as_f64().unwrap(),
    );
    let own = view["reference"]["relmse"].as_f64().unwrap();
    assert!((raw - corrected - own).abs() < 1e-12);
    let csv = std::fs::read_to_string(dir.join("out/bench.csv")).unwrap();
    let columns: Vec<usize> = csv.lines().map(|l| l.split(',').count()).collect();
    assert_eq!(columns.len(), 1 + 3 * 3);
    assert!(columns.iter().all(|c| *c == columns[0]), "{columns:?}");

    // Again: the reference is there, and the pictures are the same.
    let (code, out, err) = bench(dir, &tiny(&["-o", "again", "--json"]));
    assert_eq!((code, err.as_str()), (0, ""));
    let again: Value = serde_json::from_str(&out).unwrap();
    let runs = |json: &Value| json["views"][0]["curves"][2]["points"][0]["relmse_runs"].clone();
    assert_eq!(runs(&again), runs(&json));
    assert_eq!(
        again["views"][0]["reference"]["samples"],
        view["reference"]["samples"]
    );
}

#[test]
fn a_reference_of_something_else_is_refused_or_made_anew() {
    let temp = tempfile::tempdir().unwrap();
    let dir = temp.path();
    let brighter = tiny(&["-o", "out", "--emission-scale", "5"]);
    assert_eq!(bench(dir, &brighter).0, 0);
    let cache = dir.join("cache/runelight/references");
    let other = files(&cache).remove(0);
    let given = other.to_str().unwrap();
    let (code, out, err) = bench(dir, &tiny(&["-o", "out", "--reference", given]));
    assert_eq!((code, out.as_str()), (1, ""));
    // Emission is part of the level as it is imported, so that differs first.
    assert!(
        err.contains("--reference") && err.contains("level hash is"),
        "{err}"
    );
    std::fs::write(dir.join("no.exr"), b"v/1\x01 and nothing").unwrap();
    let (code, _, err) = bench(dir, &tiny(&["-o", "out", "--reference", "no.exr"]));
    assert!(
        code == 1 && err.contains("no EXR that can be read"),
        "{err}"
    );

    assert_eq!(bench(dir, &tiny(&["-o", "out"])).0, 0);
    let mine = files(&cache).into_iter().find(|f| *f != other).unwrap();
    std::fs::copy(&other, &mine).unwrap();
    let (code, _, err) = bench(dir, &tiny(&["-o", "out"]));
    assert_eq!(code, 0);
    assert!(err.contains("is stale and is made anew"), "{err}");
    let (code, _, err) = bench(
        dir,
        &tiny(&["-o", "out", "--reference", mine.to_str().unwrap()]),
    );
    assert_eq!((code, err.as_str()), (0, ""));
}

#[test]
fn a_baseline_tells_worse_from_noise() {
    let temp = tempfile::tempdir().unwrap();
    let dir = temp.path();
    assert_eq!(bench(dir, &tiny(&["-o", "out"])).0, 0);
    // Times as a quiet machine would have measured them.
    let json = dir.join("out/bench.json");
    let with_seconds = |scale: f64| {
        let mut bench = read(&json);
        for curve in bench["views"][0]["curves"].as_array_mut().unwrap() {
            for point in curve["points"].as_array_mut().unwrap() {
                let samples = point["samples"].as_f64().unwrap();
                let runs = [0.99, 1.0, 1.01].map(|r| r * samples * scale);
                point["seconds_runs"] = runs.to_vec().into();
            }
        }
        serde_json::to_string(&bench).unwrap()
    };
    let run = |baseline: f64, now: f64| {
        std::fs::write(dir.join("before.json"), with_seconds(baseline)).unwrap();
        std::fs::write(&json, with_seconds(now)).unwrap();
        bench(
            dir,
            &tiny(&["-o", "out", "--resume", "--baseline", "before.json"]),
        )
    };
    let (code, _, err) = run(1.0, 1.0);
    assert_eq!(code, 0, "{err}");
    assert!(err.contains("no regression beyond noise"), "{err}");
    let (code, _, err) = run(1.0, 1.02);
    assert_eq!(code, 0, "within the tolerance: {err}");
    let (code, _, err) = run(1.0, 0.5);
    assert!(code == 0 && err.contains("better"), "{err}");
    let (code, _, err) = run(1.0, 1.3);
    assert_eq!(code, 3, "{err}");
    assert!(err.contains("mis power, seconds for 16 spp: 1.300 times") && err.contains("WORSE"));

    let text = with_seconds(1.0).replace("\"settings_hash\":\"", "\"settings_hash\":\"0");
    std::fs::write(dir.join("before.json"), text).unwrap();
    let same = tiny(&["-o", "out", "--resume", "--baseline", "before.json"]);
    let (code, _, err) = bench(dir, &same);
    assert!(code == 1 && err.contains("other settings"), "{err}");
    std::fs::write(dir.join("before.json"), "{}").unwrap();
    let (code, _, err) = bench(dir, &same);
    assert!(code == 1 && err.contains("is no bench.json"), "{err}");
}

#[test]
fn wrong_usage_names_the_option() {
    let temp = tempfile::tempdir().unwrap();
    for (args, words) in [
        (
            vec!["--estimators", "mis,bdpt"],
            "\"bdpt\" is none of naive",
        ),
        (vec!["--spp", "1"], "--spp"),
        (vec!["--seconds", ""], "--seconds"),
        (vec!["--quick", "--suite"], "--suite"),
        (vec!["--paths", "10"], "--hard"),
        (
            vec!["--quick", "--reference", "a.exr"],
            "--reference is of a single view",
        ),
        (vec!["--size", "8000x8000"], "GiB of memory"),
    ] {
        let (code, _, err) = bench(temp.path(), &args);
        assert_eq!(code, 2, "{args:?}: {err}");
        assert!(err.contains(words), "{err}");
    }
    assert!(files(temp.path()).is_empty());
}

#[test]
fn hard_cases_are_written_where_output_says() {
    let temp = tempfile::tempdir().unwrap();
    let dir = temp.path();
    let cut_off = "--hard --paths 1 --time-limit 1 -o out";
    let args = cut_off.split(' ').collect::<Vec<_>>();
    let (code, _, err) = bench(dir, &args);
    assert_eq!(code, 3, "not every case was rendered: {err}");
    let written = std::fs::read(dir.join("out/hard.json")).unwrap();
    let json: Value = serde_json::from_slice(&written).unwrap();
    assert_eq!(
        (&json["complete"], &json["rows"][0]["case"]),
        (&false.into(), &"closed box".into())
    );
    let text = std::fs::read_to_string(dir.join("out/hard.txt")).unwrap();
    assert!(text.contains("Not every case was rendered."), "{text}");
    // What fails leaves what is there, and without -o there is nothing.
    std::fs::remove_file(dir.join("out/hard.txt")).unwrap();
    std::fs::create_dir(dir.join("out/hard.txt")).unwrap();
    let (code, _, err) = bench(dir, &args);
    assert!(code == 1 && err.contains("hard.txt"), "{err}");
    assert_eq!(std::fs::read(dir.join("out/hard.json")).unwrap(), written);
    bench(dir, &args[..5]);
    assert_eq!(files(dir), [dir.join("out")]);
}
