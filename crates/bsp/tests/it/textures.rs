//! Texture animation, WADs, palettes and pictures.

use bsp::lmp::{Colormap, Palette, Picture};
use bsp::miptex::{Animation, MipTex};
use bsp::wad::{Wad, WadKind};
use bsp::{Limits, WarningKind, Warnings};

use crate::fixture::name16;

fn named(names: &[&str]) -> Vec<Option<MipTex>> {
    let texture = |name: &&str| {
        Some(MipTex {
            name: (*name).to_owned(),
            raw_name: name16(name),
            width: 16,
            height: 16,
            pixels: vec![0; 256],
            palette: None,
        })
    };
    names.iter().map(texture).collect()
}

#[test]
fn animated_textures_show_five_frames_a_second() {
    let textures = named(&[
        "+0lamp", "wall", "+1lamp", "+2LAMP", "+alamp", "+3lamp", "+0other",
    ]);
    let mut warnings = Warnings::new();
    let animation = Animation::new(&textures, &mut warnings);
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!(animation.sequence(3).unwrap().primary, [0, 2, 3, 5]);
    assert_eq!(animation.frame_at(0, 0.39, false), 2);
    assert_eq!(animation.frame_at(0, 0.81, false), 0);
    assert_eq!(animation.frame_at(0, 0.6, false), 5);
    assert_eq!(animation.frame_at(0, 0.39, true), 4);
    assert_eq!(animation.frame_at(4, 0.0, false), 0);
    assert_eq!(animation.frame_at(1, 9.0, true), 1);
    assert_eq!(animation.frame_at(6, 9.0, true), 6);
    assert_eq!(animation.frame_at(0, f64::NAN, false), 0);
}

#[test]
fn gotcha_11_sequences_with_gaps_play_what_they_have() {
    let textures = named(&["+0gap", "+2gap", "+#odd", "+", "+b_only", "-0not"]);
    let mut warnings = Warnings::new();
    let animation = Animation::new(&textures, &mut warnings);
    assert_eq!(animation.sequence(0).unwrap().primary, [0, 1]);
    assert_eq!(animation.sequence(2), None);
    assert_eq!(animation.frame_at(3, 5.0, false), 3);
    assert_eq!(animation.frame_at(4, 5.0, false), 4);
    // The gap, the odd letter, no letter, and an alternate set that begins with b.
    assert_eq!(warnings.count(WarningKind::TextureAnimation), 4);
}

fn wad(magic: &[u8; 4], entries: &[(&str, u8, u8, Vec<u8>)]) -> Vec<u8> {
    let mut out = magic.to_vec();
    let size: usize = entries.iter().map(|e| e.3.len()).sum();
    out.extend((entries.len() as i32).to_le_bytes());
    out.extend((12 + size as i32).to_le_bytes());
    for e in entries {
        out.extend(&e.3);
    }
    let mut at = 12;
    for (name, kind, compression, data) in entries {
        for v in [at, data.len() as i32, data.len() as i32] {
            out.extend(v.to_le_bytes());
        }
        out.extend([*kind, *compression, 0, 0]);
        out.extend(name16(name));
        at += data.len() as i32;
    }
    out
}

fn miptex(name: &str, size: u32, palette: bool) -> Vec<u8> {
    let mut out = name16(name).to_vec();
    for v in [size, size, 40, 0, 0, 0] {
        out.extend(v.to_le_bytes());
    }
    out.resize(40 + (size * size / 64 * 85) as usize, 7);
    if palette {
        out.extend(256_u16.to_le_bytes());
        out.extend((0..768).map(|i| (i / 3) as u8 ^ 0xff));
    }
    out
}

#[test]
fn wads_give_their_textures() {
    let limits = Limits::default();
    let entries = [
        ("Wall", 68, 0, miptex("Wall", 16, false)),
        ("packed", 68, 1, vec![1, 2, 3]),
        (
            "pic",
            66,
            0,
            [2_i32, 1]
                .iter()
                .flat_map(|v| v.to_le_bytes())
                .chain([9, 8])
                .collect(),
        ),
    ];
    let file = wad(b"WAD2", &entries);
    let mut warnings = Warnings::new();
    let wad2 = Wad::parse(&file, &limits, &mut warnings).unwrap();
    assert_eq!(warnings.count(WarningKind::ArchiveEntry), 1, "compressed");
    let texture = wad2.texture(&file, "WALL", &limits).unwrap().unwrap();
    assert_eq!((texture.width, texture.pixels.len()), (16, 256));
    assert!(texture.palette.is_none());
    let pic = wad2.find("pic").unwrap();
    let pic = wad2
        .read_picture(&file, pic, &limits, &mut warnings)
        .unwrap();
    assert_eq!((pic.width, pic.height, pic.pixels), (2, 1, vec![9, 8]));

    let entries = [("own", 67, 0, miptex("own", 32, true))];
    let file = wad(b"WAD3", &entries);
    let wad3 = Wad::parse(&file, &limits, &mut warnings).unwrap();
    assert_eq!(wad3.kind, WadKind::Wad3);
    let texture = wad3.texture(&file, "own", &limits).unwrap().unwrap();
    assert_eq!(texture.palette.unwrap().rgb(1), [254; 3]);
}

#[test]
fn palettes_and_pictures_say_what_they_lack() {
    assert!(Palette::parse(&[0; 767]).is_err());
    let bytes: Vec<u8> = (0..770).map(|i| i as u8).collect();
    assert_eq!(Palette::parse(&bytes).unwrap().rgb(2), [6, 7, 8]);
    assert!(Colormap::parse(&[0; 100]).is_err());
    let colormap = Colormap::parse(&[5; 16_385]).unwrap();
    assert_eq!(colormap.shade(99, 3), 5);
    let limits = Limits::default();
    let mut warnings = Warnings::new();
    for (w, h) in [(0, 5), (5, 0), (-1, 5), (100, 100)] {
        let data: Vec<u8> = [w, h].iter().flat_map(|v: &i32| v.to_le_bytes()).collect();
        assert!(Picture::parse(&data, &limits, &mut warnings).is_err());
    }
}
