//! Ctrl-C: the first asks to finish, the second gives up.

use crate::output::remove_unfinished;
use anyhow::{Context as _, Result};
use std::sync::atomic::{AtomicBool, Ordering};

static ASKED: AtomicBool = AtomicBool::new(false);

/// Exit code of a process ended by Ctrl-C, as shells give it.
const ABORTED: i32 = 130;

/// Installs the handler, unless it is there.
///
/// # Errors
/// When the system refuses.
pub fn install() -> Result<()> {
    static IS_THERE: AtomicBool = AtomicBool::new(false);
    if IS_THERE.swap(true, Ordering::Relaxed) {
        return Ok(());
    }
    ctrlc::set_handler(|| {
        if ASKED.swap(true, Ordering::Relaxed) {
            remove_unfinished();
            std::process::exit(ABORTED);
        }
    })
    .context("the handler of Ctrl-C cannot be installed")
}

/// Whether the user asked to finish.
#[must_use]
pub fn asked() -> bool {
    ASKED.load(Ordering::Relaxed)
}
