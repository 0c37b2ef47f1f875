//! What the player sees from and with: the eye, kicks and tilts, steps of stairs, the view model
//! (`view.c`).

use super::level::{HurtEvent, Level};
use super::track::{FrameBlend, Place, Window, lerp_angles};
use bsp::dem::{ClientData, item};
use glam::{EulerRot, Mat3, Vec3};

/// Speed at which the eye follows a step of a stair, units per second.
const STAIR_SPEED: f64 = 80.0;
/// Most that it stays behind, units.
const STAIR_MOST: f64 = 12.0;
/// The eye is moved off the grid, so that it never lies in a plane of a liquid.
const OFF_GRID: f32 = 1.0 / 32.0;
/// Least and most that the eye is above the origin of who looks, units.
const LOWEST: f32 = -22.0;
const HIGHEST: f32 = 30.0;
/// Seconds that a kick takes.
const KICK_SECONDS: f64 = 0.5;

/// A message of a demo that shows entities.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moment {
    pub window: Window,
    pub level: u32,
    /// Where the player looked.
    pub angles: Vec3,
    /// The view does not turn here from where it was; since when it has not been cut.
    pub turned: bool,
    pub since: f64,
    pub view_entity: u16,
    /// Where the entity of the view is, or was last.
    pub view_origin: Vec3,
    /// Index of the player's own data.
    pub client: u32,
    /// How far the eye is behind on stairs at the message's time, units.
    pub lag: f64,
    /// The entity of the view was elsewhere before.
    pub jumps: bool,
    /// 0 in play; 1 to 3 after the level.
    pub intermission: u8,
    /// Number of entities.
    pub entities: u32,
}

impl Moment {
    /// How far the eye is behind `seconds` later, if it has risen evenly by `rise`.
    pub fn lag_after(&self, rise: f32, seconds: f64) -> f64 {
        (self.lag + f64::from(rise) - STAIR_SPEED * seconds).clamp(0.0, STAIR_MOST)
    }
}

/// Who looks, and how.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct View {
    /// The entity that looks.
    pub entity: u16,
    /// Where the eye is.
    pub eye: Vec3,
    /// Pitch (down is positive), yaw, roll in degrees.
    pub angles: Vec3,
    /// Since when the view has moved without a cut, timeline seconds.
    pub since: f64,
    /// 0 in play; 1 to 3: the level is over, the camera stands.
    pub intermission: u8,
    /// Health of the player.
    pub health: i32,
}

/// The weapon in the player's hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewModel {
    /// Index of its model.
    pub model: u16,
    /// Where it is.
    pub origin: Vec3,
    /// Its angles as those of other alias models: up is positive.
    pub angles: Vec3,
    /// Its frames.
    pub frame: FrameBlend,
    /// Opacity, 0 to 1.
    pub alpha: f32,
}

/// Axes of angles whose pitch looks down: forward, right, up (`AngleVectors`).
pub fn axes(angles: Vec3) -> [Vec3; 3] {
    let [pitch, yaw, roll] = angles.to_array().map(f32::to_radians);
    let turn = Mat3::from_euler(EulerRot::ZYX, yaw, pitch, roll);
    [turn.x_axis, -turn.y_axis, turn.z_axis]
}

/// What a hurt does, before it is known when.
pub(super) struct Hurt {
    percent: f32,
    colour: Vec3,
    pitch: f32,
    roll: f32,
}

impl Hurt {
    pub fn at(self, moment: u32, begin: f64) -> HurtEvent {
        HurtEvent {
            moment,
            begin,
            percent: self.percent,
            colour: self.colour,
            pitch: self.pitch,
            roll: self.roll,
        }
    }
}

/// The player loses armour and health to something in direction `away`; `left` is what is left of
/// earlier tints.
pub(super) fn hurt(armor: u8, blood: u8, away: Vec3, angles: Vec3, left: f32) -> Hurt {
    /// Degrees that the view is kicked by for each point.
    const KICK: f32 = 0.6;
    let count = (f32::from(armor) + f32::from(blood)) / 2.0;
    let count = count.max(10.0);
    let colour = if armor > blood {
        Vec3::new(200.0, 100.0, 100.0)
    } else if armor > 0 {
        Vec3::new(220.0, 50.0, 50.0)
    } else {
        Vec3::new(255.0, 0.0, 0.0)
    };
    // The entity's own pitch has the other sign.
    let [forward, right, _] = axes(Vec3::new(-angles.x, angles.y, 0.0));
    let away = away.normalize_or_zero();
    Hurt {
        percent: (left + 3.0 * count).min(150.0),
        colour: colour / 255.0,
        pitch: count * away.dot(forward) * KICK,
        roll: count * away.dot(right) * KICK,
    }
}

