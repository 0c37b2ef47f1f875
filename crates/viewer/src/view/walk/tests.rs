use super::*;
use crate::cli::Global;
use crate::level::Source;

/// Boxes that are solid for a player's origin: the box of the player is in them already.
struct Boxes {
    solid: Vec<[Vec3; 2]>,
    water_below: f32,
}

impl Ground for Boxes {
    fn trace(&self, from: Vec3, to: Vec3) -> Hit {
        let mut hit = Hit {
            fraction: 1.0,
            end: to,
            normal: Vec3::ZERO,
            stuck: false,
        };
        for [min, max] in &self.solid {
            hit.stuck |= from.cmpgt(*min).all() && from.cmplt(*max).all();
            let way = to - from;
            let (mut enter, mut leave, mut normal) = (f32::MIN, 1.0f32, Vec3::ZERO);
            for axis in 0..3 {
                let faces = [min[axis], max[axis]].map(|face| (face - from[axis]) / way[axis]);
                if way[axis] == 0.0 {
                    if from[axis] <= min[axis] || from[axis] >= max[axis] {
                        leave = f32::MIN;
                    }
                    continue;
                }
                let [near, far] = if way[axis] > 0.0 {
                    faces
                } else {
                    [faces[1], faces[0]]
                };
                if near > enter {
                    enter = near;
                    normal = Vec3::ZERO;
                    normal[axis] = -way[axis].signum();
                }
                leave = leave.min(far);
            }
            if (0.0..leave).contains(&enter) && enter < hit.fraction {
                let back = 1.0 / 32.0 / way.dot(normal).abs();
                hit.fraction = (enter - back).max(0.0);
                hit.normal = normal;
                hit.end = from + way * hit.fraction;
            }
        }
        hit
    }

    fn is_liquid(&self, point: Vec3) -> bool {
        point.z < self.water_below
    }
}

/// A plain for origins to be above, and a block on it from x = 100 on.
fn plain(block: f32) -> Boxes {
    let far = 1e4;
    Boxes {
        solid: vec![
            [Vec3::splat(-far), Vec3::new(far, far, 0.0)],
            [Vec3::new(100.0, -far, -far), Vec3::new(far, far, block)],
        ],
        water_below: f32::MIN,
    }
}

const AHEAD: Controls = Controls {
    forward: 1.0,
    right: 0.0,
    up: 0.0,
    fast: true,
};

fn eye(position: Vec3) -> Eye {
    Eye {
        position,
        pitch: 20.0,
        yaw: 0.0,
        roll: 0.0,
    }
}

/// Where a player is after `seconds`, in frames of `frame` seconds.
fn after(ground: &dyn Ground, start: Vec3, controls: Controls, seconds: f32, frame: f32) -> Walker {
    let mut eye = eye(start + Vec3::Z * VIEW_HEIGHT);
    let mut walker = Walker::at(&eye);
    for _ in 0..(seconds / frame).round() as u32 {
        assert!(walker.walk(ground, &mut eye, &controls, frame));
    }
    walker
}

#[test]
fn players_fall_and_stand() {
    let ground = plain(0.0);
    let start = Vec3::new(-500.0, 0.0, 100.0);
    let fallen = after(&ground, start, Controls::default(), 0.2, STEP);
    assert!(
        fallen.velocity.z < -140.0 && !fallen.on_ground,
        "{fallen:?}"
    );
    let landed = after(&ground, start, Controls::default(), 2.0, STEP);
    assert!(
        landed.on_ground && (0.0..0.1).contains(&landed.origin.z),
        "{landed:?}"
    );
}

#[test]
fn players_run_at_most_320_and_stop_by_friction() {
    let ground = plain(0.0);
    let start = Vec3::new(-5000.0, 0.0, 0.1);
    let running = after(&ground, start, AHEAD, 3.0, STEP);
    assert!((running.velocity.x - 320.0).abs() < 1.0, "{running:?}");
    let walking = Controls {
        fast: false,
        ..AHEAD
    };
    let walking = after(&ground, start, walking, 3.0, STEP);
    assert!((walking.velocity.x - 200.0).abs() < 1.0, "{walking:?}");
    let (mut stopping, mut eye) = (running, eye(running.origin));
    for _ in 0..72 {
        stopping.walk(&ground, &mut eye, &Controls::default(), STEP);
    }
    assert_eq!(stopping.velocity.truncate(), glam::Vec2::ZERO);
    // From 320 with friction 4: 55 units down to 100, then 100 / 8 at a steady rate.
    let way = stopping.origin.x - running.origin.x;
    assert!((55.0..75.0).contains(&way), "{way}");
}

