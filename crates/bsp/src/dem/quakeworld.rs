//! Recognising recordings of QuakeWorld, to refuse them by name.

use crate::reader::Reader;

/// Records that must make sense.
const RECORDS: usize = 3;
/// Longest packet of a record.
const LONGEST: u32 = 1 << 16;

/// Whether bytes without a line for a CD track look like a `.qwd` or `.mvd`.
pub fn is_quakeworld(bytes: &[u8]) -> bool {
    let all = |record: fn(&mut Reader<'_>) -> Option<()>| {
        let mut r = Reader::new(bytes);
        (0..RECORDS).all(|_| record(&mut r).is_some())
    };
    all(qwd_record) || all(mvd_record)
}

fn packet(r: &mut Reader<'_>) -> Option<()> {
    let length = r.u32().filter(|l| (1..=LONGEST).contains(l))?;
    r.take(length as usize).map(|_| ())
}

/// The time, then a command of the player, a packet, or numbers of packets.
fn qwd_record(r: &mut Reader<'_>) -> Option<()> {
    let time = r.f32()?;
    // A number that small and not zero is no time but other bytes.
    if time != 0.0 && !(1.0e-3..1.0e7).contains(&time) {
        return None;
    }
    match r.u8()? {
        0 => r.take(36).map(|_| ()),
        1 => packet(r),
        2 => r.take(8).map(|_| ()),
        _ => None,
    }
}

/// Milliseconds, then whom a packet is for.
fn mvd_record(r: &mut Reader<'_>) -> Option<()> {
    r.u8()?;
    match r.u8()? & 7 {
        1 | 4 | 5 | 6 => packet(r),
        2 => r.take(8).map(|_| ()),
        3 => {
            r.take(4)?;
            packet(r)
        }
        _ => None,
    }
}
