//! Headers of models and sprites, and the recognition of files.
#![no_main]

use bsp::mdl::MdlHeader;
use bsp::spr::SprHeader;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let _ = MdlHeader::parse(data);
    let _ = SprHeader::parse(data);
    assert!(!bsp::sniff(data).describe().is_empty());
});
