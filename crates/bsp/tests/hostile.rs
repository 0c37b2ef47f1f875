//! Every real file, cut at a thousand places and with ten thousand bytes changed, is read without
//! a panic, a hang, or more memory than 64 times its size.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use bsp::bsp::LightSamples;
use bsp::dem::{Demo, Summary};
use bsp::lmp::{Colormap, Palette, Picture};
use bsp::md3::Md3;
use bsp::md5::Md5;
use bsp::mdl::Mdl;
use bsp::miptex::Animation;
use bsp::pak::Directory;
use bsp::posed::PosedModel;
use bsp::spr::Spr;
use bsp::wad::Wad;
use bsp::{Bsp, Limits, Warnings, entity, sniff};

#[path = "it/data.rs"]
mod data;
#[path = "it/fixture.rs"]
mod fixture;
#[path = "it/model_fixture.rs"]
mod models;
#[path = "it/posed_fixture.rs"]
mod posed_fixture;

/// Counts the bytes that the current thread holds, and the most it ever held.
struct Counting;

thread_local! {
    static HELD: Cell<isize> = const { Cell::new(0) };
    static MOST: Cell<isize> = const { Cell::new(0) };
}

fn count(change: isize) {
    // Late in a thread's life the counters are gone; nothing is measured there.
    let _ = HELD.try_with(|held| {
        held.set(held.get() + change);
        let _ = MOST.try_with(|most| most.set(most.get().max(held.get())));
    });
}

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size().cast_signed());
        // SAFETY: as promised by the caller.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, ptr: *mut u8, layout: Layout) {
        count(-layout.size().cast_signed());
        // SAFETY: as promised by the caller.
        unsafe { System.dealloc(ptr, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Memory that messages and small tables may take, however short the file is.
const SMALL: usize = 64 << 10;

/// Most memory held while reading a file larger than that, in tenths of the file's size.
static WORST: AtomicUsize = AtomicUsize::new(0);

/// No file here takes a hundredth of this to read.
const HANG: Duration = Duration::from_secs(20);

fn next(state: &mut u64) -> u64 {
    // SplitMix64 (Steele, Lea, Flood 2014).
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (*state ^ *state >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ z >> 31
}

/// Reads bytes by every reader that their kind calls for.
fn read(bytes: &[u8], is_level: bool) {
    let limits = Limits::default();
    let mut warnings = Warnings::new();
    let w = &mut warnings;
    std::hint::black_box(sniff(bytes));
    if is_level {
        if let Ok(level) = Bsp::parse(bytes, &limits, w) {
            let _ = entity::parse(&level.entity_text, &limits, w);
            Animation::new(&level.textures, w);
            level.point_leaf(0, [1.0; 3]);
            level.hull_contents(0, 1, [1.0; 3]);
            level.trace(0, 1, [0.0; 3], [0.0, 0.0, -512.0]);
            level.pvs(level.leafs.len() / 2);
            let points = level
                .drawable_faces(0)
                .filter_map(|(_, f)| level.face_points(f));
            std::hint::black_box(points.flatten().count());
        }
        return;
    }
    let _ = Directory::parse(bytes, &limits, w);
    if let Ok(wad) = Wad::parse(bytes, &limits, w) {
        for e in &wad.entries {
            let _ = wad.read_texture(bytes, e, &limits);
            let _ = wad.read_picture(bytes, e, &limits, w);
        }
    }
    let _ = (Palette::parse(bytes), Colormap::parse(bytes));
    let _ = Picture::parse(bytes, &limits, w);
    if let Ok(model) = Mdl::parse(bytes, &limits, w) {
        for t in &model.triangles {
            std::hint::black_box(t.vertices.map(|v| model.skin_coordinates(t, v)));
        }
    }
    if let Ok(model) = Md3::parse(bytes, &limits) {
        std::hint::black_box(PosedModel::Md3(model).pose(1));
    }
    let mut texts = bytes.splitn(2, |&b| b == 0);
    let mesh = texts.next().unwrap_or_default();
    if let Ok(model) = Md5::parse(mesh, texts.next(), &limits) {
        std::hint::black_box(PosedModel::Md5(model).pose(1));
    }
    std::hint::black_box(Spr::parse(bytes, &limits, w).is_ok());
    if let Ok(demo) = Demo::parse(bytes, &limits, w) {
        std::hint::black_box(Summary::of(&demo, w));
    }
    let _ = LightSamples::from_lit(bytes, bytes.len().saturating_sub(8) / 3);
    if bytes.len() < 1 << 16 {
        let _ = entity::parse(bytes, &limits, w);
    }
}

/// Reads and checks time and memory.
fn measured(name: &str, what: &str, bytes: &[u8], is_level: bool) {
    let before = HELD.get();
    MOST.set(before);
    let start = Instant::now();
    read(bytes, is_level);
    let took = start.elapsed();
    let used = (MOST.get() - before).unsigned_abs();
    assert!(took < HANG, "{name}, {what}: took {took:?}");
    let allowed = 64 * bytes.len() + SMALL;
    if bytes.len() > SMALL {
        WORST.fetch_max(used * 10 / bytes.len(), Ordering::Relaxed);
    }
    assert!(
        used <= allowed,
        "{name}, {what}: {used} bytes held for a file of {}",
        bytes.len()
    );
    assert_eq!(HELD.get(), before, "{name}, {what}: memory was kept");
}

fn torture(name: &str, file: &[u8], seed: u64) {
    let is_level =
        file.starts_with(&[29, 0, 0, 0]) || file.starts_with(b"BSP2") || file.starts_with(b"2PSB");
    measured(name, "whole", file, is_level);
    for i in 0..1000 {
        let end = file.len() * i / 1000;
        measured(name, &format!("cut at {end}"), &file[..end], is_level);
    }
    if file.is_empty() {
        return;
    }
    let mut state = seed;
    let mut left: u64 = 10_000;
    let mut changed = file.to_vec();
    let mut undo = Vec::new();
    while left > 0 {
        let run = (1 + next(&mut state) % 256).min(left);
        left -= run;
        for _ in 0..run {
            let at = (next(&mut state) % file.len() as u64) as usize;
            undo.push((at, changed[at]));
            changed[at] ^= (1 + next(&mut state) % 255) as u8;
        }
        measured(
            name,
            &format!("with {left} changes to go"),
            &changed,
            is_level,
        );
        for (at, byte) in undo.drain(..).rev() {
            changed[at] = byte;
        }
    }
}

/// Works through files on all cores.
fn on_all_cores(files: &[(String, Vec<u8>)], work: impl Fn(usize, &str, &[u8]) + Sync) {
    let next = AtomicUsize::new(0);
    let failed = Mutex::new(Vec::new());
    let cores = std::thread::available_parallelism().map_or(2, |n| n.get());
    std::thread::scope(|scope| {
        for _ in 0..cores {
            scope.spawn(|| {
                while let Some((i, (name, file))) = {
                    let i = next.fetch_add(1, Ordering::Relaxed);
                    files.get(i).map(|f| (i, f))
                } {
                    let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
                        work(i, name, file);
                    }));
                    if result.is_err() {
                        failed.lock().unwrap().push(name.clone());
                    }
                }
            });
        }
    });
    let failed = failed.into_inner().unwrap();
    assert!(failed.is_empty(), "{failed:?}");
}

