//! What a room must not know, and files that must not drift.

use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Every file below `folder` with one of these extensions.
fn files(folder: &str, extensions: &[&str]) -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    let mut folders = vec![root().join(folder)];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder)
            .expect("a folder of the project")
            .flatten()
        {
            let path = entry.path();
            if path.is_dir() {
                if !path.ends_with("target") {
                    folders.push(path);
                }
            } else if path
                .extension()
                .is_some_and(|e| extensions.iter().any(|x| e == *x))
            {
                let text = fs::read_to_string(&path).expect("a text file");
                found.push((path, text));
            }
        }
    }
    assert!(!found.is_empty(), "no files in {folder}");
    found
}

/// The words of a text.
fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_alphanumeric() && c != '_')
}

#[track_caller]
fn assert_absent(folder: &str, banned: &[&str], why: &str) {
    for (path, text) in files(folder, &["rs"]) {
        for (number, line) in text.lines().enumerate() {
            let code = line.split("//").next().unwrap_or("");
            if let Some(word) = words(code).find(|w| banned.contains(w)) {
                panic!("{}:{}: {word}: {why}", path.display(), number + 1);
            }
        }
    }
}

#[test]
fn rooms_do_not_know_what_they_must_not() {
    let quake = [
        "bsp",
        "mapc",
        "miptex",
        "classname",
        "worldspawn",
        "entity",
        "lightstyle",
    ];
    assert_absent("crates/rt/src", &quake, "the GPU room knows no Quake");
    assert_absent(
        "crates/rt/src",
        &["egui", "winit"],
        "the GPU room draws triangles, whoever makes them, on whatever window",
    );
    let vulkan = ["ash", "vk", "rt"];
    assert_absent(
        "crates/reference/src",
        &vulkan,
        "the judge shares nothing with the GPU",
    );
    assert_absent(
        "crates/scene/src",
        &["ash", "vk", "rt", "File", "fs"],
        "no Vulkan, no files",
    );
    assert_absent(
        "crates/gallery/src",
        &["ash", "vk", "rt", "reference", "File", "fs", "winit"],
        "the gallery renders nothing, and knows no Vulkan, files or windows",
    );
    let rendering = ["ash", "vk", "glam", "scene", "rt"];
    assert_absent("crates/bsp/src", &rendering, "the loader knows bytes");
    for (folder, dependency) in [
        ("rt", "bsp"),
        ("rt", "mapc"),
        ("reference", "ash"),
        ("scene", "ash"),
        ("bsp", "glam"),
        ("mapc", "bsp"),
        ("gallery", "ash"),
        ("gallery", "rt"),
        ("gallery", "reference"),
        ("gallery", "runelight"),
        ("rt", "gallery"),
        ("reference", "gallery"),
        ("scene", "gallery"),
    ] {
        let manifest = fs::read_to_string(root().join(format!("crates/{folder}/Cargo.toml")));
        let manifest = manifest.expect("a manifest");
        let normal = manifest.split("[dev-dependencies]").next().unwrap_or("");
        let found = normal
            .lines()
            .any(|l| l.split(['.', ' ', '=']).next() == Some(dependency));
        assert!(!found, "crates/{folder} depends on {dependency}");
    }
}

#[test]
fn only_the_vulkan_room_is_unsafe() {
    for folder in ["crates", "tests", "xtask"] {
        for (path, text) in files(folder, &["rs"]) {
            let inside = path.components().any(|c| c.as_os_str() == "vk");
            // This file names the word; the test allocator that counts bytes must implement an
            // unsafe trait.
            let excused = path.ends_with("hygiene.rs") || path.ends_with("hostile.rs");
            if inside || excused {
                continue;
            }
            for (number, line) in text.lines().enumerate() {
                let code = line.split("//").next().unwrap_or("");
                let found = words(code).any(|w| w == "unsafe");
                assert!(!found, "{}:{}: unsafe", path.display(), number + 1);
            }
        }
    }
}

#[test]
fn files_are_short_enough_to_read() {
    let limits = [
        ("crates", "rs", 1000),
        ("tests", "rs", 1000),
        ("xtask", "rs", 1000),
    ];
    for (folder, extension, most) in limits {
        for (path, text) in files(folder, &[extension]) {
            assert!(
                text.lines().count() <= most,
                "{} is too long",
                path.display()
            );
        }
    }
    for (path, text) in files(
        "shaders",
        &["glsl", "rgen", "rchit", "rahit", "rmiss", "comp"],
    ) {
        // A generated registry is as long as what it lists.
        if path.ends_with("abi.glsl") {
            continue;
        }
        assert!(
            // What is generated is not read.
            path.ends_with("abi.glsl") || text.lines().count() <= 500,
            "{} is too long",
            path.display()
        );
    }
}

#[test]
fn the_shaders_see_the_structs_of_the_host() {
    let committed = fs::read_to_string(root().join("shaders/abi.glsl")).expect("shaders/abi.glsl");
    assert!(
        committed == rt::abi::glsl(),
        "shaders/abi.glsl is stale: run `cargo xtask abi`"
    );
}

/// Constants that shaders and the shared room both spell out: the shaders' numbers, by name.
#[test]
fn the_shaders_count_with_the_numbers_of_the_scene() {
    use scene::{gloss, material, render, sky};
    let sources = files("shaders", &["glsl", "rgen"]);
    for (name, value) in [
        ("MAX_ALBEDO", f64::from(material::MAX_ALBEDO)),
        ("WARP_TILE", material::WARP_TILE),
        ("MIN_ROUGHNESS", f64::from(gloss::MIN_ROUGHNESS)),
        ("GLOSS_TABLE_SIDE", gloss::TABLE_SIDE as f64),
        ("BACK_SPEED", sky::BACK_SPEED),
        ("FRONT_SPEED", sky::FRONT_SPEED),
        ("CELL_LIFT", f64::from(scene::cells::CELL_LIFT)),
        ("ROULETTE_GAIN", render::ROULETTE_GAIN),
        ("ROULETTE_START", f64::from(render::ROULETTE_START)),
        ("ROULETTE_MAX_SURVIVAL", render::ROULETTE_MAX_SURVIVAL),
    ] {
        let marker = format!(" {name} = ");
        let found: Vec<f64> = sources
            .iter()
            .flat_map(|(_, text)| text.lines())
            .filter_map(|line| line.strip_prefix("const ")?.split_once(&marker))
            .map(|(_, rest)| rest.trim_end_matches([';', 'u']).parse().expect("a number"))
            .collect();
        assert_eq!(found.len(), 1, "{name} is said once");
        assert!(
            (found[0] - value).abs() < 1e-6,
            "{name}: {} is not {value}",
            found[0]
        );
    }
}
