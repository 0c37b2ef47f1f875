//! Cases seen in real files or likely in broken ones, each with the behaviour due. The numbers are
//! those of the project's list of format gotchas.

use bsp::bsp::{FaceFlaw, FaceLight, Format, NodeChild};
use bsp::{Bsp, ErrorKind, Limits, SearchPath, WarningKind, Warnings};

use crate::fixture::{ALL_FORMATS, LeafRow, Room, assemble, lump_header, patch, tex, texture_lump};
use crate::room::parse;

fn error(file: &[u8]) -> bsp::FormatError {
    Bsp::parse(file, &Limits::default(), &mut Warnings::new()).unwrap_err()
}

/// Parses the room after a change, in all formats, and checks.
fn with(change: impl Fn(&mut Room), check: impl Fn(&Bsp, &Warnings)) {
    for format in ALL_FORMATS {
        let mut room = Room::new();
        change(&mut room);
        let (bsp, warnings) = parse(&room.emit(format));
        check(&bsp, &warnings);
    }
}

#[test]
fn gotcha_01_empty_and_stub_levels() {
    for stub in [&[][..], &[29, 0, 0], &[29, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]] {
        assert_eq!(error(stub).kind(), ErrorKind::Truncated);
    }
    let zeros = error(&[0; 4096]);
    assert_eq!(zeros.kind(), ErrorKind::UnknownFormat);
    assert!(zeros.to_string().contains("as a number 0"), "{zeros}");
}

#[test]
fn gotcha_01_other_formats_are_named() {
    let named = [
        (&[30, 0, 0, 0, 0, 0, 0, 0][..], "Half-Life"),
        (b"IBSP\x26\0\0\0", "Quake II level"),
        (b"IBSP\x2e\0\0\0", "Quake III"),
        (b" 46Q\0\0\0\0", "Quake 64"),
    ];
    for (bytes, name) in named {
        let e = error(bytes);
        assert_eq!(e.kind(), ErrorKind::UnsupportedFormat);
        assert!(e.to_string().contains(name), "{e}");
    }
}

#[test]
fn gotcha_05_lumps_outside_of_the_file() {
    for format in ALL_FORMATS {
        let good = Room::new().emit(format);
        for lump in 0..15 {
            let structural = [1, 3, 7, 12, 13, 14].contains(&lump);
            for (field, value) in [(0, -4), (0, i32::MAX), (4, -1), (4, i32::MAX)] {
                let mut file = good.clone();
                patch(&mut file, lump_header(lump) + field, value);
                let mut warnings = Warnings::new();
                let result = Bsp::parse(&file, &Limits::default(), &mut warnings);
                if structural {
                    let e = result.unwrap_err();
                    assert_eq!(e.kind(), ErrorKind::Truncated);
                    assert_eq!(e.offset(), Some(lump_header(lump) as u64));
                } else {
                    result.unwrap();
                    assert!(warnings.has(WarningKind::LumpRange), "{format} lump {lump}");
                }
            }
        }
    }
}

#[test]
fn gotcha_05_sizes_that_are_no_multiple_of_the_record() {
    let mut lumps = Room::new().lumps(Format::Bsp29);
    for lump in [1, 3, 5, 6, 7, 9, 10, 11, 12, 13, 14] {
        lumps[lump].push(0);
    }
    let (bsp, warnings) = parse(&assemble(Format::Bsp29, &lumps, &[]));
    assert_eq!(bsp.drawable_faces(0).count(), 8);
    assert_eq!(warnings.count(WarningKind::LumpRange), 11);
}

#[test]
fn gotcha_06_no_textures_at_all() {
    with(
        |room| room.textures.clear(),
        |bsp, warnings| {
            assert!(bsp.textures.is_empty());
            assert!(bsp.faces.iter().all(|f| bsp.face_texture(f).is_none()));
            assert!(warnings.has(WarningKind::TextureMissing));
        },
    );
}

