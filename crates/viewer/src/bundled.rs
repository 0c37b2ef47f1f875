//! What the program brings along, so that it has something to show on a machine without Quake: a level, its
//! models, and a demo.

use bsp::BuiltIn;

/// A file of `assets/sample`.
macro_rules! sample {
    ($name:literal) => {
        include_bytes!(concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../assets/sample/",
            $name
        ))
    };
}

/// The level's name.
pub const NAME: &str = "sample";
/// The level.
pub const LEVEL: &[u8] = sample!("sample.bsp");
/// Its palette.
pub const PALETTE: &[u8] = sample!("palette.lmp");
/// A demo that plays in it.
pub const DEMO: &[u8] = sample!("sample.dem");

/// All of it as the files of a game directory.
pub const FILES: BuiltIn = &[
    ("gfx/palette.lmp", PALETTE),
    ("maps/sample.bsp", LEVEL),
    ("sample.dem", DEMO),
    ("progs/end1.mdl", sample!("progs/end1.mdl")),
    ("progs/flame.mdl", sample!("progs/flame.mdl")),
    ("progs/missile.mdl", sample!("progs/missile.mdl")),
    ("progs/player.mdl", sample!("progs/player.mdl")),
    ("progs/s_explod.spr", sample!("progs/s_explod.spr")),
    ("progs/s_light.spr", sample!("progs/s_light.spr")),
    ("progs/scarab.mdl", sample!("progs/scarab.mdl")),
    ("progs/v_staff.mdl", sample!("progs/v_staff.mdl")),
];

#[cfg(test)]
mod tests {
    use super::*;
    use bsp::dem::Demo;
    use bsp::lmp::Palette;
    use bsp::{Level, Limits, SearchPath, Warnings};
    use scene::import::{CastModel, ImportOptions, import_cast};
    use scene::playback::{Eye, Parts, frame};
    use scene::timeline::{Options, Timeline};
    use std::collections::BTreeSet;
    use std::path::Path;

    #[test]
    fn all_models_that_are_made_are_bundled() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/sample/progs");
        let there: BTreeSet<String> = std::fs::read_dir(folder)
            .unwrap()
            .map(|file| format!("progs/{}", file.unwrap().file_name().display()))
            .collect();
        let names = FILES.iter().map(|f| f.0.to_owned());
        let bundled = names.filter(|n| n.starts_with("progs/")).collect();
        assert_eq!(there, bundled);
    }

    #[test]
    fn the_demo_plays_from_end_to_end_and_all_it_names_is_bundled() {
        let mut warnings = Warnings::new();
        let demo = Demo::parse(DEMO, &Limits::default(), &mut warnings).unwrap();
        let timeline = Timeline::new(&demo, &|_| None, &mut warnings);
        assert!(warnings.is_empty(), "{:?}", warnings.iter().next());
        assert_eq!(timeline.levels().len(), 1);
        assert!((timeline.duration() - 6.0).abs() < 0.05);

        let search = SearchPath::builder().built_in(FILES).build().unwrap();
        let level = Level::load(&search, "maps/sample.bsp", &Limits::default()).unwrap();
        let palette = Palette::parse(PALETTE).unwrap();
        let files = |path: &str| Some(search.read_optional(path).ok()??.bytes);
        let parts = Parts::of(&timeline, 0);
        let options = ImportOptions::default();
        let (scene, cast) = import_cast(&level, &palette, &files, &options, parts.list()).unwrap();
        for name in &parts.models {
            assert!(cast.models.contains_key(name), "{name}");
        }
        assert!(matches!(cast.models["maps/sample.bsp"], CastModel::Level));
        assert!(scene.features.smooth_normals);
        let flat = ImportOptions {
            smooth_models: false,
            ..options
        };
        let (flat, _) = import_cast(&level, &palette, &files, &flat, parts.list()).unwrap();
        assert!(!flat.features.smooth_normals);

        // What happens: it walks, throws, hits, is bitten; the door and the plat move.
        let at = |t: f64| timeline.state_at(t, &Options::default()).unwrap();
        let shows = |t: f64| {
            let eye = Eye::Player {
                fov_deg: 90.0,
                lens: None,
            };
            frame(&at(t), &timeline.levels()[0], &scene, &cast, &eye)
        };
        assert!(at(0.0).view.eye.distance(at(6.0).view.eye) > 600.0);
        assert!(at(3.8).lights.len() == 1 && shows(3.8).lights.len() == 1);
        let sparks = shows(4.45).loose.triangles.len();
        assert!(sparks > 1000, "{sparks}");
        assert!(at(5.3).tint.hurt[3] > at(5.0).tint.hurt[3]);
        let named = |t: f64, name: &str| {
            let mut found = shows(t).instances.into_iter().filter(|i| i.name == name);
            found.next().map(|i| i.transform.translation.z)
        };
        assert!(named(1.6, "*4") > named(0.0, "*4"));
        assert!(named(4.5, "*6") > named(3.0, "*6"));
        assert!(named(0.5, "progs/end1.mdl").is_some() && named(2.5, "progs/end1.mdl").is_none());
    }
}
