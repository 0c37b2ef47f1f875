//! The eye, and how it looks around and flies.

use glam::{EulerRot, Mat3, Vec3};
use scene::Camera;

/// Where the eye is and looks. Angles as in [`Camera`], in degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eye {
    /// World space.
    pub position: Vec3,
    /// Positive looks down; -90 to 90.
    pub pitch: f32,
    /// About +Z; -180 to 180.
    pub yaw: f32,
    /// Positive tilts the head to the right.
    pub roll: f32,
}

/// What hands want at a moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Controls {
    /// -1 backwards to 1 forwards.
    pub forward: f32,
    /// -1 to the left to 1 to the right.
    pub right: f32,
    /// -1 down to 1 up; when walking, more than 0 jumps.
    pub up: f32,
    /// Whether to hurry.
    pub fast: bool,
}

/// Degrees by which the view turns for each count of a mouse: the engine's `m_yaw` of 0.022 at its
/// default `sensitivity` of 3.
pub const DEGREES_PER_COUNT: f32 = 0.066;

/// Times by which hurrying is faster.
pub const HURRY: f32 = 4.0;

/// Units per second of the slowest and the fastest flight, and at first: a running player's.
pub const SPEEDS: [f32; 3] = [10.0, 8000.0, 320.0];

/// How fast flight takes up speed and loses it, per second: a few frames, so that a touch of a key is a
/// small step.
const SNAP: f32 = 12.0;

/// Slower than this is standing still, in units per second.
const STILL: f32 = 1.0;

impl Eye {
    /// A camera's.
    #[must_use]
    pub fn of(camera: &Camera) -> Self {
        Self {
            position: camera.position,
            pitch: camera.pitch_deg,
            yaw: camera.yaw_deg,
            roll: camera.roll_deg,
        }
    }

    /// The six numbers of `--camera`.
    #[must_use]
    pub fn pose(&self) -> [f32; 6] {
        let [x, y, z] = self.position.to_array();
        [x, y, z, self.pitch, self.yaw, self.roll]
    }

    /// The eye that six numbers describe; `None` if one is not finite.
    #[must_use]
    pub fn from_pose([x, y, z, pitch, yaw, roll]: [f32; 6]) -> Option<Self> {
        let all = [x, y, z, pitch, yaw, roll];
        all.iter().all(|v| v.is_finite()).then_some(Self {
            position: Vec3::new(x, y, z),
            pitch,
            yaw,
            roll,
        })
    }

    /// Turned by counts of a mouse to the right and down. The head is straightened.
    #[must_use]
    pub fn turned(mut self, [right, down]: [f32; 2]) -> Self {
        if right == 0.0 && down == 0.0 {
            return self;
        }
        self.yaw = wrapped(self.yaw - right * DEGREES_PER_COUNT);
        self.pitch = (self.pitch + down * DEGREES_PER_COUNT).clamp(-90.0, 90.0);
        self.roll = 0.0;
        self
    }

    /// Unit vectors forward, to the right and up.
    #[must_use]
    pub fn axes(&self) -> [Vec3; 3] {
        let [pitch, yaw, roll] = [self.pitch, self.yaw, self.roll].map(f32::to_radians);
        let axes = Mat3::from_euler(EulerRot::ZYX, yaw, pitch, roll);
        [axes * Vec3::X, axes * Vec3::NEG_Y, axes * Vec3::Z]
    }
}

/// An angle within -180 to 180.
fn wrapped(degrees: f32) -> f32 {
    (degrees + 180.0).rem_euclid(360.0) - 180.0
}

/// Seconds that a journey takes, however far it is.
pub const JOURNEY: f32 = 0.6;

/// The eye on its way to a place that was chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Journey {
    from: Eye,
    to: Eye,
    seconds: f32,
}

impl Journey {
    /// Sets out.
    #[must_use]
    pub fn new(from: Eye, to: Eye) -> Self {
        Self {
            from,
            to,
            seconds: 0.0,
        }
    }

    /// Where the eye is so many seconds later, and whether it has arrived. It leaves and arrives slowly, and
    /// turns the shorter way.
    pub fn pass(&mut self, seconds: f32) -> (Eye, bool) {
        self.seconds += seconds;
        let t = self.seconds / JOURNEY;
        if t >= 1.0 {
            return (self.to, true);
        }
        let share = t * t * (3.0 - 2.0 * t);
        let Self { from, to, .. } = self;
        let turned = |a: f32, b: f32| wrapped(a + wrapped(b - a) * share);
        let eye = Eye {
            position: from.position.lerp(to.position, share),
            pitch: from.pitch + (to.pitch - from.pitch) * share,
            yaw: turned(from.yaw, to.yaw),
            roll: turned(from.roll, to.roll),
        };
        (eye, false)
    }
}

/// Free flight through everything.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flight {
    /// Units per second at full speed.
    pub speed: f32,
    velocity: Vec3,
}

impl Default for Flight {
    fn default() -> Self {
        Self {
            speed: SPEEDS[2],
            velocity: Vec3::ZERO,
        }
    }
}

impl Flight {
    /// Faster by so many notches of a wheel, or slower.
    pub fn turn_wheel(&mut self, notches: f32) {
        let [least, most, _] = SPEEDS;
        self.speed = (self.speed * 1.25f32.powf(notches)).clamp(least, most);
    }

