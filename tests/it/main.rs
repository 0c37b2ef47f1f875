//! The integration tests: physical truths, agreement of estimators and devices.

mod energy;
mod hygiene;
mod parity;
