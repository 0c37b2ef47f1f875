//! What keys do.

use egui::Key;

/// Something that a key does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Action {
    /// Move forward while held.
    Forward,
    /// Move backward while held.
    Back,
    /// Move to the left while held.
    Left,
    /// Move to the right while held.
    Right,
    /// Rise while held; jump when walking.
    Up,
    /// Sink while held.
    Down,
    /// Walk with the player's box, or fly again.
    Walk,
    /// The next of the level's cameras.
    NextCamera,
    /// The mouse turns the view without a button, until Escape.
    MouseLook,
    /// Save EXR and PNG.
    Save,
    /// Read the level's files anew.
    Reload,
    /// Show or hide all panels.
    Panels,
    /// Show or hide the list of keys.
    Help,
    /// Fill the screen, or not.
    FullScreen,
    /// Play the demo, or stop it.
    Play,
    /// Some seconds of the demo back.
    Earlier,
    /// Some seconds of the demo forward.
    Later,
    /// The marked part of the demo begins here.
    MarkBegin,
    /// The marked part of the demo ends here.
    MarkEnd,
}

/// All of them with their names in the settings file, what they do, and their usual keys.
pub const ACTIONS: [(Action, &str, &str, Key); 19] = [
    (Action::Forward, "forward", "move forward", Key::W),
    (Action::Back, "back", "move backward", Key::S),
    (Action::Left, "left", "move to the left", Key::A),
    (Action::Right, "right", "move to the right", Key::D),
    (Action::Up, "up", "rise; jump when walking", Key::Space),
    (Action::Down, "down", "sink", Key::C),
    (
        Action::Walk,
        "walk",
        "walk as a player, or fly again",
        Key::V,
    ),
    (
        Action::NextCamera,
        "next_camera",
        "go to the level's next camera",
        Key::N,
    ),
    (
        Action::MouseLook,
        "mouse_look",
        "look around without a button, until Escape",
        Key::M,
    ),
    (Action::Save, "save", "save EXR and PNG", Key::P),
    (
        Action::Reload,
        "reload",
        "read the level's files anew",
        Key::F5,
    ),
    (Action::Panels, "panels", "show or hide the panels", Key::H),
    (Action::Help, "help", "show or hide this list", Key::F1),
    (
        Action::FullScreen,
        "full_screen",
        "fill the screen",
        Key::F11,
    ),
    (
        Action::Play,
        "play",
        "play the demo, or stop it",
        Key::Enter,
    ),
    (
        Action::Earlier,
        "earlier",
        "5 seconds of the demo back",
        Key::ArrowLeft,
    ),
    (
        Action::Later,
        "later",
        "5 seconds of the demo forward",
        Key::ArrowRight,
    ),
    (
        Action::MarkBegin,
        "mark_begin",
        "the marked part of the demo begins here",
        Key::I,
    ),
    (
        Action::MarkEnd,
        "mark_end",
        "the marked part of the demo ends here",
        Key::O,
    ),
];

/// Which key does what.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bindings([Key; ACTIONS.len()]);

impl Default for Bindings {
    fn default() -> Self {
        Self(ACTIONS.map(|(.., key)| key))
    }
}

impl Bindings {
    /// The key of an action.
    #[must_use]
    pub fn key(&self, action: Action) -> Key {
        self.0[action as usize]
    }

    /// Gives an action, by its name, another key, by its name.
    ///
    /// # Errors
    /// A sentence when there is no such action or key.
    pub fn set(&mut self, action: &str, key: &str) -> Result<(), String> {
        let index = ACTIONS.iter().position(|(_, name, ..)| *name == action);
        let index = index.ok_or_else(|| format!("{action} is nothing that a key does"))?;
        self.0[index] = Key::from_name(key).ok_or_else(|| format!("{key} is no key"))?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_action_has_a_key_of_its_own_that_can_be_changed() {
        let mut bindings = Bindings::default();
        for (i, (action, name, _, key)) in ACTIONS.into_iter().enumerate() {
            assert_eq!(action as usize, i, "{name} is in its place");
            assert_eq!(bindings.key(action), key);
            let same = ACTIONS.iter().filter(|(.., k)| *k == key);
            assert_eq!(same.count(), 1, "{key:?} does one thing");
        }
        bindings.set("save", "F12").unwrap();
        assert_eq!(bindings.key(Action::Save), Key::F12);
        assert!(
            bindings
                .set("fly", "A")
                .unwrap_err()
                .contains("fly is nothing")
        );
        assert!(
            bindings
                .set("save", "Any")
                .unwrap_err()
                .contains("Any is no key")
        );
    }
}
