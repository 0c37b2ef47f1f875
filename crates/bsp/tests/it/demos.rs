//! Demos: the protocol's bytes by hand, demos written in every protocol, damage, and real ones.

use std::collections::BTreeMap;

use bsp::dem::{
    BeamKind, Demo, EntityState, Message, PointEffect, Summary, TempEntity, entity_flag, flag,
};
use bsp::{ErrorKind, FileKind, Limits, WarningKind, Warnings, sniff};
use mapc::demo::{Client, DemoWriter, Dialect, Entity};

use crate::data;

/// A demo of one block that begins a level of a protocol and then says `message`.
fn one_block(protocol: &[u8], message: &[u8]) -> Vec<u8> {
    let mut body = vec![11];
    body.extend(protocol);
    body.extend(b"\x01\0title\0maps/a.bsp\0b\0\0\0");
    body.extend(message);
    file(&[&body])
}

fn file(blocks: &[&[u8]]) -> Vec<u8> {
    let mut out = b"-1\n".to_vec();
    for body in blocks {
        out.extend((body.len() as i32).to_le_bytes());
        out.extend([0; 12]);
        out.extend(*body);
    }
    out
}

const P15: &[u8] = &[15, 0, 0, 0];
const P666: &[u8] = &[0x9a, 2, 0, 0];

/// Everything after the level's beginning, and what was odd.
fn messages<'a>(demo: &'a Demo<'a>) -> (Vec<Message<'a>>, Warnings) {
    let mut warnings = Warnings::new();
    let mut found = Vec::new();
    let mut player = demo.player();
    while player
        .next_block(&mut warnings, |message| found.push(message))
        .is_some()
    {}
    found.retain(|m| !matches!(m, Message::ServerInfo(_)));
    (found, warnings)
}

#[track_caller]
fn only(protocol: &[u8], message: &[u8]) -> String {
    let bytes = one_block(protocol, message);
    let demo = Demo::parse(&bytes, &Limits::default(), &mut Warnings::new()).unwrap();
    let (found, warnings) = messages(&demo);
    assert!(warnings.is_empty(), "{:?}", warnings.iter().next());
    let [one] = found.as_slice() else {
        panic!("{found:?}");
    };
    format!("{one:?}")
}

#[test]
fn bytes_mean_what_the_protocol_says() {
    let state = EntityState {
        origin: [2.0, 0.0, 0.0],
        model: 3,
        ..EntityState::default()
    };
    let update = only(P15, &[0x83, 4, 5, 3, 0x10, 0]);
    let expected = format!("number: 5, state: {state:?}, lerp_finish: None");
    assert!(update.contains(&expected), "{update}");

    let update = only(P666, &[0x81, 0x80, 1, 7, 0x80]);
    let half = EntityState {
        alpha: 0x80,
        ..EntityState::default()
    };
    assert_eq!(half.opacity(), 0.5);
    assert!(update.contains(&format!("number: 7, state: {half:?}")));
    // Nehahra: the same bit of protocol 15 has two numbers, or three.
    let mut nehahra = vec![0x81, 0x80, 7];
    nehahra.extend(2f32.to_le_bytes().into_iter().chain(0.5f32.to_le_bytes()));
    nehahra.extend(1f32.to_le_bytes());
    assert_eq!(only(P15, &nehahra), update);

    let client = only(P15, &[15, 0, 2, 1, 0, 0, 0, 100, 0, 25, 25, 0, 0, 0, 1]);
    for part in [
        "view_height: 22.0",
        "items: 1",
        "health: 100",
        "ammo: 25",
        "ammo_counts: [25, 0, 0, 0]",
        "active_weapon: 1",
        "on_ground: false",
    ] {
        assert!(client.contains(part), "{part} in {client}");
    }
    let explosion = TempEntity::Point {
        kind: PointEffect::Explosion,
        at: [1.0, 2.0, -1.0],
    };
    let found = only(P15, &[23, 3, 8, 0, 16, 0, 0xf8, 0xff]);
    assert_eq!(found, format!("{:?}", Message::TempEntity(explosion)));
    let particles = Message::Particles {
        at: [0.0; 3],
        direction: [1.0, -1.0, 0.0],
        count: 1024,
        colour: 0x4b,
    };
    let found = only(P15, &[18, 0, 0, 0, 0, 0, 0, 0x10, 0xf0, 0, 0xff, 0x4b]);
    assert_eq!(found, format!("{particles:?}"));
    let fog = Message::Fog {
        density: 128.0 / 255.0,
        colour: [1.0, 0.0, 0.0],
        seconds: 1.0,
    };
    let found = only(P666, &[41, 0x80, 0xff, 0, 0, 0x64, 0]);
    assert_eq!(found, format!("{fog:?}"));
}

