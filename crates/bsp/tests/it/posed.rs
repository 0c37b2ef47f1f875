//! Models that stand for alias models.

use crate::posed_fixture::{md3, md5};
use bsp::md3::Md3;
use bsp::md5::Md5;
use bsp::posed::PosedModel;
use bsp::{FileKind, Limits, sniff};

fn near(found: &[[f32; 3]], right: &[[f32; 3]]) {
    assert_eq!(found.len(), right.len());
    for (a, b) in found.iter().flatten().zip(right.iter().flatten()) {
        assert!((a - b).abs() < 1e-5, "{found:?} {right:?}");
    }
}

const REST: [[f32; 3]; 4] = [
    [0.0, -2.0, 0.0],
    [0.0, 2.0, 0.0],
    [0.0, 2.0, 14.0],
    [0.0, -2.0, 14.0],
];

#[test]
fn skeletons_move_what_hangs_on_them() {
    let (mesh, anim) = md5();
    let read = |anim: Option<&str>| {
        let anim = anim.map(str::as_bytes);
        PosedModel::Md5(Md5::parse(mesh.as_bytes(), anim, &Limits::default()).unwrap())
    };
    assert_eq!(sniff(mesh.as_bytes()), FileKind::Md5);
    let still = read(None);
    assert_eq!(
        (still.frames(), still.vertices(), still.flags()),
        (1, 4, None)
    );
    assert!(still.normals(0).is_none());
    near(&still.pose(0), &REST);
    let moving = read(Some(&anim));
    assert_eq!(moving.frames(), 2);
    near(&moving.pose(0), &REST);
    // Frames that are not there are the first.
    near(&moving.pose(7), &REST);
    let surface = &moving.surfaces()[0];
    assert_eq!(surface.name, "progs/box");
    assert_eq!(surface.triangles, [[0, 2, 1], [0, 3, 2]]);
    assert_eq!(surface.uv[3], [0.0, 0.25]);
    // About the second joint (0, 2, 4) goes to (0, -4, 2) and (0, -2, 4) to (0, -4, -2), and all is 5 further along x;
    // the last vertex is a quarter where the first joint has it.
    near(
        &moving.pose(1),
        &[
            [5.0, -2.0, 0.0],
            [5.0, 2.0, 0.0],
            [5.0, -4.0, 12.0],
            [5.0, 0.25 * -2.0 + 0.75 * -4.0, 0.25 * 14.0 + 0.75 * 8.0],
        ],
    );
}

#[test]
fn surfaces_hold_every_frame() {
    let file = md3();
    assert_eq!(sniff(&file), FileKind::Md3);
    let model = PosedModel::Md3(Md3::parse(&file, &Limits::default()).unwrap());
    assert_eq!(
        (model.frames(), model.vertices(), model.flags()),
        (2, 3, Some(8))
    );
    let surface = &model.surfaces()[0];
    assert_eq!(surface.name, "progs/box.tga");
    assert_eq!(surface.uv, [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0]]);
    assert_eq!(surface.triangles, [[0, 2, 1]]);
    near(
        &model.pose(0),
        &[[0.0, -2.0, 0.0], [0.0, 2.0, 0.0], [0.0, 2.0, 1.0]],
    );
    near(
        &model.pose(1),
        &[
            [0.0, -2.0, 1.0 / 64.0],
            [0.0, 2.0, 1.0 / 64.0],
            [0.0, 2.0, 65.0 / 64.0],
        ],
    );
    // In 255ths of a turn: about an eighth from above, beyond a quarter, a quarter.
    let turn = |n: f32| (n / 255.0 * std::f32::consts::TAU).sin_cos();
    let ((high, low), (right, up)) = (turn(32.0), turn(64.0));
    let (back, along) = turn(128.0);
    let first = model.normals(0).expect("normals");
    near(
        &first[..2],
        &[[high, 0.0, low], [along * right, back * right, up]],
    );
    let second = model.normals(1).expect("normals");
    let leaning = turn(32.0);
    near(&second, &[[leaning.1 * right, leaning.0 * right, up]; 3]);
}

