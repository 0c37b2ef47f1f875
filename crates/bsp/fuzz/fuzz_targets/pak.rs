//! PAK directories.
#![no_main]

use bsp::pak::Directory;
use bsp::{Limits, Warnings};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    if let Ok(directory) = Directory::parse(data, &Limits::default(), &mut Warnings::new()) {
        for entry in directory.entries() {
            assert!(entry.offset + entry.length <= data.len() as u64);
            assert!(directory.find(&entry.name).is_some());
        }
    }
});
