//! `cargo xtask gallery`: makes the pictures in `docs/gallery/` and the page that shows them.

use std::error::Error;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

/// A picture of the bundled level.
struct Picture {
    /// Name of the file, without `.png`.
    name: &'static str,
    /// What is seen on it.
    caption: &'static str,
    /// What `runelight render` is told besides [`COMMON`] and the output.
    options: &'static str,
    /// Name of the picture it is measured against.
    truth: Option<&'static str>,
}

/// Every picture is rendered with these; the processor gives everybody the same.
const COMMON: &str = "--device cpu";

/// The sections of the page, in order: title, introduction, pictures.
const SECTIONS: [(&str, &str, &[Picture]); 4] = [
    (
        "Views",
        "Bright surfaces, the sky, and the light entities that stand for none of them.",
        &[
            Picture {
                name: "hall",
                caption: "The hall from the player's start: ceiling lamps, lava light through the opening on the left, the courtyard through the arch.",
                options: "--size 512x288 --depth 4 --camera 0 --candidates 1 --spp 64",
                truth: None,
            },
            Picture {
                name: "courtyard",
                caption: "The courtyard, lit by the whole sky: soft shade, no cast shadows.",
                options: "--size 512x288 --depth 4 --camera 1 --candidates 1 --spp 64",
                truth: None,
            },
            Picture {
                name: "lava",
                caption: "The lava chamber, lit by the texels of the pool and of the lava fall.",
                options: "--size 512x288 --depth 4 --camera 3 --candidates 1 --spp 64",
                truth: None,
            },
        ],
    ),
    (
        "Lamps that no ray hits",
        "The hall by its light entities and the sky alone.",
        &[
            Picture {
                name: "entities-naive-512",
                caption: "`naive` at 512 samples: no path can hit a light entity, so all it finds is the sky. Lava, pillars and beams stay all but black at any number of samples.",
                options: "--size 256x144 --depth 4 --camera 0 --lights entities --exposure 2 --estimator naive --spp 512",
                truth: Some("entities-truth"),
            },
            Picture {
                name: "entities-mis-1",
                caption: "`mis` at 1 sample: full of noise, but the room, its pillars and what is lit can be told.",
                options: "--size 256x144 --depth 4 --camera 0 --lights entities --exposure 2 --spp 1",
                truth: Some("entities-truth"),
            },
            Picture {
                name: "entities-mis-64",
                caption: "`mis` at 64 samples: clean but for grain on the floor.",
                options: "--size 256x144 --depth 4 --camera 0 --lights entities --exposure 2 --spp 64",
                truth: Some("entities-truth"),
            },
            Picture {
                name: "entities-truth",
                caption: "What the three are measured against: `mis`, one candidate, 512 samples.",
                options: "--size 256x144 --depth 4 --camera 0 --lights entities --exposure 2 --candidates 1 --seed 1 --spp 512",
                truth: None,
            },
        ],
    ),
    (
        "One small lamp",
        "The dark room is lit by one lamp of 8 x 8 texels. `--emission-scale` raises its light to that of a lit room, so that relMSE tells noise.",
        &[
            Picture {
                name: "dark-naive-512",
                caption: "`naive` at 512 samples: bright dots; a corner and the floor can be guessed.",
                options: "--size 256x144 --depth 4 --camera 2 --emission-scale 256 --estimator naive --spp 512",
                truth: Some("dark-truth"),
            },
            Picture {
                name: "dark-mis-1",
                caption: "`mis` at 1 sample: dots as well, fewer than above. One sample is too little here.",
                options: "--size 256x144 --depth 4 --camera 2 --emission-scale 256 --spp 1",
                truth: Some("dark-truth"),
            },
            Picture {
                name: "dark-mis-64",
                caption: "`mis` at 64 samples: everything can be seen, with noise.",
                options: "--size 256x144 --depth 4 --camera 2 --emission-scale 256 --spp 64",
                truth: Some("dark-truth"),
            },
            Picture {
                name: "dark-truth",
                caption: "What the three are measured against: `mis`, one candidate, 512 samples.",
                options: "--size 256x144 --depth 4 --camera 2 --emission-scale 256 --candidates 1 --seed 1 --spp 512",
                truth: None,
            },
        ],
    ),
    (
        "Other light and surfaces",
        "The level has no lightmaps, so there is no picture with `--lighting lightmap`.",
        &[
            Picture {
                name: "hall-fullbright",
                caption: "No light at all: textures as they are stored.",
                options: "--size 512x288 --camera 0 --lighting fullbright --depth 1 --spp 16",
                truth: None,
            },
            Picture {
                name: "hall-compiler",
                caption: "Direct light of the light entities by the light compilers' formulas, at 0 s. The lamp of style 10 (a faulty tube) lights the wall at the right edge.",
                options: "--size 512x288 --camera 0 --lighting compiler --estimator nee --depth 2 --spp 16",
                truth: None,
            },
            Picture {
                name: "hall-compiler-later",
                caption: "The same at 0.25 s: the tube is off in this tenth of a second, and the wall is dark.",
                options: "--size 512x288 --camera 0 --lighting compiler --estimator nee --depth 2 --at 0.25 --spp 16",
                truth: None,
            },
            Picture {
                name: "hall-materials",
                caption: "Materials for common families of texture names: the floor is glossy and shows the lava.",
                options: "--size 512x288 --depth 4 --camera 0 --materials default --candidates 1 --spp 64",
                truth: None,
            },
        ],
    ),
];

