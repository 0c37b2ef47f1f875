//! Light styles: the strings of letters that make lights flicker and pulse.

use crate::entity::Entity;

/// Number of styles that the engine keeps.
pub const COUNT: usize = 64;
/// First of the styles that compilers give to lights with a `targetname`.
pub const FIRST_SWITCHABLE: u16 = 32;
/// Last of them.
pub const LAST_SWITCHABLE: u16 = 62;
/// Letters per second.
pub const RATE: f64 = 10.0;
/// Spawnflag of lights that are off when the level starts.
pub const START_OFF: u32 = 1;

/// Brightness of a letter that a style stays at if nothing is known of it: `m`.
const NORMAL: f32 = 264.0 / 256.0;

/// A step of this many letters or more is a switch, not a fade.
const SWITCH: i32 = 6;

/// The strings of styles 0 to 11, as the game sets them.
pub const STANDARD: [&str; 12] = [
    "m",
    "mmnmmommommnonmmonqnmmo",
    "abcdefghijklmnopqrstuvwxyzyxwvutsrqponmlkjihgfedcba",
    "mmmmmaaaaammmmmaaaaaabcdefgabcdefg",
    "mamamamamama",
    "jklmnopqrstuvwxyzyxwvutsrqponmlkj",
    "nmonqnmomnmomomno",
    "mmmaaaabcdefgmmmmaaaammmaamm",
    "mmmaaammmaaammmabcdefaaaammmmabcdefmmmaaaa",
    "aaaaaaaazzzzzzzz",
    "mmamammmmammamamaaamammma",
    "abcdefghijklmnopqrrqponmlkjihgfedcba",
];

/// How a style passes from one letter to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Blend {
    /// In steps, ten a second.
    #[default]
    Step,
    /// Linearly, except for steps of six letters or more.
    Linear,
}

/// The strings of all styles of a level.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LightStyles {
    strings: Vec<Vec<u8>>,
}

impl Default for LightStyles {
    /// The standard styles, switchable ones on, style 63 dark.
    fn default() -> Self {
        let mut strings: Vec<Vec<u8>> = STANDARD.iter().map(|s| s.as_bytes().to_vec()).collect();
        strings.resize(COUNT - 1, b"m".to_vec());
        strings.push(b"a".to_vec());
        Self { strings }
    }
}

impl LightStyles {
    /// The styles at the start of a level: switchable ones whose light has START_OFF are dark.
    pub fn at_start(entities: &[Entity]) -> Self {
        let mut this = Self::default();
        let lights = entities
            .iter()
            .filter(|e| e.classname().starts_with("light"));
        for light in lights.filter(|l| l.spawnflags() & START_OFF != 0) {
            let style = light.int("style").and_then(|s| u16::try_from(s).ok());
            if let Some(style @ FIRST_SWITCHABLE..=LAST_SWITCHABLE) = style {
                this.set(style, "a");
            }
        }
        this
    }

    /// Replaces the string of a style; numbers beyond the table are ignored.
    pub fn set(&mut self, style: u16, letters: &str) {
        if let Some(string) = self.strings.get_mut(usize::from(style)) {
            *string = letters.as_bytes().to_vec();
        }
    }

    /// Brightness of a style at `time` seconds: 1 shows lightmaps as stored, `m` is 264/256, an
    /// empty string is 1, styles beyond the table stay at `m`.
    pub fn brightness(&self, style: u16, time: f64, blend: Blend) -> f32 {
        let Some(string) = self.strings.get(usize::from(style)) else {
            return NORMAL;
        };
        brightness(string, time, blend)
    }
}

/// Brightness of a style's letters at `time` seconds: 1 shows lightmaps as stored, `m` is 264/256,
/// no letters are 1.
pub fn brightness(letters: &[u8], time: f64, blend: Blend) -> f32 {
    if letters.is_empty() {
        return 1.0;
    }
    let step = (time * RATE).max(0.0);
    let index = (step.floor() % letters.len() as f64) as usize;
    let letter = |i: usize| {
        let c = letters.get(i % letters.len()).copied().unwrap_or(b'm');
        i32::from(c) - i32::from(b'a')
    };
    let (now, next) = (letter(index), letter(index + 1));
    let value = |letter: f32| 22.0 * letter / 256.0;
    if blend == Blend::Linear && (next - now).abs() < SWITCH {
        let part = (step - step.floor()) as f32;
        return value(now as f32 + (next - now) as f32 * part);
    }
    value(now as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn style_1_flickers_ten_times_a_second() {
        let styles = LightStyles::default();
        let at = |style, t| styles.brightness(style, t, Blend::Step);
        assert_eq!(at(1, 0.25), 286.0 / 256.0);
        assert_eq!(at(1, 0.35), 264.0 / 256.0);
        assert_eq!(at(63, 1.0), 0.0);
        assert_eq!(at(99, 1.0), 264.0 / 256.0);
        assert_eq!(styles.brightness(1, 0.15, Blend::Linear), 275.0 / 256.0);
        // From m to a is a switch.
        assert_eq!(styles.brightness(4, 0.05, Blend::Linear), 264.0 / 256.0);
    }
}
