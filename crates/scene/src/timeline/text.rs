//! Command lines that servers send: those that change what is seen.

use super::fog::AskedFog;

/// Longest line that is waited for; servers send some in parts.
const LONGEST: usize = 1 << 16;

/// A command that changes what is seen.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Command {
    /// The screen flashes for an item.
    Bonus,
    /// The screen's tint outside liquids: red, green, blue, opacity, 0 to 1.
    Shift([f32; 4]),
    /// Fog, and the seconds until it is reached.
    Fog(AskedFog, f64),
    /// The sky's pictures.
    Sky(String),
}

/// Puts parts of lines together.
#[derive(Debug)]
pub(super) struct Commands {
    line: Vec<u8>,
    /// The fog as far as it was set.
    pub fog: AskedFog,
}

impl Default for Commands {
    fn default() -> Self {
        Self {
            line: Vec::new(),
            fog: AskedFog::LEVEL,
        }
    }
}

impl Commands {
    /// The commands that `text` completes.
    pub fn read(&mut self, text: &[u8]) -> Vec<Command> {
        let mut found = Vec::new();
        for &byte in text {
            if byte != b'\n' {
                if self.line.len() < LONGEST {
                    self.line.push(byte);
                }
                continue;
            }
            let line = std::mem::take(&mut self.line);
            if line.starts_with(b"//") {
                continue;
            }
            let line = String::from_utf8_lossy(&line);
            found.extend(line.split(';').filter_map(|c| self.one(c)));
        }
        found
    }

    fn one(&mut self, command: &str) -> Option<Command> {
        let mut words = command.split_whitespace();
        let name = words.next()?.to_ascii_lowercase();
        match name.as_str() {
            "bf" => Some(Command::Bonus),
            "v_cshift" => {
                let numbers = numbers(words);
                let get = |i: usize| numbers.get(i).copied().unwrap_or(0.0);
                let shift = [0, 1, 2, 3].map(|i| (get(i) / 255.0).clamp(0.0, 1.0));
                Some(Command::Shift(shift))
            }
            "fog" => {
                let (density, colour, seconds) = match *numbers(words).as_slice() {
                    [density] => (Some(density), None, 0.0),
                    [r, g, b] => (None, Some([r, g, b]), 0.0),
                    [density, r, g, b] => (Some(density), Some([r, g, b]), 0.0),
                    [density, r, g, b, seconds, ..] => (Some(density), Some([r, g, b]), seconds),
                    _ => return None,
                };
                let [r, g, b] = colour.map_or([None; 3], |c| c.map(Some));
                let values = [density, r, g, b].map(|x| Some(x?.clamp(0.0, 1.0e3)));
                self.fog = self.fog.with(values);
                Some(Command::Fog(self.fog, f64::from(seconds)))
            }
            "sky" | "skybox" => {
                let name = words.next()?.trim_matches('"');
                Some(Command::Sky(name.to_owned()))
            }
            _ => None,
        }
    }
}

fn numbers<'a>(words: impl Iterator<Item = &'a str>) -> Vec<f32> {
    words
        .filter_map(|w| w.trim_matches('"').parse().ok())
        .filter(|x: &f32| x.is_finite())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_come_in_parts_and_hold_several_commands() {
        let mut commands = Commands::default();
        assert_eq!(commands.read(b"bf; play mis"), []);
        let found = commands.read(b"c.wav; fog 0.5\nfog 1 0 .5 ;v_cshift 255 0 0 51\n//bf\nsky d");
        let denser = AskedFog::LEVEL.with([Some(0.5), None, None, None]);
        assert_eq!(denser.in_level([0.1, 0.2, 0.3, 0.4]), [0.5, 0.2, 0.3, 0.4]);
        let expected = [
            Command::Bonus,
            Command::Fog(denser, 0.0),
            Command::Fog(AskedFog::of([0.5, 1.0, 0.0, 0.5]), 0.0),
            Command::Shift([1.0, 0.0, 0.0, 0.2]),
        ];
        assert_eq!(found, expected);
        assert_eq!(commands.read(b"ay\n"), [Command::Sky("day".into())]);
        let fog = Command::Fog(AskedFog::of([0.1, 0.2, 0.3, 0.4]), 2.0);
        assert_eq!(commands.read(b"fog .1 .2 .3 .4 2\nreconnect\n"), [fog]);
    }
}
