//! What levels call themselves, read beside the frame loop: a search path has hundreds of them.

use crate::cli::Global;
use crate::level::search_path;
use bsp::{Bsp, Limits};
use std::collections::HashMap;
use std::sync::mpsc::{Receiver, channel};

/// The titles of levels by their names, as far as they are read.
#[derive(Default)]
pub struct Titles {
    found: HashMap<String, String>,
    coming: Option<Receiver<(String, String)>>,
}

impl Titles {
    /// Begins to read the titles of levels that the search path has as `maps/NAME.bsp`.
    pub fn read(&mut self, global: &Global, names: Vec<String>) {
        let (sender, coming) = channel();
        let global = global.clone();
        self.coming = Some(coming);
        std::thread::spawn(move || {
            // Whoever listed the names has said what is wrong with it.
            let Ok(search) = search_path(&global) else {
                return;
            };
            for name in names {
                // What can't be read says so when it is opened.
                let file = search.read(&format!("maps/{name}.bsp"));
                let title = file.map(|f| Bsp::title(&f.bytes, &Limits::default()));
                if let Ok(Some(title)) = title
                    && sender.send((name, title)).is_err()
                {
                    // Nobody waits any more.
                    return;
                }
            }
        });
    }

    /// The title of a level; empty if it has none, or it is not read yet.
    #[must_use]
    pub fn of(&self, name: &str) -> &str {
        self.found.get(name).map_or("", String::as_str)
    }

    /// Takes what was read meanwhile; whether more may come.
    pub fn receive(&mut self) -> bool {
        let Some(coming) = &self.coming else {
            return false;
        };
        loop {
            match coming.try_recv() {
                Ok((name, title)) => _ = self.found.insert(name, title),
                Err(std::sync::mpsc::TryRecvError::Empty) => return true,
                Err(std::sync::mpsc::TryRecvError::Disconnected) => break,
            }
        }
        self.coming = None;
        false
    }
}
