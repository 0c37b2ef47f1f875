//! Demos: blocks, and the messages of all protocols.
#![no_main]

use bsp::dem::{Demo, Message, Summary};
use bsp::{Limits, Warnings};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let mut warnings = Warnings::new();
    let Ok(demo) = Demo::parse(data, &Limits::default(), &mut warnings) else {
        return;
    };
    let mut player = demo.player();
    while let Some(block) = player.next_block(&mut warnings, |message| {
        if let Message::Entity(e) = message {
            assert!(e.state.origin.iter().chain(&e.state.angles).all(|x| x.is_finite()));
        }
    }) {
        assert!(block.view_angles.iter().all(|a| a.is_finite()));
    }
    let summary = Summary::of(&demo, &mut warnings);
    assert!(summary.blocks <= demo.blocks.len() && summary.seconds().is_finite());
});
