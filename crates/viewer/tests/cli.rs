//! The binary as people and scripts meet it: one test for each class of message.

use serde_json::Value;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// The program on the processor, in an empty environment of its own.
fn runelight(dir: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_runelight"));
    command
        .args(args)
        .current_dir(dir)
        .env_remove("RUNELIGHT_BASEDIR");
    command
}

fn run(dir: &Path, args: &[&str]) -> (i32, String, String) {
    let Output {
        status,
        stdout,
        stderr,
    } = runelight(dir, args).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (status.code().unwrap_or(-1), text(stdout), text(stderr))
}

fn names(dir: &Path) -> Vec<String> {
    let mut names: Vec<String> = (std::fs::read_dir(dir).unwrap())
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// Arguments of a small picture of the bundled level.
fn small(more: &[&'static str]) -> Vec<&'static str> {
    let mut args = vec!["render", "--size", "32x18", "--device", "cpu"];
    args.extend(more);
    args
}

/// Real game files, or `None` after saying that the test is skipped.
fn test_data() -> Option<PathBuf> {
    let dir = std::env::var_os("RUNELIGHT_TEST_DATA").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"),
        PathBuf::from,
    );
    if dir.is_dir() {
        return Some(dir);
    }
    println!("SKIPPED: no test data at {}", dir.display());
    None
}

#[test]
fn its_help_names_the_commands() {
    let dir = tempfile::tempdir().unwrap();
    let (code, out, err) = run(dir.path(), &["--help"]);
    assert_eq!((code, err.as_str()), (0, ""));
    for word in [
        "view",
        "render",
        "info",
        "compare",
        "devices",
        "Examples:",
        "Exit codes",
    ] {
        assert!(out.contains(word), "no {word:?} in {out}");
    }
}

#[test]
fn without_a_display_the_window_says_so_and_points_at_render() {
    let dir = tempfile::tempdir().unwrap();
    for args in [&[][..], &["view"], &["view", "e1m1", "--fov", "100"]] {
        let output = Command::new(env!("CARGO_BIN_EXE_runelight"))
            .current_dir(dir.path())
            .args(args)
            .env_remove("DISPLAY")
            .env_remove("WAYLAND_DISPLAY")
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{args:?}: {said}");
        assert!(
            said.contains("no display") && said.contains("`runelight render`"),
            "{said}"
        );
        assert_eq!(said.lines().count(), 1, "{said}");
    }
}

#[test]
fn wrong_usage_is_2_and_names_the_option() {
    let dir = tempfile::tempdir().unwrap();
    for (args, sentence) in [
        (vec!["render", "--denoise", "oidn"], "--denoise"),
        (
            vec!["render", "--layers", "shadow"],
            "there is no layer \"shadow\"; there are beauty,",
        ),
        (
            vec!["render", "-o", "a.jpg"],
            "--output a.jpg: an output ends in .exr or .png",
        ),
        (vec!["render", "--game", "hipnotic"], "--game hipnotic"),
        (
            vec!["compare", "a.exr", "b.exr", "--heatmap", "c.exr"],
            "--heatmap c.exr",
        ),
    ] {
        let (code, out, err) = run(dir.path(), &args);
        assert_eq!((code, out.as_str()), (2, ""), "{args:?}: {err}");
        assert!(err.contains(sentence), "{err}");
    }
    assert!(names(dir.path()).is_empty());
}

#[test]
fn what_cannot_be_done_is_1_and_leaves_nothing_behind() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("garbage.bsp"), "garbage").unwrap();
    std::fs::write(dir.path().join("old.png"), "old").unwrap();
    let flight = "[[key]]\ntime = 0\nposition = [0, 0, 0]\nangles = [0, 0, 0]\nfov = 0\n";
    std::fs::write(dir.path().join("flight.toml"), flight).unwrap();
    for (args, sentence) in [
        (small(&["nosuch"]), "nosuch"),
        (small(&["garbage.bsp", "-o", "old.png"]), "garbage.bsp"),
        (
            small(&["-o", "no/such/a.exr"]),
            "no/such/a.exr cannot be written",
        ),
        (small(&["--camera", "99", "-o", "old.png"]), "--camera 99"),
        (
            small(&["--camera-path", "flight.toml", "-o", "old.png"]),
            "flight.toml: key 1 (line 1): fov: 0 is not a number from 1 to 170",
        ),
        (
            vec!["render", "--device", "no such device"],
            "--device no such device",
        ),
        (vec!["render", "--basedir", "nowhere", "start"], "nowhere"),
        (vec!["info", "garbage.bsp"], "garbage.bsp"),
        (vec!["compare", "old.png", "nosuch.png"], "old.png"),
    ] {
        let (code, out, err) = run(dir.path(), &args);
        assert_eq!((code, out.as_str()), (1, ""), "{args:?}: {err}");
        assert!(
            err.starts_with("error: ") || err.contains("\nerror: "),
            "{err}"
        );
        assert!(err.contains(sentence), "{err}");
    }
    assert_eq!(names(dir.path()), ["flight.toml", "garbage.bsp", "old.png"]);
    assert_eq!(std::fs::read(dir.path().join("old.png")).unwrap(), b"old");
}

