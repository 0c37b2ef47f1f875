//! Remarks of an import: one sentence per oddity, with how often it came.

/// Most different remarks kept.
const MAX_NOTES: usize = 200;

/// Collects remarks. Those of the same subject are told once and counted.
#[derive(Debug, Default)]
pub struct Notes {
    list: Vec<(String, String, usize)>,
    suppressed: usize,
}

impl Notes {
    /// Tells of one occurrence; `text` is called for the first of its `subject` only.
    pub fn add(&mut self, subject: &str, text: impl FnOnce() -> String) {
        if let Some(known) = self.list.iter_mut().find(|(s, ..)| s == subject) {
            known.2 += 1;
        } else if self.list.len() < MAX_NOTES {
            self.list.push((subject.to_owned(), text(), 1));
        } else {
            self.suppressed += 1;
        }
    }

    /// The sentences in order of first occurrence.
    pub fn into_sentences(self) -> Vec<String> {
        let mut out: Vec<String> = self
            .list
            .into_iter()
            .map(|(_, text, count)| match count {
                1 => text,
                n => format!("{text} ({n} times)"),
            })
            .collect();
        if self.suppressed > 0 {
            out.push(format!("{} more remarks of other kinds", self.suppressed));
        }
        out
    }
}
