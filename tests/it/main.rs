//! The integration tests: physical truths, agreement of estimators and devices, golden pictures.

mod display;
mod energy;
mod every_level;
mod golden;
mod hygiene;
mod parity;
