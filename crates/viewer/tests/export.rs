//! `runelight export`: what other programs find in an export of the bundled level.

use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

fn run(dir: &Path, args: &[&str]) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_runelight"))
        .arg("export")
        .args(args)
        .current_dir(dir)
        .env_remove("RUNELIGHT_BASEDIR")
        .output()
        .unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (
        output.status.code().unwrap_or(-1),
        text(output.stdout),
        text(output.stderr),
    )
}

/// Runs, expects success, and returns the JSON.
fn export(dir: &Path, args: &[&str]) -> Value {
    let (code, out, err) = run(dir, &[args, &["--json"]].concat());
    assert_eq!(code, 0, "{err}");
    serde_json::from_str(&out).unwrap()
}

/// All files below a directory, by path.
fn files(dir: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut out = BTreeMap::new();
    for entry in std::fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        if path.is_dir() {
            for (below, bytes) in files(&path) {
                out.insert(format!("{name}/{below}"), bytes);
            }
        } else {
            out.insert(name, std::fs::read(path).unwrap());
        }
    }
    out
}

/// Values of `name="filename"` in a scene file.
fn named_files(xml: &str) -> Vec<&str> {
    xml.split("name=\"filename\" value=\"")
        .skip(1)
        .map(|rest| rest.split('"').next().unwrap())
        .collect()
}

#[test]
fn a_mitsuba_scene_is_complete_and_the_same_every_time() {
    let dir = tempfile::tempdir().unwrap();
    // Without what the camera alone sees all of it can be said.
    let args = ["--size", "64x36", "--camera", "1", "--no-entities", "-o"];
    let json = export(dir.path(), &[&args[..], &["a"]].concat());
    export(dir.path(), &[&args[..], &["b"]].concat());
    let (a, b) = (files(&dir.path().join("a")), files(&dir.path().join("b")));
    assert!(a == b, "two exports of the same scene differ");

    let xml = std::str::from_utf8(&a["scene.xml"]).unwrap();
    let named = named_files(xml);
    assert!(named.len() > 20, "{named:?}");
    for name in &named {
        assert!(a.contains_key(*name), "{name} is named but not there");
    }
    for name in a.keys().filter(|n| n.contains('/')) {
        assert!(
            named.contains(&name.as_str()),
            "{name} is there but not named"
        );
    }
    // Every file is in the manifest with its size, and nothing else is.
    let listed: BTreeMap<&str, u64> = (json["files"].as_array().unwrap().iter())
        .map(|f| (f["path"].as_str().unwrap(), f["bytes"].as_u64().unwrap()))
        .collect();
    let there: BTreeMap<&str, u64> = (a.iter())
        .filter(|(name, _)| *name != "runelight-export.json")
        .map(|(name, bytes)| (name.as_str(), bytes.len() as u64))
        .collect();
    assert_eq!(listed, there);
    assert_eq!(json["integrator"], "volpath");
    assert_eq!(json["offset"], json["camera"]["position"]);
    assert_eq!(json["exact"], true);

    // The meshes hold as many triangles as is said, all indices are within, and no place is
    // farther from the eye than the level reaches.
    let mut triangles = 0;
    for (name, bytes) in a.iter().filter(|(n, _)| n.ends_with(".ply")) {
        triangles += check_ply(name, bytes);
    }
    assert_eq!(json["counts"]["triangles"], triangles);
}