#[test]
fn the_bundled_level_renders_the_same_twice_and_compare_says_so() {
    let dir = tempfile::tempdir().unwrap();
    let (code, out, err) = run(dir.path(), &small(&["--spp", "3", "--json"]));
    assert_eq!(code, 0, "{err}");
    let json: Value = serde_json::from_str(&out).unwrap();
    for key in [
        "level",
        "device",
        "driver",
        "size",
        "spp",
        "depth",
        "estimator",
        "seed",
        "triangles",
        "emitters",
        "seconds",
        "paths",
        "rays",
        "mpaths_per_s",
        "mrays_per_s",
        "mean_radiance",
        "nonfinite",
        "escaped",
        "outputs",
    ] {
        assert!(
            json.get(key).is_some_and(|v| !v.is_null()),
            "no {key} in {json}"
        );
    }
    assert_eq!(
        (&json["level"], &json["device"]),
        (&"sample".into(), &"cpu".into())
    );
    assert_eq!(
        (&json["spp"], &json["paths"]),
        (&3.into(), &(32 * 18 * 3).into())
    );
    assert_eq!(
        (&json["nonfinite"], &json["escaped"]),
        (&0.into(), &0.into())
    );
    assert_eq!(
        json["outputs"],
        serde_json::json!(["sample.exr", "sample.png"])
    );
    for part in ["load", "build", "render", "write"] {
        assert!(json["seconds"][part].as_f64().unwrap() >= 0.0);
    }
    assert_eq!(names(dir.path()), ["sample.exr", "sample.png"]);

    let again = small(&["--spp", "3", "-o", "again.exr", "--layers", "all", "-q"]);
    assert_eq!(run(dir.path(), &again).0, 0);
    let same = [
        "compare",
        "sample.exr",
        "again.exr",
        "--json",
        "--max-mse",
        "0",
    ];
    let (code, out, _) = run(dir.path(), &same);
    assert_eq!(code, 0);
    let json: Value = serde_json::from_str(&out).unwrap();
    for (key, value) in json.as_object().unwrap() {
        match key.as_str() {
            "mean_ratio" => assert_eq!(value, 1.0),
            "pixels" => assert_eq!(value, 32 * 18),
            "ci95" => {}
            _ => assert_eq!(value.as_f64(), Some(0.0), "{key}"),
        }
    }

    // Another seed is another picture: a limit is exceeded, and the heat map shows where.
    let other = small(&["--spp", "3", "--seed", "1", "-o", "other.exr", "-q"]);
    assert_eq!(run(dir.path(), &other).0, 0);
    let limit = [
        "compare",
        "sample.exr",
        "other.exr",
        "--max-relmse",
        "1e-9",
        "--heatmap",
        "heat.png",
    ];
    let (code, out, err) = run(dir.path(), &limit);
    assert_eq!(code, 3);
    assert!(
        out.contains("relmse") && err.contains("more than the 0.000000001 allowed"),
        "{err}"
    );
    assert!(names(dir.path()).contains(&"heat.png".to_owned()));
    let missing = ["compare", "sample.exr", "other.exr", "--layer", "albedo"];
    let (code, _, err) = run(dir.path(), &missing);
    assert!(
        code == 1 && err.contains("has no layer \"albedo\"; it has beauty"),
        "{err}"
    );
}