#[test]
fn broken_real_files_do_no_harm() {
    let Some(dir) = data::dir("broken_real_files_do_no_harm") else {
        return;
    };
    let mut files = data::everything(&dir);
    // The largest first, so that no core is left alone with one at the end.
    files.sort_by_key(|(_, file)| std::cmp::Reverse(file.len()));
    on_all_cores(&files, |i, name, file| torture(name, file, i as u64));
    println!(
        "most memory held: {} tenths of a file",
        WORST.load(Ordering::Relaxed)
    );
}

/// Files made to take as much memory and time as their size allows.
#[test]
fn crafted_files_do_no_harm() {
    use bsp::bsp::Format;
    use fixture::{Room, assemble, patch, tex, texture_lump};

    let repeat =
        |head: &str, body: &str, n: usize| format!("{head}{}", body.repeat(n)).into_bytes();
    let texts = [
        repeat("", "{}", 200_000),
        repeat("", "{classname a}", 40_000),
        repeat("", "{a b}", 80_000),
        repeat("{", "a b ", 120_000),
        repeat("", "{", 400_000),
        repeat("", "\"", 400_000),
        repeat("", "/*", 200_000),
        repeat("{classname worldspawn wad \"", "a;", 200_000),
    ];
    for (i, text) in texts.iter().enumerate() {
        let mut room = Room::new();
        room.entities = text.clone();
        measured(
            &format!("entity text {i}"),
            "",
            &room.emit(Format::Bsp29),
            true,
        );
    }

    // Many textures in one place: with pixels, without, animated and each of another name.
    for external in [false, true] {
        let mut one = tex("+0aaaaaaaaaaaa", 16, 16).unwrap();
        one.first_offset = if external { 0 } else { 40 };
        let count = 60_000;
        let mut lump = texture_lump(&vec![None; count]);
        let base = lump.len();
        lump.extend(&texture_lump(&[Some(one)])[8..]);
        for i in 0..count {
            patch(&mut lump, 4 + 4 * i, base as i32);
        }
        let mut room = Room::new();
        room.textures = lump;
        measured("textures in one place", "", &room.emit(Format::Bsp29), true);
    }
    let mut lump = texture_lump(&vec![None; 60_000]);
    let base = lump.len();
    lump.extend(b"+0aa\x10\0\0\0".repeat(30_000));
    for i in 0..60_000 {
        patch(&mut lump, 4 + 4 * i, (base + 8 * (i % 29_000)) as i32);
    }
    let mut room = Room::new();
    room.textures = lump;
    measured("textures that overlap", "", &room.emit(Format::Bsp2), true);

    // Chains and nets of nodes.
    for format in [Format::Bsp29, Format::Bsp2] {
        let mut room = Room::new();
        room.nodes = (0..60_000).map(|i| (0, [i + 1, i + 1])).collect();
        room.clipnodes = (0..60_000).map(|i| (0, [i + 1, i])).collect();
        measured("long trees", "", &room.emit(format), true);
        room.nodes = (0..4000).map(|i| (i % 6, [i + 1, i + 1])).collect();
        room.clipnodes = (0..4000).map(|i| (i % 6, [i + 1, i + 1])).collect();
        measured("trees that are nets", "", &room.emit(format), true);
    }

    // A BSPX directory of one name, and of names that nobody knows.
    for name in ["LMSHIFT", "RGBLIGHTING", "X"] {
        let mut room = Room::new();
        room.bspx = vec![(name, vec![4; 8]); 20_000];
        measured("BSPX directory", name, &room.emit(Format::Bsp29), true);
    }

    // Lumps that share their bytes, as far as that is allowed.
    let lumps = Room::new().lumps(Format::Bsp29);
    for pair in [[5, 9], [9, 11], [11, 12], [2, 9], [0, 10]] {
        let mut file = assemble(Format::Bsp29, &lumps, &[]);
        let start = file.len() as i32;
        file.resize(file.len() + 480_000, 1);
        for lump in pair {
            patch(&mut file, fixture::lump_header(lump), start);
            patch(&mut file, fixture::lump_header(lump) + 4, 480_000);
        }
        measured(&format!("lumps {pair:?} in one place"), "", &file, true);
    }

    let files: Vec<(String, Vec<u8>)> = (0..20_000).map(|i| (format!("{i}"), Vec::new())).collect();
    let files: Vec<(&str, &[u8])> = files.iter().map(|(n, d)| (n.as_str(), &d[..])).collect();
    measured("PAK directory", "", &fixture::pak(&files), false);
    let mut wad = b"WAD2".to_vec();
    wad.extend([20_000_i32, 12].iter().flat_map(|v| v.to_le_bytes()));
    wad.resize(12 + 32 * 20_000, 0);
    measured("WAD directory", "", &wad, false);

    // Models of as many of the smallest parts as fit, and of empty groups.
    let model = |counts: [i32; 6], parts: &[u8]| {
        let mut file = b"IDPO\x06\0\0\0".to_vec();
        file.resize(48, 0);
        file.extend(counts.iter().flat_map(|v| v.to_le_bytes()));
        file.resize(84, 0);
        [&file[..], parts].concat()
    };
    let one_each = [&[0; 5 + 12 + 16][..], &[0; 32]].concat();
    let (n, single) = (20_000, [0, 0, 0, 0, 9]);
    let skins = model(
        [n, 1, 1, 1, 1, 1],
        &[single.repeat(n as usize), one_each[5..].to_vec()].concat(),
    );
    measured("many skins", "", &skins, false);
    let frames = model(
        [1, 1, 1, 1, 1, n],
        &[&one_each[..33], &vec![0; 32 * n as usize]].concat(),
    );
    measured("many frames", "", &frames, false);
    for skins in [16, 17, 5000] {
        let empty = [1_i32, 0].map(i32::to_le_bytes).concat();
        let group = [1_i32, 30_000].map(i32::to_le_bytes).concat();
        let parts = [empty.repeat(skins), group, vec![1; 5 * 30_000]].concat();
        let file = model(
            [skins as i32 + 1, 1, 1, 1, 1, 1],
            &[&parts[..], &one_each[5..]].concat(),
        );
        measured("empty skin groups", "", &file, false);
    }
    let mut sprite = b"IDSP\x01\0\0\0".to_vec();
    sprite.resize(36, 0);
    sprite[24..28].copy_from_slice(&n.to_le_bytes());
    sprite.resize(36 + 20 * n as usize, 0);
    measured("many frames of a sprite", "", &sprite, false);
    println!(
        "most memory held: {} tenths of a file",
        WORST.load(Ordering::Relaxed)
    );
}

