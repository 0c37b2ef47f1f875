//! Real files read as their makers say.

use bsp::bsp::{FaceLight, LightSamples};
use bsp::mdl::MdlHeader;
use bsp::spr::{SprHeader, SpriteType};
use bsp::wad::Wad;
use bsp::{Bsp, FileKind, Level, Limits, LoadError, SearchPath, WarningKind, Warnings, sniff};

use crate::data;

#[test]
fn every_file_is_of_the_kind_its_name_says() {
    let Some(dir) = data::dir("every_file_is_of_the_kind_its_name_says") else {
        return;
    };
    for (name, file) in data::everything(&dir) {
        let kind = sniff(&file);
        let ok = match name.rsplit('.').next().unwrap_or_default() {
            "bsp" => matches!(
                kind,
                FileKind::Bsp(_) | FileKind::BspHalfLife | FileKind::BspQuake2
            ),
            "pak" => kind == FileKind::Pak,
            "wad" => kind == FileKind::Wad2,
            "mdl" => kind == FileKind::Mdl && MdlHeader::parse(&file).is_ok(),
            "spr" => kind == FileKind::Spr && SprHeader::parse(&file).is_ok(),
            "dem" => kind == FileKind::Demo,
            "lit" | "lux" => kind == FileKind::Lit,
            "lmp" if name.ends_with("palette.lmp") => kind == FileKind::Palette,
            "lmp" if name.ends_with("colormap.lmp") => true,
            "lmp" => kind == FileKind::Picture,
            _ => true,
        };
        assert!(ok, "{name}: {kind:?}");
    }
}

#[test]
fn every_level_reads_without_a_loss() {
    let Some(dir) = data::dir("every_level_reads_without_a_loss") else {
        return;
    };
    let limits = Limits::default();
    let mut read = 0;
    for (name, file) in data::everything(&dir) {
        if !matches!(sniff(&file), FileKind::Bsp(_)) {
            continue;
        }
        let mut warnings = Warnings::new();
        let bsp =
            Bsp::parse(&file, &limits, &mut warnings).unwrap_or_else(|e| panic!("{name}: {e}"));
        for w in warnings.iter() {
            // Compilers leave slivers behind, and one level is about a missing texture.
            let known = w.kind == WarningKind::FaceDropped && w.text.contains("no area")
                || w.kind == WarningKind::TextureMissing && name.contains("missing_texture");
            assert!(known, "{name}: {w}");
        }
        // The world's tree finds its way, and the vertices of a face agree with its plane.
        assert!(bsp.point_leaf(0, [0.0; 3]).is_some(), "{name}");
        for (index, face) in bsp.drawable_faces(0) {
            let plane = bsp.face_plane(face).unwrap();
            for p in bsp.face_points(face).unwrap() {
                let dot: f32 = plane.normal.iter().zip(p).map(|(a, b)| a * b).sum();
                assert!((dot - plane.distance).abs() < 0.3, "{name}: face {index}");
            }
        }
        read += 1;
    }
    assert!(read >= 50, "only {read} levels");
}

#[test]
fn no_two_lightmaps_overlap() {
    let Some(dir) = data::dir("no_two_lightmaps_overlap") else {
        return;
    };
    let limits = Limits::default();
    for (name, file) in data::everything(&dir) {
        let Ok(bsp) = Bsp::parse(&file, &limits, &mut Warnings::new()) else {
            continue;
        };
        let mut blocks: Vec<(usize, usize)> = (0..bsp.faces.len())
            .filter(|&i| bsp.faces[i].is_valid())
            .filter_map(|i| match bsp.face_light(i, &limits) {
                FaceLight::Lightmap(map) => Some((map.offset, map.offset + map.len())),
                _ => None,
            })
            .collect();
        blocks.sort_unstable();
        blocks.dedup();
        for pair in blocks.windows(2) {
            assert!(pair[0].1 <= pair[1].0, "{name}: {pair:?}");
        }
    }
}

