//! False colour.

/// The perceptually uniform map "viridis" of matplotlib (Smith and van der Walt 2015, CC0), from 0, dark
/// violet, to 1, yellow, as display codes. The polynomial is the fit of degree 6 by Zucker ("matplotlib
/// colormaps", 2019, CC0), within 2 codes of the table; beyond 0 to 1 the ends stay.
#[must_use]
pub fn viridis(t: f32) -> [u8; 3] {
    const C: [[f32; 3]; 7] = [
        [0.277_727_33, 0.005_407_344_5, 0.334_099_8],
        [0.105_093_04, 1.404_613_5, 1.384_590_2],
        [-0.330_861_83, 0.214_847_56, 0.095_095_165],
        [-4.634_230_5, -5.799_101, -19.332_441],
        [6.228_27, 14.179_933, 56.690_55],
        [4.776_385, -13.745_145, -65.353_03],
        [-5.435_456, 4.645_852_6, 26.312_435],
    ];
    let t = if t.is_nan() { 0.0 } else { t.clamp(0.0, 1.0) };
    let channel = |c: usize| {
        let value = C.iter().rev().fold(0.0, |sum, k| sum * t + k[c]);
        (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
    };
    [channel(0), channel(1), channel(2)]
}

/// A colour for a number: those of neighbours differ, the same number always has the same. Hues are a
/// golden angle apart, so that the next is never near the last ones.
#[must_use]
pub fn of_number(number: u32) -> [u8; 3] {
    // The fractional part of n / phi, exactly, in 32 bits.
    let hue = number.wrapping_mul(0x9e37_79b9) as f32 / (1u64 << 32) as f32;
    let light = [0.95, 0.75, 0.6][number as usize % 3];
    let channel = |shift: f32| {
        // The sides of a hue's hexagon, softened so that texts stay readable over it.
        let x = ((hue + shift).fract() * 6.0 - 3.0).abs() - 1.0;
        let value = 0.25 + 0.75 * x.clamp(0.0, 1.0);
        (value * light * 255.0) as u8
    };
    [channel(0.0), channel(2.0 / 3.0), channel(1.0 / 3.0)]
}

/// The range that shows most of some values: their 1st to 99th percentile, or one around the only value.
/// `None` without a finite value.
#[must_use]
pub fn range_of(values: impl Iterator<Item = f32>) -> Option<[f32; 2]> {
    /// So many are enough to know.
    const ENOUGH: usize = 1 << 16;
    let mut all: Vec<f32> = values.filter(|v| v.is_finite()).collect();
    if all.len() > ENOUGH {
        let step = all.len().div_ceil(ENOUGH);
        all = all.into_iter().step_by(step).collect();
    }
    all.sort_unstable_by(f32::total_cmp);
    let at = |share: f32| all.get(((all.len().max(1) - 1) as f32 * share).round() as usize);
    let (&low, &high) = (at(0.01)?, at(0.99)?);
    Some(if low < high {
        [low, high]
    } else {
        let half = (low.abs() * 0.5).max(0.5);
        [low - half, low + half]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lightness of CIE Lab (1976) of display codes.
    fn lightness(code: [u8; 3]) -> f32 {
        let [r, g, b] = code.map(|c| crate::tonemap::srgb_decode(f32::from(c) / 255.0));
        let y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        116.0 * y.cbrt() - 16.0
    }

    #[test]
    fn viridis_has_the_colours_of_its_table_and_equal_steps_of_lightness() {
        for (t, table) in [
            (0.0, [68, 1, 84]),
            (0.25, [59, 82, 139]),
            (0.5, [33, 145, 140]),
            (0.75, [94, 201, 98]),
            (1.0, [253, 231, 37]),
        ] {
            let found = viridis(t);
            for c in 0..3 {
                let apart = i32::from(found[c]) - table[c];
                assert!(apart.abs() <= 5, "{t}: {found:?}, not {table:?}");
            }
        }
        let steps: Vec<f32> = (0..=10)
            .map(|i| lightness(viridis(i as f32 / 10.0)))
            .collect();
        for pair in steps.windows(2) {
            let step = pair[1] - pair[0];
            assert!((5.0..10.0).contains(&step), "{steps:?}");
        }
        assert_eq!(viridis(f32::NAN), viridis(-3.0));
        assert_eq!(viridis(7.0), viridis(1.0));
    }

    #[test]
    fn ranges_leave_out_what_is_rare_or_no_number() {
        let values = (0..1000)
            .map(|i| i as f32)
            .chain([f32::NAN, f32::INFINITY, -1e9]);
        let [low, high] = range_of(values).expect("numbers");
        assert!((5.0..15.0).contains(&low) && (985.0..995.0).contains(&high));
        assert_eq!(range_of([3.0; 5].into_iter()), Some([1.5, 4.5]));
        assert_eq!(range_of([f32::NAN].into_iter()), None);
        assert_eq!(range_of(std::iter::empty()), None);
    }

    #[test]
    fn numbers_side_by_side_have_colours_apart() {
        for n in 0..100 {
            let [a, b] = [of_number(n), of_number(n + 1)];
            let apart: i32 = (0..3)
                .map(|c| (i32::from(a[c]) - i32::from(b[c])).abs())
                .sum();
            assert!(apart > 60, "{n}: {a:?} {b:?}");
        }
    }
}