#[test]
fn a_jump_is_as_high_as_the_engines() {
    let ground = plain(0.0);
    let jump = Controls {
        up: 1.0,
        ..Controls::default()
    };
    let mut eye = eye(Vec3::new(-500.0, 0.0, VIEW_HEIGHT + 0.05));
    let mut walker = Walker::at(&eye);
    walker.walk(&ground, &mut eye, &Controls::default(), 0.1);
    assert!(walker.on_ground);
    let highest = (0..40).fold(0.0f32, |highest, _| {
        walker.walk(&ground, &mut eye, &jump, STEP);
        highest.max(walker.origin.z)
    });
    // 270^2 / 1600 = 45.6 units, less half a step of gravity.
    assert!((42.0..46.0).contains(&highest), "{highest}");
}

#[test]
fn steps_are_climbed_and_walls_are_not() {
    let start = Vec3::new(-50.0, 0.0, 0.05);
    let up = after(&plain(16.0), start, AHEAD, 1.5, STEP);
    assert!(
        up.origin.x > 200.0 && (16.0..16.2).contains(&up.origin.z),
        "{up:?}"
    );
    let wall = after(&plain(24.0), start, AHEAD, 1.5, STEP);
    assert!(wall.origin.x < 100.0 && wall.origin.z < 0.2, "{wall:?}");
    // Along the wall, when it is met at an angle.
    let slant = Controls {
        right: 1.0,
        ..AHEAD
    };
    let along = after(&plain(24.0), start, slant, 1.5, STEP);
    assert!(
        along.origin.x < 100.0 && along.origin.y < -150.0,
        "{along:?}"
    );
}

#[test]
fn frame_rates_lead_to_the_same_place() {
    let start = Vec3::new(-50.0, 0.0, 40.0);
    let ground = plain(16.0);
    let one = after(&ground, start, AHEAD, 1.0, STEP);
    for frame in [1.0 / 240.0, 1.0 / 30.0, 0.1] {
        let other = after(&ground, start, AHEAD, 1.0, frame);
        let apart = (one.origin - other.origin).length();
        // Part of a step may be left.
        assert!(apart < 320.0 * 1.5 * STEP, "{apart} at {frame}");
    }
}

#[test]
fn swimmers_sink_and_follow_their_eyes() {
    let mut pool = plain(0.0);
    pool.water_below = 1e4;
    let start = Vec3::new(-500.0, 0.0, 500.0);
    let idle = after(&pool, start, Controls::default(), 2.0, STEP);
    assert!((-45.0..-25.0).contains(&idle.velocity.z), "{idle:?}");
    // The eyes look down by 20 degrees.
    let ahead = after(&pool, start, AHEAD, 1.0, STEP);
    assert!(
        ahead.velocity.x > 100.0 && ahead.velocity.z < -40.0,
        "{ahead:?}"
    );
}

#[test]
fn who_is_stuck_stays() {
    let ground = plain(0.0);
    let mut eye = eye(Vec3::new(0.0, 0.0, -50.0));
    let (mut walker, before) = (Walker::at(&eye), eye);
    assert!(!walker.walk(&ground, &mut eye, &AHEAD, 1.0));
    assert_eq!(eye, before);
}

#[test]
fn the_sample_level_is_walked_through_without_leaving_it() {
    let loaded = Source::new(None, &Global::default())
        .unwrap()
        .load()
        .unwrap();
    let level = &loaded.level;
    let walls = Walls::of(&level.bsp, &level.entities).expect("a hull for players");
    let scene = loaded
        .import(&scene::import::ImportOptions::default())
        .unwrap();
    let mut eye = Eye::of(&scene.cameras[0]);
    let (mut walker, start) = (Walker::at(&eye), eye);
    let mut farthest = 0.0f32;
    for i in 0..40 {
        for _ in 0..36 {
            assert!(walker.walk(&walls, &mut eye, &AHEAD, STEP), "never stuck");
        }
        let contents = level.bsp.point_contents(0, eye.position.to_array());
        assert!(contents.is_some_and(|c| c != contents::SOLID), "{eye:?}");
        farthest = farthest.max((eye.position - start.position).length());
        eye = eye.turned([if i % 3 == 0 { 700.0 } else { 0.0 }, 0.0]);
    }
    assert!(farthest > 200.0, "{farthest}");
}