#[test]
fn numbers_are_as_wide_as_the_flags_say() {
    let with = |flags: u32, message: &[u8]| {
        let mut protocol = 999_i32.to_le_bytes().to_vec();
        protocol.extend(flags.to_le_bytes());
        only(&protocol, message)
    };
    let turned = |degrees: f32| format!("{:?}", Message::SetAngle([degrees, 0.0, 0.0]));
    assert_eq!(with(0, &[10, 0xc0, 0, 0]), turned(-90.0));
    let short = [10, 0, 0x40, 0, 0, 0, 0];
    assert_eq!(with(flag::SHORT_ANGLE, &short), turned(90.0));
    let float = [&[10][..], &33.5f32.to_le_bytes(), &[0; 8]].concat();
    let both = flag::FLOAT_ANGLE | flag::SHORT_ANGLE;
    assert_eq!(with(both, &float), turned(33.5));

    let at = |x: f32| {
        let at = [x, 0.0, 0.0];
        format!("{:?}", Message::StaticSound { sound: 9, at })
    };
    let sound = |flags: u32, x: &[u8]| {
        let message = [&[29], x, &vec![0; 2 * x.len()], &[9, 255, 64]].concat();
        with(flags, &message)
    };
    assert_eq!(sound(0, &[0xf8, 0xff]), at(-1.0));
    assert_eq!(sound(flag::COORD_24BIT, &[1, 0, 0xff]), at(2.0));
    assert_eq!(sound(flag::INT32_COORD, &[0x10, 0, 0, 0]), at(1.0));
    let all = flag::FLOAT_COORD | flag::INT32_COORD | flag::COORD_24BIT;
    assert_eq!(sound(all, &5.25f32.to_le_bytes()), at(5.25));
}

const MODELS: [&str; 4] = ["maps/a.bsp", "*1", "progs/ogre.mdl", "progs/missile.mdl"];

/// Every way that numbers and entities are sent.
fn dialects() -> Vec<Dialect> {
    let mut all = vec![Dialect::QUAKE];
    let with = |protocol, flags, fte2| Dialect {
        protocol,
        flags,
        fte2,
    };
    all.push(with(666, 0, 0));
    for flags in (0..0x100).filter(|f| f & 0x61 == 0) {
        all.push(with(999, flags, 0));
    }
    for (flags, fte2) in [(0, 8), (0x82, 8), (0x82, 0x28), (0x14, 0x28)] {
        all.push(with(999, flags, fte2));
    }
    all.push(with(666, 0, 8));
    all
}

/// The entities of message `i` of a level: one that moves, turns and changes its frame, one that
/// jumps, one that comes and goes, and one with a large number.
fn cast(i: u16, level: u16, dialect: Dialect) -> Vec<(u16, Entity)> {
    let rich = dialect.protocol != 15;
    let x = f32::from(i);
    let mover = Entity {
        origin: [x * 4.0 - 50.0, -x, 24.0],
        // A 16th of a turn is a number in every coding.
        angles: [0.0, f32::from(i % 8) * 22.5 - 90.0, 0.0],
        model: if rich && level == 2 { 300 } else { 3 },
        frame: if rich { i * 20 } else { i },
        skin: 1,
        colormap: (i % 2) as u8,
        effects: if i.is_multiple_of(5) { 2 } else { 0 },
        alpha: if rich && i.is_multiple_of(3) { 100 } else { 0 },
        step: i.is_multiple_of(2),
        ..Entity::default()
    };
    let jumper = Entity {
        origin: [if i < 15 { 0.0 } else { 1000.0 }, 64.0, -8.0],
        model: 2,
        scale: if dialect.protocol == 999 { 20 } else { 16 },
        ..Entity::default()
    };
    let mut all = vec![(1, mover), (7, jumper)];
    if (5..12).contains(&i) || i > 20 {
        all.push((9, Entity { model: 4, ..mover }));
    }
    all.push((3000, Entity { frame: 0, ..jumper }));
    all
}

/// A message's time and entities.
type Frame = (f32, Vec<(u16, Entity)>);

