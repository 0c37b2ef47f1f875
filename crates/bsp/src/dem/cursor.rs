//! A cursor over one server message, with the numbers of its protocol.

use super::message::{Fault, Vec3};
use crate::reader::Reader;

/// Largest coordinate, angle or speed taken from a message. Engines keep coordinates within
/// 1/8 million; anything beyond is damage.
const LARGEST: f32 = 1.0e6;

/// How protocol 999 sends numbers, by its flags.
pub mod flag {
    /// Angles have 16 bits.
    pub const SHORT_ANGLE: u32 = 1 << 1;
    /// Angles are floats.
    pub const FLOAT_ANGLE: u32 = 1 << 2;
    /// Coordinates have 24 bits.
    pub const COORD_24BIT: u32 = 1 << 3;
    /// Coordinates are floats.
    pub const FLOAT_COORD: u32 = 1 << 4;
    /// Entities have a scale.
    pub const EDICT_SCALE: u32 = 1 << 5;
    /// Alpha is checked by the server.
    pub const ALPHA_SANITY: u32 = 1 << 6;
    /// Coordinates have 32 bits, 4 of them after the point.
    pub const INT32_COORD: u32 = 1 << 7;
    /// All of them.
    pub const KNOWN: u32 = 0xfe;
}

/// What a read gives.
pub type Read<T> = Result<T, Fault>;

/// Reads the values of one message one after the other. Numbers that are not finite or beyond
/// [`LARGEST`] come out as 0 and are counted.
pub struct Cursor<'a> {
    reader: Reader<'a>,
    size: usize,
    flags: u32,
    /// Numbers that were replaced by 0.
    pub wild: u64,
}

impl<'a> Cursor<'a> {
    /// A cursor at the start of `data`; `flags` are those of protocol 999, 0 for all others.
    pub fn new(data: &'a [u8], flags: u32) -> Self {
        Self {
            reader: Reader::new(data),
            size: data.len(),
            flags,
            wild: 0,
        }
    }

    /// Sets the flags that numbers are sent by.
    pub fn set_flags(&mut self, flags: u32) {
        self.flags = flags;
    }

    /// Bytes read so far.
    pub fn at(&self) -> usize {
        self.size - self.reader.remaining()
    }

    pub fn is_empty(&self) -> bool {
        self.reader.remaining() == 0
    }

    pub fn byte(&mut self) -> Read<u8> {
        self.reader.u8().ok_or(Fault::End)
    }

    pub fn char(&mut self) -> Read<i8> {
        self.byte().map(u8::cast_signed)
    }

    pub fn u16(&mut self) -> Read<u16> {
        self.reader.u16().ok_or(Fault::End)
    }

    pub fn short(&mut self) -> Read<i16> {
        self.reader.i16().ok_or(Fault::End)
    }

    pub fn long(&mut self) -> Read<i32> {
        self.reader.i32().ok_or(Fault::End)
    }

    pub fn ulong(&mut self) -> Read<u32> {
        self.reader.u32().ok_or(Fault::End)
    }

    /// A byte, or a short where `wide`.
    pub fn byte_or_short(&mut self, wide: bool) -> Read<u16> {
        if wide {
            self.u16()
        } else {
            self.byte().map(u16::from)
        }
    }

    pub fn skip(&mut self, bytes: usize) -> Read<()> {
        self.reader.take(bytes).map(|_| ()).ok_or(Fault::End)
    }

    fn tame(&mut self, value: f32) -> f32 {
        if value.abs() <= LARGEST {
            return value;
        }
        self.wild += 1;
        0.0
    }

    pub fn float(&mut self) -> Read<f32> {
        let value = self.reader.f32().ok_or(Fault::End)?;
        Ok(self.tame(value))
    }

    /// The bytes before the next NUL, which is skipped.
    pub fn string(&mut self) -> Read<&'a [u8]> {
        let mut probe = self.reader;
        let rest = probe.take(probe.remaining()).unwrap_or_default();
        let length = rest.iter().position(|&b| b == 0).ok_or(Fault::End)?;
        let text = self.reader.take(length).ok_or(Fault::End)?;
        self.skip(1)?;
        Ok(text)
    }

    pub fn coord(&mut self) -> Read<f32> {
        let flags = self.flags;
        if flags & flag::FLOAT_COORD != 0 {
            self.float()
        } else if flags & flag::INT32_COORD != 0 {
            // 16 is a power of two: f64 keeps all bits until the one rounding.
            let value = (f64::from(self.long()?) / 16.0) as f32;
            Ok(self.tame(value))
        } else if flags & flag::COORD_24BIT != 0 {
            Ok(f32::from(self.short()?) + f32::from(self.byte()?) / 255.0)
        } else {
            Ok(f32::from(self.short()?) / 8.0)
        }
    }

    pub fn coords(&mut self) -> Read<Vec3> {
        Ok([self.coord()?, self.coord()?, self.coord()?])
    }

    /// An angle in degrees.
    pub fn angle(&mut self) -> Read<f32> {
        if self.flags & (flag::FLOAT_ANGLE | flag::SHORT_ANGLE) != 0 {
            return self.angle16();
        }
        Ok(f32::from(self.char()?) * (360.0 / 256.0))
    }

    /// An angle in degrees of at least 16 bits.
    pub fn angle16(&mut self) -> Read<f32> {
        if self.flags & flag::FLOAT_ANGLE != 0 {
            return self.float();
        }
        Ok(f32::from(self.short()?) * (360.0 / 65536.0))
    }

    pub fn angles(&mut self) -> Read<Vec3> {
        Ok([self.angle()?, self.angle()?, self.angle()?])
    }
}