#[test]
fn levels_come_with_what_belongs_to_them() {
    let Some(dir) = data::dir("levels_come_with_what_belongs_to_them") else {
        return;
    };
    let limits = Limits::default();
    let search = SearchPath::builder().basedir(&dir).build().unwrap();
    assert!(search.warnings().is_empty());
    let start = Level::load(&search, "start", &limits).unwrap();
    assert_eq!(
        start.worldspawn().unwrap().get("message"),
        Some("Episode Select")
    );
    assert!(matches!(start.light, LightSamples::Rgb(_)));
    assert_eq!((start.bsp.faces.len(), start.bsp.models.len()), (1105, 44));
    assert_eq!(
        Level::load(&search, "maps/dm3.bsp", &limits).unwrap().name,
        "dm3"
    );

    let loose = |name: &str| {
        let path = dir.join("loose/bsp").join(name);
        Level::load(&search, path.to_str().unwrap(), &limits)
    };
    let notex = loose("start_notex.bsp").unwrap();
    assert!(notex.bsp.textures.iter().flatten().all(|t| !t.has_pixels()));
    assert!(notex.warnings.has(WarningKind::TextureExternal));
    let decoupled = loose("slope_decoupled.bsp").unwrap();
    assert!(matches!(decoupled.light, LightSamples::E5Bgr9(_)));
    let bsp2 = loose("lqdm1_bsp2.bsp").unwrap().bsp;
    let brushes: usize = bsp2.bspx.brush_list().iter().map(|m| m.brushes.len()).sum();
    assert!(brushes > 100);
    let normals = bsp2.bspx.face_normals().unwrap();
    assert_eq!(normals.corners.len(), bsp2.surfedges.len());
    for (name, says) in [
        ("dev_hl.bsp", "Half-Life"),
        ("lqdm1_q2.bsp", "Quake II level"),
    ] {
        let e = loose(name).unwrap_err();
        assert!(matches!(e, LoadError::Format(_)));
        assert!(e.to_string().contains(says), "{e}");
    }
    // Of what both PAKs have, the later one's counts.
    let wizard = search.read("progs/wizard.mdl").unwrap();
    assert!(wizard.origin.contains("pak1.pak"), "{}", wizard.origin);
}

#[test]
fn textures_of_a_level_come_from_the_wads_beside_it() {
    let Some(dir) = data::dir("textures_of_a_level_come_from_the_wads_beside_it") else {
        return;
    };
    let limits = Limits::default();
    let search = SearchPath::builder()
        .pak(dir.join("loose/wad"))
        .build()
        .unwrap();
    let path = dir.join("loose/bsp/start_notex.bsp");
    let level = Level::load_file(&search, &path, &limits).unwrap();
    let filled = level
        .bsp
        .textures
        .iter()
        .flatten()
        .filter(|t| t.has_pixels());
    assert!(filled.count() > 3);
}

#[test]
fn wads_hold_the_textures_listed() {
    let Some(dir) = data::dir("wads_hold_the_textures_listed") else {
        return;
    };
    let limits = Limits::default();
    for (name, count) in [("lq_dev", 228), ("lq_liquidsky", 80), ("lq_props", 51)] {
        let file = std::fs::read(dir.join(format!("loose/wad/{name}.wad"))).unwrap();
        let mut warnings = Warnings::new();
        let wad = Wad::parse(&file, &limits, &mut warnings).unwrap();
        assert!(warnings.is_empty());
        let textures = wad.entries.iter().filter(|e| wad.is_texture(e));
        assert_eq!(textures.clone().count(), count);
        for e in textures {
            wad.read_texture(&file, e, &limits).unwrap();
        }
    }
}

#[test]
fn model_and_sprite_headers_read_as_listed() {
    let Some(dir) = data::dir("model_and_sprite_headers_read_as_listed") else {
        return;
    };
    let read = |name: &str| std::fs::read(dir.join("loose").join(name)).unwrap();
    let boss = MdlHeader::parse(&read("mdl/boss.mdl")).unwrap();
    assert_eq!(
        (
            boss.num_frames,
            boss.num_skins,
            boss.skin_width,
            boss.skin_height
        ),
        (106, 2, 1024, 256)
    );
    assert_eq!(
        (boss.num_vertices, boss.num_triangles, boss.flags),
        (768, 911, 0)
    );
    let oriented = SprHeader::parse(&read("spr/lq_oriented.spr")).unwrap();
    assert_eq!(
        (oriented.sprite_type, oriented.num_frames),
        (SpriteType::Oriented, 1)
    );
    assert!(MdlHeader::parse(&read("spr/s_light.spr")).is_err());
    assert!(SprHeader::parse(&read("mdl/laser.mdl")).is_err());
}
