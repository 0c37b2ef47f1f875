//! A gamepad's sticks and triggers as hands: the left stick moves, the right one looks around, the triggers
//! rise and sink.

use super::fly::{Controls, DEGREES_PER_COUNT};

/// Where sticks and triggers are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pad {
    /// The left stick, -1 to 1: to the right, and down, which is towards oneself.
    pub left: [f32; 2],
    /// The right stick.
    pub right: [f32; 2],
    /// The left and the right trigger, 0 to 1.
    pub triggers: [f32; 2],
}

/// A stick within this share of its way is at rest: none comes back to its middle exactly.
const DEAD: f32 = 0.15;
/// Degrees a second that the view turns at most.
const TURN: f32 = 200.0;

/// What a stick means: nothing near its middle, and from there on little at first, so that small steps can be
/// made.
fn bent([x, y]: [f32; 2]) -> [f32; 2] {
    let length = x.hypot(y);
    if length.is_nan() || length <= DEAD {
        return [0.0; 2];
    }
    let share = (length.min(1.0) - DEAD) / (1.0 - DEAD);
    [x, y].map(|v| v / length * share * share)
}

impl Pad {
    /// What the hands want, and how far the view turns in so many seconds, in counts of a mouse to the right
    /// and down.
    #[must_use]
    pub fn hands(&self, seconds: f32) -> (Controls, [f32; 2]) {
        let [right, back] = bent(self.left);
        let [sink, rise] = self.triggers.map(|t| bent([t, 0.0])[0]);
        let controls = Controls {
            forward: -back,
            right,
            up: rise - sink,
            fast: false,
        };
        let counts = TURN / DEGREES_PER_COUNT * seconds;
        (controls, bent(self.right).map(|v| v * counts))
    }
}

/// The first gamepad of the system, once there is one.
#[derive(Default)]
pub struct Gamepad {
    now: Pad,
    #[cfg(target_os = "linux")]
    device: linux::Found,
}

impl Gamepad {
    /// Looks for one from now on, beside the frame loop. Systems that are not known have none.
    pub fn search(&mut self) {
        #[cfg(target_os = "linux")]
        self.device.search();
    }

    /// Whether one is there.
    #[must_use]
    pub fn is_there(&self) -> bool {
        #[cfg(target_os = "linux")]
        return self.device.is_there();
        #[cfg(not(target_os = "linux"))]
        false
    }

    /// Says where sticks and triggers are, in place of a gamepad.
    pub fn hold(&mut self, pad: Pad) {
        self.now = pad;
    }

    /// Where sticks and triggers are.
    pub fn poll(&mut self) -> Pad {
        #[cfg(target_os = "linux")]
        if let Some(pad) = self.device.poll() {
            self.now = pad;
        }
        self.now
    }
}

/// Linux tells of gamepads through files that whoever sits at the machine may read; no library is needed.
#[cfg(target_os = "linux")]
mod linux {
    use super::Pad;
    use evdev::{AbsoluteAxisCode as Axis, Device, KeyCode};
    use std::sync::Arc;
    use std::sync::mpsc::{Receiver, channel};
    use std::time::Duration;

    /// Between two looks for a gamepad.
    const EVERY: Duration = Duration::from_secs(2);

    #[derive(Default)]
    pub struct Found {
        device: Option<Device>,
        search: Option<Search>,
    }

    /// Where a gamepad comes from.
    struct Search {
        /// While this is held, somebody wants one.
        _wanted: Arc<()>,
        found: Receiver<Device>,
    }

    impl Found {
        pub fn search(&mut self) {
            let (sender, found) = channel();
            let wanted = Arc::new(());
            let still = Arc::downgrade(&wanted);
            std::thread::spawn(move || {
                while still.strong_count() > 0 {
                    let found = evdev::enumerate().map(|(_, d)| d).find(is_gamepad);
                    if let Some(device) = found {
                        _ = sender.send(device);
                        return;
                    }
                    std::thread::sleep(EVERY);
                }
            });
            self.search = Some(Search {
                _wanted: wanted,
                found,
            });
        }

