//! A level's lightmaps beside light that is traced by the light compilers' rules.
//!
//! Facts about the rules are from ericw-tools' `light`: where it takes its samples ([`faces`]), what
//! casts shadows ([`shadows`]), and what adds up in which order ([`light`]).

pub mod atlas;
pub mod compare;
pub mod faces;
pub mod light;
pub mod shadows;
