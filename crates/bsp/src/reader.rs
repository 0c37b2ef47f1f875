//! A little-endian cursor over bytes that may end anywhere.

/// Reads little-endian values one after the other; every method gives `None` at the end of the
/// bytes and then leaves the cursor where it was.
#[derive(Clone, Copy)]
pub(crate) struct Reader<'a> {
    rest: &'a [u8],
}

impl<'a> Reader<'a> {
    pub fn new(data: &'a [u8]) -> Self {
        Self { rest: data }
    }

    /// A cursor at `offset`, or `None` beyond the end.
    pub fn at(data: &'a [u8], offset: usize) -> Option<Self> {
        Some(Self {
            rest: data.get(offset..)?,
        })
    }

    pub fn remaining(&self) -> usize {
        self.rest.len()
    }

    pub fn take(&mut self, n: usize) -> Option<&'a [u8]> {
        let (head, rest) = self.rest.split_at_checked(n)?;
        self.rest = rest;
        Some(head)
    }

    #[inline]
    pub fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, rest) = self.rest.split_first_chunk::<N>()?;
        self.rest = rest;
        Some(*head)
    }

    #[inline]
    pub fn u8(&mut self) -> Option<u8> {
        self.array::<1>().map(|[b]| b)
    }

    #[inline]
    pub fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    #[inline]
    pub fn i16(&mut self) -> Option<i16> {
        self.array().map(i16::from_le_bytes)
    }

    #[inline]
    pub fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    #[inline]
    pub fn i32(&mut self) -> Option<i32> {
        self.array().map(i32::from_le_bytes)
    }

    #[inline]
    pub fn f32(&mut self) -> Option<f32> {
        self.array().map(f32::from_le_bytes)
    }

    #[inline]
    pub fn vec3(&mut self) -> Option<[f32; 3]> {
        Some([self.f32()?, self.f32()?, self.f32()?])
    }

    #[inline]
    pub fn vec4(&mut self) -> Option<[f32; 4]> {
        Some([self.f32()?, self.f32()?, self.f32()?, self.f32()?])
    }
}

/// Reads a table of records of `size` bytes each; bytes after the last whole record are left.
pub(crate) fn records<'a, T>(
    data: &'a [u8],
    size: usize,
    read: impl Fn(&mut Reader<'a>) -> Option<T>,
) -> Vec<T> {
    let mut out = Vec::with_capacity(data.len().checked_div(size).unwrap_or(0));
    if size > 0 {
        out.extend(
            data.chunks_exact(size)
                .map_while(|record| read(&mut Reader::new(record))),
        );
    }
    out
}

/// The bytes of a fixed-size name field before its first NUL, or all of them.
pub(crate) fn until_nul(field: &[u8]) -> &[u8] {
    field.split(|&b| b == 0).next().unwrap_or_default()
}

/// Bytes as text, each byte the character of the same number, so that no byte is lost.
pub(crate) fn latin1(bytes: &[u8]) -> String {
    bytes.iter().map(|&b| char::from(b)).collect()
}
