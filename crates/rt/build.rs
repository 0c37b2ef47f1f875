//! Compiles `shaders/` to SPIR-V in `OUT_DIR`, with compilers that come as crates.
//!
//! Screen-space passes (`.comp`, `.vert`, `.frag`) go through naga, in pure Rust. Ray-tracing stages go through the
//! bundled glslang: naga's GLSL front end has no ray-tracing stages, buffer references or scalar
//! layout.

#[path = "src/shader_compiler.rs"]
mod shader_compiler;

use std::path::{Path, PathBuf};
use std::{env, fs};

fn main() {
    let shaders = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("set by cargo"))
        .join("../../shaders");
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("set by cargo"));
    println!("cargo::rerun-if-changed={}", shaders.display());
    // Development builds run it once more where shaders are written while they run.
    if let Ok(this) = env::current_exe() {
        println!("cargo::rustc-env=RT_BUILD_SCRIPT={}", this.display());
    }
    println!("cargo::rerun-if-changed=src/shader_compiler.rs");
    let mut names: Vec<PathBuf> = fs::read_dir(&shaders)
        .expect("the folder shaders/ is part of the project")
        .map(|entry| entry.expect("readable folder").path())
        .collect();
    names.sort();
    for path in names {
        let name = path
            .file_name()
            .expect("a file in a folder")
            .to_string_lossy();
        let Some(compiler) = shader_compiler::compiler_for(&path) else {
            continue;
        };
        write(&out.join(format!("{name}.spv")), compiler(&path));
        if name.ends_with(".comp") {
            // For the test that compares the two compilers.
            let other = shader_compiler::compile_with_glslang(&path);
            write(&out.join(format!("{name}.glslang.spv")), other);
        }
    }
}

fn write(path: &Path, compiled: Result<Vec<u32>, String>) {
    match compiled {
        Ok(words) => {
            let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
            fs::write(path, bytes).expect("OUT_DIR is writable");
        }
        Err(message) => {
            eprintln!("{message}");
            std::process::exit(1);
        }
    }
}