#[test]
fn what_is_wrong_is_told_with_its_place() {
    let (mesh, anim) = md5();
    let wrong_mesh = |from: &str, to: &str| {
        let text = mesh.replace(from, to);
        assert_ne!(text, mesh, "{from}");
        let error = Md5::parse(text.as_bytes(), None, &Limits::default()).unwrap_err();
        (error.to_string(), text)
    };
    for (from, to, says) in [
        (
            "MD5Version 10",
            "MD5Version 11",
            "found \"11\", allowed is \"10\"",
        ),
        ("numJoints 2", "numJoints 2000000", "found 2000000 joints"),
        ("numMeshes 1", "numMeshes 0", "found 0 meshes"),
        ("\"arm\"\t0", "\"arm\"\t1", "found joint 1 on 1"),
        (
            "numverts 4",
            "numverts 3",
            "found vertex 3, allowed is less than 3",
        ),
        (
            "( 1 0 ) 2 1",
            "( 1 0 ) 2 4",
            "found weights 2 to 6, allowed is up to 5",
        ),
        ("( 1 0 ) 2 1", "( 1 0 ) 2 33", "a vertex of 33 weights"),
        ("tri 1 0 3 2", "tri 1 0 4 2", "found vertex 4"),
        ("weight 4 1", "weight 4 2", "found joint 2"),
        ("( 0 -2 4 )", "( 0 nan 4 )", "found NaN"),
        ("( 0 -2 4 )", "( 0 1e9 4 )", "found 1000000000"),
        ("( 0 -2 4 )\n}", "( 0 -2 4 )", "the end of the text"),
    ] {
        let (error, text) = wrong_mesh(from, to);
        assert!(
            error.contains(says) && error.contains("MD5 mesh at byte"),
            "{error}"
        );
        assert!(text.len() > 100);
    }
    for (from, to, says) in [
        ("numJoints 2", "numJoints 3", "found 3 joints, allowed is 2"),
        ("\"arm\"\t0", "\"leg\"\t0", "\"arm\" of the mesh"),
        ("0 8 1", "0 24 1", "flags 24 from number 1 on"),
        ("0 8 1", "0 64 1", "flags 64"),
        ("frame 1", "frame 0", "no frame 1"),
        ("frame 1", "frame 2", "found frame 2"),
        ("5 -0.7", "5", "found \"}\""),
    ] {
        let mut text = anim.replace(from, to);
        if from.starts_with("5 ") {
            text = anim.replace("5 -0.70710678", to);
        }
        let found = Md5::parse(mesh.as_bytes(), Some(text.as_bytes()), &Limits::default());
        let error = found.unwrap_err().to_string();
        assert!(
            error.contains(says) && error.contains("MD5 animation at byte"),
            "{error}"
        );
    }
    let file = md3();
    for (at, value, says) in [
        (4, 16, "version 16"),
        (76, 1000, "found 1000 frames, allowed is 1 to"),
        (76, 1, "found 2 frames, allowed is 1, as the header says"),
        (84, 0, "found 0 surfaces"),
        (84, 2, "MD3 surface 1"),
        (100, 1 << 30, "MD3 surface 0"),
        (220 + 84, 1 << 20, "triangles from byte"),
        (
            220 + 108,
            3,
            "triangle 0: found vertices 3, 2, 1, allowed is 0 to 2",
        ),
        (
            220 + 120,
            f32::NAN.to_bits().cast_signed(),
            "texture coordinate 0",
        ),
        (220 + 100, 1000, "vertices of all frames from byte 1000"),
    ] {
        let mut file = file.clone();
        file[at..at + 4].copy_from_slice(&i32::to_le_bytes(value));
        let error = Md3::parse(&file, &Limits::default())
            .unwrap_err()
            .to_string();
        assert!(error.contains(says), "{error}");
    }
    for end in 0..file.len() {
        assert!(
            Md3::parse(&file[..end], &Limits::default()).is_err(),
            "{end}"
        );
    }
}
