//! Scenes with known answers, and the tool to build such scenes by hand.

#![forbid(unsafe_code)]

pub mod builder;
