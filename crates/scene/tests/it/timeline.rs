//! Demos as functions of time: equal however a moment is reached, and as the engine plays them.

use crate::common;
use bsp::dem::{Demo, Message, Summary};
use bsp::{Limits, Warnings};
use glam::Vec3;
use mapc::demo::{Client, DemoWriter, Dialect, Entity};
use scene::timeline::{EventKind, LightKind, Options, State, Timeline, Unseen};

/// Reads a demo, with the flags that the game's own models have.
fn timeline(bytes: &[u8]) -> Timeline {
    let mut warnings = Warnings::new();
    let demo = Demo::parse(bytes, &Limits::default(), &mut warnings).unwrap();
    let timeline = Timeline::new(&demo, &|_| None, &mut warnings);
    assert!(warnings.is_empty(), "{:?}", warnings.iter().next());
    timeline
}

fn at(timeline: &Timeline, t: f64) -> State {
    timeline.state_at(t, &Options::default()).unwrap()
}

const MODELS: [&str; 6] = [
    "maps/a.bsp",
    "*1",
    "progs/ogre.mdl",
    "progs/missile.mdl",
    "progs/flame.mdl",
    "progs/v_rock.mdl",
];
/// What of these models entities show, as numbers of the list.
const DOOR: u16 = 2;
const OGRE: u16 = 3;
const MISSILE: u16 = 4;
const FLAME: u16 = 5;
const WEAPON: u16 = 6;

/// Begins a level whose first message is at 10 seconds.
fn begin(dialect: Dialect) -> DemoWriter {
    let mut w = DemoWriter::new(dialect, -1);
    level(&mut w);
    w
}

fn level(w: &mut DemoWriter) {
    w.server_info("title", 1, &MODELS, &[])
        .set_view(1)
        .signon(1);
    w.end_block([0.0; 3]);
    let door = Entity {
        model: DOOR,
        origin: [1.0, 2.0, 3.0],
        ..Entity::default()
    };
    w.baseline(50, &door).spawn_static(&Entity {
        model: FLAME,
        ..Entity::default()
    });
    w.light_style(0, "m").light_style(5, "az").signon(2);
    w.end_block([0.0; 3]);
    w.signon(3);
    w.end_block([0.0; 3]);
}

fn player(x: f32) -> (u16, Entity) {
    let player = Entity {
        origin: [x, 0.0, 24.0],
        model: OGRE,
        ..Entity::default()
    };
    (1, player)
}

/// A demo with one entity besides the player, as it is at 10.0 s, 10.1 s and so on.
fn one_entity(states: &[Option<Entity>]) -> Timeline {
    let mut w = begin(Dialect {
        protocol: 666,
        ..Dialect::QUAKE
    });
    for (i, state) in states.iter().enumerate() {
        let mut all = vec![player(0.0)];
        all.extend(state.map(|s| (9, s)));
        w.frame(10.0 + i as f32 / 10.0, &all)
            .client(&Client::default());
        w.end_block([0.0; 3]);
    }
    timeline(&w.finish())
}

fn ogre(x: f32) -> Entity {
    Entity {
        origin: [x, 0.0, 0.0],
        model: OGRE,
        ..Entity::default()
    }
}

fn entity(state: &State) -> scene::timeline::Entity {
    *state.entities.iter().find(|e| e.number == 9).unwrap()
}

#[track_caller]
fn near(a: f32, b: f32) {
    assert!((a - b).abs() < 1e-3, "{a} is not {b}");
}

#[test]
fn entities_move_from_message_to_message_and_jump_when_it_is_far() {
    let turned = |x: f32, yaw: f32| Entity {
        angles: [0.0, yaw, 0.0],
        ..ogre(x)
    };
    let t = one_entity(&[
        Some(turned(0.0, -11.25)),
        Some(turned(100.0, 11.25)),
        Some(turned(201.0, 11.25)),
        None,
        Some(ogre(50.0)),
    ]);
    near(t.duration() as f32, 0.4);
    let x = |time: f64| entity(&at(&t, time)).origin.x;
    near(x(0.0), 0.0);
    near(x(0.05), 50.0);
    near(entity(&at(&t, 0.05)).angles.y, 0.0);
    near(x(0.1), 100.0);
    // 101 units are a jump, at once and with no motion before it.
    near(x(0.101), 201.0);
    near(entity(&at(&t, 0.15)).since as f32, 0.1);
    assert!(at(&t, 0.25).entities.len() == 1);
    near(x(0.31), 50.0);
}