#[test]
fn gotcha_07_missing_textures_keep_their_numbers() {
    with(
        |room| {
            room.textures =
                texture_lump(&[None, tex("a", 16, 16), tex("b", 16, 16), tex("c", 16, 16)]);
            // Into the directory.
            patch(&mut room.textures, 12, 8);
        },
        |bsp, warnings| {
            let names: Vec<Option<&str>> = bsp
                .textures
                .iter()
                .map(|t| t.as_ref().map(|t| t.name.as_str()))
                .collect();
            assert_eq!(names, [None, Some("a"), None, Some("c")]);
            assert!(warnings.has(WarningKind::TextureMissing));
        },
    );
}

#[test]
fn gotcha_08_impossible_texture_sizes() {
    for size in [[0, 16], [16, 0], [0x1_0001, 0xffff], [u32::MAX, u32::MAX]] {
        with(
            |room| {
                let mut bad = tex("bad", 16, 16).unwrap();
                bad.size = size;
                room.textures = texture_lump(&[Some(bad), tex("good", 16, 16)]);
            },
            |bsp, warnings| {
                assert!(bsp.textures[0].is_none());
                assert!(bsp.textures[1].is_some());
                assert!(warnings.has(WarningKind::TextureMissing));
            },
        );
    }
}

#[test]
fn gotcha_09_pixels_past_the_end_are_padded() {
    with(
        |room| {
            let mut short = tex("short", 16, 16).unwrap();
            short.pixels.truncate(200);
            room.textures = texture_lump(&[Some(short)]);
        },
        |bsp, warnings| {
            let t = bsp.textures[0].as_ref().unwrap();
            assert_eq!(t.pixels.len(), 256);
            assert_eq!(
                (t.pixels[100], t.pixels[199], t.pixels[255]),
                (100, 199, 199)
            );
            assert!(warnings.has(WarningKind::TextureRepaired));
        },
    );
}

#[test]
fn gotcha_09_a_small_file_makes_no_large_textures() {
    // A thousand textures that share one header of 8192 x 8192.
    let mut big = tex("big", 16, 16).unwrap();
    big.size = [8192, 8192];
    let mut lump = texture_lump(&vec![Some(big); 1000]);
    let last = i32::from_le_bytes(lump[4000..4004].try_into().unwrap());
    for i in 0..1000 {
        patch(&mut lump, 4 + 4 * i, last);
    }
    with(
        |room| room.textures = lump.clone(),
        |bsp, _| assert!(bsp.textures.iter().all(Option::is_none)),
    );
}

#[test]
fn gotcha_10_external_textures_are_named_once() {
    let mut room = Room::new();
    let mut names = Vec::new();
    for i in 0..20 {
        let mut t = tex(&format!("ext{i}"), 16, 16).unwrap();
        t.first_offset = 0;
        t.pixels.clear();
        names.push(Some(t));
    }
    room.textures = texture_lump(&names);
    room.entities = b"{\"classname\" \"worldspawn\" \"wad\" \"q:\\x\\none.wad\"}".to_vec();
    let dir = tempdir("gotcha10");
    let path = dir.join("room.bsp");
    std::fs::write(&path, room.emit(Format::Bsp29)).unwrap();
    let search = SearchPath::default();
    let level = bsp::Level::load_file(&search, &path, &Limits::default()).unwrap();
    assert!(
        level
            .bsp
            .textures
            .iter()
            .flatten()
            .all(|t| !t.has_pixels() && t.width == 16)
    );
    let external: Vec<_> = level
        .warnings
        .iter()
        .filter(|w| w.kind == WarningKind::TextureExternal)
        .collect();
    assert_eq!((external.len(), external[0].count), (1, 20));
    assert_eq!(level.warnings.count(WarningKind::FileMissing), 1);
}

#[test]
fn gotcha_12_version_29_counts_to_65535() {
    // A face, its texinfo and plane, all beyond 32767.
    let mut room = Room::new();
    let (plane, texinfo) = (room.planes[0], room.texinfos[0]);
    room.planes.resize(40_000, plane);
    room.texinfos.resize(40_000, texinfo);
    let face = room.faces[0].clone();
    room.faces.resize(40_000, face);
    room.faces[39_999].plane = 39_999;
    room.faces[39_999].texinfo = 39_998;
    room.marks = vec![39_999];
    room.leafs[1].num_marks = 1;
    room.leafs[2].num_marks = 1;
    room.models[0].num_faces = 40_000;
    // Shares edges with others: room must be made for them.
    room.surfedges.resize(40_000, 0);
    let (bsp, warnings) = parse(&room.emit(Format::Bsp29));
    assert!(warnings.is_empty(), "{warnings:?}");
    let face = &bsp.faces[39_999];
    assert_eq!((face.plane, face.texinfo), (39_999, 39_998));
    assert_eq!(bsp.leaf_faces(&bsp.leafs[1]).collect::<Vec<_>>(), [39_999]);
}

