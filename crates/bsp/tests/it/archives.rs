//! PAKs and the search path.

use std::fs;

use bsp::bsp::Format;
use bsp::pak::Directory;
use bsp::{Level, Limits, LoadError, SearchPath, WarningKind, Warnings};

use crate::fixture::{Room, pak, patch};
use crate::gotchas::tempdir;

fn directory(file: &[u8]) -> (Directory, Warnings) {
    let mut warnings = Warnings::new();
    let directory = Directory::parse(file, &Limits::default(), &mut warnings).unwrap();
    (directory, warnings)
}

#[test]
fn gotcha_01_a_directory_beyond_the_file_fails_that_pak_only() {
    let good = pak(&[("a.txt", b"hello")]);
    for (at, value) in [(4, i32::MAX), (4, -1), (8, i32::MAX), (8, -64)] {
        let mut file = good.clone();
        patch(&mut file, at, value);
        let result = Directory::parse(&file, &Limits::default(), &mut Warnings::new());
        assert!(result.is_err());
    }
    let dir = tempdir("gotcha01");
    fs::create_dir_all(dir.join("id1")).unwrap();
    fs::write(dir.join("id1/pak0.pak"), &good).unwrap();
    fs::write(dir.join("id1/pak1.pak"), &good[..20]).unwrap();
    let search = SearchPath::builder().basedir(&dir).build().unwrap();
    assert_eq!(search.read("a.txt").unwrap().bytes, b"hello");
    assert!(search.warnings().has(WarningKind::ArchiveEntry));
    // Given by name, it is an error.
    let explicit = SearchPath::builder().pak(dir.join("id1/pak1.pak")).build();
    assert!(matches!(explicit, Err(LoadError::Format(_))));
}

#[test]
fn gotcha_02_bad_entries_are_left_out() {
    let mut file = pak(&[
        ("past", b"12"),
        ("negative", b"34"),
        ("good", b"56"),
        ("../up", b"7"),
    ]);
    let table = 12 + 7;
    patch(&mut file, table + 60, 100_000);
    patch(&mut file, table + 64 + 60, -1);
    let (directory, warnings) = directory(&file);
    let names: Vec<&str> = directory
        .entries()
        .iter()
        .map(|e| e.name.as_str())
        .collect();
    assert_eq!(names, ["good"]);
    assert_eq!(warnings.count(WarningKind::ArchiveEntry), 3);
}

#[test]
fn gotcha_03_names_without_their_end() {
    let long = "x".repeat(56);
    let (found, _) = directory(&pak(&[(&long, b"1"), ("short\0garbage", b"2")]));
    assert_eq!(found.entries()[0].name.len(), 56);
    assert_eq!(found.entries()[1].name, "short");
    // The same for textures.
    let mut room = Room::new();
    let mut t = crate::fixture::tex("", 16, 16).unwrap();
    t.name = *b"sixteen_letters_";
    let mut u = t.clone();
    u.name = *b"cut\0garbage_____";
    room.textures = crate::fixture::texture_lump(&[Some(t), Some(u)]);
    let (bsp, _) = crate::room::parse(&room.emit(Format::Bsp29));
    assert_eq!(bsp.textures[0].as_ref().unwrap().name, "sixteen_letters_");
    assert_eq!(bsp.textures[1].as_ref().unwrap().name, "cut");
}

#[test]
fn gotcha_04_mixed_case_and_backslashes() {
    let file = pak(&[
        ("Maps\\Start.BSP", b"1"),
        ("a.txt", b"first"),
        ("A.TXT", b"2"),
        ("a.txt", b"second"),
    ]);
    let (directory, _) = directory(&file);
    assert_eq!(
        directory.find("maps/start.bsp").unwrap().name,
        "Maps/Start.BSP"
    );
    assert_eq!(directory.find("A.TXT").unwrap().length, 1);
    assert_eq!(directory.find("a.txt").unwrap().length, 5);
    assert_eq!(directory.find("a.TXT").unwrap().length, 5);
    assert!(directory.find("b.txt").is_none());
}