#[test]
fn monsters_step_from_where_they_are_and_poses_blend() {
    let step = |x: f32, frame: u16, finish: Option<u8>| {
        Some(Entity {
            step: true,
            frame,
            lerp_finish: finish,
            ..ogre(x)
        })
    };
    let t = one_entity(&[
        step(0.0, 1, None),
        step(10.0, 2, None),
        step(10.0, 2, None),
        // Done half a second after the message's own time, and interrupted on the way.
        step(20.0, 3, Some(128)),
        step(60.0, 4, None),
    ]);
    let e = |time: f64| entity(&at(&t, time));
    near(e(0.05).origin.x, 5.0);
    assert_eq!((e(0.05).frame.from, e(0.05).frame.to), (1, 2));
    near(e(0.05).frame.fraction, 0.5);
    near(e(0.15).origin.x, 10.0);
    assert_eq!(e(0.15).frame.from, 2);
    let way = 0.1 + 128.0 / 255.0;
    near(e(0.3).origin.x, 10.0 + 10.0 * 0.1 / way);
    near(e(0.3).frame.fraction, 0.1 / way);
    // From there to 60 in a tenth of a second.
    let from = e(0.3).origin.x;
    near(e(0.35).origin.x, (from + 60.0) / 2.0);
    assert_eq!((e(0.35).frame.from, e(0.35).frame.to), (3, 4));

    // A flash is not blended, nor the frame after it; nor another model, nor one long unseen.
    let shot = |frame: u16, effects: u8, model: u16| {
        Some(Entity {
            frame,
            effects,
            model,
            ..ogre(0.0)
        })
    };
    let t = one_entity(&[
        shot(1, 0, OGRE),
        shot(2, 2, OGRE),
        shot(3, 0, OGRE),
        shot(4, 0, OGRE),
        shot(5, 0, MISSILE),
        None,
        None,
        None,
        shot(7, 0, MISSILE),
        shot(8, 0, FLAME),
        shot(9, 0, FLAME),
    ]);
    let from = |time: f64| {
        let frame = entity(&at(&t, time)).frame;
        (frame.from, frame.to)
    };
    assert_eq!(from(0.05), (2, 2));
    assert_eq!(from(0.15), (3, 3));
    assert_eq!(from(0.25), (3, 4));
    assert_eq!(from(0.35), (5, 5));
    assert_eq!(from(0.75), (7, 7));
    // Flames are never blended.
    assert_eq!(from(0.95), (9, 9));
}

#[test]
fn entities_out_of_sight_stay_if_asked_to() {
    let door = |z: f32| Entity {
        origin: [1.0, 2.0, z],
        model: DOOR,
        ..Entity::default()
    };
    let mut w = begin(Dialect::QUAKE);
    for i in 0..6_u16 {
        let mut all = vec![player(0.0)];
        if i < 3 {
            all.push((9, ogre(f32::from(i))));
            all.push((
                10,
                Entity {
                    model: MISSILE,
                    ..ogre(0.0)
                },
            ));
        }
        if (1..=2).contains(&i) {
            all.push((50, door(10.0 * f32::from(i))));
        }
        w.frame(10.0 + f32::from(i) / 10.0, &all)
            .client(&Client::default());
        w.end_block([0.0; 3]);
    }
    let t = timeline(&w.finish());
    let numbers = |time: f64, unseen: Unseen| -> Vec<(u16, f32)> {
        let options = Options {
            unseen,
            ..Options::default()
        };
        let state = t.state_at(time, &options).unwrap();
        state
            .entities
            .iter()
            .map(|e| (e.number, e.origin.z))
            .collect()
    };
    assert_eq!(numbers(0.5, Unseen::Hidden), [(1, 24.0)]);
    assert_eq!(numbers(0.0, Unseen::Brushes).last(), Some(&(50, 3.0)));
    assert_eq!(numbers(0.5, Unseen::Brushes), [(1, 24.0), (50, 20.0)]);
    assert_eq!(numbers(0.5, Unseen::All), [(1, 24.0), (9, 0.0), (50, 20.0)]);
}

