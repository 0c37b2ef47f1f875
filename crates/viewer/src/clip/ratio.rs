//! Seconds and rates without rounding.

/// A fraction, 0 or more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ratio {
    num: u64,
    den: u64,
}

/// Largest numerator and denominator of a fraction that is written as one, and the largest value.
const MOST: u64 = 1_000_000;
/// Most decimals.
const DECIMALS: usize = 6;

impl Ratio {
    /// 0.
    pub const ZERO: Self = Self { num: 0, den: 1 };

    /// `12`, `0.125` (six decimals at most) or `30000/1001`, a million at most.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        let whole = |text: &str| {
            let digits = !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
            text.parse::<u64>().ok().filter(|n| digits && *n <= MOST)
        };
        let (num, den) = if let Some((num, den)) = text.split_once('/') {
            (whole(num)?, whole(den).filter(|d| *d > 0)?)
        } else if let Some((units, decimals)) = text.split_once('.') {
            if decimals.len() > DECIMALS || (units.is_empty() && decimals.is_empty()) {
                return None;
            }
            let part = |text: &str| {
                if text.is_empty() {
                    Some(0)
                } else {
                    whole(text)
                }
            };
            let den = 10_u64.pow(decimals.len() as u32);
            (part(units)? * den + part(decimals)?, den)
        } else {
            (whole(text)?, 1)
        };
        let divisor = gcd(num, den);
        Some(Self {
            num: num / divisor,
            den: den / divisor,
        })
    }

    /// Numerator and denominator, without a common divisor.
    #[must_use]
    pub fn parts(self) -> (u64, u64) {
        (self.num, self.den)
    }

    /// The nearest fraction of whole microseconds to a number; `None` of numbers that [`Self::parse`] does not
    /// take.
    #[must_use]
    pub fn of(number: f64) -> Option<Self> {
        Self::parse(&format!("{number:.DECIMALS$}"))
    }

    /// The text that [`Self::parse`] reads: decimals where they say all of it, else a fraction.
    #[must_use]
    pub fn to_decimal(self) -> String {
        let million = 10_u64.pow(DECIMALS as u32);
        if !million.is_multiple_of(self.den) {
            return self.to_string();
        }
        let (units, rest) = (self.num / self.den, self.num % self.den);
        let text = format!("{units}.{:0DECIMALS$}", rest * (million / self.den));
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    }

    /// The nearest number.
    #[must_use]
    pub fn value(self) -> f64 {
        self.num as f64 / self.den as f64
    }
}

impl std::fmt::Display for Ratio {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.den {
            1 => self.num.fmt(f),
            den => write!(f, "{}/{den}", self.num),
        }
    }
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a.max(1) } else { gcd(b, a % b) }
}

/// When frames are: frame `n` at `from + n / fps` seconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Steps {
    /// The time of frame 0, seconds.
    pub from: Ratio,
    /// Frames per second, > 0.
    pub fps: Ratio,
}

impl Steps {
    /// The time of a frame as a fraction. No part of it is too large: numerators are 1e12 at most, all
    /// else 1e6, and frames have 32 bits.
    fn exact(&self, frame: u32) -> (u128, u128) {
        let [a, b, c, d] =
            [self.from.num, self.from.den, self.fps.num, self.fps.den].map(u128::from);
        (a * c + u128::from(frame) * d * b, b * c)
    }

    /// Seconds; exact but for one rounding of the whole and one of the rest.
    #[must_use]
    pub fn time(&self, frame: u32) -> f64 {
        let (num, den) = self.exact(frame);
        (num / den) as f64 + (num % den) as f64 / den as f64
    }

    /// The number of frames before `to`.
    #[must_use]
    pub fn before(&self, to: Ratio) -> u32 {
        let is_before = |frame| {
            let (num, den) = self.exact(frame);
            num * u128::from(to.den) < u128::from(to.num) * den
        };
        first_not(is_before)
    }

    /// The number of frames before `seconds`.
    #[must_use]
    pub fn before_seconds(&self, seconds: f64) -> u32 {
        first_not(|frame| self.time(frame) < seconds)
    }
}

/// The first number for which a question that turns from yes to no is answered by no.
fn first_not(is: impl Fn(u32) -> bool) -> u32 {
    let (mut low, mut high) = (0, u32::MAX);
    while low < high {
        let middle = low + (high - low) / 2;
        if is(middle) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fractions_are_said_as_they_are_read() {
        for (text, said) in [
            ("12", "12"),
            ("0.125", "0.125"),
            ("2.000001", "2.000001"),
            ("999999.999999", "999999.999999"),
            ("30000/1001", "30000/1001"),
            ("100", "100"),
        ] {
            let ratio = Ratio::parse(text).unwrap();
            assert_eq!(ratio.to_decimal(), said);
            assert_eq!(Ratio::parse(said), Some(ratio));
        }
        assert_eq!(Ratio::of(1.0 / 3.0), Ratio::parse("0.333333"));
        assert_eq!((Ratio::of(-1.0), Ratio::of(f64::NAN)), (None, None));
    }

    fn ratio(text: &str) -> Ratio {
        Ratio::parse(text).unwrap()
    }

    #[test]
    fn fractions_are_read_as_written() {
        assert_eq!(ratio("60").parts(), (60, 1));
        assert_eq!(ratio("0.2").parts(), (1, 5));
        assert_eq!(ratio(".5"), ratio("0.500"));
        assert_eq!(ratio("60000/2002").to_string(), "30000/1001");
        assert_eq!(ratio("0"), Ratio::ZERO);
        for wrong in [
            "",
            ".",
            "-1",
            "+1",
            "1/0",
            "1e3",
            "1.2.3",
            "1000001",
            "0.1234567",
            "a",
            "1/",
        ] {
            assert_eq!(Ratio::parse(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn steps_do_not_drift() {
        let steps = Steps {
            from: ratio("0.1"),
            fps: ratio("30000/1001"),
        };
        assert_eq!(steps.time(0), 0.1);
        assert_eq!(steps.time(30_000), 1001.1);
        assert_eq!(steps.time(3_000_000), 100_100.1);
        let tenths = Steps {
            from: Ratio::ZERO,
            fps: ratio("10"),
        };
        assert_eq!(tenths.time(3), 0.3);
        // Frame 3 is at the end, and not before it.
        assert_eq!(tenths.before(ratio("0.3")), 3);
        assert_eq!(tenths.before(ratio("0.300001")), 4);
        assert_eq!(tenths.before_seconds(0.25), 3);
        assert_eq!(tenths.before(Ratio::ZERO), 0);
    }
}
