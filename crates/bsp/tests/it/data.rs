//! The real files that tests run on, where they are at hand.

use std::path::{Path, PathBuf};

/// The directory of real files: `RUNELIGHT_TEST_DATA`, else `shared/data` beside the workspace.
/// Without it a test says so and passes.
pub fn dir(test: &str) -> Option<PathBuf> {
    let path = std::env::var_os("RUNELIGHT_TEST_DATA").map_or_else(
        || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data")),
        PathBuf::from,
    );
    if path.is_dir() {
        return Some(path);
    }
    println!("SKIPPED: {test}: no test data at {}", path.display());
    None
}

/// All files below a directory, sorted.
pub fn files(dir: &Path) -> Vec<PathBuf> {
    let mut out = Vec::new();
    let mut todo = vec![dir.to_owned()];
    while let Some(dir) = todo.pop() {
        for entry in std::fs::read_dir(dir).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                todo.push(path);
            } else {
                out.push(path);
            }
        }
    }
    out.sort();
    out
}

/// Every file of the data: the loose ones, the PAKs, and each member of each PAK.
pub fn everything(dir: &Path) -> Vec<(String, Vec<u8>)> {
    let mut out = Vec::new();
    for path in files(&dir.join("loose"))
        .into_iter()
        .chain(files(&dir.join("id1")))
    {
        let bytes = std::fs::read(&path).unwrap();
        let name = path.display().to_string();
        if bytes.starts_with(b"PACK") {
            let (limits, mut warnings) = (bsp::Limits::default(), bsp::Warnings::new());
            let pak = bsp::pak::Directory::parse(&bytes, &limits, &mut warnings).unwrap();
            for e in pak.entries() {
                let (from, to) = (e.offset as usize, (e.offset + e.length) as usize);
                out.push((format!("{name}:{}", e.name), bytes[from..to].to_vec()));
            }
        }
        out.push((name, bytes));
    }
    out
}
