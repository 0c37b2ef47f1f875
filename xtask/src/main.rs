//! Developer chores: `cargo xtask test`, `cargo xtask sample`, `cargo xtask accuracy`, `cargo xtask gallery`,
//! `cargo xtask abi`.

#[path = "../../crates/rt/src/abi.rs"]
#[allow(dead_code, reason = "only the generated text is used here")]
mod abi;
mod accuracy;
mod gallery;
mod sample;
mod test;

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

const HELP: &str = "\
cargo xtask test [ARGUMENTS]  install or name what the tests need, then run every test
                              (ARGUMENTS go to cargo test)
cargo xtask sample            rebuild assets/sample from its source
cargo xtask accuracy          measure precision, hard cases and speed against error, and write
                              docs/accuracy.md (--device TEXT: the Vulkan device, llvmpipe)
cargo xtask gallery           render the pictures in docs/gallery, on the processor (minutes)
cargo xtask abi               rewrite shaders/abi.glsl from crates/rt/src/abi.rs";

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let result = match arguments.next().as_deref() {
        Some("test") => test::run(&arguments.collect::<Vec<_>>()),
        Some("sample") => sample::run(),
        Some("accuracy") => accuracy::run(&arguments.collect::<Vec<_>>()),
        Some("gallery") => gallery::run(),
        Some("abi") => std::fs::write(root().join("shaders/abi.glsl"), abi::glsl())
            .map_err(|e| Box::<dyn Error>::from(format!("shaders/abi.glsl: {e}"))),
        Some("help" | "--help" | "-h") | None => {
            println!("{HELP}");
            Ok(())
        }
        Some(other) => {
            eprintln!("xtask: there is no chore {other}\n\n{HELP}");
            return ExitCode::from(2);
        }
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("xtask: {error}");
            ExitCode::FAILURE
        }
    }
}

/// The project's root folder.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}