#[test]
fn a_filtered_picture_is_nearer_the_truth_and_leaves_what_was_traced() {
    let dir = tempfile::tempdir().unwrap();
    for more in [
        &["--spp", "64", "--seed", "1", "-o", "truth.exr"][..],
        &["--spp", "2", "--layers", "albedo", "-o", "plain.exr"],
        &["--spp", "2", "--layers", "albedo", "--denoise", "svgf"],
    ] {
        let (code, _, err) = run(dir.path(), &small(more));
        assert_eq!(code, 0, "{err}");
    }
    let relmse = |reference: &str, picture: &str, layer: &str| {
        let of = ["--layer", layer, "--reference-layer", "beauty", "--json"];
        let args = [&["compare", reference, picture][..], &of].concat();
        let (code, out, err) = run(dir.path(), &args);
        assert_eq!(code, 0, "{err}");
        let json: Value = serde_json::from_str(&out).unwrap();
        json["relmse"].as_f64().unwrap()
    };
    assert_eq!(relmse("plain.exr", "sample.exr", "beauty"), 0.0);
    let [traced, filtered] = ["beauty", "denoised"].map(|l| relmse("truth.exr", "sample.exr", l));
    assert!(filtered < 0.7 * traced, "{traced} to {filtered}");
}

#[test]
fn a_camera_path_says_where_the_camera_is_and_options_adjust_it() {
    let dir = tempfile::tempdir().unwrap();
    let key = |time, y, yaw| {
        format!(
            "[[key]]\ntime = {time}\nposition = [40, {y}, 56]\nangles = [0, {yaw}, 0]\nfov = 80\n"
        )
    };
    let flight = key(0, -40, 0) + &key(2, 0, 20) + "aperture = 1\nfocus = 90\n";
    std::fs::write(dir.path().join("flight.toml"), flight).unwrap();
    let picture = |more: &[&'static str]| {
        let args = [
            &["--spp", "1", "--depth", "1", "-o", "a.png", "--json"],
            more,
        ]
        .concat();
        let (code, out, err) = run(dir.path(), &small(&args));
        assert_eq!(code, 0, "{err}");
        let json: Value = serde_json::from_str(&out).unwrap();
        // What is before the pixels tells how the camera is called.
        let png = std::fs::read(dir.path().join("a.png")).unwrap();
        let pixels = png.windows(4).position(|w| w == b"IDAT").unwrap();
        (json["lens"].clone(), png[pixels..].to_vec())
    };
    let path = ["--camera-path", "flight.toml"];
    let (lens, flown) = picture(&[&path[..], &["--at", "1", "--aperture", "0"]].concat());
    assert_eq!(lens, Value::Null);
    let camera = ["--camera", "40 -20 56 0 10 0", "--fov", "80", "--at", "1"];
    assert!(picture(&camera).1 == flown, "another picture");
    let (lens, _) = picture(&[&path[..], &["--at", "1", "--focus", "50"]].concat());
    assert_eq!(
        (&lens["radius"], &lens["focus"]),
        (&0.5.into(), &50.0.into())
    );
}

