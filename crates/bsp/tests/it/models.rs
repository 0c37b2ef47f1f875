//! Alias models and sprites: what our own writer writes, what is broken about them, and real files.

use crate::data;
use crate::model_fixture::{model, sprite};
use bsp::mdl::{Mdl, flags};
use bsp::spr::{Spr, SpriteType, Times};
use bsp::{ErrorKind, FormatError, Limits, WarningKind, Warnings};

fn mdl(data: &[u8]) -> (Result<Mdl, FormatError>, Warnings) {
    let mut warnings = Warnings::new();
    let read = Mdl::parse(data, &Limits::default(), &mut warnings);
    (read, warnings)
}

fn spr(data: &[u8]) -> (Result<Spr, FormatError>, Warnings) {
    let mut warnings = Warnings::new();
    let read = Spr::parse(data, &Limits::default(), &mut warnings);
    (read, warnings)
}

fn set(file: &mut [u8], at: usize, value: i32) {
    file[at..at + 4].copy_from_slice(&value.to_le_bytes());
}

#[test]
fn a_model_is_read_as_it_was_written() {
    let written = model();
    let (read, warnings) = mdl(&written.write());
    let read = read.unwrap();
    assert!(warnings.is_empty());
    assert_eq!(
        (read.header.flags, read.header.sync_type),
        (flags::ROTATE, 1)
    );
    assert_eq!([read.header.skin_width, read.header.skin_height], [100, 3]);
    assert_eq!(
        (read.skins.len(), read.frames.len(), read.pose_count()),
        (2, 2, 3)
    );
    assert_eq!(read.skins[0].pictures, [vec![7; 300]]);
    assert_eq!(read.skins[0].cycle, None);
    assert_eq!(read.skins[1].pictures, [vec![1; 300], vec![2; 300]]);
    let cycle = read.skins[1].cycle.as_ref().unwrap();
    assert_eq!(
        (cycle.at(0.2).0, cycle.at(0.5).0, cycle.seconds()),
        (0, 1, 1.0)
    );
    let names: Vec<&str> = (read.frames.iter().flat_map(|f| &f.poses))
        .map(|p| p.name.as_str())
        .collect();
    assert_eq!(names, ["still", "up1", "up2"]);
    let group = read.frames[1].cycle.as_ref().unwrap();
    assert_eq!((group.at(0.05).0, group.at(0.2).0), (0, 1));
    assert_eq!(read.triangles[1].vertices, [0, 1, 3]);
    // Half a step of the 256 between the lowest and the highest is what rounding may cost.
    let tops = [4.0_f32, 0.0, 20.0];
    for (pose, top) in read.frames.iter().flat_map(|f| &f.poses).zip(tops) {
        let [x, y, z] = read.position(pose.vertices[2]);
        assert!(x.abs() < 0.05 && (y - 8.0).abs() < 0.05 && (z - top).abs() < 0.05);
    }
}

#[test]
fn vertices_on_the_seam_lie_half_a_skin_further_for_the_back() {
    let (read, _) = mdl(&model().write());
    let read = read.unwrap();
    let [front, back] = [read.triangles[0], read.triangles[1]];
    assert_eq!(read.skin_coordinates(&front, 0), [10.5, 0.5]);
    assert_eq!(read.skin_coordinates(&back, 0), [60.5, 0.5]);
    assert_eq!(read.skin_coordinates(&back, 3), [70.5, 2.5]);
    // Editors write other values than 0x20.
    let mut file = model().write();
    let seams = file.len() - 3 * (24 + 16) - (4 + 4 + 4 + 8 + 8) - 2 * 16 - 4 * 12;
    assert_eq!(file[seams], 0x20);
    set(&mut file, seams, 1);
    let read = mdl(&file).0.unwrap();
    assert_eq!(read.skin_coordinates(&back, 0), [60.5, 0.5]);
}

#[test]
fn a_sprite_is_read_as_it_was_written() {
    let kinds = [
        SpriteType::ParallelUpright,
        SpriteType::FacingUpright,
        SpriteType::Parallel,
        SpriteType::Oriented,
        SpriteType::ParallelOriented,
    ];
    for (number, kind) in kinds.into_iter().enumerate() {
        let (read, warnings) = spr(&sprite(number as u32).write());
        let read = read.unwrap();
        assert!(warnings.is_empty());
        assert_eq!(read.header.sprite_type, kind);
        assert_eq!((read.frames.len(), read.picture_count()), (3, 11));
        assert_eq!(read.frames[0].times, Times::Single);
        let first = &read.frames[0].pictures[0];
        assert_eq!(
            (first.origin, first.width, first.height),
            ([-28, 28], 56, 56)
        );
        let Times::Group(cycle) = &read.frames[1].times else {
            panic!("{:?}", read.frames[1].times);
        };
        assert_eq!((cycle.parts(), cycle.seconds()), (2, 0.3));
        assert_eq!(read.frames[1].pictures[1].pixels, [4; 10]);
        assert_eq!(read.frames[2].times, Times::Angled);
        assert_eq!(read.frames[2].pictures[7].pixels, [7]);
    }
    let (bad, _) = spr(&sprite(5).write());
    assert_eq!(bad.unwrap_err().kind(), ErrorKind::OutOfRange);
}

