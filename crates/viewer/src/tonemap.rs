//! From scene-linear radiance to the codes of an sRGB display.
//!
//! Plain `f32` functions, one per step, so that the GPU pass can be written from them line by
//! line. Input and output are RGB with sRGB primaries.

/// A tone curve for display images. It never touches an EXR.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Tonemap {
    /// Troy Sobotka's AgX, base look: bright saturated light goes to white without a hue shift
    #[default]
    Agx,
    /// Narkowicz's fit of the ACES reference curve: contrasty
    Aces,
    /// x / (1 + x) on luminance (Reinhard et al. 2002)
    Reinhard,
    /// No curve: radiance above 1 is cut off
    #[value(alias = "none", alias = "srgb")]
    Clip,
}

impl Tonemap {
    /// The name on the command line and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Agx => "agx",
            Self::Aces => "aces",
            Self::Reinhard => "reinhard",
            Self::Clip => "clip",
        }
    }
}

/// Display code values in 0..=1 (times 255 they are the bytes of a PNG) for scene-linear
/// `radiance` at an exposure of `ev` stops.
///
/// What is not finite is shown as black; what is negative counts as 0.
#[must_use]
pub fn display(radiance: [f32; 3], ev: f32, curve: Tonemap) -> [f32; 3] {
    let gain = ev.exp2();
    let exposed = radiance.map(|x| {
        if x.is_finite() {
            x.max(0.0) * gain
        } else {
            0.0
        }
    });
    match curve {
        Tonemap::Agx => agx(exposed),
        Tonemap::Aces => exposed.map(|x| srgb_encode(aces(x))),
        Tonemap::Reinhard => {
            let scale = 1.0 / (1.0 + scene::material::luminance(exposed));
            exposed.map(|x| srgb_encode(x * scale))
        }
        Tonemap::Clip => exposed.map(srgb_encode),
    }
}

/// [`display`], rounded to 8 bits.
#[must_use]
pub fn display_u8(radiance: [f32; 3], ev: f32, curve: Tonemap) -> [u8; 3] {
    display(radiance, ev, curve).map(|x| (x * 255.0 + 0.5) as u8)
}

/// The sRGB transfer function (IEC 61966-2-1); clamps to 0..=1.
#[must_use]
pub fn srgb_encode(linear: f32) -> f32 {
    let x = linear.clamp(0.0, 1.0);
    if x <= 0.003_130_8 {
        12.92 * x
    } else {
        1.055 * x.powf(1.0 / 2.4) - 0.055
    }
}

/// Inverse of [`srgb_encode`] on 0..=1.
#[must_use]
pub fn srgb_decode(encoded: f32) -> f32 {
    if encoded <= 0.040_45 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

/// Darkest exposure AgX shows, in stops: `log2(0.18) - 10`.
const AGX_MIN_EV: f32 = -12.473_93;
/// Brightest exposure AgX shows, in stops: `log2(0.18) + 6.5`.
const AGX_MAX_EV: f32 = 4.026_069;
/// Where middle grey (0.18) lies on AgX's logarithmic axis.
const AGX_X_PIVOT: f32 = 10.0 / 16.5;
/// The code middle grey is shown with.
const AGX_Y_PIVOT: f32 = 0.5;
/// Slope of the curve at middle grey.
const AGX_SLOPE: f32 = 2.0;
/// Powers of the curve below and above middle grey.
const AGX_TOE_POWER: f32 = 3.0;
/// See [`AGX_TOE_POWER`].
const AGX_SHOULDER_POWER: f32 = 3.25;

/// Moves each primary towards the others, so that a bright saturated colour reaches all three
/// channels. Rows give the red, green and blue of the result.
const AGX_INSET: [[f32; 3]; 3] = [
    [0.842_479_06, 0.078_433_6, 0.079_223_745],
    [0.042_328_242, 0.878_468_64, 0.079_166_13],
    [0.042_375_655, 0.078_433_6, 0.879_143],
];
/// Inverse of [`AGX_INSET`].
const AGX_OUTSET: [[f32; 3]; 3] = [
    [1.196_879, -0.098_020_88, -0.099_029_74],
    [-0.052_896_85, 1.151_903_1, -0.098_961_18],
    [-0.052_971_635, -0.098_043_45, 1.151_073_7],
];

/// AgX with the base look.
///
/// The matrices and the range are those of Benjamin Wrensch, "Minimal AgX Implementation" (2023),
/// which reproduces Troy Sobotka's AgX configuration (`sobotka/AgX`); the curve is Sobotka's own
/// two-sided hyperbola instead of a polynomial fitted to it. The result is already encoded for a
/// display.
fn agx(linear: [f32; 3]) -> [f32; 3] {
    let code = multiply(&AGX_INSET, linear).map(|x| {
        let ev = x.max(1e-10).log2().clamp(AGX_MIN_EV, AGX_MAX_EV);
        agx_curve((ev - AGX_MIN_EV) / (AGX_MAX_EV - AGX_MIN_EV))
    });
    multiply(&AGX_OUTSET, code).map(|x| x.clamp(0.0, 1.0))
}

/// AgX's contrast curve on its logarithmic axis, 0..=1 to 0..=1.
fn agx_curve(x: f32) -> f32 {
    let from_pivot = x - AGX_X_PIVOT;
    let (run, rise, power) = if from_pivot < 0.0 {
        (AGX_X_PIVOT, AGX_Y_PIVOT, AGX_TOE_POWER)
    } else {
        (1.0 - AGX_X_PIVOT, 1.0 - AGX_Y_PIVOT, AGX_SHOULDER_POWER)
    };
    // The scale makes the hyperbola reach the end of the axis exactly.
    let scale = ((AGX_SLOPE * run).powf(-power) * ((AGX_SLOPE * run / rise).powf(power) - 1.0))
        .powf(-1.0 / power);
    let t = AGX_SLOPE * from_pivot.abs() / scale;
    let y = scale * t / (1.0 + t.powf(power)).powf(1.0 / power);
    (AGX_Y_PIVOT + y.copysign(from_pivot)).clamp(0.0, 1.0)
}

/// Krzysztof Narkowicz, "ACES Filmic Tone Mapping Curve" (2015); linear to display-linear.
fn aces(x: f32) -> f32 {
    (x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)).clamp(0.0, 1.0)
}