#[test]
fn lights_beams_and_particles_come_and_go() {
    let mut w = begin(Dialect::QUAKE);
    for i in 0..20_u16 {
        let x = f32::from(i) * 30.0;
        let missile = Entity {
            model: MISSILE,
            effects: if i == 3 { 2 } else { 0 },
            ..ogre(x)
        };
        let all = [player(0.0), (9, missile)];
        w.frame(10.0 + f32::from(i) / 10.0, &all)
            .client(&Client::default());
        match i {
            5 => drop(w.effect(3, [8.0, 0.0, 0.0])),
            10 => drop(w.beam(5, 1, [0.0; 3], [95.0, 0.0, 24.0])),
            11 => drop(w.beam(6, 1, [0.0; 3], [0.0, 95.0, 24.0])),
            _ => {}
        }
        w.end_block([0.0; 3]);
    }
    let t = timeline(&w.finish());
    // The rocket's own light, and that of the explosion half a second long.
    let reach = |time: f64| {
        let lights = at(&t, time).lights;
        lights
            .iter()
            .find(|l| l.kind == LightKind::Explosion)
            .map(|l| l.reach)
    };
    assert_eq!(reach(0.4), None);
    near(reach(0.45).unwrap(), 335.0);
    assert_eq!(reach(0.91), None);
    assert!(
        at(&t, 0.45)
            .lights
            .iter()
            .any(|l| l.kind == LightKind::Rocket)
    );
    // The newest beam of an entity; the player's begins where the player is.
    assert!(at(&t, 0.9).beams.is_empty());
    let beam = at(&t, 0.95).beams[0];
    assert_eq!((beam.start, beam.parts().count()), (Vec3::Z * 24.0, 4));
    assert_eq!(at(&t, 1.05).beams.len(), 1);
    assert_eq!(at(&t, 1.05).beams[0].end.y, 95.0);
    assert!(at(&t, 1.21).beams.is_empty());
    // The trail has a particle every three units of the last 1.2 seconds at most, in the colours of
    // fire; where it was born does not depend on when one looks.
    let trail = |time: f64| -> Vec<Vec3> {
        let state = at(&t, time);
        let fire = [0x6d, 0x6b, 6, 5, 4, 3];
        let found = state.particles.iter().filter(|p| fire.contains(&p.colour));
        found.map(|p| p.at).collect()
    };
    assert!(trail(0.0).is_empty());
    let early = trail(0.1).len();
    assert!((10..=11).contains(&early), "{early}");
    assert!((50..=121).contains(&trail(1.8).len()));
    let [a, b] = [1.85, 1.9].map(trail);
    let same = a
        .iter()
        .filter(|p| b.iter().any(|q| q.truncate() == p.truncate()));
    assert!(same.count() > 40);
    // Every one is near the rocket's way.
    assert!(
        b.iter()
            .all(|p| p.y.abs() <= 3.0 && p.x <= 30.0 * 19.0 + 3.0)
    );
}

