//! MD3 and MD5 models that stand for alias models.

use crate::common::{WHITE, compile, palette, room};
use crate::inhabitants::model;
use glam::Vec3;
use scene::Scene;
use scene::import::{CastList, CastModel, ImportOptions, Lighting, import, import_cast};
use std::collections::HashMap;

#[path = "../../../bsp/tests/it/posed_fixture.rs"]
mod posed_fixture;

type Folder = HashMap<String, Vec<u8>>;

/// A picture lump of one palette index.
fn lump(size: [u32; 2], index: u8) -> Vec<u8> {
    let mut file = size.map(u32::to_le_bytes).concat();
    file.resize(8 + (size[0] * size[1]) as usize, index);
    file
}

/// An alias model that turns, and an MD5 model beside it with two skins.
fn folder() -> Folder {
    let (mesh, anim) = posed_fixture::md5();
    HashMap::from([
        ("progs/box.mdl".to_owned(), model(&[8.0], &[90], 8, false)),
        ("progs/box.md5mesh".to_owned(), mesh.into_bytes()),
        ("progs/box.md5anim".to_owned(), anim.into_bytes()),
        ("progs/box_00_00.lmp".to_owned(), lump([8, 4], 90)),
        ("progs/box_01_00.lmp".to_owned(), lump([16, 8], WHITE)),
    ])
}

fn scene(folder: &Folder, keys: &[(&str, &str)], options: &ImportOptions) -> Scene {
    let mut map = room();
    let mut all = vec![("origin", "200 200 60"), ("model", "progs/box.mdl")];
    all.extend(keys);
    map.entity("misc_box", &all);
    let files = |path: &str| folder.get(path).cloned();
    import(&compile(&map), &palette(), &files, options).expect("a scene")
}

fn shown(scene: &Scene) -> &scene::Mesh {
    let instance = scene.instances.last().expect("an instance");
    assert_eq!(instance.name, "misc_box");
    &scene.meshes[instance.mesh]
}

#[test]
fn skeletons_stand_for_alias_models_frame_by_frame() {
    let options = ImportOptions::default();
    let at_rest = scene(&folder(), &[], &options);
    assert_eq!(
        at_rest.report.replaced,
        [("progs/box.mdl".to_owned(), "progs/box.md5mesh".to_owned())]
    );
    let mesh = shown(&at_rest);
    assert_eq!(mesh.positions.len(), 4);
    let near = |p: Vec3, q: [f32; 3]| assert!((p - Vec3::from(q)).length() < 1e-4, "{p}");
    near(mesh.positions[2], [0.0, 2.0, 14.0]);
    // Corners (0, -2), (0, 2), (0, 2) above: counter-clockwise seen from the front, which is +x.
    assert!(mesh.triangles.iter().all(|t| t.normal.x > 0.99));
    // Texture coordinates count texels of a picture of 8 by 4.
    assert_eq!(mesh.triangles[0].uv, [[0.0, 4.0], [8.0, 4.0], [8.0, 0.0]]);
    let material = &at_rest.materials[mesh.triangles[0].material.0 as usize];
    assert!(material.emission.is_none());
    let picture = &at_rest.textures[material.base.0 as usize];
    assert_eq!((picture.width, picture.height), (8, 4));

    let moved = scene(&folder(), &[("frame", "1"), ("skin", "1")], &options);
    let mesh = shown(&moved);
    near(mesh.positions[2], [5.0, -4.0, 12.0]);
    let material = &moved.materials[mesh.triangles[0].material.0 as usize];
    assert!(material.emission.is_some(), "index {WHITE} shines");
    // All skins of a surface are as large as its first.
    let picture = &moved.textures[material.base.0 as usize];
    assert_eq!((picture.width, picture.height), (8, 4));
    // A skeleton turns if the alias model does.
    let later = ImportOptions {
        time: 0.9,
        ..ImportOptions::default()
    };
    let turned = scene(&folder(), &[], &later);
    let x = turned.instances.last().unwrap().transform.matrix3.x_axis;
    assert!((x.y - 1.0).abs() < 1e-4, "{x}");
}

