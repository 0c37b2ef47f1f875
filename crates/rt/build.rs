//! Compiles `shaders/` to SPIR-V in `OUT_DIR`, with compilers that come as crates.
//!
//! Screen-space passes (`.comp`) go through naga, in pure Rust. Ray-tracing stages go through the
//! bundled glslang: naga's GLSL front end has no ray-tracing stages, buffer references or scalar
//! layout.

#[path = "src/shader_compiler.rs"]
mod shader_compiler;

use std::{env, fs, path::PathBuf};

fn main() {
    let shaders = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("set by cargo"))
        .join("../../shaders");
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("set by cargo"));
    println!("cargo::rerun-if-changed={}", shaders.display());
    println!("cargo::rerun-if-changed=src/shader_compiler.rs");
    let mut names: Vec<PathBuf> = fs::read_dir(&shaders)
        .expect("the folder shaders/ is part of the project")
        .map(|entry| entry.expect("readable folder").path())
        .collect();
    names.sort();
    for path in names {
        match shader_compiler::compile(&path) {
            Ok(Some(words)) => {
                let name = path.file_name().expect("a file in a folder").to_string_lossy();
                let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
                fs::write(out.join(format!("{name}.spv")), bytes).expect("OUT_DIR is writable");
            }
            Ok(None) => {} // a header or a text
            Err(message) => {
                eprintln!("{message}");
                std::process::exit(1);
            }
        }
    }
}
