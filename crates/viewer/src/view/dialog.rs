//! The system's own dialog for opening a file, beside the frame loop.

use super::app::App;
use super::panels::FILE_KINDS;
use std::path::{Path, PathBuf};
use std::pin::Pin;
use std::task::{Context, Poll, Waker};
use std::time::{Duration, Instant};

/// Nobody says no so soon: then there was no dialog.
const SOON: Duration = Duration::from_millis(400);
/// How often it is asked whether a file was chosen.
const EVERY: Duration = Duration::from_millis(100);

/// A dialog that is open.
pub struct Dialog {
    answer: Pin<Box<dyn Future<Output = Option<PathBuf>> + Send>>,
    opened: Instant,
}

/// What became of a dialog.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// A file was chosen.
    File(PathBuf),
    /// None was.
    Nothing,
    /// The system has no such dialog: neither a portal nor zenity on Linux.
    NoDialog,
}

impl Dialog {
    /// Opens the system's, at a folder.
    #[must_use]
    pub fn open(folder: Option<&Path>) -> Self {
        let mut dialog = rfd::AsyncFileDialog::new()
            .set_title("Open a level, demo, archive or picture")
            .add_filter("levels, demos, archives, pictures", &FILE_KINDS)
            .add_filter("all files", &["*"]);
        if let Some(folder) = folder {
            dialog = dialog.set_directory(folder);
        }
        let file = dialog.pick_file();
        Self::of(async move { file.await.map(|file| file.path().to_owned()) })
    }

    /// One whose answer comes from elsewhere.
    #[must_use]
    pub fn of(answer: impl Future<Output = Option<PathBuf>> + Send + 'static) -> Self {
        Self {
            answer: Box::pin(answer),
            opened: Instant::now(),
        }
    }

    /// The answer, once it is there; not to be asked again after that.
    pub fn poll(&mut self) -> Option<Answer> {
        let mut context = Context::from_waker(Waker::noop());
        match self.answer.as_mut().poll(&mut context) {
            Poll::Pending => None,
            Poll::Ready(Some(file)) => Some(Answer::File(file)),
            Poll::Ready(None) if self.opened.elapsed() < SOON => Some(Answer::NoDialog),
            Poll::Ready(None) => Some(Answer::Nothing),
        }
    }
}

impl App {
    /// Opens the system's dialog, unless one is open.
    pub fn ask_for_file(&mut self) {
        if self.dialog.is_none() {
            let here = std::env::current_dir().ok();
            let folder = self.global.basedir.clone().or(here);
            self.dialog = Some(Dialog::open(folder.as_deref()));
        }
    }

    /// Opens the file that was chosen. Without a dialog files are listed in the window.
    pub(super) fn receive_dialog(&mut self) {
        let Some(dialog) = &mut self.dialog else {
            return;
        };
        let Some(answer) = dialog.poll() else {
            return self.egui().request_repaint_after(EVERY);
        };
        self.dialog = None;
        match answer {
            Answer::File(path) => self.open_from_list(&path),
            Answer::Nothing => {}
            Answer::NoDialog => {
                (self.panels.open, self.panels.lists_files) = (true, true);
                let why = "the system has no dialog to choose files; they are listed here";
                self.notices.say(why.into());
            }
        }
    }

    /// Opens a file, and leaves the panel for that open where it has something to choose from.
    pub(super) fn open_from_list(&mut self, path: &Path) {
        self.open_file(path);
        let kind = path.extension().unwrap_or_default();
        self.panels.open = kind.eq_ignore_ascii_case("pak");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dialog_answers_once_or_was_none() {
        let mut chosen = Dialog::of(async { Some(PathBuf::from("a.bsp")) });
        assert_eq!(chosen.poll(), Some(Answer::File("a.bsp".into())));
        let mut none = Dialog::of(async { None });
        assert_eq!(none.poll(), Some(Answer::NoDialog));
        let mut refused = Dialog::of(async { None });
        refused.opened = refused.opened.checked_sub(SOON).unwrap_or(refused.opened);
        assert_eq!(refused.poll(), Some(Answer::Nothing));
        let mut open = Dialog::of(std::future::pending());
        assert_eq!((open.poll(), open.poll()), (None, None));
    }
}