/// A demo of two levels in a dialect, with what every message shows.
fn written(dialect: Dialect) -> (Vec<u8>, Vec<Frame>) {
    let mut w = DemoWriter::new(dialect, 2);
    let mut frames = Vec::new();
    for level in 1..=2 {
        w.text(8, "hello\n");
        w.server_info("Ti\u{3}tle", 4, &MODELS, &["misc/a.wav"]);
        w.set_view(1).signon(1);
        w.end_block([0.0; 3]);
        let base = Entity {
            model: 2,
            frame: 1,
            ..Entity::default()
        };
        w.baseline(7, &base);
        w.baseline(3000, &Entity { model: 300, ..base });
        w.spawn_static(&Entity {
            origin: [8.0, 16.0, 32.0],
            model: 3,
            ..base
        });
        w.signon(2);
        w.end_block([0.0; 3]);
        w.time(0.875).light_style(0, "m").stat(12, 7);
        w.set_angle([0.0, 90.0, 0.0]).client(&Client::default());
        w.signon(3);
        w.end_block([0.0; 3]);
        for i in 0..31_u16 {
            let seconds = 1.0 + f32::from(i) / 8.0;
            let entities = cast(i, level, dialect);
            w.frame(seconds, &entities);
            w.client(&Client {
                punch: [-2, 0, 1],
                velocity: [20, -20, 0],
                view_height: -8,
                armor: 200,
                weapon: if dialect.protocol == 15 { 4 } else { 260 },
                weapon_frame: if dialect.protocol == 15 { 3 } else { 259 },
                ..Client::default()
            });
            let at = [f32::from(i), 2.0, -3.0];
            match i {
                1..=5 => drop(w.effect([0, 1, 2, 3, 4][usize::from(i) - 1], at)),
                6..=9 => drop(w.effect([7, 8, 10, 11][usize::from(i) - 6], at)),
                10..=13 => {
                    let number = [5, 6, 9, 13][usize::from(i) - 10];
                    w.beam(number, 7, at, [100.0, 0.0, 0.0]);
                }
                14 => drop(w.coloured_explosion(at, 16, 0)),
                15 => drop(w.particles(at, [16, -16, 0], 20, 73)),
                16 => drop(w.damage(10, 20, at)),
                17 => drop(w.fog(25, [255, 0, 0], 100)),
                18 => drop(w.text(9, "bf\n")),
                30 => drop(w.intermission()),
                _ => {}
            }
            w.end_block([1.0, f32::from(i), 0.0]);
            frames.push((seconds, entities));
        }
    }
    w.disconnect().end_block([0.0; 3]);
    (w.finish(), frames)
}

fn as_state(e: &Entity) -> EntityState {
    EntityState {
        origin: e.origin,
        angles: e.angles,
        model: e.model,
        frame: e.frame,
        skin: u16::from(e.skin),
        colormap: e.colormap,
        effects: u32::from(e.effects),
        alpha: e.alpha,
        scale: e.scale,
        flags: if e.step { entity_flag::STEP } else { 0 },
        velocity: [0.0; 3],
    }
}

/// What each message with a time shows, from the first with an entity on.
fn shown(demo: &Demo<'_>, warnings: &mut Warnings) -> Vec<(f32, BTreeMap<u16, EntityState>)> {
    let mut frames = Vec::new();
    let mut now = BTreeMap::new();
    let mut time = 0.0;
    let mut player = demo.player();
    loop {
        let mut timed = false;
        let persist = player.entities_persist();
        let block = player.next_block(warnings, |message| match message {
            Message::ServerInfo(_) | Message::RemoveAll => now.clear(),
            Message::Time(t) => {
                (time, timed) = (t, true);
                if !persist {
                    now.clear();
                }
            }
            Message::Entity(e) => drop(now.insert(e.number, e.state)),
            Message::Remove(n) => drop(now.remove(&n)),
            _ => {}
        });
        if block.is_none() {
            return frames;
        }
        if timed && !now.is_empty() {
            frames.push((time, now.clone()));
        }
    }
}

