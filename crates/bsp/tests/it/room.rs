//! The room of the fixture reads the same in all formats.

use bsp::bsp::{FaceLight, LightSamples, contents};
use bsp::{Bsp, Limits, Warnings, entity};

use crate::fixture::{ALL_FORMATS, Room, WALL_SAMPLES, patch};

pub fn parse(file: &[u8]) -> (Bsp, Warnings) {
    let mut warnings = Warnings::new();
    let bsp = Bsp::parse(file, &Limits::default(), &mut warnings).unwrap();
    (bsp, warnings)
}

#[test]
fn all_formats_read_the_same() {
    for format in ALL_FORMATS {
        let (bsp, warnings) = parse(&Room::new().emit(format));
        assert!(warnings.is_empty(), "{format}: {warnings:?}");
        assert_eq!(bsp.format, format);
        assert_eq!(bsp.drawable_faces(0).count(), 8);
        let names: Vec<&str> = bsp
            .textures
            .iter()
            .flatten()
            .map(|t| t.name.as_str())
            .collect();
        assert_eq!(names, ["wall", "{grate", "sky1", "*water1"]);
        assert_eq!(bsp.leafs[2].contents, contents::WATER);
        assert_eq!(bsp.leafs[1].maxs, [64.0; 3]);
        for (index, face) in bsp.drawable_faces(0) {
            let plane = bsp.face_plane(face).unwrap();
            let points: Vec<[f32; 3]> = bsp.face_points(face).unwrap().collect();
            for p in &points {
                let dot: f32 = plane.normal.iter().zip(p).map(|(a, b)| a * b).sum();
                assert_eq!(dot, plane.distance, "{format} face {index}");
            }
            // The walls look inwards, and so do their planes.
            if index < 6 {
                assert_eq!(plane.distance, -64.0);
            }
        }
        let limits = Limits::default();
        let entities = entity::parse(&bsp.entity_text, &limits, &mut Warnings::new()).unwrap();
        assert_eq!(entities.len(), 2);
    }
}

#[test]
fn points_and_boxes_find_their_place() {
    for format in ALL_FORMATS {
        let (bsp, _) = parse(&Room::new().emit(format));
        assert_eq!(bsp.point_leaf(0, [0.0; 3]), Some(1));
        assert_eq!(
            bsp.point_contents(0, [0.0, 0.0, -40.0]),
            Some(contents::WATER)
        );
        assert_eq!(
            bsp.point_contents(0, [0.0, 80.0, 0.0]),
            Some(contents::SOLID)
        );
        assert_eq!(bsp.hull_contents(0, 1, [0.0; 3]), Some(contents::EMPTY));
        assert_eq!(
            bsp.hull_contents(0, 2, [0.0, 0.0, 99.0]),
            Some(contents::SOLID)
        );
        assert_eq!(bsp.point_leaf(7, [0.0; 3]), None);

        for hull in [0, 1] {
            let down = bsp
                .trace(0, hull, [8.0, 0.0, 16.0], [8.0, 0.0, -240.0])
                .unwrap();
            assert_eq!(down.normal, Some([0.0, 0.0, 1.0]));
            assert_eq!(down.end, [8.0, 0.0, -64.0 + 1.0 / 32.0]);
            assert!(!down.start_solid);
            let free = bsp.trace(0, hull, [0.0; 3], [0.0, 8.0, 0.0]).unwrap();
            assert_eq!((free.fraction, free.normal), (1.0, None));
            let stuck = bsp.trace(0, hull, [0.0, 0.0, 100.0], [0.0; 3]).unwrap();
            assert!(stuck.start_solid);
        }
    }
}

#[test]
fn lightmaps_lie_on_their_faces() {
    let (bsp, _) = parse(&Room::new().emit(bsp::bsp::Format::Bsp29));
    let limits = Limits::default();
    let FaceLight::Lightmap(map) = bsp.face_light(1, &limits) else {
        panic!("face 1 is lit");
    };
    assert_eq!((map.width, map.height, map.offset), (9, 9, WALL_SAMPLES));
    assert_eq!(map.sample(0, 8, 8), 2 * WALL_SAMPLES - 1);
    // Luxel (0, 0) lies on the corner with the least coordinates.
    assert_eq!(map.axes[0], [0.0, 1.0 / 16.0, 0.0, 4.0]);
    let value = LightSamples::Lump.value(&bsp, map.offset);
    assert_eq!(value, [101.0 / 128.0; 3]);
    assert_eq!(bsp.face_light(5, &limits), FaceLight::Fullbright);
}