#[test]
fn estimators_that_miss_light_entities_warn_unless_quiet() {
    let dir = tempfile::tempdir().unwrap();
    let args = small(&[
        "--spp",
        "1",
        "--estimator",
        "naive",
        "-o",
        "a.png",
        "--lights",
        "all",
    ]);
    let (code, _, err) = run(dir.path(), &args);
    assert_eq!(code, 0, "{err}");
    assert!(
        err.contains("--estimator naive") && err.contains("light entities"),
        "{err}"
    );
    let quiet: Vec<&str> = args.iter().copied().chain(["-q"]).collect();
    assert_eq!(run(dir.path(), &quiet).2, "");
}

#[cfg(unix)]
#[test]
fn an_interruption_after_the_first_sample_keeps_the_picture() {
    let dir = tempfile::tempdir().unwrap();
    let args = small(&["--spp", "10000000", "-o", "a.png", "--json", "-vv"]);
    let mut child = runelight(dir.path(), &args)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    let sampled = lines
        .by_ref()
        .any(|line| line.unwrap().ends_with(" samples"));
    assert!(sampled, "no sample was reported");
    assert!(!dir.path().join("a.png").exists());
    let pid = child.id().to_string();
    assert!(
        Command::new("kill")
            .args(["-INT", &pid])
            .status()
            .unwrap()
            .success()
    );
    // The pipe must stay open and drained until the program ends.
    for line in lines {
        line.unwrap();
    }
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["stopped"], "interrupted");
    assert!(json["spp"].as_u64().unwrap() >= 1);
    assert_eq!(names(dir.path()), ["a.png"]);
}

#[test]
fn devices_lists_the_processor_whatever_else_there_is() {
    let dir = tempfile::tempdir().unwrap();
    let (code, out, err) = run(dir.path(), &["devices", "--json"]);
    assert_eq!(code, 0, "{err}");
    let json: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(json["cpu"]["name"], "cpu");
    assert!(json["cpu"]["threads"].as_u64().unwrap() >= 1);
    let listed = json["devices"].as_array().unwrap();
    assert!(!listed.is_empty() || json["vulkan_error"].is_string());
}

#[test]
fn info_tells_what_files_hold_one_object_a_line() {
    let dir = tempfile::tempdir().unwrap();
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/sample");
    let file = |name: &str| assets.join(name).display().to_string();
    let args = ["info", "--json", &file("sample.bsp"), &file("palette.lmp")];
    let (code, out, err) = run(dir.path(), &args);
    assert_eq!(code, 0, "{err}");
    let objects: Vec<Value> = out
        .lines()
        .map(|l| serde_json::from_str(l).unwrap())
        .collect();
    assert_eq!(objects.len(), 2);
    for key in [
        "format",
        "entities",
        "faces",
        "triangles",
        "textures",
        "lights",
        "emissive_texels",
        "leafs",
        "models",
        "bounds",
        "warnings",
    ] {
        assert!(
            objects[0].get(key).is_some_and(|v| !v.is_null()),
            "no {key}"
        );
    }
    assert_eq!(objects[0]["format"], "BSP29");
    assert_eq!(objects[0]["sealed"], true);
    assert_eq!(objects[1]["kind"], "palette");
    let (code, out, _) = run(dir.path(), &["info", &file("sample.bsp")]);
    assert!(code == 0 && out.contains("features") && out.contains("cameras"));
}