#[test]
fn files_cut_anywhere_are_refused_and_what_follows_them_is_not() {
    let (model, sprite) = (model().write(), sprite(2).write());
    for end in 0..model.len() {
        let error = mdl(&model[..end]).0.unwrap_err();
        assert!(error.to_string().contains("MDL"), "{error}");
    }
    for end in 0..sprite.len() {
        let error = spr(&sprite[..end]).0.unwrap_err();
        assert!(error.to_string().contains("SPR"), "{error}");
    }
    let longer = [&model[..], b"QMEX notes"].concat();
    let (read, warnings) = mdl(&longer);
    assert_eq!(read.unwrap().trailing, 10);
    assert!(warnings.is_empty());
    assert_eq!(spr(&[&sprite[..], &[0; 3]].concat()).0.unwrap().trailing, 3);
}

#[test]
fn broken_parts_of_models_are_repaired_or_named() {
    let whole = model().write();
    let frames = whole.len() - 3 * (24 + 16) - (4 + 4 + 4 + 8 + 8);
    let triangles = frames - 2 * 16;

    // A vertex that is not there.
    let mut file = whole.clone();
    set(&mut file, triangles + 4, 4);
    let (read, warnings) = mdl(&file);
    assert_eq!(read.unwrap().triangles.len(), 1);
    assert_eq!(warnings.count(WarningKind::Model), 1);

    // Times that do not rise.
    let mut file = whole.clone();
    let times = frames + 4 + 40 + 4 + 4 + 8;
    set(&mut file, times, 0.9_f32.to_bits().cast_signed());
    let (read, warnings) = mdl(&file);
    assert_eq!(
        read.unwrap().frames[1].cycle.as_ref().unwrap().seconds(),
        0.2
    );
    assert!(warnings.has(WarningKind::Model));

    // An empty group shows the frame before it, if none follows.
    let mut file = whole.clone();
    set(&mut file, frames + 4 + 40 + 4, 0);
    let (read, warnings) = mdl(&file);
    let read = read.unwrap();
    assert_eq!(read.frames[1], read.frames[0]);
    assert!(warnings.has(WarningKind::Model));

    // What there is no living with.
    let nan = f32::NAN.to_bits().cast_signed();
    let huge = 1e9_f32.to_bits().cast_signed();
    for (at, value, says) in [
        (4, 3, "version 3"),
        (8, nan, "NaN"),
        (12, huge, "1000000000"),
        (20, nan, "NaN"),
        (48, 0, "number of skins"),
        (52, i32::MAX, "skin width"),
        (60, -1, "number of vertices"),
        (64, 0, "number of triangles"),
        (68, 1 << 20, "number of frames"),
        (frames + 4 + 40 + 4, -1, "MDL frame 1"),
        (frames + 4 + 40 + 4, i32::MAX, "group of 2147483647"),
        (84 + 4 + 300 + 4, 5, "MDL skin 1"),
    ] {
        let mut file = whole.clone();
        set(&mut file, at, value);
        let error = mdl(&file).0.unwrap_err().in_file("x.mdl").to_string();
        assert!(error.contains(says) && error.contains("x.mdl"), "{error}");
    }
}

#[test]
fn broken_parts_of_sprites_are_repaired_or_named() {
    let whole = sprite(2).write();
    let group = 36 + 4 + 16 + 56 * 56;
    let mut file = whole.clone();
    set(&mut file, group + 8, 0);
    let (read, warnings) = spr(&file);
    let read = read.unwrap();
    let Times::Group(cycle) = &read.frames[1].times else {
        panic!("no group");
    };
    assert_eq!(cycle.seconds(), 0.2);
    assert!(warnings.has(WarningKind::Model));
    // A frame without texels shows nothing.
    let mut file = whole.clone();
    file.truncate(36);
    file.extend([0; 20]);
    set(&mut file, 24, 1);
    assert_eq!(spr(&file).0.unwrap().frames[0].pictures[0].width, 0);

    for (at, value, says) in [
        (4, 2, "Half-Life"),
        (24, 0, "number of frames"),
        (24, 1 << 20, "number of frames"),
        (36, 3, "type 3"),
        (36 + 4, i32::MIN, "-2147483648"),
        (36 + 12, -1, "-1x56"),
        (36 + 16, 10_000, "56x10000"),
        (group + 4, 0, "group of 0"),
        (group + 4, -3, "group of -3"),
        (group + 4, i32::MAX, "SPR frame 1 at byte"),
        (group, 2, "2 directions"),
    ] {
        let mut file = whole.clone();
        set(&mut file, at, value);
        let error = spr(&file).0.unwrap_err().in_file("x.spr").to_string();
        assert!(error.contains(says) && error.contains("x.spr"), "{error}");
    }
}

