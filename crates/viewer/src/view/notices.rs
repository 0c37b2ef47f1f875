//! Sentences for people, for a while.

/// Seconds that a notice stays, and an error.
const STAYS: [f32; 2] = [12.0, 30.0];
/// More are not shown at a time.
const MOST: usize = 6;

/// A sentence.
#[derive(Clone, Debug, PartialEq)]
pub struct Notice {
    /// What is said.
    pub text: String,
    /// Whether something could not be done.
    pub is_error: bool,
    left: f32,
}

/// What was said lately.
#[derive(Clone, Debug, Default)]
pub struct Notices(Vec<Notice>);

impl Notices {
    /// Says something.
    pub fn say(&mut self, text: String) {
        self.add(text, false);
    }

    /// Says what could not be done.
    pub fn error(&mut self, text: String) {
        self.add(text, true);
    }

    fn add(&mut self, text: String, is_error: bool) {
        self.0.retain(|n| n.text != text);
        self.0.push(Notice {
            text,
            is_error,
            left: STAYS[usize::from(is_error)],
        });
        if self.0.len() > MOST {
            self.0.remove(0);
        }
    }

    /// Time passes.
    pub fn pass(&mut self, seconds: f32) {
        self.0.iter_mut().for_each(|n| n.left -= seconds);
        self.0.retain(|n| n.left > 0.0);
    }

    /// What is still there, the oldest first.
    #[must_use]
    pub fn all(&self) -> &[Notice] {
        &self.0
    }

    /// Forgets one.
    pub fn forget(&mut self, index: usize) {
        self.0.remove(index);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notices_go_by_themselves_and_are_never_many() {
        let mut notices = Notices::default();
        notices.say("a".into());
        notices.error("b".into());
        notices.say("a".into());
        let texts = |n: &Notices| n.all().iter().map(|n| n.text.clone()).collect::<Vec<_>>();
        assert_eq!(texts(&notices), ["b", "a"]);
        notices.pass(15.0);
        assert_eq!(texts(&notices), ["b"]);
        (0..20).for_each(|i| notices.say(i.to_string()));
        assert_eq!(notices.all().len(), MOST);
        notices.pass(100.0);
        assert!(notices.all().is_empty());
    }
}
