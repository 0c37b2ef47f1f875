//! Shaders that are compiled anew while the program runs, in development builds: the build script that
//! compiled them is still there, and is run once more. Programs that are given to others have none of this.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{PoisonError, RwLock};

/// Where the sources are: the shaders of this build, while they and the build script are there.
#[must_use]
pub fn shader_folder() -> Option<PathBuf> {
    let folder = PathBuf::from(MANIFEST).join("../../shaders");
    (PathBuf::from(BUILD_SCRIPT).is_file() && folder.is_dir()).then_some(folder)
}

const MANIFEST: &str = env!("CARGO_MANIFEST_DIR");
/// The build script names itself.
const BUILD_SCRIPT: &str = env!("RT_BUILD_SCRIPT");

type Codes = HashMap<String, Vec<u32>>;

static CODES: RwLock<Option<Codes>> = RwLock::new(None);
static GENERATION: AtomicU32 = AtomicU32::new(0);

/// How often shaders were compiled anew.
pub(crate) fn generation() -> u32 {
    GENERATION.load(Ordering::Acquire)
}

/// The words of a shader by its file's name, once it was compiled anew.
pub(crate) fn code(name: &str) -> Option<Vec<u32>> {
    let codes = CODES.read().unwrap_or_else(PoisonError::into_inner);
    codes.as_ref()?.get(name).cloned()
}

/// Compiles all shaders of a folder, [`shader_folder`] or a copy of it that lies as that does: `crates/rt` is
/// beside it. Pipelines that are made from now on have them; what runs stays as it is.
///
/// # Errors
/// What the compiler says, with file and line; then nothing changes.
pub fn recompile_shaders(folder: &Path) -> Result<(), String> {
    let codes = compile(&folder.join("../crates/rt"))?;
    *CODES.write().unwrap_or_else(PoisonError::into_inner) = Some(codes);
    GENERATION.fetch_add(1, Ordering::AcqRel);
    Ok(())
}

/// Compiles the shaders beside the folder of a crate.
fn compile(manifest: &Path) -> Result<Codes, String> {
    let name = format!("runelight-shaders-{}-{}", std::process::id(), generation());
    let out = std::env::temp_dir().join(name);
    let failed = |e: std::io::Error| format!("{}: {e}", out.display());
    std::fs::create_dir_all(&out).map_err(failed)?;
    let ran = Command::new(BUILD_SCRIPT)
        .env("CARGO_MANIFEST_DIR", manifest)
        .env("OUT_DIR", &out)
        .stdin(Stdio::null())
        .output();
    let read = || -> std::io::Result<Codes> {
        let mut codes = HashMap::new();
        for entry in std::fs::read_dir(&out)?.flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            if let Some(name) = name.strip_suffix(".spv") {
                let words = crate::passes::words(&std::fs::read(entry.path())?);
                codes.insert(name.to_owned(), words);
            }
        }
        Ok(codes)
    };
    let result = match ran {
        Ok(output) if output.status.success() => read().map_err(failed),
        Ok(output) => Err(String::from_utf8_lossy(&output.stderr).trim().to_owned()),
        Err(error) => Err(format!("{BUILD_SCRIPT}: {error}")),
    };
    // If it cannot be removed it is in nobody's way.
    let _ = std::fs::remove_dir_all(&out);
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shaders_are_compiled_anew_and_errors_name_file_and_line() {
        assert!(
            shader_folder().is_some(),
            "the sources of a development build"
        );
        let codes = compile(Path::new(MANIFEST)).expect("the shaders of this build");
        assert_eq!(
            codes["path_trace.rchit"].as_slice(),
            crate::passes::spirv!("path_trace.rchit")
        );
        let name = format!("runelight-hot-{}", std::process::id());
        let copy = std::env::temp_dir().join(name);
        let (crates, shaders) = (copy.join("crates/rt"), copy.join("shaders"));
        std::fs::create_dir_all(&crates).unwrap();
        std::fs::create_dir_all(&shaders).unwrap();
        let broken =
            "#version 460\n#extension GL_EXT_ray_tracing : require\nvoid main() {\n    oops;\n}\n";
        std::fs::write(shaders.join("broken.rmiss"), broken).unwrap();
        let error = compile(&crates).unwrap_err();
        assert!(error.contains("broken.rmiss:4:"), "{error}");
        std::fs::remove_dir_all(&copy).unwrap();
    }
}