/// Frames, skins, skin size, vertices, triangles, flags, poses and whether bytes follow, as the data's
/// own list has them.
const LISTED: [(&str, [u32; 8], bool); 12] = [
    ("armor", [1, 3, 200, 200, 141, 148, 0x8, 1], false),
    ("b_g_key", [250, 6, 96, 96, 92, 78, 0x8, 250], false),
    ("boss", [106, 2, 1024, 256, 768, 911, 0, 106], true),
    ("flame", [1, 1, 256, 256, 133, 118, 0, 6], true),
    ("flame2", [2, 1, 64, 128, 91, 102, 0, 14], true),
    ("laser", [1, 1, 256, 256, 9, 6, 0, 5], true),
    ("oldone", [67, 1, 4096, 256, 986, 1156, 0, 67], false),
    ("player", [143, 1, 296, 194, 801, 1060, 0, 143], false),
    ("soldier", [114, 1, 296, 194, 613, 886, 0, 114], false),
    ("tarbaby", [61, 1, 180, 180, 578, 711, 0, 61], true),
    ("v_rock2", [7, 2, 200, 200, 320, 304, 0, 7], false),
    ("w_spike", [4, 1, 64, 128, 56, 56, 0x10, 4], false),
];

#[test]
fn real_models_read_as_listed() {
    let Some(dir) = data::dir("real_models_read_as_listed") else {
        return;
    };
    for (name, listed, has_more) in LISTED {
        let file = std::fs::read(dir.join(format!("loose/mdl/{name}.mdl"))).unwrap();
        let (read, warnings) = mdl(&file);
        let read = read.unwrap();
        let h = read.header;
        let found = [
            read.frames.len() as u32,
            read.skins.len() as u32,
            h.skin_width,
            h.skin_height,
            read.skin_vertices.len() as u32,
            read.triangles.len() as u32,
            h.flags,
            read.pose_count() as u32,
        ];
        assert_eq!((found, read.trailing > 0), (listed, has_more), "{name}");
        assert!(warnings.is_empty(), "{name}: {warnings:?}");
    }
}

#[test]
fn real_sprites_read_as_listed() {
    let Some(dir) = data::dir("real_sprites_read_as_listed") else {
        return;
    };
    use SpriteType::{Oriented, Parallel, ParallelUpright};
    for (name, kind, frames, pictures, first) in [
        ("lq_group", Parallel, 3, 4, [64, 64]),
        ("lq_oriented", Oriented, 1, 1, [64, 64]),
        ("lq_upright", ParallelUpright, 2, 2, [64, 64]),
        ("s_bubble", Parallel, 2, 2, [16, 16]),
        ("s_explod", Parallel, 6, 6, [64, 64]),
        ("s_light", Parallel, 1, 1, [32, 32]),
    ] {
        let file = std::fs::read(dir.join(format!("loose/spr/{name}.spr"))).unwrap();
        let (read, warnings) = spr(&file);
        let read = read.unwrap();
        let picture = &read.frames[0].pictures[0];
        assert_eq!(
            (
                read.header.sprite_type,
                read.frames.len(),
                [picture.width, picture.height]
            ),
            (kind, frames, first),
            "{name}"
        );
        println!("{name}: {} pictures", read.picture_count());
        assert!(read.picture_count() >= pictures, "{name}");
        assert_eq!(read.trailing, 0, "{name}");
        assert!(warnings.is_empty(), "{name}: {warnings:?}");
    }
}

#[test]
fn every_model_of_the_archives_reads() {
    let Some(dir) = data::dir("every_model_of_the_archives_reads") else {
        return;
    };
    let (mut models, mut sprites) = (0, 0);
    for (name, bytes) in data::everything(&dir) {
        let (read, warnings) = if bytes.starts_with(b"IDPO") {
            models += 1;
            let (read, warnings) = mdl(&bytes);
            (read.map(drop), warnings)
        } else if bytes.starts_with(b"IDSP") {
            sprites += 1;
            let (read, warnings) = spr(&bytes);
            (read.map(drop), warnings)
        } else {
            continue;
        };
        read.unwrap_or_else(|e| panic!("{name}: {e}"));
        for warning in warnings.iter() {
            println!("{name}: {warning}");
        }
    }
    println!("{models} models, {sprites} sprites");
    assert!(
        models >= 94 && sprites >= 10,
        "{models} models, {sprites} sprites"
    );
}