impl HurtEvent {
    /// Percent of red at `t`.
    pub fn percent_at(&self, t: f64) -> f32 {
        (self.percent - 150.0 * (t - self.begin) as f32).max(0.0)
    }

    /// Pitch and roll that the view is kicked by at `t`, degrees.
    fn kick_at(&self, t: f64) -> (f32, f32) {
        let share = (1.0 - (t - self.begin) / KICK_SECONDS).clamp(0.0, 1.0) as f32;
        (self.pitch * share, self.roll * share)
    }
}

/// How the head goes up and down while walking, units; `speed` is that over ground.
fn bob(clock: f64, speed: f32) -> f32 {
    const CYCLE: f64 = 0.6;
    const SIZE: f32 = 0.02;
    let c = (clock / CYCLE).rem_euclid(1.0);
    // Up and down take half of it each.
    let phase = std::f64::consts::PI
        * if c < 0.5 {
            c / 0.5
        } else {
            1.0 + (c - 0.5) / 0.5
        };
    let b = speed * SIZE;
    (b * (0.3 + 0.7 * phase.sin() as f32)).clamp(-7.0, 4.0)
}

/// How the head tilts while walking sideways, degrees.
fn strafe_roll(velocity: Vec3, yaw: f32) -> f32 {
    const MOST: f32 = 2.0;
    const AT_SPEED: f32 = 200.0;
    let [_, right, _] = axes(Vec3::new(0.0, yaw, 0.0));
    let side = velocity.dot(right);
    side.signum() * side.abs().min(AT_SPEED) / AT_SPEED * MOST
}

/// All that the view at a moment depends on.
pub(super) struct Looking<'a> {
    pub level: &'a Level,
    pub now: &'a Moment,
    /// The message before, if it is of the same level.
    pub before: Option<&'a Moment>,
    pub client: &'a ClientData,
    pub client_before: &'a ClientData,
    /// Where the entity that looks is.
    pub body: Place,
    pub t: f64,
    pub clock: f64,
    pub index: u32,
}