#[test]
fn alias_models_are_shown_where_nothing_can_stand_for_them() {
    let original = |scene: &Scene, says: &str| {
        assert_eq!(shown(scene).name, "progs/box.mdl", "{says}");
        let warnings: Vec<_> = scene
            .report
            .warnings
            .iter()
            .map(ToString::to_string)
            .collect();
        let told = warnings.iter().any(|w| w.contains(says));
        assert!(told || says.is_empty(), "{says}: {warnings:?}");
    };
    let plain = ImportOptions::default();
    let off = ImportOptions {
        model_replacements: false,
        ..ImportOptions::default()
    };
    original(&scene(&folder(), &[], &off), "");
    let fullbright = ImportOptions {
        lighting: Lighting::Fullbright,
        ..ImportOptions::default()
    };
    original(&scene(&folder(), &[], &fullbright), "");
    let mut bare = folder();
    bare.remove("progs/box_00_00.lmp");
    original(
        &scene(&bare, &[], &plain),
        "there is no picture for its surface \"progs/box\"",
    );
    let mut broken = folder();
    broken.insert("progs/box.md5anim".to_owned(), b"MD5Version 11".to_vec());
    original(&scene(&broken, &[], &plain), "MD5 animation at byte 11");
}

#[test]
fn surfaces_of_md3_come_first_and_have_pictures_of_their_own() {
    let mut folder = folder();
    folder.insert("progs/box.md3".to_owned(), posed_fixture::md3());
    let options = ImportOptions::default();
    // Named after the surface, without its ending.
    folder.insert("progs/box.lmp".to_owned(), lump([2, 2], 90));
    let found = scene(&folder, &[("frame", "1")], &options);
    let mesh = shown(&found);
    assert_eq!(
        (mesh.name.as_str(), mesh.positions.len()),
        ("progs/box.md3", 3)
    );
    assert_eq!(mesh.positions[0].z, 1.0 / 64.0);
    // It is shaded by the normals of the file, where they point out of the facet; in the second frame all to one side.
    let normals = |keys: &[(&str, &str)], options: &ImportOptions| {
        let found = scene(&folder, keys, options);
        shown(&found).corner_normals(0, scene::PoseBlend::default())
    };
    let turn = |n: f32| (n / 255.0 * std::f32::consts::TAU).sin_cos();
    let near = |n: Vec3, right: Vec3| assert!((n - right).length() < 1e-4, "{n} {right}");
    let (high, low) = turn(32.0);
    let [a, b, c] = normals(&[], &options).expect("normals");
    // The second vertex' normal points inside.
    near(a, Vec3::new(high, 0.0, low));
    near(b, Vec3::X);
    let (right, up) = turn(63.0);
    near(c, Vec3::new(right, 0.0, up));
    for n in normals(&[("frame", "1")], &options).expect("normals") {
        let (right, up) = turn(64.0);
        near(n, Vec3::new(low * right, high * right, up));
    }
    let flat = ImportOptions {
        smooth_models: false,
        ..ImportOptions::default()
    };
    assert!(normals(&[], &flat).is_none());
    // As a list of skins says.
    let list = b"progs/box.tga, skins/a.tga, skins/b.tga\r\n";
    folder.insert("progs/box.md3.skin".to_owned(), list.to_vec());
    folder.insert("progs/skins/a.lmp".to_owned(), lump([4, 2], 90));
    folder.insert("textures/skins/b.lmp".to_owned(), lump([4, 2], WHITE));
    let found = scene(&folder, &[("skin", "1")], &options);
    let material = shown(&found).triangles[0].material;
    assert!(found.materials[material.0 as usize].emission.is_some());
}

#[test]
fn they_move_in_frames() {
    let folder = folder();
    let names = ["maps/test.bsp", "progs/box.mdl"].map(str::to_owned);
    let list = CastList {
        models: &names,
        ..CastList::default()
    };
    let files = |path: &str| folder.get(path).cloned();
    let options = ImportOptions::default();
    let (scene, cast) =
        import_cast(&compile(&room()), &palette(), &files, &options, list).expect("a cast");
    let found: &CastModel = &cast.models["progs/box.mdl"];
    let (mesh, alias) = found.surfaces().next().expect("a surface");
    assert_eq!(found.surfaces().count(), 1);
    assert_eq!((scene.meshes[mesh].poses.len(), alias.skins.len()), (2, 2));
    assert_eq!(alias.flags, 8);
    let half = scene.meshes[mesh].posed(alias.between(0, 1, 0.5, 0.0));
    assert!(
        (half[2] - Vec3::new(2.5, -1.0, 13.0)).length() < 1e-4,
        "{}",
        half[2]
    );
    assert!(scene.meshes[mesh].skins.contains(&alias.skin(1, 0.0)));
}
