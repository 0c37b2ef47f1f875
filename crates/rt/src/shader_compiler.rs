//! GLSL to SPIR-V, for the build script.

use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};

/// A source with its includes expanded, and where each line came from.
pub struct Expanded {
    /// The text.
    pub text: String,
    /// File and 1-based line of each line of the text.
    pub origin: Vec<(PathBuf, usize)>,
}

/// Turns a file into SPIR-V, or says what is wrong with file and line.
pub type Compiler = fn(&Path) -> Result<Vec<u32>, String>;

/// The compiler for a file, by its extension; `None` if it is not a shader stage.
pub fn compiler_for(path: &Path) -> Option<Compiler> {
    match path.extension()?.to_str()? {
        "rgen" | "rchit" | "rahit" | "rmiss" => Some(compile_with_glslang),
        "comp" | "vert" | "frag" => Some(compile_with_naga),
        _ => None,
    }
}

/// Replaces `#include "file"` lines (relative to the including file) by the file, once each.
///
/// # Errors
/// A file that can't be read, named.
pub fn expand(path: &Path) -> Result<Expanded, String> {
    fn add(path: &Path, seen: &mut HashSet<PathBuf>, out: &mut Expanded) -> Result<(), String> {
        let text = fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
        for (number, line) in text.lines().enumerate() {
            let include = line
                .trim()
                .strip_prefix("#include \"")
                .and_then(|l| l.strip_suffix('"'));
            if let Some(name) = include {
                let file = path.parent().unwrap_or(Path::new(".")).join(name);
                let key = file
                    .canonicalize()
                    .map_err(|e| format!("{}: {e}", file.display()))?;
                if seen.insert(key) {
                    add(&file, seen, out)?;
                }
            } else {
                out.text += line;
                out.text.push('\n');
                out.origin.push((path.to_owned(), number + 1));
            }
        }
        Ok(())
    }
    let mut out = Expanded {
        text: String::new(),
        origin: Vec::new(),
    };
    add(path, &mut HashSet::new(), &mut out)?;
    Ok(out)
}

/// Compiles a ray-tracing or compute stage for Vulkan 1.3 with glslang.
///
/// # Errors
/// The compiler's messages, each with file and line.
pub fn compile_with_glslang(path: &Path) -> Result<Vec<u32>, String> {
    use glslang::{
        Compiler, CompilerOptions, ShaderInput, ShaderSource, ShaderStage, SpirvVersion, Target,
        VulkanVersion,
    };
    let stage = match path.extension().and_then(|e| e.to_str()) {
        Some("rgen") => ShaderStage::RayGeneration,
        Some("rchit") => ShaderStage::ClosestHit,
        Some("rahit") => ShaderStage::AnyHit,
        Some("rmiss") => ShaderStage::Miss,
        Some("comp") => ShaderStage::Compute,
        _ => return Err(format!("{}: not a shader stage", path.display())),
    };
    let expanded = expand(path)?;
    let name_lines = |log: String| name_lines(&log, &expanded);
    let compiler = Compiler::acquire().ok_or("glslang could not be initialised")?;
    let source = ShaderSource::from(expanded.text.as_str());
    let options = CompilerOptions {
        target: Target::Vulkan {
            version: VulkanVersion::Vulkan1_3,
            spirv_version: SpirvVersion::SPIRV1_6,
        },
        ..CompilerOptions::default()
    };
    let input = ShaderInput::new(
        &source,
        stage,
        &options,
        None::<&[(&str, Option<&str>)]>,
        None,
    )
    .map_err(|e| name_lines(e.to_string()))?;
    let shader = compiler
        .create_shader(input)
        .map_err(|e| name_lines(e.to_string()))?;
    shader.compile().map_err(|e| name_lines(e.to_string()))
}

/// Compiles a compute, vertex or fragment stage with naga.
///
/// # Errors
/// The compiler's messages, each with file and line.
pub fn compile_with_naga(path: &Path) -> Result<Vec<u32>, String> {
    use naga::back::spv;
    use naga::valid::{Capabilities, ValidationFlags, Validator};
    let expanded = expand(path)?;
    let stage = match path.extension().and_then(|e| e.to_str()) {
        Some("vert") => naga::ShaderStage::Vertex,
        Some("frag") => naga::ShaderStage::Fragment,
        _ => naga::ShaderStage::Compute,
    };
    let options = naga::front::glsl::Options::from(stage);
    let module = naga::front::glsl::Frontend::default()
        .parse(&options, &expanded.text)
        .map_err(|e| format!("{}: {}", path.display(), e.emit_to_string(&expanded.text)))?;
    let info = Validator::new(ValidationFlags::all(), Capabilities::IMMEDIATES)
        .validate(&module)
        .map_err(|e| format!("{}: {}", path.display(), e.emit_to_string(&expanded.text)))?;
    let options = spv::Options {
        lang_version: (1, 5),
        flags: spv::WriterFlags::empty(),
        ..spv::Options::default()
    };
    spv::write_vec(&module, &info, &options, None).map_err(|e| format!("{}: {e}", path.display()))
}

/// Replaces glslang's `0:LINE:` by the file and line the text came from.
fn name_lines(log: &str, expanded: &Expanded) -> String {
    log.lines()
        .map(|line| {
            let named = line.split_once("0:").and_then(|(kind, rest)| {
                let (number, message) = rest.split_once(':')?;
                let (file, at) = expanded
                    .origin
                    .get(number.parse::<usize>().ok()?.checked_sub(1)?)?;
                Some(format!("{kind}{}:{at}:{message}", file.display()))
            });
            named.unwrap_or_else(|| line.to_owned())
        })
        .collect::<Vec<_>>()
        .join("\n")
}
