//! Raw video as YUV4MPEG2, which ffmpeg, mpv and every encoder read.
//!
//! Full chroma resolution, 8 bits, ITU-R BT.709 in its limited range: luma 16 to 235, chroma 16 to 240.

use super::ratio::Ratio;
use std::io::{self, Write};

/// Writes the stream's header.
///
/// # Errors
/// When the output fails.
pub fn header(out: &mut dyn Write, [width, height]: [u32; 2], fps: Ratio) -> io::Result<()> {
    let (num, den) = fps.parts();
    writeln!(
        out,
        "YUV4MPEG2 W{width} H{height} F{num}:{den} Ip A1:1 C444 XCOLORRANGE=LIMITED"
    )
}

/// A frame of RGB triples of display codes, rows from the top, as the stream has it.
#[must_use]
pub fn frame(codes: &[[u8; 3]]) -> Vec<u8> {
    const MARK: &[u8] = b"FRAME\n";
    let mut bytes = Vec::with_capacity(MARK.len() + 3 * codes.len());
    bytes.extend(MARK);
    for plane in 0..3 {
        bytes.extend(codes.iter().map(|rgb| yuv(*rgb)[plane]));
    }
    bytes
}

/// BT.709's luma and chroma of display codes.
fn yuv(rgb: [u8; 3]) -> [u8; 3] {
    let [r, g, b] = rgb.map(|c| f32::from(c) / 255.0);
    let y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
    // (B - Y) / 1.8556 and (R - Y) / 1.5748 lie in -0.5..=0.5.
    [
        16.0 + 219.0 * y,
        128.0 + 224.0 * (b - y) / 1.8556,
        128.0 + 224.0 * (r - y) / 1.5748,
    ]
    .map(|v| v.round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_those_of_bt_709() {
        assert_eq!(yuv([0; 3]), [16, 128, 128]);
        assert_eq!(yuv([255; 3]), [235, 128, 128]);
        assert_eq!(yuv([255, 0, 0]), [63, 102, 240]);
        assert_eq!(yuv([0, 255, 0]), [173, 42, 26]);
        assert_eq!(yuv([0, 0, 255]), [32, 240, 118]);
    }

    #[test]
    fn a_stream_is_a_header_and_frames_of_planes() {
        let mut out = Vec::new();
        let fps = Ratio::parse("30000/1001").unwrap();
        header(&mut out, [2, 1], fps).unwrap();
        out.extend(frame(&[[255; 3], [255, 0, 0]]));
        let expected = b"YUV4MPEG2 W2 H1 F30000:1001 Ip A1:1 C444 XCOLORRANGE=LIMITED\n\
            FRAME\n\xeb\x3f\x80\x66\x80\xf0";
        assert_eq!(out, expected);
    }
}
