//! `runelight view`: a window on a level that is path traced while one flies through it.
//!
//! [`app`] is what happens in a frame, whatever it is shown on; [`window`] is the window system around
//! it, and [`session`] the same without one. What moves the eye ([`fly`], [`walk`]), shares out the work
//! ([`pace`]) and says the picture as a command ([`look`]) is plain arithmetic.

pub mod app;
pub mod convergence;
pub mod dialog;
pub mod display;
pub mod draw;
pub mod entities;
pub mod export;
pub mod fly;
pub mod gamepad;
pub mod hot;
pub mod inspect;
pub mod keys;
pub mod look;
pub mod looking;
pub mod notices;
pub mod pace;
pub mod panels;
pub mod path;
pub mod player;
pub mod preferences;
pub mod restore;
pub mod save;
pub mod session;
pub mod stage;
pub mod statistics;
pub mod titles;
pub mod walk;
pub mod watch;
pub mod window;

/// Samples per pixel at which a picture is done where nothing else is asked for.
pub const SAMPLES: u32 = 1 << 16;