#[test]
fn info_reads_archives_models_and_sprites_and_says_what_it_does_not_read() {
    let Some(data) = test_data() else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    let file = |name: &str| data.join(name).display().to_string();
    let info = |name: &str| -> Value {
        let (code, out, err) = run(dir.path(), &["info", "--json", &file(name)]);
        assert_eq!(code, 0, "{name}: {err}");
        serde_json::from_str(&out).unwrap()
    };
    let pak = info("id1/pak0.pak");
    assert_eq!(pak["kind"], "PAK");
    assert!(
        pak["levels"]
            .as_array()
            .unwrap()
            .contains(&"maps/start.bsp".into())
    );
    assert_eq!(info("loose/wad/lq_dev.wad")["textures"], 228);
    let model = info("loose/mdl/soldier.mdl");
    assert_eq!(
        (&model["frames"], &model["vertices"]),
        (&114.into(), &613.into())
    );
    assert_eq!(info("loose/spr/s_explod.spr")["frames"], 6);
    let demo = info("loose/dem/qs666_e1m1.dem");
    assert_eq!(
        (&demo["kind"], &demo["protocol"]),
        (&"DEM".into(), &"666".into())
    );
    let (code, out, err) = run(dir.path(), &["info", &file("loose/bsp/dev_hl.bsp")]);
    assert_eq!((code, out.as_str()), (1, ""));
    assert!(
        err.contains("dev_hl.bsp") && err.contains("Half-Life"),
        "{err}"
    );

    let base = data.display().to_string();
    let start = [
        "info",
        "--json",
        "--basedir",
        &base,
        "start",
        "progs/player.mdl",
    ];
    let (code, out, err) = run(dir.path(), &start);
    assert_eq!(code, 0, "{err}");
    assert_eq!(out.lines().count(), 2);
    assert!(
        out.starts_with("{\"file\":\"start\",\"kind\":\"BSP\",\"format\":\"BSP29\""),
        "{out}"
    );
    // Its teleporters shine, and are lit by a light entity on their faces: each counts once, and is listed.
    let level: Value = serde_json::from_str(out.lines().next().unwrap()).unwrap();
    let pairs = level["lamp_pairs"].as_array().unwrap();
    let is_teleporter = |pair: &Value| {
        let texture = pair["texture"].as_str().unwrap();
        texture.starts_with("*tele") && pair["classname"] == "light"
    };
    assert!(pairs.iter().any(is_teleporter), "{pairs:?}");
}

#[test]
fn demo_lists_what_a_demo_holds() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("none.dem"), "no demo").unwrap();
    let (code, out, err) = run(dir.path(), &["demo", "none.dem"]);
    assert_eq!((code, out.as_str()), (1, ""));
    assert!(
        err.contains("none.dem") && err.contains("CD track"),
        "{err}"
    );
    let (code, _, err) = run(dir.path(), &["demo", "demo1"]);
    assert!(code == 1 && err.contains("--basedir"), "{err}");

    let Some(data) = test_data() else {
        return;
    };
    let base = data.display().to_string();
    let (code, out, err) = run(dir.path(), &["demo", "demo1", "--basedir", &base, "--json"]);
    assert_eq!(code, 0, "{err}");
    let demo: Value = serde_json::from_str(&out).unwrap();
    let level = &demo["levels"][0];
    assert_eq!(level["map"], "maps/lq_e0m1.bsp");
    let seconds = demo["seconds"].as_f64().unwrap() as usize;
    let counts = level["entities_per_second"].as_array().unwrap();
    assert_eq!(counts.len(), seconds + 1);
    assert!(demo["message_kinds"]["entity"].as_u64() > Some(10_000));
    let mvd = data.join("loose/qw/qw_dm3.mvd").display().to_string();
    let (code, _, err) = run(dir.path(), &["demo", &mvd]);
    assert!(code == 1 && err.contains("QuakeWorld"), "{err}");
}

