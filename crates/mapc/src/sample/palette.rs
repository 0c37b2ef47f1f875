//! The sample level's own palette, in the structure Quake's palette has: 16 rows of 16 colours;
//! rows 0 to 7 run from dark to light, rows 8 to 13 from light to dark, rows 14 and 15 (224 to
//! 255) are fullbright.

/// Row of neutral greys, dark to light.
pub(super) const GREY: u8 = 0;
/// Warm stone.
pub(super) const STONE: u8 = 1;
/// Cool steel.
pub(super) const STEEL: u8 = 2;
/// Moss and grass.
pub(super) const MOSS: u8 = 3;
/// Fired brick.
pub(super) const BRICK: u8 = 4;
/// Pale sandstone.
pub(super) const SAND: u8 = 5;
/// Oiled wood; engines take the colours of fire, smoke and explosions from here.
pub(super) const WOOD: u8 = 6;
/// Teal paint.
pub(super) const TEAL: u8 = 7;
/// Brass, light to dark.
pub(super) const BRASS: u8 = 8;
/// Deep blue, light to dark.
pub(super) const BLUE: u8 = 9;
/// Day sky, light to dark.
pub(super) const SKY: u8 = 10;
/// Clear water, light to dark.
pub(super) const WATER: u8 = 11;
/// Cooling lava crust, light to dark.
pub(super) const CRUST: u8 = 12;
/// Red paint, light to dark.
pub(super) const RED: u8 = 13;
/// Fullbright fire: deep red to nearly white.
pub(super) const FIRE: u8 = 14;
/// Fullbright lamps: blue-white, warm white, green, magenta, four levels each; the last is the hole of fences.
pub(super) const LAMP: u8 = 15;

/// The hole in fence textures.
pub(super) const HOLE: u8 = 255;

/// First and last colour of each row with an even number of steps between; the third is the
/// middle of the row, so that rows may bend.
const ROWS: [[[i32; 3]; 3]; 15] = [
    [[6, 6, 7], [122, 122, 123], [240, 240, 238]],
    [[22, 17, 13], [142, 123, 101], [232, 216, 188]],
    [[14, 17, 22], [108, 122, 138], [216, 228, 238]],
    [[12, 18, 8], [86, 116, 52], [196, 210, 132]],
    [[30, 10, 7], [148, 74, 52], [228, 160, 126]],
    [[34, 28, 19], [176, 154, 114], [248, 236, 206]],
    [[24, 13, 6], [130, 84, 44], [222, 176, 120]],
    [[6, 22, 24], [42, 128, 126], [168, 226, 216]],
    [[250, 232, 160], [186, 140, 54], [40, 26, 8]],
    [[176, 196, 240], [62, 84, 168], [8, 10, 36]],
    [[246, 250, 255], [158, 198, 242], [66, 112, 186]],
    [[190, 232, 232], [50, 126, 140], [6, 26, 40]],
    [[190, 80, 40], [92, 30, 18], [16, 8, 8]],
    [[244, 140, 120], [176, 40, 34], [34, 6, 8]],
    [[110, 12, 2], [255, 136, 22], [255, 250, 196]],
];

/// The last row, level by level.
const LAMP_ROW: [[i32; 3]; 16] = [
    [90, 130, 190],
    [150, 190, 235],
    [200, 226, 250],
    [236, 246, 255],
    [190, 150, 90],
    [230, 196, 140],
    [250, 230, 190],
    [255, 246, 224],
    [20, 120, 40],
    [60, 200, 80],
    [130, 250, 140],
    [205, 255, 205],
    [130, 40, 160],
    [200, 90, 230],
    [240, 170, 255],
    [159, 91, 83],
];

/// The 768 bytes of `palette.lmp`: red, green, blue of each index, sRGB-encoded.
#[must_use]
pub(super) fn palette() -> Vec<u8> {
    let mut out = Vec::with_capacity(768);
    for [a, b, c] in ROWS {
        for i in 0..16i32 {
            for k in 0..3 {
                // Piecewise linear through the middle at 7.5.
                let v = if 2 * i < 15 {
                    a[k] + (b[k] - a[k]) * 2 * i / 15
                } else {
                    b[k] + (c[k] - b[k]) * (2 * i - 15) / 15
                };
                out.push(v.clamp(0, 255) as u8);
            }
        }
    }
    for rgb in LAMP_ROW {
        out.extend(rgb.map(|v| v as u8));
    }
    out
}

/// The index of a shade in a row, `0.0` the darkest and `1.0` the lightest, dithered by the
/// texel's place so that gradients do not band.
pub(super) fn shade(row: u8, value: f64, x: usize, y: usize) -> u8 {
    const BAYER: [[u8; 4]; 4] = [[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]];
    let threshold = (f64::from(BAYER[y % 4][x % 4]) + 0.5) / 16.0;
    let step = ((value.clamp(0.0, 1.0) * 15.0 + threshold).floor() as u8).min(15);
    let column = if (8..=13).contains(&row) {
        15 - step
    } else {
        step
    };
    row * 16 + column
}