#[test]
fn gotcha_12_too_many_leafs_are_told() {
    let mut room = Room::new();
    let leaf = LeafRow {
        contents: -1,
        vis_offset: -1,
        first_mark: 0,
        num_marks: 0,
    };
    room.leafs.resize(32_768, leaf);
    let (_, warnings) = parse(&room.emit(Format::Bsp29));
    assert!(warnings.has(WarningKind::LeafCount));
    let (_, warnings) = parse(&room.emit(Format::Bsp2));
    assert!(!warnings.has(WarningKind::LeafCount));
}

#[test]
fn gotcha_13_leaf_children_out_of_range() {
    with(
        |room| room.nodes[6].1 = [-2, -100],
        |bsp, warnings| {
            assert_eq!(
                bsp.nodes[6].children,
                [NodeChild::Leaf(1), NodeChild::Leaf(0)]
            );
            assert!(warnings.has(WarningKind::Tree));
        },
    );
}

#[test]
fn gotcha_14_bad_edges_drop_the_face() {
    let changes: [fn(&mut Room); 5] = [
        |room| room.surfedges[2] = i32::MIN,
        |room| room.surfedges[2] = 9999,
        |room| room.edges[3] = [9999, 9998],
        |room| room.faces[0].first_edge = u32::MAX,
        |room| room.faces[0].num_edges = 60_000,
    ];
    for change in changes {
        with(change, |bsp, warnings| {
            assert!(bsp.faces.iter().any(|f| f.flaw == Some(FaceFlaw::BadIndex)));
            assert!(bsp.drawable_faces(0).count() >= 6);
            for (_, face) in bsp.drawable_faces(0) {
                assert_eq!(bsp.face_points(face).unwrap().len(), 4);
            }
            assert!(warnings.has(WarningKind::FaceDropped));
        });
    }
}

#[test]
fn gotcha_14_shared_edges_do_not_multiply_memory() {
    let mut room = Room::new();
    room.surfedges = room.surfedges.repeat(100);
    let mut face = room.faces[0].clone();
    face.num_edges = room.surfedges.len() as u32;
    face.first_edge = 0;
    room.faces.resize(1000, face);
    let (bsp, _) = parse(&room.emit(Format::Bsp2));
    let used: usize = bsp
        .faces
        .iter()
        .filter(|f| f.is_valid())
        .map(|f| f.num_edges as usize)
        .sum();
    assert!(used <= 4 * bsp.surfedges.len());
}

#[test]
fn gotcha_15_faces_without_area() {
    with(
        |room| {
            room.faces[0].num_edges = 2;
            // All corners of face 1 on one line.
            let first = room.faces[1].first_edge as usize;
            for edge in &mut room.surfedges[first..first + 4] {
                *edge = 1;
            }
        },
        |bsp, warnings| {
            assert_eq!(bsp.faces[0].flaw, Some(FaceFlaw::FewEdges));
            assert_eq!(bsp.faces[1].flaw, Some(FaceFlaw::NoArea));
            assert!(bsp.face_vertices(&bsp.faces[0]).is_none());
            assert_eq!(warnings.count(WarningKind::FaceDropped), 2);
        },
    );
}