/// Checks a mesh and returns its number of triangles.
fn check_ply(name: &str, bytes: &[u8]) -> usize {
    let mark = b"end_header\n";
    let at = bytes.windows(mark.len()).position(|w| w == mark).unwrap() + mark.len();
    let header = std::str::from_utf8(&bytes[..at]).unwrap();
    let count = |element: &str| -> usize {
        let line = header.lines().find(|l| l.starts_with(element)).unwrap();
        line.rsplit(' ').next().unwrap().parse().unwrap()
    };
    let (vertices, faces) = (count("element vertex"), count("element face"));
    let width = header.matches("property float").count() * 4;
    let (body, list) = bytes[at..].split_at(vertices * width);
    assert_eq!(list.len(), faces * 13, "{name}");
    for vertex in body.chunks(width) {
        for x in vertex[..12].as_chunks::<4>().0 {
            let x = f32::from_le_bytes(*x);
            assert!(x.abs() < 4096.0, "{name}: {x}");
        }
    }
    for face in list.chunks(13) {
        assert_eq!(face[0], 3, "{name}");
        for i in face[1..].as_chunks::<4>().0 {
            assert!((u32::from_le_bytes(*i) as usize) < vertices, "{name}");
        }
    }
    faces
}

#[test]
fn a_lens_is_said_to_those_who_know_lenses() {
    let dir = tempfile::tempdir().unwrap();
    let lens = [
        "--no-entities",
        "--aperture",
        "1.5",
        "--focus",
        "200",
        "-o",
        "a",
    ];
    let json = export(dir.path(), &lens);
    assert_eq!(json["exact"], true);
    assert_eq!(json["camera"]["lens"]["focus"], 200.0);
    let xml = std::fs::read_to_string(dir.path().join("a/scene.xml")).unwrap();
    assert!(xml.contains("<sensor type=\"thinlens\">"));
    assert!(xml.contains("name=\"aperture_radius\" value=\"1.5\""));
    assert!(xml.contains("name=\"focus_distance\" value=\"200\""));
    let (code, _, err) = run(dir.path(), &["--aperture", "1", "-o", "b"]);
    assert!(code == 2 && err.contains("--focus"), "{code}: {err}");
    let (code, _, err) = run(dir.path(), &["--focus", "9", "-o", "b"]);
    assert!(code == 2 && err.contains("--aperture"), "{code}: {err}");
}

#[test]
fn other_peoples_directories_are_left_alone() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir(dir.path().join("mine")).unwrap();
    std::fs::write(dir.path().join("mine/letter.txt"), "dear").unwrap();
    let (code, _, err) = run(dir.path(), &["--format", "gltf", "-o", "mine"]);
    assert_eq!(code, 1);
    assert!(err.contains("no earlier export"), "{err}");
    let (code, ..) = run(dir.path(), &["--format", "gltf", "-o", "no/such/place"]);
    assert_eq!(code, 1);
    let left: Vec<String> = files(dir.path()).into_keys().collect();
    assert_eq!(left, ["mine/letter.txt"]);
    // An earlier export is replaced.
    export(dir.path(), &["--format", "gltf", "-o", "mine-too"]);
    export(dir.path(), &["--format", "gltf", "-o", "mine-too"]);
}

