//! The passes, and the frame that is made of them.

pub mod denoise;
pub mod overlay;
pub mod path_trace;
pub mod pose;
pub mod tonemap;

use crate::film::GpuFilm;
use crate::gpu_scene::GpuScene;
use crate::vk::{Error, Recording};
use path_trace::{PathTrace, Samples};
use scene::Frame as Moment;
use scene::render::Settings;

/// What one frame does.
pub(crate) struct Frame<'a> {
    /// What is shown from now on; `None` if nothing has changed.
    pub moment: Option<&'a Moment>,
    /// Who looks, and how.
    pub settings: &'a Settings,
    /// Samples to add.
    pub samples: Samples,
}

/// Records one frame: move what moves, then add samples to the film.
///
/// Display passes (see [`tonemap`]) read the film afterwards and never write it.
///
/// # Errors
/// When a call fails or there is no memory.
pub(crate) fn record_frame(
    recording: &mut Recording,
    scene: &mut GpuScene,
    film: &GpuFilm,
    path_trace: &mut PathTrace,
    frame: &Frame<'_>,
) -> Result<(), Error> {
    if let Some(moment) = frame.moment {
        let size = [frame.settings.width, frame.settings.height];
        scene.record_moment(recording, moment, size)?;
        path_trace.follow(scene)?;
    }
    recording.span("path trace", |r| {
        path_trace.record(r, scene, film, frame.settings, &frame.samples)
    })
}

/// SPIR-V words of a compiled shader.
macro_rules! spirv {
    ($name:literal) => {{
        const BYTES: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/", $name, ".spv"));
        $crate::passes::code($name, BYTES)
    }};
}
pub(crate) use spirv;

/// The words of a shader: those of the build, or in development those that were compiled since.
pub(crate) fn code(name: &str, built: &[u8]) -> Vec<u32> {
    #[cfg(debug_assertions)]
    if let Some(words) = crate::hot::code(name) {
        return words;
    }
    let _ = name;
    words(built)
}

/// How often shaders were compiled since the build.
pub(crate) fn generation() -> u32 {
    #[cfg(debug_assertions)]
    return crate::hot::generation();
    #[cfg(not(debug_assertions))]
    0
}

/// Little-endian bytes to words.
pub(crate) fn words(bytes: &[u8]) -> Vec<u32> {
    bytes
        .chunks_exact(4)
        .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
        .collect()
}

#[cfg(test)]
mod tests {
    use crate::abi;
    use std::collections::HashMap;

    /// Member offsets of every named struct in a module: name of the struct to member offsets by
    /// name. Reads the instructions OpName (5), OpMemberName (6) and OpMemberDecorate (72) with
    /// decoration Offset (35) of the SPIR-V specification.
    fn offsets(code: &[u32]) -> HashMap<String, HashMap<String, usize>> {
        let text = |words: &[u32]| {
            let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
            String::from_utf8_lossy(bytes.split(|&b| b == 0).next().unwrap_or(&[])).into_owned()
        };
        let (mut names, mut members) = (HashMap::new(), HashMap::new());
        let mut offsets: HashMap<String, HashMap<String, usize>> = HashMap::new();
        let mut at = 5;
        while at < code.len() {
            let (count, opcode) = ((code[at] >> 16) as usize, code[at] & 0xffff);
            let words = &code[at + 1..at + count];
            match opcode {
                5 => _ = names.insert(words[0], text(&words[1..])),
                6 => _ = members.insert((words[0], words[1]), text(&words[2..])),
                72 if words[2] == 35 => {
                    let (Some(name), Some(member)) =
                        (names.get(&words[0]), members.get(&(words[0], words[1])))
                    else {
                        panic!("an offset of something without a name");
                    };
                    let member = (member.clone(), words[3] as usize);
                    offsets.entry(name.clone()).or_default().extend([member]);
                }
                _ => {}
            }
            at += count;
        }
        offsets
    }

    #[test]
    fn members_lie_where_the_shaders_look() {
        let compiled = offsets(&spirv!("path_trace.rgen"));
        for layout in abi::LAYOUTS {
            let found = compiled
                .get(layout.name)
                .unwrap_or_else(|| panic!("no {}", layout.name));
            let host = layout
                .members
                .iter()
                .map(|&(name, at)| (name.to_owned(), at));
            assert_eq!(found, &host.collect(), "offsets of {}", layout.name);
        }
    }
}
