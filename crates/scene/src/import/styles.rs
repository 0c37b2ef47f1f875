//! Light styles: how bright a lamp is at a time.

/// Styles 0 to 11 of the game code, one letter per tenth of a second.
const STYLES: [&str; 12] = [
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

/// Letters per second.
const LETTERS_PER_SECOND: f64 = 10.0;

/// Brightness of `style` at `time` seconds: `22 (c - 'a') / 256`, so that `m` is 264/256. Styles
/// that the game code does not define stay at `m`; 63 is dark.
pub fn brightness(style: u32, time: f64) -> f32 {
    let letters = match style {
        63 => "a",
        _ => STYLES.get(style as usize).copied().unwrap_or("m"),
    };
    let step = (time * LETTERS_PER_SECOND)
        .floor()
        .rem_euclid(letters.len() as f64);
    let letter = letters
        .as_bytes()
        .get(step as usize)
        .copied()
        .unwrap_or(b'm');
    f32::from(letter - b'a') * 22.0 / 256.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn style_1_flickers_as_the_engine_does() {
        assert_eq!(brightness(1, 0.25), 286.0 / 256.0);
        assert_eq!(brightness(1, 0.35), 264.0 / 256.0);
        assert_eq!(brightness(0, 12.3), 264.0 / 256.0);
        assert_eq!(brightness(4, 0.1), 0.0);
        assert_eq!(brightness(40, 3.0), 264.0 / 256.0);
    }
}