#[test]
fn an_independent_reader_finds_the_level_in_gltf() {
    let dir = tempfile::tempdir().unwrap();
    let args = ["--format", "gltf", "--no-entities", "-o"];
    export(dir.path(), &[&args[..], &["level"]].concat());
    export(dir.path(), &[&args[..], &["level.glb"]].concat());
    let read = |name: &str| gltf::import(dir.path().join(name)).unwrap();
    let (document, buffers, images) = read("level/scene.gltf");
    let (packed, packed_buffers, packed_images) = read("level.glb");

    let info: Value = {
        let level = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../assets/sample/sample.bsp"
        );
        let output = Command::new(env!("CARGO_BIN_EXE_runelight"))
            .args(["info", "--json", level])
            .output()
            .unwrap();
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let info = info.as_array().map_or(&info, |list| &list[0]);

    for (document, buffers) in [(&document, &buffers), (&packed, &packed_buffers)] {
        let mut triangles = 0;
        let (mut lo, mut hi) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for node in document.default_scene().unwrap().nodes() {
            let Some(mesh) = node.mesh() else { continue };
            for primitive in mesh.primitives() {
                let reader = primitive.reader(|b| Some(&buffers[b.index()]));
                let positions: Vec<[f32; 3]> = reader.read_positions().unwrap().collect();
                let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
                assert!(indices.iter().all(|&i| (i as usize) < positions.len()));
                triangles += indices.len() / 3;
                let bounds = primitive.bounding_box();
                for p in &positions {
                    for i in 0..3 {
                        assert!(p[i] >= bounds.min[i] && p[i] <= bounds.max[i]);
                        if node.transform().matrix()[3][..3] == [0.0; 3] {
                            lo[i] = lo[i].min(p[i]);
                            hi[i] = hi[i].max(p[i]);
                        }
                    }
                }
                // Counter-clockwise from the side that the normals point to.
                let normals: Vec<[f32; 3]> = reader.read_normals().unwrap().collect();
                let at = |i: u32| glam::Vec3::from(positions[i as usize]);
                for t in indices.chunks(3).step_by(17) {
                    let cross = (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0]));
                    assert!(cross.dot(normals[t[0] as usize].into()) >= 0.0);
                }
            }
        }
        assert_eq!(info["triangles"], triangles);
        // The model's bounds, which are up to 32 units larger than its faces: Z there is Y here,
        // and X there is backwards.
        let metres = |units: f64| (units * 0.0254) as f32;
        let (min, max) = (&info["bounds"][0], &info["bounds"][1]);
        let bound = |v: &Value, i: usize| metres(v[i].as_f64().unwrap());
        let near = |inner: f32, outer: f32| (outer - inner).abs() <= metres(33.0);
        assert!(
            near(lo[1], bound(min, 2)) && near(hi[1], bound(max, 2)),
            "{lo:?} {hi:?}"
        );
        assert!(
            near(-hi[2], bound(min, 0)) && near(-lo[2], bound(max, 0)),
            "{lo:?} {hi:?}"
        );
        assert!(
            near(-hi[0], bound(min, 1)) && near(-lo[0], bound(max, 1)),
            "{lo:?} {hi:?}"
        );
        assert_eq!(document.cameras().count(), 5);
        // The player's start: 6 degrees to the left of +X, level, 73.74 degrees from top to bottom.
        let start = document.nodes().find(|n| n.camera().is_some()).unwrap();
        let matrix = start.transform().matrix();
        let (sin, cos) = 6.0f32.to_radians().sin_cos();
        let expected = [[cos, 0.0, -sin], [0.0, 1.0, 0.0], [sin, 0.0, cos]];
        for (column, expected) in matrix.iter().zip(expected) {
            assert!(
                (0..3).all(|i| (column[i] - expected[i]).abs() < 1e-6),
                "{matrix:?}"
            );
        }
        let eye = [55.96875, 46.03125, -40.03125].map(metres);
        assert!(
            (0..3).all(|i| (matrix[3][i] - eye[i]).abs() < 1e-5),
            "{matrix:?}"
        );
        let camera = document.cameras().next().unwrap();
        let gltf::camera::Projection::Perspective(lens) = camera.projection() else {
            panic!("not a perspective camera")
        };
        assert!((lens.yfov().to_degrees() - 73.7398).abs() < 1e-3);
        let lights: Vec<_> = document.lights().unwrap().collect();
        assert_eq!(info["lights_lit"], lights.len());
        assert!(lights.iter().all(|l| l.intensity() > 0.0));
        let of = |name: &str| {
            let mut materials = document.materials();
            materials.find(|m| m.name() == Some(name)).unwrap()
        };
        assert_eq!(of("{grate").alpha_mode(), gltf::material::AlphaMode::Mask);
        assert_eq!(of("lamp_panel").emissive_strength(), Some(4.0));
        let albedo = of("brick").pbr_metallic_roughness().base_color_texture();
        let sampler = albedo.unwrap().texture().sampler();
        assert_eq!(
            sampler.mag_filter(),
            Some(gltf::texture::MagFilter::Nearest)
        );
    }
    assert!(images.len() > 20 && images.len() == packed_images.len());
    for (a, b) in images.iter().zip(&packed_images) {
        assert!(a.pixels == b.pixels);
    }
}