#[test]
fn broken_models_and_sprites_do_no_harm() {
    let (mesh, anim) = posed_fixture::md5();
    let files = [
        ("a model".to_owned(), models::model().write()),
        ("a sprite".to_owned(), models::sprite(1).write()),
        ("an MD3".to_owned(), posed_fixture::md3()),
        (
            "an MD5".to_owned(),
            [mesh.as_bytes(), b"\0", anim.as_bytes()].concat(),
        ),
    ];
    on_all_cores(&files, |i, name, file| {
        torture(name, file, 99 + i as u64);
        for at in 0..file.len().saturating_sub(4) {
            for value in [0, 1, -1, 0x7fff, i32::MAX, i32::MIN, file.len() as i32] {
                let mut changed = file.to_vec();
                fixture::patch(&mut changed, at, value);
                measured(name, &format!("{value} at {at}"), &changed, false);
            }
        }
    });
}

#[test]
fn broken_small_levels_do_no_harm() {
    let mut files = Vec::new();
    for format in fixture::ALL_FORMATS {
        let mut room = fixture::Room::new();
        room.bspx = vec![
            ("RGBLIGHTING", vec![1; 3 * room.lighting.len()]),
            ("LMSTYLE", vec![0; 16]),
            ("LMSHIFT", vec![4; 8]),
        ];
        files.push((format.to_string(), room.emit(format)));
    }
    on_all_cores(&files, |i, name, file| {
        torture(name, file, 77 + i as u64);
        // At every byte of the header, and with every word replaced by extremes.
        for end in 0..file.len().min(4096) {
            measured(name, &format!("cut at {end}"), &file[..end], true);
        }
        for at in (4..file.len() - 4).step_by(4) {
            for value in [
                0,
                1,
                -1,
                0x7fff,
                0xffff,
                i32::MAX,
                i32::MIN,
                file.len() as i32,
            ] {
                let mut changed = file.to_vec();
                fixture::patch(&mut changed, at, value);
                measured(name, &format!("{value} at {at}"), &changed, true);
            }
        }
    });
}
