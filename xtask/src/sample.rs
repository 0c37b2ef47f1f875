//! `cargo xtask sample`: rebuilds the bundled level, its models and its demo from their source.

use std::error::Error;
use std::fs;
use std::path::Path;

/// Compiles `assets/sample/sample.map` with the textures and the palette drawn by
/// [`mapc::sample`], and writes `sample.bsp` and `palette.lmp` beside it, with the models and the demo.
///
/// # Errors
/// The map cannot be read or compiled, or a file cannot be written; files already there are
/// then left as they were.
pub fn run() -> Result<(), Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/sample");
    let source = folder.join("sample.map");
    let text = fs::read_to_string(&source)
        .map_err(|e| format!("cannot read {}: {e}", source.display()))?;
    let level = mapc::sample::build(&text)?;
    for warning in &level.warnings {
        eprintln!("sample.map: {warning}");
    }
    write(&folder.join("sample.bsp"), &level.bytes)?;
    write(&folder.join("palette.lmp"), &mapc::sample::palette())?;
    write(&folder.join("sample.dem"), &mapc::sample::demo(&text)?)?;
    fs::create_dir_all(folder.join("progs"))?;
    for (name, bytes) in mapc::sample::models() {
        write(&folder.join(name), &bytes)?;
    }
    Ok(())
}

/// Writes beside the file and renames, so that nobody ever sees half a file.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), Box<dyn Error>> {
    let beside = path.with_extension("new");
    fs::write(&beside, bytes).map_err(|e| format!("cannot write {}: {e}", beside.display()))?;
    fs::rename(&beside, path).map_err(|e| format!("cannot replace {}: {e}", path.display()))?;
    Ok(())
}