/// Renders every picture and writes `docs/gallery/`.
///
/// # Errors
/// A picture fails, or a file cannot be written; if a picture fails, those already there are left as
/// they were.
pub fn run() -> Result<(), Box<dyn Error>> {
    let made = std::env::temp_dir().join(format!("runelight-gallery-{}", std::process::id()));
    fs::create_dir_all(&made)?;
    let page = make(&made);
    let result = page.and_then(|page| publish(&made, &page));
    // What is left of a failure is of no use to anybody.
    let _ = fs::remove_dir_all(&made);
    result
}

/// Renders into the folder `made`; the text of the page.
fn make(made: &Path) -> Result<String, Box<dyn Error>> {
    let mut page = String::from(
        "# Gallery\n\nWritten by `cargo xtask gallery`. Do not edit.\n\n\
         The bundled level, rendered on the processor. Every picture has the command that makes it.\n",
    );
    for (title, text, pictures) in SECTIONS {
        page += &format!("\n## {title}\n\n{text}\n");
        for picture in pictures {
            eprintln!("xtask: {}", picture.name);
            program(made, &picture.command())?;
        }
        for picture in pictures {
            let Picture { name, caption, .. } = picture;
            let mut commands = format!("runelight {}\n", picture.command());
            let mut measured = String::new();
            if let Some(truth) = picture.truth {
                let command = format!("compare {truth}.exr {name}.exr --json");
                measured = format!(" relMSE {:.4}.", relmse(&program(made, &command)?)?);
                commands += &format!("runelight {command}\n");
            }
            page += &format!(
                "\n![{name}]({name}.png)\n\n{caption}{measured}\n\n```sh\n{commands}```\n"
            );
        }
    }
    Ok(page)
}

/// Puts the pictures in `made` and the page where they are kept.
fn publish(made: &Path, page: &str) -> Result<(), Box<dyn Error>> {
    let folder = crate::root().join("docs/gallery");
    fs::create_dir_all(&folder)?;
    for (_, _, pictures) in SECTIONS {
        for picture in pictures {
            let file = format!("{}.png", picture.name);
            crate::sample::write(&folder.join(&file), &fs::read(made.join(&file))?)?;
        }
    }
    crate::sample::write(&folder.join("README.md"), page.as_bytes())
}

/// Runs the program in the folder `made` with these arguments; what it says on stdout.
fn program(made: &Path, arguments: &str) -> Result<String, Box<dyn Error>> {
    let output = Command::new(env!("CARGO"))
        .args([
            "run",
            "--quiet",
            "--release",
            "--package=runelight",
            "--manifest-path",
        ])
        .arg(crate::root().canonicalize()?.join("Cargo.toml"))
        .arg("--")
        .args(arguments.split_whitespace())
        .current_dir(made)
        .stderr(Stdio::inherit())
        .output()?;
    if !output.status.success() {
        return Err(format!("runelight {arguments}: failed").into());
    }
    Ok(String::from_utf8(output.stdout)?)
}

/// The relative mean squared error in what `runelight compare --json` says.
fn relmse(said: &str) -> Result<f64, Box<dyn Error>> {
    let (_, rest) = said
        .split_once("\"relmse\":")
        .ok_or("compare tells no relMSE")?;
    let number = rest.split([',', '}']).next().unwrap_or_default();
    Ok(number.trim().parse()?)
}

impl Picture {
    /// The arguments of `runelight` that make it.
    fn command(&self) -> String {
        let Self { name, options, .. } = self;
        let compared = SECTIONS
            .iter()
            .flat_map(|(_, _, pictures)| *pictures)
            .any(|p| p.truth.is_some() && (p.name == *name || p.truth == Some(name)));
        let exr = if compared {
            format!(" -o {name}.exr")
        } else {
            String::new()
        };
        format!("render {COMMON} {options} -o {name}.png{exr}")
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn relmse_is_found() {
        let said = r#"{"rmse":0.25,"relmse":0.0125,"ci95":{"relmse":[0.01,0.02]}}"#;
        assert_eq!(super::relmse(said).ok(), Some(0.0125));
        assert!(super::relmse("{}").is_err());
    }
}
