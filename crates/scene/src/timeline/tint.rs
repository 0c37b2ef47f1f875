//! What colours the whole screen (`view.c`).

use super::level::{HurtEvent, Level};
use super::seed::Digest;
use bsp::bsp::contents;
use bsp::dem::{ClientData, item};

/// Colour and opacity, 0 to 1 each, in display values.
pub type Shift = [f32; 4];

/// What colours the screen at a moment; [`Tint::over`] puts it together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tint {
    /// What the game asks for where the eye is in no liquid.
    pub outside: Shift,
    /// For being hurt.
    pub hurt: Shift,
    /// For an item.
    pub bonus: Shift,
    /// For what the player carries.
    pub power: Shift,
}

impl Tint {
    /// The tint where the eye is in `contents` ([`bsp::bsp::contents`]): colour and opacity, 0 to 1 each.
    pub fn over(&self, contents: i32) -> Shift {
        let liquid = |r: f32, g: f32, b: f32, percent: f32| {
            [r / 255.0, g / 255.0, b / 255.0, percent / 255.0]
        };
        let contents = match contents {
            contents::WATER => liquid(130.0, 80.0, 50.0, 128.0),
            contents::SLIME => liquid(0.0, 25.0, 5.0, 150.0),
            contents::LAVA => liquid(255.0, 80.0, 0.0, 150.0),
            _ => self.outside,
        };
        let mut out = [0.0; 4];
        for [r, g, b, a2] in [contents, self.hurt, self.bonus, self.power] {
            let [_, _, _, a] = out;
            let sum = a + a2 * (1.0 - a);
            if a2 <= 0.0 || sum <= 0.0 {
                continue;
            }
            let share = a2 / sum;
            for (o, x) in out.iter_mut().zip([r, g, b]) {
                *o += (x - *o) * share;
            }
            out[3] = sum;
        }
        out
    }

    /// The tint of message `moment` at `t`.
    pub(super) fn at(
        level: &Level,
        client: &ClientData,
        moment: u32,
        intermission: u8,
        t: f64,
    ) -> Self {
        let shift = (level.shifts.iter().rev()).find(|(m, _)| *m <= moment);
        let outside = shift.map_or([0.0; 4], |(_, s)| *s);
        if intermission > 0 {
            return Self {
                outside,
                ..Self::default()
            };
        }
        let next = level.hurts.partition_point(|h| h.moment <= moment);
        let hurt = next.checked_sub(1).and_then(|i| level.hurts.get(i));
        let next = level.bonuses.partition_point(|(m, _)| *m <= moment);
        let bonus = next.checked_sub(1).and_then(|i| level.bonuses.get(i));
        let bonus = bonus.map_or(0.0, |(_, begin)| {
            (50.0 - 100.0 * (t - begin) as f32).max(0.0)
        });
        Self {
            outside,
            hurt: hurt.map_or([0.0; 4], |h: &HurtEvent| {
                let [r, g, b] = h.colour.to_array();
                [r, g, b, h.percent_at(t) / 255.0]
            }),
            bonus: [215.0 / 255.0, 186.0 / 255.0, 69.0 / 255.0, bonus / 255.0],
            power: power(client.items),
        }
    }

    pub(super) fn digest(&self, digest: &mut Digest) {
        for shift in [self.outside, self.hurt, self.bonus, self.power] {
            shift.into_iter().for_each(|x| digest.add_f32(x));
        }
    }
}

/// The tint of what the player carries; one hides the others.
fn power(items: u32) -> Shift {
    [
        (item::QUAD, [0.0, 0.0, 1.0, 30.0 / 255.0]),
        (item::SUIT, [0.0, 1.0, 0.0, 20.0 / 255.0]),
        (item::INVISIBILITY, [100.0 / 255.0; 4]),
        (item::INVULNERABILITY, [1.0, 1.0, 0.0, 30.0 / 255.0]),
    ]
    .into_iter()
    .find_map(|(bit, shift)| (items & bit != 0).then_some(shift))
    .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tints_lie_over_each_other() {
        let tint = Tint {
            hurt: [1.0, 0.0, 0.0, 45.0 / 255.0],
            ..Tint::default()
        };
        let [r, .., a] = tint.over(contents::WATER);
        assert!((a - 0.590).abs() < 1e-3, "{a}");
        assert!(r > 130.0 / 255.0);
        assert_eq!(tint.over(contents::EMPTY), tint.hurt);
        assert_eq!(Tint::default().over(contents::SOLID), [0.0; 4]);
    }
}