#[test]
fn demos_of_every_protocol_read_as_they_were_written() {
    for dialect in dialects() {
        let (bytes, frames) = written(dialect);
        let mut warnings = Warnings::new();
        let demo = Demo::parse(&bytes, &Limits::default(), &mut warnings).unwrap();
        assert_eq!(demo.cd_track, 2);
        assert_eq!(sniff(&bytes), FileKind::Demo);
        let found = shown(&demo, &mut warnings);
        let first = warnings.iter().next();
        assert!(first.is_none(), "{dialect:?}: {first:?}");
        assert_eq!(found.len(), frames.len(), "{dialect:?}");
        for ((time, entities), (t, expected)) in found.iter().zip(&frames) {
            assert_eq!(time, t);
            let expected: BTreeMap<u16, EntityState> =
                expected.iter().map(|(n, e)| (*n, as_state(e))).collect();
            assert_eq!(entities, &expected, "{dialect:?} at {t}");
        }
        let (messages, _) = messages(&demo);
        let count = |like: fn(&Message<'_>) -> bool| messages.iter().filter(|m| like(m)).count();
        assert_eq!(count(|m| matches!(m, Message::TempEntity(_))), 2 * 14);
        assert_eq!(count(|m| matches!(m, Message::Intermission)), 2);
        let beams = |kind| {
            let of_kind = |m: &&Message<'_>| {
                matches!(m, Message::TempEntity(TempEntity::Beam { kind: k, entity: 7, .. })
                    if *k == kind)
            };
            messages.iter().filter(of_kind).count()
        };
        assert_eq!(beams(BeamKind::Grapple), 2);
        let client = messages.iter().rev().find_map(|m| match m {
            Message::Client(c) => Some(*c),
            _ => None,
        });
        let client = client.unwrap();
        let large = u16::from(dialect.protocol != 15);
        assert_eq!(client.punch, [-2.0, 0.0, 1.0]);
        assert_eq!(client.velocity, [320.0, -320.0, 0.0]);
        assert_eq!((client.armor, client.view_height), (200, -8.0));
        assert_eq!(client.weapon, 4 + 256 * large);
        assert_eq!(client.weapon_frame, 3 + 256 * large);
        assert_eq!(messages.last(), Some(&Message::Disconnect));

        let summary = Summary::of(&demo, &mut warnings);
        assert!(summary.disconnected);
        assert_eq!(summary.levels.len(), 2);
        let level = &summary.levels[1];
        assert_eq!(
            (level.map.as_str(), level.title.as_str()),
            ("maps/a.bsp", "Ti tle")
        );
        assert_eq!((level.models, level.sounds, level.statics), (4, 1, 1));
        assert_eq!((level.entities, level.seconds), (4, 30.0 / 8.0));
        assert_eq!(level.entities_per_second, [4, 4, 4, 4]);
        assert_eq!(level.clock, [1.0, 1.0 + 30.0 / 8.0]);
    }
}

#[test]
fn a_demo_cut_anywhere_keeps_what_comes_before() {
    let limits = Limits::default();
    for dialect in [Dialect::QUAKE, *dialects().last().unwrap()] {
        let (bytes, _) = written(dialect);
        let whole = Demo::parse(&bytes, &limits, &mut Warnings::new()).unwrap();
        let all = shown(&whole, &mut Warnings::new());
        let ends: Vec<usize> = (whole.blocks.iter())
            .map(|b| b.offset as usize + 16 + b.length as usize)
            .collect();
        for cut in 0..bytes.len() {
            let mut warnings = Warnings::new();
            let demo = match Demo::parse(&bytes[..cut], &limits, &mut warnings) {
                Ok(demo) => demo,
                Err(error) => {
                    assert!(
                        cut < 2 && error.kind() == ErrorKind::UnknownFormat,
                        "{error}"
                    );
                    continue;
                }
            };
            let kept = ends.iter().filter(|e| **e <= cut).count();
            assert_eq!(demo.blocks.len(), kept, "cut at {cut}");
            let torn = !ends.contains(&cut) && cut > 2;
            assert_eq!(
                warnings.has(WarningKind::DemoTruncated),
                torn,
                "cut at {cut}"
            );
            if cut % 7 == 0 {
                let found = shown(&demo, &mut warnings);
                assert_eq!(found, all[..found.len()], "cut at {cut}");
            }
        }
    }
}