#[test]
fn the_eye_follows_the_player() {
    let mut w = begin(Dialect::QUAKE);
    for i in 0..40_u16 {
        let (n, mut p) = player(f32::from(i));
        // A step of 16 units at message 10.
        p.origin[2] = if i < 10 { 24.0 } else { 40.0 };
        w.frame(10.0 + f32::from(i) / 32.0, &[(n, p)]);
        w.client(&Client {
            weapon: WEAPON,
            weapon_frame: i / 20,
            items: if i == 39 { 1 << 22 } else { 0 },
            punch: [if i == 36 { -4 } else { 0 }, 0, 0],
            view_height: if i == 34 { 60 } else { 22 },
            ..Client::default()
        });
        match i {
            15 => drop(w.set_angle([0.0, 90.0, 0.0])),
            20 => drop(w.damage(0, 30, [1000.0, 0.0, 46.0])),
            38 => drop(w.intermission()),
            _ => {}
        }
        w.end_block(if i < 15 {
            [0.0, 350.0, 0.0]
        } else {
            [10.0, 90.0, 0.0]
        });
    }
    let t = timeline(&w.finish());
    let m = |i: f64| i / 32.0;
    let view = |time: f64| at(&t, time).view;
    let off = 1.0 / 32.0;
    near(view(m(3.5)).eye.x, 3.5 + off);
    near(view(m(3.0)).eye.z, 46.0 + off);
    near(view(m(3.5)).angles.y, 350.0);
    // 16 up, of which 80 units per second were made up for.
    near(view(m(10.0)).eye.z, 62.0 - 12.0 + off);
    near(view(m(11.0)).eye.z, 62.0 - 12.0 + 2.5 + off);
    near(view(m(16.0)).eye.z, 62.0 + off);
    // No eye is further above its owner, whatever the server says.
    near(view(m(34.0)).eye.z, 40.0 + 30.0 + off);
    // The view is set, not turned.
    near(view(m(14.5)).angles.y, 90.0);
    near(view(m(14.5)).since as f32, m(14.0) as f32);
    // Kicked back by a hurt from ahead, and by the own weapon.
    assert!(at(&t, m(19.01)).tint.hurt[3] > 0.17);
    near(at(&t, m(19.0) + 0.3).tint.hurt[3], 0.0);
    near(view(m(36.0)).angles.x, 10.0 - 4.0);
    let weapon = at(&t, m(19.5)).view_model.unwrap();
    assert_eq!(
        (weapon.model, weapon.frame.from, weapon.frame.to),
        (WEAPON, 0, 1)
    );
    near(weapon.origin.z, 62.0);
    near(weapon.angles.x, -view(m(19.5)).angles.x);
    assert!(at(&t, m(37.9)).tint.power[3] == 0.0);
    // After the level the entity itself is the camera.
    let last = at(&t, m(39.0));
    assert_eq!((last.view.intermission, last.view_model), (1, None));
    near(last.view.eye.z, 40.0);
    assert_eq!(last.tint.power[3], 0.0);
    // Styles go by the server's clock, which is at 10 seconds here: the 100th letter of two.
    near(at(&t, 0.0).styles[5], 0.0);
    near(at(&t, 0.15).styles[5], 25.0 * 22.0 / 256.0);
    near(at(&t, 0.15).styles[0], 264.0 / 256.0);
    near(at(&t, 0.15).styles[7], 1.0);
}

#[test]
fn levels_follow_each_other_and_gaps_are_short() {
    let mut w = begin(Dialect::QUAKE);
    let frame = |w: &mut DemoWriter, time: f32, x: f32| {
        w.frame(time, &[player(x)]).client(&Client::default());
        w.end_block([0.0; 3]);
    };
    frame(&mut w, 10.0, 0.0);
    frame(&mut w, 10.5, 50.0);
    // The clock stands still, is set back, and leaps.
    frame(&mut w, 10.5, 60.0);
    frame(&mut w, 3.0, 70.0);
    frame(&mut w, 100.0, 80.0);
    level(&mut w);
    frame(&mut w, 2.0, 7.0);
    frame(&mut w, 2.1, 8.0);
    let t = timeline(&w.finish());
    near(t.duration() as f32, 1.6);
    let x = |time: f64| at(&t, time).entities[0].origin.x;
    // Half a second passes at rest, but for its last tenth.
    near(x(0.3), 0.0);
    near(x(0.45), 25.0);
    near(x(0.5), 50.0);
    near(x(1.3), 70.0);
    near(x(1.45), 75.0);
    let spans: Vec<(f64, f64)> = t.levels().iter().map(|l| l.span).collect();
    assert_eq!(t.levels().len(), 2);
    near(spans[0].1 as f32, 1.5);
    assert_eq!(spans[0].1, spans[1].0);
    assert_eq!((at(&t, 1.5).level, at(&t, 1.51).level), (0, 1));
    near(x(1.55), 7.5);
    assert_eq!(at(&t, -1.0), at(&t, 0.0));
    assert_eq!(at(&t, 9.0), at(&t, t.duration()));
    // Nothing at all has no state.
    let empty = timeline(&begin(Dialect::QUAKE).finish());
    assert_eq!(empty.state_at(0.0, &Options::default()), None);
}

