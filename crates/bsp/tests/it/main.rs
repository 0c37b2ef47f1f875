//! Tests of the readers: on levels made in memory, and on real files where they are at hand.

mod archives;
mod data;
mod demos;
mod entities;
mod fixture;
mod gotchas;
mod model_fixture;
mod models;
mod other_reader;
mod posed;
mod posed_fixture;
mod real;
mod room;
mod textures;