/// The counts of `info --json` against the `qbsp` crate, a reader written by others, on every level
/// that it reads (it knows no 2PSB).
#[test]
fn info_counts_what_an_independent_reader_counts() {
    use qbsp::{BspData, BspParseInput, BspParseSettings};
    let Some(data) = test_data() else {
        return;
    };
    let search = bsp::SearchPath::builder().basedir(&data).build().unwrap();
    let loose = std::fs::read_dir(data.join("loose/bsp")).unwrap();
    let mut files: Vec<(String, Vec<u8>)> = loose
        .map(|e| e.unwrap().path())
        .filter(|p| p.extension().is_some_and(|e| e == "bsp"))
        .map(|p| (p.display().to_string(), std::fs::read(&p).unwrap()))
        .collect();
    files.extend(
        (search.list("maps/").into_iter())
            .filter(|n| n.ends_with(".bsp"))
            .map(|name| {
                let bytes = search.read(&name).unwrap().bytes;
                (name, bytes)
            }),
    );
    files.retain(|(_, f)| f.starts_with(&[29, 0, 0, 0]) || f.starts_with(b"BSP2"));
    assert!(files.len() >= 45, "only {} levels", files.len());
    let dir = tempfile::tempdir().unwrap();
    let base = data.display().to_string();
    let mut args = vec!["info", "--json", "-q", "--basedir", &base];
    args.extend(files.iter().map(|(name, _)| name.as_str()));
    let (code, out, err) = run(dir.path(), &args);
    assert_eq!(code, 0, "{err}");
    assert_eq!(out.lines().count(), files.len());
    for (line, (name, file)) in out.lines().zip(&files) {
        let info: Value = serde_json::from_str(line).unwrap();
        let settings = BspParseSettings {
            use_bspx_rgb_lighting: false,
            parse_bspx_structures: false,
        };
        let theirs = BspData::parse(BspParseInput {
            bsp: file,
            lit: None,
            settings,
        })
        .unwrap_or_else(|e| panic!("{name}: {e}"));
        let format = if file.starts_with(b"BSP2") {
            "BSP2"
        } else {
            "BSP29"
        };
        let text = String::from_utf8_lossy(&theirs.entities).into_owned();
        // Keys and values hold no braces in these levels.
        let entities = text.matches('{').count();
        assert_eq!(info["format"], format, "{name}");
        for (key, count) in [
            ("entities", entities),
            ("faces", theirs.faces.len()),
            ("textures", theirs.textures.len()),
            ("leafs", theirs.leaves.len()),
            ("models", theirs.models.len()),
            ("vertices", theirs.vertices.len()),
            ("planes", theirs.planes.len()),
            ("nodes", theirs.nodes.len()),
        ] {
            assert_eq!(info[key], count, "{name}: {key}");
        }
    }
}

#[test]
fn lightmaps_are_measured_and_a_limit_is_a_limit() {
    let dir = tempfile::tempdir().unwrap();
    let level = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/baked/light_modes.bsp");
    let level = level.to_str().unwrap();
    let args = [
        "compare-light",
        level,
        "--json",
        "-o",
        "heat.png",
        "-o",
        "light.exr",
    ];
    let (code, out, _) = run(dir.path(), &args);
    let told: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(code, 0);
    assert_eq!(told["median"], 0.0);
    assert!(told["luxels"].as_u64() > Some(30_000));
    assert_eq!(told["styles"].as_array().map(Vec::len), Some(13));
    assert_eq!(names(dir.path()), ["heat.png", "light.exr"]);
    let (code, _, err) = run(dir.path(), &["compare-light", level, "--max-p99=-1"]);
    assert_eq!(code, 3);
    assert!(
        err.contains("99th percentile is") && err.contains("more than the -1 allowed"),
        "{err}"
    );
    let sample = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/sample/sample.bsp");
    let (code, _, err) = run(dir.path(), &["compare-light", sample.to_str().unwrap()]);
    assert_eq!(code, 1);
    assert!(err.contains("no lightmaps to compare with"), "{err}");
}

#[test]
fn other_lights_than_physical_need_no_long_paths() {
    let dir = tempfile::tempdir().unwrap();
    for (lighting, depth) in [("compiler", 2), ("lightmap", 1), ("fullbright", 1)] {
        let args = small(&["--spp", "1", "--json", "--depth", "0", "-o", "a.png"]);
        let args: Vec<&str> = args.into_iter().chain(["--lighting", lighting]).collect();
        let (code, out, err) = run(dir.path(), &args);
        assert_eq!(code, 0, "{err}");
        let told: Value = serde_json::from_str(&out).unwrap();
        assert_eq!(
            (told["lighting"].as_str(), told["depth"].as_u64()),
            (Some(lighting), Some(depth))
        );
        assert_eq!(told["estimator"], "nee");
    }
}