#[test]
fn bspx_lumps_are_checked_and_read() {
    let mut room = Room::new();
    let samples = room.lighting.len();
    let mut decoupled = Vec::new();
    for _ in 0..8 {
        decoupled.extend([3_u16, 5].iter().flat_map(|v| v.to_le_bytes()));
        decoupled.extend(7_i32.to_le_bytes());
        decoupled.extend([0.5_f32; 8].iter().flat_map(|v| v.to_le_bytes()));
    }
    let mut brushes: Vec<u8> = [1_i32, 0, 1, 1]
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    brushes.extend(
        [-1.0_f32, -1.0, -1.0, 1.0, 1.0, 1.0]
            .iter()
            .flat_map(|v| v.to_le_bytes()),
    );
    brushes.extend([-2_i16, 1].iter().flat_map(|v| v.to_le_bytes()));
    brushes.extend(
        [0.0_f32, 0.0, 1.0, 0.5]
            .iter()
            .flat_map(|v| v.to_le_bytes()),
    );
    room.bspx = vec![
        ("RGBLIGHTING", vec![64; samples * 3]),
        ("DECOUPLED_LM", decoupled),
        ("BRUSHLIST", brushes),
        ("LMSHIFT", vec![4; 7]),
        ("SOMETHING", vec![1, 2, 3]),
    ];
    let (bsp, warnings) = parse(&room.emit(bsp::bsp::Format::Bsp2));
    let usable: Vec<bool> = bsp.bspx.lumps().iter().map(|l| l.is_usable).collect();
    assert_eq!(usable, [true, true, true, false, false]);
    assert_eq!(warnings.count(bsp::WarningKind::Bspx), 1, "{warnings:?}");
    assert_eq!(bsp.own_light_samples().value(&bsp, 3), [0.5; 3]);
    let models = bsp.bspx.brush_list();
    assert_eq!(models[0].brushes[0].planes, [([0.0, 0.0, 1.0], 0.5)]);
    let FaceLight::Lightmap(map) = bsp.face_light(0, &Limits::default()) else {
        panic!("face 0 is lit");
    };
    assert_eq!((map.width, map.height, map.offset), (3, 5, 7));
    assert_eq!(map.axes, [[0.5; 4]; 2]);
}

#[test]
fn light_grids_are_walked_to_their_end() {
    let mut grid = vec![0; 41];
    grid.extend(1_u32.to_le_bytes());
    grid.extend([0; 44]);
    grid.extend(1_u32.to_le_bytes());
    grid.extend([0; 12]);
    grid.extend([2_u32, 1, 1].iter().flat_map(|v| v.to_le_bytes()));
    grid.extend([255, 1, 0, 9, 9, 9]);
    let usable = |grid: &[u8]| {
        let mut room = Room::new();
        room.bspx = vec![("LIGHTGRID_OCTREE", grid.to_vec())];
        parse(&room.emit(bsp::bsp::Format::Bsp29)).0.bspx.lumps()[0].is_usable
    };
    assert!(usable(&grid));
    assert!(!usable(&grid[..grid.len() - 1]));
    grid.push(0);
    assert!(!usable(&grid));
}

#[test]
fn a_level_in_memory_needs_no_files() {
    let file = Room::new().emit(bsp::bsp::Format::Psb2);
    let search = bsp::SearchPath::default();
    let limits = Limits::default();
    let level = bsp::Level::from_bytes(&search, "a/room.bsp", file, &limits).unwrap();
    assert_eq!((level.name.as_str(), level.entities.len()), ("room", 2));
    let error = bsp::Level::from_bytes(&search, "room.bsp", vec![0; 8], &limits).unwrap_err();
    assert!(error.to_string().starts_with("room.bsp: "), "{error}");
}

#[test]
fn lightmaps_follow_lmshift_lmoffset_and_lmstyle() {
    let mut room = Room::new();
    room.lighting.resize(1000, 9);
    room.bspx = vec![
        ("LMSHIFT", vec![5; 8]),
        (
            "LMOFFSET",
            (0..8_i32).flat_map(|i| (i * 100).to_le_bytes()).collect(),
        ),
        (
            "LMSTYLE16",
            [3_u16, 500, u16::MAX, 7]
                .repeat(8)
                .iter()
                .flat_map(|v| v.to_le_bytes())
                .collect(),
        ),
    ];
    let (bsp, warnings) = parse(&room.emit(bsp::bsp::Format::Bsp2));
    assert!(warnings.is_empty(), "{warnings:?}");
    let FaceLight::Lightmap(map) = bsp.face_light(2, &Limits::default()) else {
        panic!("face 2 is lit");
    };
    assert_eq!((map.width, map.height, map.offset), (5, 5, 200));
    assert_eq!(map.styles, [3, 500]);
}

#[test]
fn errors_name_part_offset_found_and_allowed() {
    let mut file = Room::new().emit(bsp::bsp::Format::Bsp29);
    patch(&mut file, 4 + 8 * 3, 1 << 30);
    let error = Bsp::parse(&file, &Limits::default(), &mut Warnings::new()).unwrap_err();
    let text = error.in_file("maps/room.bsp").to_string();
    assert_eq!(
        text,
        format!(
            "maps/room.bsp: lump 3 (vertices) at byte 28: found 144 bytes at 1073741824, allowed \
             is a range within the file's {} bytes",
            file.len()
        )
    );
}