#[test]
fn what_happens_is_told_in_order() {
    let mut w = begin(Dialect::QUAKE);
    for i in 0..8_u16 {
        w.frame(10.0 + f32::from(i) / 10.0, &[player(0.0)]);
        let health = if (3..5).contains(&i) { -5 } else { 80 };
        w.client(&Client {
            health,
            ..Client::default()
        });
        match i {
            2 => drop(w.damage(0, 30, [1000.0, 0.0, 46.0])),
            5 => drop(w.text(9, "bf\n")),
            7 => drop(w.intermission()),
            _ => {}
        }
        w.end_block([0.0; 3]);
    }
    level(&mut w);
    w.frame(2.0, &[player(7.0)]).client(&Client::default());
    w.end_block([0.0; 3]);
    let t = timeline(&w.finish());
    let told = t.events();
    let kinds: Vec<EventKind> = told.iter().map(|e| e.kind).collect();
    let expected = [
        EventKind::Level(0),
        EventKind::Hurt,
        EventKind::Death,
        EventKind::Pickup,
        EventKind::Intermission,
        EventKind::Level(1),
    ];
    assert_eq!(kinds, expected, "{told:?}");
    assert!(told.windows(2).all(|e| e[0].time <= e[1].time));
    near(told[2].time as f32, 0.3);
    near(told[4].time as f32, 0.7);
    assert!(Timeline::default().events().is_empty());
}

/// Every demo of the test data that is read here.
fn real_demos() -> Vec<(String, Vec<u8>)> {
    let Some(dir) = common::data() else {
        return Vec::new();
    };
    let mut demos = Vec::new();
    let loose = std::fs::read_dir(dir.join("loose/dem")).unwrap();
    for path in loose.map(|e| e.unwrap().path()) {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if !name.contains("unsupported") {
            demos.push((name, std::fs::read(path).unwrap()));
        }
    }
    let search = bsp::SearchPath::builder().basedir(&dir).build().unwrap();
    for name in ["demo1.dem", "demo2.dem", "demo3.dem"] {
        demos.push((name.to_owned(), search.read(name).unwrap().bytes));
    }
    demos.sort();
    demos
}

#[test]
fn seeking_equals_playing() {
    let options = Options {
        unseen: Unseen::All,
        smooth_styles: true,
    };
    for (name, bytes) in real_demos() {
        let [sought, played] = [timeline(&bytes), timeline(&bytes)];
        let mut seed = 1_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 33) as f64 / (1u64 << 31) as f64
        };
        let duration = sought.duration();
        let mut warnings = Warnings::new();
        let demo = Demo::parse(&bytes, &Limits::default(), &mut warnings).unwrap();
        let seconds = Summary::of(&demo, &mut warnings).seconds();
        assert!(
            (duration - seconds).abs() < 1e-6,
            "{name}: {duration} is not {seconds}"
        );
        let times: Vec<f64> = (0..200).map(|_| random() * duration).collect();
        let hash = |t: &Timeline, time: f64| t.state_at(time, &options).unwrap().hash();
        let found: Vec<u64> = times.iter().map(|&time| hash(&sought, time)).collect();
        // Played forwards, ten pictures a second and those.
        let mut order: Vec<usize> = (0..times.len()).collect();
        order.sort_by(|&a, &b| times[a].total_cmp(&times[b]));
        let mut next = 0;
        let mut clock = 0.0;
        while next < order.len() {
            let wanted = times[order[next]];
            if clock < wanted {
                std::hint::black_box(hash(&played, clock));
                clock += 0.1;
                continue;
            }
            assert_eq!(
                hash(&played, wanted),
                found[order[next]],
                "{name} at {wanted}"
            );
            next += 1;
        }
        let different: std::collections::BTreeSet<u64> = found.iter().copied().collect();
        assert_eq!(
            different.len(),
            times.len(),
            "{name}: moments look the same"
        );
    }
}

