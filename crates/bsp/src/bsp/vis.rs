//! Which leafs can see which (PVS), and the external `.vis` file that replaces it.

use super::{Bsp, Format, records};
use crate::error::{WarningKind, Warnings};
use crate::reader::{Reader, until_nul};

/// The leafs that can be seen from some leaf.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pvs {
    /// Bit i of the row is leaf i + 1; `None` if everything is visible.
    row: Option<Vec<u8>>,
}

impl Pvs {
    /// Whether `leaf` is visible. Leafs without a bit are.
    pub fn sees(&self, leaf: usize) -> bool {
        let Some(row) = &self.row else { return true };
        let Some(bit) = leaf.checked_sub(1) else {
            return false;
        };
        row.get(bit / 8).is_none_or(|b| b >> (bit % 8) & 1 != 0)
    }

    /// Whether there was no data to exclude anything.
    pub fn is_everything(&self) -> bool {
        self.row.is_none()
    }
}

/// Decompresses one row of `length` bytes: a byte that is not 0 stands for itself, 0 and n for n
/// zeros. The flag tells that the data ended before the row did: the rest is all visible.
pub fn decompress(data: &[u8], length: usize) -> (Vec<u8>, bool) {
    // A run byte makes at most 255 bytes of 2, so the row is bounded by the data as well.
    let mut row = Vec::with_capacity(length.min(data.len().saturating_mul(128)));
    let mut bytes = data.iter().copied();
    while row.len() < length {
        match bytes.next() {
            Some(0) => match bytes.next() {
                Some(run) => row.resize(length.min(row.len() + usize::from(run)), 0),
                None => break,
            },
            Some(literal) => row.push(literal),
            None => break,
        }
    }
    let short = row.len() < length;
    row.resize(length, 0xff);
    (row, short)
}

impl Bsp {
    /// Bytes of a visibility row: one bit for each leaf that the world model counts.
    pub fn vis_row_bytes(&self) -> usize {
        let claimed = self.models.first().map_or(0, |m| m.vis_leafs);
        let leafs = self.leafs.len().saturating_sub(1);
        usize::try_from(claimed).unwrap_or(0).min(leafs).div_ceil(8)
    }

    /// What can be seen from a leaf. Everything, if the leaf is the solid one or has no row, or
    /// there is no visibility data.
    pub fn pvs(&self, leaf: usize) -> Pvs {
        let offset = match self.leafs.get(leaf) {
            Some(l) if leaf != 0 => usize::try_from(l.vis_offset).ok(),
            _ => None,
        };
        let row = offset
            .and_then(|o| self.visibility.get(o..))
            .filter(|data| !data.is_empty())
            .map(|data| decompress(data, self.vis_row_bytes()).0);
        Pvs { row }
    }

    /// Warns of visibility data that is not whole.
    pub(super) fn check_visibility(&self, warnings: &mut Warnings) {
        if self.visibility.is_empty() {
            return;
        }
        let claimed = self.models.first().map_or(0, |m| m.vis_leafs);
        let leafs = self.leafs.len().saturating_sub(1);
        if !usize::try_from(claimed).is_ok_and(|n| n <= leafs) {
            warnings.add(WarningKind::Visibility, "leafs", || {
                format!("the world claims {claimed} leafs with visibility of {leafs}")
            });
        }
        let beyond = self
            .leafs
            .iter()
            .skip(1)
            .filter(|l| usize::try_from(l.vis_offset).is_ok_and(|o| o >= self.visibility.len()))
            .count();
        warnings.add_many(WarningKind::Visibility, "offset", beyond as u64, || {
            "a leaf's visibility row lies past the end of the lump: it sees everything".to_owned()
        });
    }

    /// Replaces visibility and leafs by those that an external `.vis` file holds for `map`
    /// (`start.bsp`). Gives whether it did; what is unusable is left with a warning.
    pub fn apply_vis(&mut self, file: &[u8], map: &str, warnings: &mut Warnings) -> bool {
        let mut ignore = |why: &str| {
            warnings.add(WarningKind::Companion, "vis", || {
                format!("the external .vis file was ignored: {why}")
            });
            false
        };
        if self.format != Format::Bsp29 {
            return ignore("it serves levels of version 29 only");
        }
        let Some((visibility, leafs)) = find_vis(file, map) else {
            return ignore("it has no whole entry for this level");
        };
        let leafs = records::leafs(leafs, self.format);
        // The nodes' children were checked against the leafs there are.
        if leafs.len() != self.leafs.len() {
            return ignore("its number of leafs differs from the level's");
        }
        self.visibility = visibility.to_vec();
        self.leafs = leafs;
        super::validate::leafs(self, warnings);
        self.check_visibility(warnings);
        true
    }
}

/// Visibility and leaf bytes of a map in a `.vis` file.
fn find_vis<'a>(file: &'a [u8], map: &str) -> Option<(&'a [u8], &'a [u8])> {
    let mut reader = Reader::new(file);
    loop {
        let name = reader.take(32)?;
        let length = usize::try_from(reader.i32()?).ok()?;
        let body = reader.take(length)?;
        if until_nul(name).eq_ignore_ascii_case(map.as_bytes()) {
            let mut body = Reader::new(body);
            let length = usize::try_from(body.i32()?).ok()?;
            let visibility = body.take(length)?;
            let length = usize::try_from(body.i32()?).ok()?;
            return Some((visibility, body.take(length)?));
        }
    }
}