    /// Comes to rest at once.
    pub fn stop(&mut self) {
        self.velocity = Vec3::ZERO;
    }

    /// Moves the eye for so many seconds.
    pub fn fly(&mut self, eye: &mut Eye, controls: &Controls, seconds: f32) {
        let [forward, right, _] = eye.axes();
        let wish = forward * controls.forward + right * controls.right + Vec3::Z * controls.up;
        let speed = self.speed * if controls.fast { HURRY } else { 1.0 };
        let wish = wish.clamp_length_max(1.0) * speed;
        // The exact answer to v' = SNAP (wish - v), so that frame rates make no difference.
        let fade = (-SNAP * seconds).exp();
        let path = wish * seconds + (self.velocity - wish) * ((1.0 - fade) / SNAP);
        self.velocity = wish + (self.velocity - wish) * fade;
        if wish == Vec3::ZERO && self.velocity.length() < STILL {
            self.velocity = Vec3::ZERO;
            return;
        }
        eye.position += path;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const START: Eye = Eye {
        position: Vec3::ZERO,
        pitch: 0.0,
        yaw: 0.0,
        roll: 0.0,
    };

    #[test]
    fn the_axes_are_those_of_the_camera() {
        let eye = Eye {
            pitch: 30.0,
            yaw: 45.0,
            roll: 10.0,
            ..START
        };
        let camera = Camera {
            name: String::new(),
            position: Vec3::ZERO,
            pitch_deg: 30.0,
            yaw_deg: 45.0,
            roll_deg: 10.0,
            fov_deg: 90.0,
            lens: None,
        };
        assert_eq!(Eye::of(&camera), eye);
        let basis = camera.view_basis(4, 3);
        for (axis, expected) in (eye.axes().into_iter()).zip([basis.forward, basis.right, basis.up])
        {
            let expected = expected.normalize().as_vec3();
            assert!((axis - expected).length() < 1e-6, "{axis}, not {expected}");
        }
    }

    #[test]
    fn a_mouse_turns_as_in_quake_and_never_over_the_top() {
        let eye = START.turned([100.0, -50.0]);
        assert!((eye.yaw + 6.6).abs() < 1e-4 && (eye.pitch + 3.3).abs() < 1e-4);
        assert_eq!(START.turned([0.0, 1e6]).pitch, 90.0);
        let round = START.turned([-360.0 / DEGREES_PER_COUNT - 1000.0, 0.0]).yaw;
        assert!((round - 66.0).abs() < 1e-2, "{round}");
        // Not touched, a tilted head stays.
        let tilted = Eye { roll: 5.0, ..START };
        assert_eq!(tilted.turned([0.0, 0.0]), tilted);
        assert_eq!(tilted.turned([1.0, 0.0]).roll, 0.0);
        assert_eq!(Eye::from_pose(eye.pose()), Some(eye));
        assert_eq!(Eye::from_pose([f32::NAN; 6]), None);
    }

    #[test]
    fn flight_does_not_depend_on_the_frame_rate_and_comes_to_rest() {
        let forward = Controls {
            forward: 1.0,
            ..Controls::default()
        };
        let path = |frames: u32| {
            let (mut eye, mut flight) = (START, Flight::default());
            for _ in 0..frames {
                flight.fly(&mut eye, &forward, 1.0 / frames as f32);
            }
            for _ in 0..2 * frames {
                flight.fly(&mut eye, &Controls::default(), 1.0 / frames as f32);
            }
            let rest = eye;
            flight.fly(&mut eye, &Controls::default(), 0.1);
            assert_eq!(eye, rest, "at rest");
            eye.position
        };
        let (slow, fast) = (path(10), path(200));
        // Speed that is left when it counts as rest is not flown off.
        assert!((slow - fast).length() < 0.5, "{slow} {fast}");
        assert!((slow.x - 320.0).abs() < 0.5 && slow.y == 0.0, "{slow}");
    }

    #[test]
    fn a_journey_leaves_and_arrives_slowly_and_turns_the_shorter_way() {
        let from = Eye {
            yaw: 170.0,
            ..START
        };
        let to = Eye {
            position: Vec3::new(100.0, -200.0, 40.0),
            pitch: -20.0,
            yaw: -150.0,
            roll: 0.0,
        };
        let mut journey = Journey::new(from, to);
        let eyes: Vec<Eye> = (0..60).map(|_| journey.pass(JOURNEY / 60.5).0).collect();
        let steps: Vec<f32> = (eyes.windows(2))
            .map(|e| e[0].position.distance(e[1].position))
            .collect();
        assert!(
            steps[0] < 0.2 * steps[29] && steps[58] < 0.2 * steps[29],
            "{steps:?}"
        );
        assert!(
            eyes.iter().all(|e| e.yaw.abs() >= 150.0),
            "40 degrees, not 320"
        );
        assert_eq!(journey.pass(0.1), (to, true), "exactly there");
    }

    #[test]
    fn the_wheel_stays_within_its_speeds() {
        let mut flight = Flight::default();
        flight.turn_wheel(2.0);
        assert!((flight.speed - 500.0).abs() < 1e-3);
        flight.turn_wheel(1e4);
        assert_eq!(flight.speed, SPEEDS[1]);
        flight.turn_wheel(-1e4);
        assert_eq!(flight.speed, SPEEDS[0]);
    }
}