/// At the time of each message a demo looks as the message says, without anything in between.
#[test]
fn at_its_own_time_a_message_is_what_is_shown() {
    for (name, bytes) in real_demos() {
        let timeline = timeline(&bytes);
        let mut warnings = Warnings::new();
        let demo = Demo::parse(&bytes, &Limits::default(), &mut warnings).unwrap();
        let mut player = demo.player();
        let (mut message, mut compared) = (0, 0);
        loop {
            let mut seen = Vec::new();
            let mut timed = false;
            let block = player.next_block(&mut warnings, |m| match m {
                Message::Time(_) => timed = true,
                Message::Entity(e) => seen.push(e),
                _ => {}
            });
            if block.is_none() {
                break;
            }
            if !timed || seen.is_empty() {
                continue;
            }
            let state = timeline
                .message_time(message)
                .map(|t| at(&timeline, t))
                .unwrap();
            if state.message == message && message % 7 == 0 {
                for e in seen.iter().filter(|e| e.state.model != 0) {
                    let shown = state.entities.iter().find(|s| s.number == e.number);
                    let shown = shown.unwrap_or_else(|| panic!("{name}: {message}: {e:?}"));
                    assert_eq!(shown.model, e.state.model, "{name}: {message}");
                    let off = (shown.origin - Vec3::from(e.state.origin)).length();
                    // Monsters may be within a step, and no step is longer than this.
                    let most = if e.state.flags & 1 != 0 { 100.0 } else { 1e-3 };
                    assert!(
                        off < most,
                        "{name}: {message}: {e:?} is at {}",
                        shown.origin
                    );
                    compared += 1;
                }
                assert!(state.entities.len() <= seen.len(), "{name}: {message}");
            }
            message += 1;
        }
        assert_eq!(message, timeline.messages(), "{name}");
        assert!(compared > 200, "{name}: {compared}");
    }
}

/// Whatever is broken in a demo, what is left of it plays, with numbers that are finite.
#[test]
fn broken_demos_play_what_is_left_of_them() {
    let mut w = begin(Dialect {
        protocol: 999,
        flags: 0x14,
        ..Dialect::QUAKE
    });
    for i in 0..30_u16 {
        let missile = Entity {
            model: MISSILE,
            effects: (i % 16) as u8,
            step: i % 3 == 0,
            ..ogre(f32::from(i) * 20.0)
        };
        let all = [player(f32::from(i)), (9, missile), (50, ogre(1.0))];
        w.frame(10.0 + f32::from(i) / 16.0, &all)
            .client(&Client::default());
        let kind = (i % 13) as u8;
        match kind {
            5 | 6 | 9 => drop(w.beam(kind, 1, [0.0; 3], [90.0; 3])),
            12 => drop(w.coloured_explosion([1.0; 3], 250, 9)),
            _ => drop(w.effect(kind, [f32::from(i); 3])),
        }
        w.damage(3, 7, [0.0; 3]).fog(9, [1, 2, 3], 50);
        w.end_block([0.0, f32::from(i), 0.0]);
    }
    let bytes = w.finish();
    let mut random = common::Random(7);
    let options = Options {
        unseen: Unseen::All,
        smooth_styles: true,
    };
    let mut played = 0;
    for _ in 0..400 {
        let mut broken = bytes.clone();
        for _ in 0..1 + (random.next() * 20.0) as usize {
            let at = 3 + (random.next() * (bytes.len() - 3) as f64) as usize;
            broken[at] = (random.next() * 256.0) as u8;
        }
        let mut warnings = Warnings::new();
        let Ok(demo) = Demo::parse(&broken, &Limits::default(), &mut warnings) else {
            continue;
        };
        let timeline = Timeline::new(&demo, &|_| None, &mut warnings);
        for i in 0..8 {
            let t = timeline.duration() * f64::from(i) / 7.0;
            let Some(state) = timeline.state_at(t, &options) else {
                continue;
            };
            let entities = state.entities.iter().flat_map(|e| [e.origin, e.angles]);
            let lights = state.lights.iter().map(|l| l.at);
            let particles = state.particles.iter().map(|p| p.at);
            let view = [state.view.eye, state.view.angles];
            let mut all = entities.chain(lights).chain(particles).chain(view);
            assert!(all.all(|p| p.is_finite()));
            assert!(state.particles.len() <= 16_384);
            played += 1;
        }
    }
    assert!(played > 2000, "{played}");
}