        pub fn is_there(&self) -> bool {
            self.device.is_some()
        }

        pub fn poll(&mut self) -> Option<Pad> {
            if let Some(device) = &self.device {
                let read = read(device);
                if read.is_none() {
                    // It was unplugged: its sticks are let go, and another one is looked for.
                    self.device = None;
                    self.search();
                }
                return Some(read.unwrap_or_default());
            }
            let search = self.search.as_ref()?;
            self.device = search.found.try_recv().ok();
            None
        }
    }

    fn is_gamepad(device: &Device) -> bool {
        let has = |keys: &evdev::AttributeSetRef<KeyCode>| keys.contains(KeyCode::BTN_SOUTH);
        let sticks = [Axis::ABS_X, Axis::ABS_Y, Axis::ABS_RX, Axis::ABS_RY];
        device.supported_keys().is_some_and(has)
            && (device.supported_absolute_axes())
                .is_some_and(|axes| sticks.into_iter().all(|a| axes.contains(a)))
    }

    fn read(device: &Device) -> Option<Pad> {
        let mut pad = Pad::default();
        for (axis, info) in device.get_absinfo().ok()? {
            let share = super::share(info.value(), info.minimum(), info.maximum());
            match axis {
                Axis::ABS_X => pad.left[0] = 2.0 * share - 1.0,
                Axis::ABS_Y => pad.left[1] = 2.0 * share - 1.0,
                Axis::ABS_RX => pad.right[0] = 2.0 * share - 1.0,
                Axis::ABS_RY => pad.right[1] = 2.0 * share - 1.0,
                Axis::ABS_Z => pad.triggers[0] = share,
                Axis::ABS_RZ => pad.triggers[1] = share,
                _ => {}
            }
        }
        Some(pad)
    }
}

/// Where between its ends a value is, 0 to 1; the middle where it has no ends.
#[cfg_attr(
    not(any(test, target_os = "linux")),
    expect(dead_code, reason = "no gamepads there")
)]
fn share(value: i32, least: i32, most: i32) -> f32 {
    let way = f64::from(most) - f64::from(least);
    if way <= 0.0 {
        return 0.5;
    }
    ((f64::from(value) - f64::from(least)) / way).clamp(0.0, 1.0) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pad(value: i32) -> f32 {
        2.0 * share(value, -32768, 32767) - 1.0
    }

    #[test]
    fn sticks_rest_near_their_middle_and_begin_gently() {
        let forward = |value: i32| {
            let left = [0.0, pad(value)];
            let held = Pad {
                left,
                ..Pad::default()
            };
            held.hands(0.1).0.forward
        };
        assert_eq!(forward(4000), 0.0, "not back in its middle, and let go");
        assert_eq!(forward(-32768), 1.0);
        assert!((forward(32767) + 1.0).abs() < 1e-3);
        let half = forward(-16384);
        assert!((0.1..0.3).contains(&half), "{half}");
        // In a corner it is no faster than straight on.
        let corner = Pad {
            left: [1.0, -1.0],
            ..Pad::default()
        };
        let (controls, turned) = corner.hands(0.1);
        assert!(controls.forward.hypot(controls.right) < 1.0 + 1e-6);
        assert_eq!(turned, [0.0; 2]);
    }

    #[test]
    fn triggers_rise_and_sink_and_the_view_turns_by_the_clock() {
        let held = Pad {
            right: [1.0, 0.0],
            triggers: [share(0, 0, 255), share(255, 0, 255)],
            ..Pad::default()
        };
        let (controls, [right, down]) = held.hands(0.25);
        assert_eq!((controls.up, down), (1.0, 0.0));
        assert!((right * DEGREES_PER_COUNT - TURN / 4.0).abs() < 1e-3);
        assert_eq!(share(7, 3, 3), 0.5, "no way at all");
        let nowhere = Pad {
            left: [f32::NAN; 2],
            ..Pad::default()
        };
        assert_eq!(nowhere.hands(1.0).0, Controls::default());
    }
}