#[test]
fn damage_in_a_block_costs_the_rest_of_that_block() {
    let limits = Limits::default();
    let start = one_block(P15, &[7, 0, 0, 0x80, 0x3f]);
    let append = |blocks: &[&[u8]]| {
        let mut bytes = start.clone();
        bytes.extend(&file(blocks)[3..]);
        bytes
    };
    let names = |bytes: &[u8]| -> (Vec<&'static str>, Warnings) {
        let demo = Demo::parse(bytes, &limits, &mut Warnings::new()).unwrap();
        let (found, warnings) = messages(&demo);
        (found.iter().map(Message::name).collect(), warnings)
    };
    let (found, warnings) = names(&append(&[&[27, 38, 28], &[40], &[23, 99], &[28, 12, 0]]));
    assert_eq!(found, ["time", "killedmonster", "bf", "foundsecret"]);
    assert_eq!(warnings.count(WarningKind::DemoBlock), 3);
    let text = warnings.iter().next().unwrap().to_string();
    let says = "message 38 is unknown, after message 27; the rest of the block is left out";
    assert!(text.contains(says), "{text}");
    let byte = start.len() + 16 + 1;
    assert!(text.contains(&format!("block 1 at byte {byte}:")), "{text}");
    // Three in a row end it.
    let (found, warnings) = names(&append(&[&[38], &[38], &[27, 38], &[28]]));
    assert_eq!(found, ["time", "killedmonster"]);
    assert_eq!(warnings.count(WarningKind::DemoBlock), 3);
    // So does a length that no block has, and a message that says so.
    let mut long = append(&[&[28]]);
    long.extend([0xff, 0xff, 0xff, 0x7f]);
    long.extend([0; 16]);
    let mut warnings = Warnings::new();
    let demo = Demo::parse(&long, &limits, &mut warnings).unwrap();
    assert_eq!(demo.blocks.len(), 2);
    let text = warnings.iter().next().unwrap().to_string();
    assert!(
        text.contains("has 2147483647 bytes, allowed are 0 to 262144"),
        "{text}"
    );
    assert_eq!(names(&append(&[&[2, 27], &[28]])).0, ["time", "disconnect"]);
    // Numbers that are none are read as 0.
    let mut nan = vec![7];
    nan.extend(f32::NAN.to_le_bytes());
    let bytes = append(&[&nan]);
    let demo = Demo::parse(&bytes, &limits, &mut Warnings::new()).unwrap();
    let (found, warnings) = messages(&demo);
    assert_eq!(found.last(), Some(&Message::Time(0.0)));
    assert_eq!(warnings.count(WarningKind::DemoValue), 1);
}

#[test]
fn recordings_of_other_kinds_are_refused_by_name() {
    let limits = Limits::default();
    let error = |bytes: &[u8]| Demo::parse(bytes, &limits, &mut Warnings::new()).unwrap_err();
    let darkplaces = one_block(&3504_i32.to_le_bytes(), &[]);
    let e = error(&darkplaces);
    assert_eq!(e.kind(), ErrorKind::UnsupportedFormat);
    let says = "demo: found the unsupported protocol 3504 of DarkPlaces, allowed is 15, 666 or 999";
    assert_eq!(e.to_string(), says);
    let fte = one_block(b"FTEX\x00\x80\x00\x00\x0f\x00\x00\x00", &[]);
    assert!(
        error(&fte)
            .to_string()
            .contains("extensions 0x8000 and 0x0")
    );
    assert!(
        error(b"\x1f\x8b\x08\x00")
            .to_string()
            .contains("compressed")
    );
    assert!(
        error(b"hello, world, this is text")
            .to_string()
            .contains("CD track")
    );
    // A later level in such a protocol ends the demo there.
    let mut bytes = one_block(P15, &[27]);
    bytes.extend(&darkplaces[3..]);
    let demo = Demo::parse(&bytes, &limits, &mut Warnings::new()).unwrap();
    let (found, warnings) = messages(&demo);
    assert_eq!(found, [Message::KilledMonster]);
    assert!(warnings.iter().any(|w| w.to_string() == says));
}

#[test]
fn every_real_demo_reads_to_its_last_byte() {
    let Some(dir) = data::dir("every_real_demo_reads_to_its_last_byte") else {
        return;
    };
    let limits = Limits::default();
    let (mut read, mut refused) = (0, 0);
    for (name, file) in data::everything(&dir) {
        let mut warnings = Warnings::new();
        if name.ends_with(".qwd") || name.ends_with(".mvd") {
            assert_eq!(sniff(&file), FileKind::DemoQuakeWorld, "{name}");
            let error = Demo::parse(&file, &limits, &mut warnings).unwrap_err();
            assert!(error.to_string().contains("QuakeWorld"), "{name}: {error}");
            refused += 1;
        }
        if !name.ends_with(".dem") {
            continue;
        }
        if name.contains("unsupported") {
            let error = Demo::parse(&file, &limits, &mut warnings).unwrap_err();
            assert!(
                error.to_string().contains("protocol 3504"),
                "{name}: {error}"
            );
            refused += 1;
            continue;
        }
        let demo = Demo::parse(&file, &limits, &mut warnings).unwrap();
        let summary = Summary::of(&demo, &mut warnings);
        let first = warnings.iter().next();
        assert!(first.is_none(), "{name}: {first:?}");
        let last = demo.blocks.last().unwrap();
        assert_eq!(
            last.offset as usize + 16 + last.length as usize,
            file.len(),
            "{name}"
        );
        assert!(
            summary.seconds() > 5.0 && !summary.levels.is_empty(),
            "{name}"
        );
        let two = name.contains("restart") || name.contains("_to_");
        assert_eq!(summary.levels.len(), 1 + usize::from(two), "{name}");
        read += 1;
    }
    assert!(read >= 18 && refused == 3, "{read} read, {refused} refused");
}