fn multiply(rows: &[[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    rows.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_agx_curve_is_the_one_the_published_polynomial_was_fitted_to() {
        // Wrensch's sixth-order fit; its own mean squared error is given as 3.7e-6.
        let fit = |x: f32| {
            let (x2, x4) = (x * x, x * x * x * x);
            15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x
                - 0.002_32
        };
        for i in 0..=100 {
            let x = i as f32 / 100.0;
            let (ours, theirs) = (agx_curve(x), fit(x));
            assert!((ours - theirs).abs() < 6e-3, "at {x}: {ours}, fit {theirs}");
        }
    }

    #[test]
    fn agx_keeps_grey_grey_and_middle_grey_in_the_middle() {
        let [r, g, b] = display([0.18; 3], 0.0, Tonemap::Agx);
        assert!((r - 0.5).abs() < 1e-3 && (g - r).abs() < 1e-3 && (b - r).abs() < 1e-3);
        assert_eq!(display_u8([0.0; 3], 0.0, Tonemap::Agx), [0; 3]);
        assert_eq!(display_u8([1e9; 3], 0.0, Tonemap::Agx), [255; 3]);
        // A very bright pure red is shown nearly white, not as a flat red.
        assert!(display([1000.0, 0.0, 0.0], 0.0, Tonemap::Agx)[1] > 0.5);
    }

    #[test]
    fn exposure_counts_in_stops_and_never_darkens_when_raised() {
        for curve in [
            Tonemap::Agx,
            Tonemap::Aces,
            Tonemap::Reinhard,
            Tonemap::Clip,
        ] {
            assert_eq!(
                display([0.1, 0.05, 0.02], 1.0, curve),
                display([0.2, 0.1, 0.04], 0.0, curve)
            );
            let mut last = -1.0;
            for i in -80..40 {
                let now = display([1.0; 3], i as f32 / 4.0, curve)[0];
                assert!(
                    now >= last && (0.0..=1.0).contains(&now),
                    "{curve:?} at {i}"
                );
                last = now;
            }
            assert_eq!(
                display_u8([f32::NAN, f32::INFINITY, -1.0], 0.0, curve),
                [0; 3]
            );
        }
    }

    #[test]
    fn srgb_codes_match_the_standard() {
        assert_eq!(
            display_u8([0.5, 0.214_041_14, 1.0], 0.0, Tonemap::Clip),
            [188, 128, 255]
        );
        for code in 0..=255u8 {
            let linear = srgb_decode(f32::from(code) / 255.0);
            assert!((f64::from(linear) - scene::material::srgb_to_linear(code)).abs() < 1e-6);
            assert_eq!((srgb_encode(linear) * 255.0 + 0.5) as u8, code);
        }
    }
}