#[test]
fn the_search_path_has_quakes_order() {
    let dir = tempdir("order");
    for game in ["id1", "mod"] {
        fs::create_dir_all(dir.join(game).join("sub")).unwrap();
    }
    let write = |path: &str, files: &[(&str, &[u8])]| {
        fs::write(dir.join(path), pak(files)).unwrap();
    };
    write(
        "id1/pak0.pak",
        &[("a", b"id1 pak0"), ("b", b"id1 pak0"), ("c", b"id1 pak0")],
    );
    write("id1/PAK1.PAK", &[("b", b"id1 pak1")]);
    write("id1/pak3.pak", &[("a", b"never: pak2 is missing")]);
    fs::write(dir.join("id1/a"), b"id1 loose").unwrap();
    fs::write(dir.join("id1/sub/Loose.txt"), b"id1 sub").unwrap();
    fs::write(dir.join("mod/c"), b"mod loose").unwrap();
    write("extra.pak", &[("d", b"extra"), ("a", b"extra")]);
    fs::create_dir_all(dir.join("last")).unwrap();
    fs::write(dir.join("last/d"), b"last").unwrap();

    let text = |search: &SearchPath, name: &str| {
        String::from_utf8(search.read(name).unwrap().bytes).unwrap()
    };
    let search = SearchPath::builder()
        .basedir(&dir)
        .game("mod")
        .build()
        .unwrap();
    assert_eq!(text(&search, "a"), "id1 pak0");
    assert_eq!(text(&search, "b"), "id1 pak1");
    assert_eq!(text(&search, "c"), "mod loose");
    assert_eq!(text(&search, "SUB/loose.TXT"), "id1 sub");
    assert_eq!(
        search.list(""),
        [
            "a",
            "b",
            "c",
            "pak0.pak",
            "pak1.pak",
            "pak3.pak",
            "sub/loose.txt"
        ]
    );
    assert_eq!(search.list("sub/"), ["sub/loose.txt"]);
    assert!(search.exists("sub\\loose.txt") && !search.exists("nothing"));
    assert!(search.read("c").unwrap().priority > search.read("a").unwrap().priority);
    assert!(search.read("b").unwrap().origin.ends_with("PAK1.PAK:b"));

    let files = SearchPath::builder()
        .basedir(&dir)
        .files_first(true)
        .build()
        .unwrap();
    assert_eq!(text(&files, "a"), "id1 loose");

    let extra = SearchPath::builder()
        .basedir(&dir)
        .pak(dir.join("extra.pak"))
        .pak(dir.join("last"))
        .build()
        .unwrap();
    assert_eq!(text(&extra, "a"), "extra");
    assert_eq!(text(&extra, "d"), "last");

    let brought = SearchPath::builder()
        .basedir(&dir)
        .built_in(&[("a", b"built in"), ("maps/b", b"b")])
        .build()
        .unwrap();
    assert_eq!(text(&brought, "A"), "built in");
    assert_eq!(text(&brought, "b"), "id1 pak1");
    assert_eq!(brought.list("maps/"), ["maps/b"]);

    for bad in ["../secret", "/etc/passwd", "a/../../b", "", "c:\\x"] {
        assert!(
            matches!(search.read(bad), Err(LoadError::BadName(_))),
            "{bad:?}"
        );
    }
    assert!(matches!(
        search.read("nothing"),
        Err(LoadError::NotFound { .. })
    ));
    let missing = SearchPath::builder().basedir(&dir).game("nomod").build();
    assert!(missing.unwrap_err().to_string().contains("nomod"));
}

#[test]
fn companions_count_from_their_own_place_up() {
    let dir = tempdir("companions");
    fs::create_dir_all(dir.join("id1/maps")).unwrap();
    fs::create_dir_all(dir.join("mod/maps")).unwrap();
    let room = Room::new();
    let mut lit = b"QLIT\x01\0\0\0".to_vec();
    lit.resize(8 + 3 * room.lighting.len(), 1);
    let sum = bsp::level::crc16(&room.entities[..room.entities.len() - 1]);
    let level = room.emit(Format::Bsp29);
    let load = || {
        let search = SearchPath::builder()
            .basedir(&dir)
            .game("mod")
            .build()
            .unwrap();
        Level::load(&search, "room", &Limits::default()).unwrap()
    };

    // The level in id1, companions in mod: all count.
    fs::write(dir.join("id1/maps/room.bsp"), &level).unwrap();
    fs::write(dir.join("mod/maps/room.lit"), &lit).unwrap();
    fs::write(dir.join("mod/maps/room.ent"), b"{\"classname\" \"plain\"}").unwrap();
    let found = load();
    assert_eq!(found.name, "room");
    assert_eq!(found.entities[0].classname(), "plain");
    assert_eq!(found.companions.len(), 2);
    let name = format!("mod/maps/room@{sum:04x}.ent");
    fs::write(dir.join(name), b"{\"classname\" \"summed\"}").unwrap();
    assert_eq!(load().entities[0].classname(), "summed");

    // A level of mod does not take the companions of id1.
    fs::rename(dir.join("id1/maps/room.bsp"), dir.join("mod/maps/room.bsp")).unwrap();
    fs::rename(dir.join("mod/maps/room.lit"), dir.join("id1/maps/room.lit")).unwrap();
    let found = load();
    assert_eq!(found.light, bsp::bsp::LightSamples::Lump);
    assert!(found.warnings.has(WarningKind::Companion));
}

#[test]
fn external_visibility_replaces_that_of_the_level() {
    let dir = tempdir("vis");
    let mut room = Room::new();
    let path = dir.join("Room.bsp");
    let full = room.emit(Format::Bsp29);
    let leafs = room.lumps(Format::Bsp29)[10].clone();
    room.visibility.clear();
    for leaf in &mut room.leafs {
        leaf.vis_offset = -1;
    }
    fs::write(&path, room.emit(Format::Bsp29)).unwrap();
    let mut body = 1_i32.to_le_bytes().to_vec();
    body.push(1);
    body.extend((leafs.len() as i32).to_le_bytes());
    body.extend(&leafs);
    let mut vis = Vec::new();
    for (name, body) in [("other.bsp", &b"xyz"[..]), ("room.bsp", &body)] {
        let mut field = [0; 32];
        field[..name.len()].copy_from_slice(name.as_bytes());
        vis.extend(field);
        vis.extend((body.len() as i32).to_le_bytes());
        vis.extend(body);
    }
    fs::write(dir.join("room.vis"), &vis).unwrap();
    let load = || Level::load_file(&SearchPath::default(), &path, &Limits::default()).unwrap();
    let level = load();
    assert!(!level.bsp.pvs(1).sees(2) && level.bsp.pvs(1).sees(1));
    assert_eq!(level.companions.len(), 1);
    // The same leafs as in the level with its own visibility.
    let (own, _) = crate::room::parse(&full);
    assert_eq!(level.bsp.leafs, own.leafs);

    fs::write(dir.join("room.vis"), &vis[..vis.len() - 1]).unwrap();
    let level = load();
    assert!(level.bsp.pvs(1).is_everything());
    assert!(level.warnings.has(WarningKind::Companion));
}
