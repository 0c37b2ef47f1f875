//! The hard-case gallery: scenes that are known to break renderers, each with its answer.
//!
//! A [`Case`] is a scene, a view of it, the [`Truth`] about the picture, and a pass line with its
//! reason. Scenes are built by hand ([`builder`]) where a figure must be exact, and compiled from
//! brushes and imported ([`level`]) where the import itself is on trial. Nothing here renders:
//! whoever has a picture of a case asks [`Case::judge`] what to think of it.
//!
//! ```
//! use gallery::{Truth, cases};
//!
//! let case = cases().into_iter().find(|c| c.name == "closed box").expect("a case");
//! let settings = case.settings(scene::render::Estimator::Mis, 1);
//! assert_eq!(settings.width, settings.height);
//! assert!(matches!(case.truth, Truth::Radiance(_)));
//! assert_eq!(case.scene().triangle_count(), 12);
//! ```

#![forbid(unsafe_code)]

pub mod builder;
mod case;
mod cases;
pub mod formulas;
mod judge;
pub mod level;
pub mod lumps;
mod run;

pub use case::{Case, Escapes, Line, Truth};
pub use cases::cases;
pub use judge::{SIGMAS, Target, Verdict};
pub use run::{Plan, Render};