#[test]
fn gotcha_15_collinear_vertices_stay() {
    with(
        |room| {
            // A fifth corner in the middle of an edge of a face of its own.
            let v = room.vertices.len() as u32;
            room.vertices.extend([
                [-64.0, -64.0, -64.0],
                [64.0, -64.0, -64.0],
                [64.0, 0.0, -64.0],
                [64.0, 64.0, -64.0],
                [-64.0, 64.0, -64.0],
            ]);
            let first_edge = room.surfedges.len() as u32;
            for i in 0..5 {
                room.surfedges.push(room.edges.len() as i32);
                room.edges.push([v + (5 - i) % 5, v + (4 - i)]);
            }
            room.faces[4].first_edge = first_edge;
            room.faces[4].num_edges = 5;
        },
        |bsp, warnings| {
            assert!(warnings.is_empty(), "{warnings:?}");
            let points: Vec<_> = bsp.face_points(&bsp.faces[4]).unwrap().collect();
            assert_eq!(points.len(), 5);
            assert!(points.contains(&[64.0, 0.0, -64.0]));
        },
    );
}

#[test]
fn gotcha_16_unusable_planes_come_from_the_vertices() {
    for normal in [[0.0; 3], [f32::NAN; 3]] {
        with(
            |room| {
                room.planes[4].0 = normal;
                room.planes[5].0 = normal;
            },
            |bsp, warnings| {
                let floor = bsp.face_plane(&bsp.faces[4]).unwrap();
                assert_eq!((floor.normal, floor.distance), ([0.0, 0.0, 1.0], -64.0));
                let ceiling = bsp.face_plane(&bsp.faces[5]).unwrap();
                assert_eq!(
                    (ceiling.normal, ceiling.distance),
                    ([0.0, 0.0, -1.0], -64.0)
                );
                assert!(warnings.has(WarningKind::Plane));
                // A tree over such a plane is not walked.
                assert_eq!(bsp.point_leaf(0, [0.0; 3]), None);
            },
        );
    }
}

#[test]
fn gotcha_16_unusable_texture_axes_are_told() {
    with(
        |room| room.texinfos[0].0 = [0.0; 4],
        |bsp, warnings| {
            assert!(warnings.has(WarningKind::Texinfo));
            assert_eq!(
                bsp.face_texinfo(&bsp.faces[0]).unwrap().st([1.0; 3])[0],
                0.0
            );
        },
    );
    with(
        |room| room.texinfos[0].1 = [f32::NAN; 4],
        |bsp, warnings| {
            assert!(warnings.has(WarningKind::Texinfo));
            assert_eq!(bsp.face_light(0, &Limits::default()), FaceLight::Black);
        },
    );
}

#[test]
fn gotcha_17_absurd_vertices_drop_their_faces() {
    for bad in [f32::NAN, f32::INFINITY, 1.1e5, -1.1e5] {
        with(
            |room| room.vertices[0][1] = bad,
            |bsp, warnings| {
                let dropped = bsp
                    .faces
                    .iter()
                    .filter(|f| f.flaw == Some(FaceFlaw::BadVertex))
                    .count();
                assert_eq!(dropped, 3, "a corner of the room is on three faces");
                assert_eq!(warnings.count(WarningKind::FaceDropped), 3);
            },
        );
    }
}

#[test]
fn gotcha_18_a_lit_file_of_another_level_is_ignored() {
    use bsp::bsp::LightSamples;
    let lit = |version: i32, bytes: usize| {
        let mut file = b"QLIT".to_vec();
        file.extend(version.to_le_bytes());
        file.resize(8 + bytes, 32);
        file
    };
    assert_eq!(
        LightSamples::from_lit(&lit(1, 30), 10),
        Ok(LightSamples::Rgb(vec![32; 30]))
    );
    assert!(matches!(
        LightSamples::from_lit(&lit(0x10001, 40), 10),
        Ok(LightSamples::E5Bgr9(_))
    ));
    assert!(LightSamples::from_lit(&lit(1, 33), 10).is_err());
    let own_scale = LightSamples::from_lit(&lit(2, 30), 10).unwrap_err();
    assert!(own_scale.contains("-lit2"), "{own_scale}");
    assert!(LightSamples::from_lit(&lit(3, 30), 10).is_err());

    let dir = tempdir("gotcha18");
    let room = Room::new();
    let path = dir.join("room.bsp");
    std::fs::write(&path, room.emit(Format::Bsp29)).unwrap();
    let load = || bsp::Level::load_file(&SearchPath::default(), &path, &Limits::default()).unwrap();
    std::fs::write(dir.join("room.lit"), lit(1, 3 * room.lighting.len())).unwrap();
    assert!(matches!(load().light, LightSamples::Rgb(_)));
    std::fs::write(dir.join("room.lit"), lit(1, 3)).unwrap();
    let level = load();
    assert_eq!(level.light, LightSamples::Lump);
    assert!(level.warnings.has(WarningKind::Companion));
}

