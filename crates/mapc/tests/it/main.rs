//! Tests of the map compiler: it writes, an independent reader reads.

mod check;
mod maps;
mod reader;
mod sample;