impl Looking<'_> {
    /// The view and the view model.
    pub fn look(&self) -> (View, Option<ViewModel>) {
        let (now, t) = (self.now, self.t);
        let view = View {
            entity: now.view_entity,
            since: now.since,
            intermission: now.intermission,
            health: self.client.health,
            ..View::default()
        };
        if now.intermission > 0 {
            return (self.standing(view), None);
        }
        let share = now.window.share(t);
        let mut aim = now.angles;
        if let Some(before) = self.before.filter(|_| !now.turned) {
            aim = lerp_angles(before.angles, aim, share);
        }
        let velocity =
            Vec3::from(self.client_before.velocity).lerp(Vec3::from(self.client.velocity), share);
        let bob = bob(self.clock, velocity.truncate().length());
        let lag = self.lag() as f32;
        let above = self.client.view_height + bob;
        let height = Vec3::Z * (above - lag);
        // Stairs come after that.
        let above = above.clamp(LOWEST, HIGHEST);
        let (pitch, roll) = self.kick();
        let mut angles = aim + Vec3::new(pitch, 0.0, roll);
        angles.z += strafe_roll(velocity, aim.y);
        if self.client.health <= 0 {
            angles = Vec3::new(aim.x, aim.y, 80.0);
        }
        let gun = Place {
            origin: self.body.origin + height + axes(aim)[0] * (bob * 0.4),
            angles: Vec3::new(-angles.x, angles.y, aim.z),
        };
        let view = View {
            eye: self.body.origin + Vec3::Z * (above - lag) + OFF_GRID,
            angles: angles + Vec3::from(self.client.punch),
            ..view
        };
        (view, self.view_model(gun))
    }

    /// How far the eye is behind on stairs, units.
    fn lag(&self) -> f64 {
        let now = self.now;
        if self.t >= now.window.end {
            return now.lag_after(0.0, self.t - now.window.end);
        }
        let before = self.before.filter(|_| !now.jumps && self.client.on_ground);
        before.map_or(0.0, |b| {
            let rise = self.body.origin.z - b.view_origin.z;
            b.lag_after(rise, self.t - b.window.end)
        })
    }

    /// The view after the level: the entity itself is the camera, and sways a little.
    fn standing(&self, view: View) -> View {
        let sway = |rate: f64, size: f32| (self.clock * rate).sin() as f32 * size;
        View {
            eye: self.body.origin,
            angles: self.body.angles + Vec3::new(sway(1.0, 0.3), sway(2.0, 0.3), sway(0.5, 0.1)),
            ..view
        }
    }

    /// Pitch and roll of the newest hurt.
    fn kick(&self) -> (f32, f32) {
        let hurts = &self.level.hurts;
        let next = hurts.partition_point(|h| h.moment <= self.index);
        let last = next.checked_sub(1).and_then(|i| hurts.get(i));
        last.map_or((0.0, 0.0), |h| h.kick_at(self.t))
    }

    fn view_model(&self, gun: Place) -> Option<ViewModel> {
        let weapons = &self.level.weapons;
        let next = weapons.partition_point(|w| w.moment <= self.index);
        let key = next.checked_sub(1).and_then(|i| weapons.get(i))?;
        let hidden = self.client.items & item::INVISIBILITY != 0 || self.client.health <= 0;
        if key.model == 0 || hidden {
            return None;
        }
        Some(ViewModel {
            model: key.model,
            origin: gun.origin,
            angles: gun.angles,
            frame: key.blend.at(self.t),
            alpha: match self.client.weapon_alpha {
                0 => 1.0,
                a => f32::from(a - 1) / 254.0,
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_the_engines() {
        let near = |angles: [f32; 3], expected: [[f32; 3]; 3]| {
            for (found, expected) in axes(angles.into()).into_iter().zip(expected) {
                let off = (found - Vec3::from(expected)).abs().max_element();
                assert!(off < 5e-4, "{angles:?}: {found} is not {expected:?}");
            }
        };
        near([0.0, 90.0, 0.0], [[0., 1., 0.], [1., 0., 0.], [0., 0., 1.]]);
        near(
            [90.0, 0.0, 0.0],
            [[0., 0., -1.], [0., -1., 0.], [1., 0., 0.]],
        );
        near(
            [30.0, 45.0, 10.0],
            [
                [0.6124, 0.6124, -0.5],
                [0.6350, -0.7577, -0.1504],
                [0.4709, 0.2253, 0.8529],
            ],
        );
    }

    #[test]
    fn heads_bob_between_the_engines_bounds() {
        let all: Vec<f32> = (0..600)
            .map(|i| bob(f64::from(i) / 1000.0, 320.0))
            .collect();
        let least = all.iter().copied().fold(f32::MAX, f32::min);
        let most = all.iter().copied().fold(f32::MIN, f32::max);
        assert!(
            (least + 2.56).abs() < 0.01 && most == 4.0,
            "{least} to {most}"
        );
        assert_eq!(bob(0.2, 0.0), 0.0);
        // A moment later it is the same, however late in the day.
        assert!((bob(4250.3, 320.0) - bob(4250.9, 320.0)).abs() < 1e-3);
    }

    #[test]
    fn hurts_tint_and_kick() {
        let h = hurt(0, 30, Vec3::X, Vec3::ZERO, 0.0).at(0, 10.0);
        assert_eq!((h.percent, h.colour), (45.0, Vec3::X));
        assert_eq!((h.pitch, h.roll), (9.0, 0.0));
        assert_eq!(h.percent_at(10.3), 0.0);
        assert_eq!(h.kick_at(10.25), (4.5, 0.0));
        assert_eq!(hurt(100, 100, Vec3::X, Vec3::ZERO, 40.0).percent, 150.0);
    }

    #[test]
    fn eyes_climb_stairs_at_their_own_speed() {
        let still = Moment {
            window: Window {
                start: 0.0,
                end: 0.0,
                clock: 0.0,
            },
            level: 0,
            angles: Vec3::ZERO,
            turned: false,
            since: 0.0,
            view_entity: 1,
            view_origin: Vec3::ZERO,
            client: 0,
            lag: 0.0,
            jumps: false,
            intermission: 0,
            entities: 1,
        };
        // A step of 8 in a hundredth of a second, of 16, and no step.
        assert!((still.lag_after(8.0, 0.01) - 7.2).abs() < 1e-6);
        assert_eq!(still.lag_after(16.0, 0.01), 12.0);
        assert_eq!(still.lag_after(0.5, 0.01), 0.0);
        let lagging = Moment { lag: 12.0, ..still };
        assert_eq!(lagging.lag_after(0.0, 0.1), 4.0);
    }
}