#[test]
fn gotcha_19_bad_lightmaps_are_black() {
    let limits = Limits::default();
    with(
        |room| {
            room.faces[0].light_offset = 1 << 20;
            room.faces[1].light_offset = -7;
            room.faces[2].styles = [255; 4];
            room.faces[3].light_offset = -1;
        },
        |bsp, warnings| {
            for face in 0..4 {
                assert_eq!(bsp.face_light(face, &limits), FaceLight::Black);
            }
            assert!(matches!(bsp.face_light(4, &limits), FaceLight::Lightmap(_)));
            // No style and no offset are ordinary.
            assert_eq!(warnings.count(WarningKind::Lightmap), 2);
        },
    );
    with(
        |room| room.lighting.clear(),
        |bsp, warnings| {
            assert!(warnings.is_empty());
            assert_eq!(bsp.face_light(0, &limits), FaceLight::Fullbright);
        },
    );
}

#[test]
fn gotcha_20_cut_visibility_is_visible() {
    // The row of 9 leafs takes 2 bytes.
    assert_eq!(
        bsp::bsp::decompress(&[1, 0, 3, 0xff], 5),
        (vec![1, 0, 0, 0, 0xff], false)
    );
    assert_eq!(
        bsp::bsp::decompress(&[1, 0], 3),
        (vec![1, 0xff, 0xff], true)
    );
    assert_eq!(bsp::bsp::decompress(&[0, 255], 2), (vec![0, 0], false));
    with(
        |room| room.visibility = vec![1],
        |bsp, _| {
            let pvs = bsp.pvs(1);
            assert!(pvs.sees(1) && !pvs.sees(2) && !pvs.sees(0));
            assert!(bsp.pvs(0).is_everything());
        },
    );
    with(
        |room| room.leafs[1].vis_offset = 77,
        |bsp, warnings| {
            assert!(bsp.pvs(1).is_everything());
            assert!(warnings.has(WarningKind::Visibility));
        },
    );
    for claimed in [-1, 1 << 30] {
        with(
            |room| room.models[0].vis_leafs = claimed,
            |bsp, warnings| {
                assert!(bsp.vis_row_bytes() <= 1);
                assert!(bsp.pvs(1).sees(2));
                assert!(warnings.has(WarningKind::Visibility));
            },
        );
    }
    with(
        |room| {
            room.models[0].vis_leafs = 9;
            room.leafs.resize(10, room.leafs[1].clone());
        },
        |bsp, _| assert_eq!(bsp.vis_row_bytes(), 2),
    );
}

#[test]
fn gotcha_21_loops_disable_their_tree() {
    with(
        |room| {
            room.nodes[6].1[1] = 3;
            room.clipnodes[2].1[0] = 2;
        },
        |bsp, warnings| {
            assert_eq!(bsp.point_leaf(0, [0.0; 3]), None);
            assert_eq!(bsp.hull_contents(0, 1, [0.0; 3]), None);
            assert_eq!(bsp.trace(0, 0, [0.0; 3], [9.0; 3]), None);
            assert_eq!(bsp.drawable_faces(0).count(), 8);
            assert!(warnings.has(WarningKind::Tree));
        },
    );
    // A node that is reached twice is no loop.
    with(
        |room| room.nodes[2].1 = [3, 3],
        |bsp, warnings| {
            assert!(warnings.is_empty(), "{warnings:?}");
            assert_eq!(bsp.point_leaf(0, [0.0; 3]), Some(1));
        },
    );
}

#[test]
fn gotcha_21_deep_trees_do_not_overflow_the_stack() {
    for (depth, leaf) in [(3000, Some(1)), (200_000, None)] {
        let mut room = Room::new();
        room.nodes = (0..depth).map(|i| (0, [i + 1, -1])).collect();
        room.nodes.push((0, [-2, -1]));
        let (bsp, warnings) = parse(&room.emit(Format::Bsp2));
        assert_eq!(bsp.point_leaf(0, [0.0; 3]), leaf);
        let trace = bsp.trace(0, 0, [0.0; 3], [0.0, 0.0, 1.0]);
        assert_eq!(trace.is_some(), leaf.is_some());
        assert_eq!(warnings.has(WarningKind::Tree), leaf.is_none());
    }
}

#[test]
fn gotcha_22_no_models() {
    for format in ALL_FORMATS {
        let mut room = Room::new();
        room.models.clear();
        assert_eq!(error(&room.emit(format)).kind(), ErrorKind::Missing);
        let mut room = Room::new();
        room.faces.clear();
        assert_eq!(error(&room.emit(format)).kind(), ErrorKind::Missing);
    }
}

#[test]
fn gotcha_23_models_claim_faces_that_are_not_there() {
    for (first, count) in [(6, 100), (-5, 3), (0, -1), (1000, 1000)] {
        with(
            |room| {
                room.models.push(room.models[0].clone());
                room.models[1].first_face = first;
                room.models[1].num_faces = count;
            },
            |bsp, warnings| {
                assert!(bsp.models[1].faces().end <= 8);
                assert!(warnings.has(WarningKind::ModelRange));
                assert_eq!(bsp.drawable_faces(999).count(), 0);
            },
        );
    }
}

#[test]
fn gotcha_29_hexen_ii_is_told_apart() {
    let mut lumps = Room::new().lumps(Format::Bsp29);
    let model = lumps[14].clone();
    // Eight roots instead of four, here for four models (a multiple of both sizes).
    lumps[14].clear();
    for i in 0..4_i32 {
        let mut m = model[..52].to_vec();
        m.extend([0; 16]);
        m.extend(&model[52..56]);
        m.extend((2 * i).to_le_bytes());
        m.extend(2_i32.to_le_bytes());
        assert_eq!(m.len(), 80);
        lumps[14].extend(m);
    }
    let e = error(&assemble(Format::Bsp29, &lumps, &[]));
    assert!(e.to_string().contains("Hexen II"), "{e}");
    // Five good models of Quake make a multiple of 80 too.
    with(
        |room| {
            room.models.resize(5, room.models[0].clone());
            for m in &mut room.models[1..] {
                (m.first_face, m.num_faces) = (8, 0);
            }
        },
        |bsp, warnings| {
            assert_eq!(bsp.models.len(), 5);
            assert!(warnings.is_empty(), "{warnings:?}");
        },
    );
}

#[test]
fn gotcha_29_half_life_lighting_under_version_29() {
    let mut room = Room::new();
    room.models[0].head_nodes[3] = 1;
    for face in &mut room.faces {
        if face.light_offset >= 0 {
            face.light_offset *= 3;
        }
    }
    room.lighting = room.lighting.iter().flat_map(|&v| [v, v / 2, 0]).collect();
    let (bsp, warnings) = parse(&room.emit(Format::Bsp29));
    assert!(bsp.rgb_lighting);
    assert!(warnings.has(WarningKind::Mislabelled));
    let FaceLight::Lightmap(map) = bsp.face_light(1, &Limits::default()) else {
        panic!("face 1 is lit");
    };
    let value = bsp.own_light_samples().value(&bsp, map.offset);
    assert_eq!(value, [101.0 / 128.0, 50.0 / 128.0, 0.0]);
    // Hull 3 alone makes no Half-Life level.
    let mut room = Room::new();
    room.models[0].head_nodes[3] = 1;
    assert!(!parse(&room.emit(Format::Bsp29)).0.rgb_lighting);
}

#[test]
fn lumps_that_share_their_bytes_are_refused() {
    let mut file = Room::new().emit(Format::Bsp2);
    let size = file.len() as i32;
    for lump in 0..15 {
        patch(&mut file, lump_header(lump), 0);
        patch(&mut file, lump_header(lump) + 4, size);
    }
    assert_eq!(error(&file).kind(), ErrorKind::TooLarge);
}

/// A fresh directory of a test.
pub fn tempdir(test: &str) -> std::path::PathBuf {
    let dir = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
    let _ = std::fs::remove_dir_all(&dir);
    std::fs::create_dir_all(&dir).unwrap();
    dir
}
