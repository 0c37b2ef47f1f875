//! Options that several commands have: where from, what is lit, how light is found.

use crate::Usage;
use anyhow::{Context as _, Result, anyhow, bail};
use clap::{Args, ValueEnum};
use scene::camera::{DEFAULT_FOV_DEG, Lens};
use scene::import::rules::Rules;
use scene::import::{FogKeys, Lighting, MAX_FOG_DENSITY};
use scene::render::{Estimator, Sampler, Selection};
use scene::{Camera, CameraPath, Scene};
use std::io::Read as _;
use std::path::{Path, PathBuf};

/// What a picture shows of a scene.
#[derive(Clone, Debug, PartialEq, Args)]
pub struct ViewArgs {
    /// Picture size in pixels
    #[arg(
        long,
        value_name = "WxH",
        default_value = "1280x720",
        help_heading = "Picture"
    )]
    #[arg(value_parser = parse_size)]
    pub size: (u32, u32),
    /// Where from: "X Y Z PITCH YAW ROLL" in Quake units and degrees (the eye, 22 above what an
    /// engine's viewpos prints), or the number or name of a camera that `runelight info` lists
    /// [default: the player's start]
    #[arg(
        long,
        value_name = "CAMERA",
        help_heading = "Picture",
        allow_hyphen_values = true
    )]
    #[arg(value_parser = parse_camera)]
    pub camera: Option<CameraChoice>,
    /// A camera path, a TOML file of keys (docs/cameras.md): the camera is where it is at the
    /// time `--at`, in a demo at the time of the frame
    #[arg(
        long,
        value_name = "FILE",
        help_heading = "Picture",
        conflicts_with = "camera"
    )]
    pub camera_path: Option<PathBuf>,
    /// Field of view in degrees, horizontally at 4:3; wider pictures show more at the sides
    /// [default: the camera's, 90]
    #[arg(long, value_name = "DEG", help_heading = "Picture", value_parser = number(1.0, 170.0))]
    pub fov: Option<f64>,
    /// Radius of the lens in Quake units: what is not in the plane of focus blurs; 0 for a pinhole
    /// [default: 0]
    #[arg(long, value_name = "UNITS", help_heading = "Picture", value_parser = number(0.0, 1e4))]
    pub aperture: Option<f64>,
    /// Distance of the plane of focus along the view direction, in Quake units
    #[arg(long, value_name = "UNITS", help_heading = "Picture", value_parser = number(0.01, 1e6))]
    pub focus: Option<f64>,
}

impl ViewArgs {
    /// The camera asked for at a level time of `at` seconds, or the level's first, adjusted.
    ///
    /// # Errors
    /// When the level has no such camera, the camera path can't be read, or the lens is half said.
    pub fn camera_of(&self, scene: &Scene, at: f64) -> Result<Camera> {
        self.adjusted(match self.path()? {
            Some(path) => path.at(at),
            None => pick_camera(self.camera.as_ref(), scene)?,
        })
    }

    /// The camera path asked for.
    ///
    /// # Errors
    /// When it cannot be read or is wrong.
    pub fn path(&self) -> Result<Option<CameraPath>> {
        let Some(file) = &self.camera_path else {
            return Ok(None);
        };
        let text = read_text(file).with_context(|| format!("--camera-path {}", file.display()))?;
        Ok(Some(CameraPath::parse(&file.display().to_string(), &text)?))
    }

    /// A camera with the field of view and the lens asked for.
    ///
    /// # Errors
    /// When the lens is half said.
    pub fn adjusted(&self, mut camera: Camera) -> Result<Camera> {
        if let Some(fov) = self.fov {
            camera.fov_deg = fov as f32;
        }
        camera.lens = self.lens_of(camera.lens)?;
        Ok(camera)
    }

    /// The lens asked for, in place of a camera's own.
    ///
    /// # Errors
    /// When nothing says how wide it is, or where things are sharp.
    pub fn lens_of(&self, own: Option<Lens>) -> Result<Option<Lens>> {
        let radius = (self.aperture.map(|x| x as f32)).or(own.map(|l| l.radius));
        let focus = (self.focus.map(|x| x as f32)).or(own.map(|l| l.focus));
        match (radius, focus) {
            (Some(radius), Some(focus)) => Ok(Lens::new(radius, focus)),
            (Some(radius), None) if radius > 0.0 => {
                Err(Usage("--aperture: --focus must say what is sharp".into()).into())
            }
            // Of a path, a moment may have no lens.
            (None, Some(_)) if self.camera_path.is_none() => {
                Err(Usage("--focus: without --aperture everything is sharp".into()).into())
            }
            _ => Ok(None),
        }
    }

    /// Has the field of view and the lens of a camera.
    pub(crate) fn take_lens(&mut self, camera: &Camera) {
        self.fov = Some(camera.fov_deg.into());
        self.aperture = camera.lens.map(|l| l.radius.into());
        self.focus = camera.lens.map(|l| l.focus.into());
    }
}

/// The text of a file that people write.
///
/// # Errors
/// When it can't be read or is longer than any such file.
pub(crate) fn read_text(path: &Path) -> Result<String> {
    /// No such file is longer.
    const MAX_BYTES: u64 = 1 << 24;
    let mut text = String::new();
    let read = std::fs::File::open(path)?
        .take(MAX_BYTES + 1)
        .read_to_string(&mut text)?;
    if read as u64 > MAX_BYTES {
        bail!("it is longer than {MAX_BYTES} bytes");
    }
    Ok(text)
}

fn pick_camera(choice: Option<&CameraChoice>, scene: &Scene) -> Result<Camera> {
    let count = scene.cameras.len();
    match choice {
        Some(&CameraChoice::Pose([x, y, z, pitch_deg, yaw_deg, roll_deg])) => Ok(Camera {
            name: "--camera".into(),
            position: [x, y, z].into(),
            pitch_deg,
            yaw_deg,
            roll_deg,
            fov_deg: DEFAULT_FOV_DEG,
            lens: None,
        }),
        Some(CameraChoice::Index(index)) => scene.cameras.get(*index).cloned().ok_or_else(|| {
            anyhow!(
                "--camera {index}: {} has {count} cameras, counted from 0",
                scene.name
            )
        }),
        Some(CameraChoice::Name(name)) => (scene.cameras.iter())
            .find(|c| c.name == *name)
            .cloned()
            .ok_or_else(|| {
                let mut names: Vec<&str> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
                names.dedup();
                anyhow!(
                    "--camera {name}: {} has only {}",
                    scene.name,
                    names.join(", ")
                )
            }),
        None => match scene.cameras.first() {
            Some(camera) => Ok(camera.clone()),
            None => bail!("{} has no camera; give one with --camera", scene.name),
        },
    }
}

/// What a level becomes as a scene.
#[derive(Clone, Debug, PartialEq, Args)]
pub struct SceneArgs {
    /// Level time in seconds: animated and scrolling textures
    #[arg(
        long,
        value_name = "SECONDS",
        default_value_t = 0.0,
        help_heading = "Picture"
    )]
    #[arg(value_parser = number(0.0, 1e6))]
    pub at: f64,
    /// Which lamps shine in physical light
    #[arg(
        long,
        value_name = "WHICH",
        default_value = "auto",
        help_heading = "Light"
    )]
    pub lights: Lights,
    /// Relative luminance from which a fullbright texel emits, 0 to 1
    #[arg(long, value_name = "T", default_value_t = 0.5, help_heading = "Light")]
    #[arg(value_parser = number(0.0, 1.0))]
    pub threshold: f64,
    /// Radiance of a white emitting texel
    #[arg(long, value_name = "X", default_value_t = 4.0, help_heading = "Light")]
    #[arg(value_parser = number(0.0, 1e6))]
    pub emission_scale: f64,
    /// Brightness of a light style, "NUMBER=BRIGHTNESS", whatever the level or a demo says; 0 is
    /// dark, 1 shows lightmaps as stored; repeatable
    #[arg(long = "light-style", value_name = "N=X", help_heading = "Light", value_parser = parse_style)]
    pub styles: Vec<(u16, f64)>,
    /// Fog in place of the level's: "DENSITY R G B" as in worldspawn's key, the colour 0 to 1 and 0.3
    /// where it is missing, or `off`
    #[arg(long, value_name = "FOG", help_heading = "Light", value_parser = parse_fog)]
    pub fog: Option<FogKeys>,
    /// Share of the sky that the fog veils, 0 to 1 [default: the level's, 0.5]
    #[arg(long, value_name = "X", help_heading = "Light", value_parser = number(0.0, 1.0))]
    pub skyfog: Option<f64>,
    /// Who is there.
    #[command(flatten)]
    pub entities: EntityArgs,
    /// What surfaces are made of.
    #[command(flatten)]
    pub surfaces: SurfaceArgs,
}

/// Which point entities are there.
#[derive(Clone, Debug, PartialEq, Args)]
pub struct EntityArgs {
    /// Show the bare level, without monsters, items, flames and the like
    #[arg(long, help_heading = "Entities")]
    pub no_entities: bool,
    /// Entities of a game of this skill: 0 easy, 1 normal, 2 hard, 3 nightmare
    #[arg(
        long,
        value_name = "0-3",
        default_value_t = 1,
        help_heading = "Entities"
    )]
    #[arg(value_parser = clap::value_parser!(u32).range(0..=3))]
    pub skill: u32,
    /// Entities of a game of deathmatch instead
    #[arg(long, help_heading = "Entities", conflicts_with = "skill")]
    pub deathmatch: bool,
}

impl Default for EntityArgs {
    fn default() -> Self {
        Self {
            no_entities: false,
            skill: 1,
            deathmatch: false,
        }
    }
}

/// What surfaces are made of.
#[derive(Clone, Debug, Default, PartialEq, Args)]
pub struct SurfaceArgs {
    /// Materials by texture name: a TOML file (docs/materials.md), or `default` for common
    /// families of Quake textures; several add up, and later entries win
    #[arg(long, value_name = "FILE", help_heading = "Surfaces")]
    pub materials: Vec<String>,
    /// Leave pictures in textures/ alone that replace those of the level
    #[arg(long, help_heading = "Surfaces")]
    pub no_textures: bool,
    /// Show alias models themselves where MD3 or MD5 models stand for them
    #[arg(long, help_heading = "Surfaces")]
    pub original_models: bool,
    /// Shade the facets of models flat, not as parts of a round surface
    #[arg(long, help_heading = "Surfaces")]
    pub flat_models: bool,
}

impl SurfaceArgs {
    /// The entries of all files, in order.
    ///
    /// # Errors
    /// When a file cannot be read or is wrong.
    pub fn rules(&self) -> Result<Rules> {
        const DEFAULT: &str = include_str!(concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../assets/materials/default.toml"
        ));
        self.materials
            .iter()
            .try_fold(Rules::default(), |rules, name| {
                if name == "default" {
                    return Ok(rules.and(Rules::parse(name, DEFAULT)?));
                }
                let text =
                    read_text(Path::new(name)).with_context(|| format!("--materials {name}"))?;
                Ok(rules.and(Rules::parse(name, &text)?))
            })
    }
}

impl SceneArgs {
    /// What the import is told.
    ///
    /// # Errors
    /// When a file of materials cannot be read or is wrong.
    pub fn import_options(&self) -> Result<scene::import::ImportOptions> {
        Ok(scene::import::ImportOptions {
            materials: self.surfaces.rules()?,
            replacements: !self.surfaces.no_textures,
            model_replacements: !self.surfaces.original_models,
            smooth_models: !self.surfaces.flat_models,
            time: self.at as f32,
            threshold: self.threshold as f32,
            emission_scale: self.emission_scale as f32,
            lights: self.lights.into(),
            inhabitants: !self.entities.no_entities,
            skill: self.entities.skill,
            deathmatch: self.entities.deathmatch,
            style_brightness: (self.styles.iter())
                .map(|&(number, brightness)| (number, brightness as f32))
                .collect(),
            fog: self.fog,
            sky_fog: self.skyfog.map(|share| share as f32),
            ..Default::default()
        })
    }
}

/// `--estimator`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum EstimatorName {
    /// Walk on in a direction weighted by the cosine, find light by hitting it
    Naive,
    /// Walk on in any direction of the hemisphere, find light by hitting it
    Uniform,
    /// Choose lights and look whether they are seen
    Nee,
    /// Both, each weighted by how likely it was
    Mis,
}

impl From<EstimatorName> for Estimator {
    fn from(name: EstimatorName) -> Self {
        match name {
            EstimatorName::Naive => Self::Naive,
            EstimatorName::Uniform => Self::Uniform,
            EstimatorName::Nee => Self::Nee,
            EstimatorName::Mis => Self::Mis,
        }
    }
}

/// `--selection`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SelectionName {
    /// The best for the scene: leaf where the level has a tree, else power
    Auto,
    /// Bright and large lights more often
    Power,
    /// Every light alike
    Uniform,
    /// By a tree over all lights: power, distance and the way they face
    Tree,
    /// What may be seen from a place, by power over squared distance; by power for a tenth
    Leaf,
}

impl From<SelectionName> for Selection {
    fn from(name: SelectionName) -> Self {
        match name {
            SelectionName::Power => Self::Power,
            SelectionName::Uniform => Self::Uniform,
            SelectionName::Tree => Self::Tree,
            // Where there are no lists it is by power.
            SelectionName::Auto | SelectionName::Leaf => Self::Leaf,
        }
    }
}

/// `--lighting`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LightingName {
    /// Bright surfaces, the sky, and light entities as small spheres
    Physical,
    /// Light entities and suns as the light compilers take them
    Compiler,
    /// The lightmaps that come with the level
    Lightmap,
    /// None: textures as they are stored
    Fullbright,
}

impl From<LightingName> for Lighting {
    fn from(name: LightingName) -> Self {
        match name {
            LightingName::Physical => Self::Physical,
            LightingName::Compiler => Self::Compiler,
            LightingName::Lightmap => Self::Lightmap,
            LightingName::Fullbright => Self::Fullbright,
        }
    }
}

/// `--sampler`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SamplerName {
    /// All independent: error estimates hold
    Independent,
    /// Sobol' points, scrambled for every pixel: less noise, and error estimates read high
    Sobol,
}

impl From<SamplerName> for Sampler {
    fn from(name: SamplerName) -> Self {
        match name {
            SamplerName::Independent => Self::Independent,
            SamplerName::Sobol => Self::Sobol,
        }
    }
}

/// `--lights`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Lights {
    /// Bright surfaces, and those light entities that stand for none of them
    Auto,
    /// Bright surfaces alone: fullbright texels, glowing liquids, sky without suns
    Textures,
    /// Light entities alone, and the sky with its suns
    Entities,
    /// Both, even where they are one lamp
    All,
}

impl Lights {
    /// The name on the command line and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Textures => "textures",
            Self::Entities => "entities",
            Self::All => "all",
        }
    }
}

impl From<Lights> for scene::import::LightMode {
    fn from(lights: Lights) -> Self {
        match lights {
            Lights::Auto => Self::Auto,
            Lights::Textures => Self::Textures,
            Lights::Entities => Self::Entities,
            Lights::All => Self::All,
        }
    }
}

/// `--camera`
#[derive(Clone, Debug, PartialEq)]
pub enum CameraChoice {
    /// Eye in Quake units; pitch, yaw and roll in degrees.
    Pose([f32; 6]),
    /// Number among the level's cameras.
    Index(usize),
    /// Name of one of the level's cameras.
    Name(String),
}

/// Largest side of a picture, in pixels.
const MAX_SIDE: u32 = 32_768;

pub(super) fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let wrong = || format!("a size is WIDTHxHEIGHT in pixels, 1 to {MAX_SIDE} each, as 1280x720");
    let (w, h) = text.split_once(['x', 'X']).ok_or_else(wrong)?;
    let side = |s: &str| s.parse().ok().filter(|n| (1..=MAX_SIDE).contains(n));
    side(w).zip(side(h)).ok_or_else(wrong)
}

pub(crate) fn parse_camera(text: &str) -> Result<CameraChoice, String> {
    let words: Vec<&str> = (text.split(|c: char| c.is_whitespace() || c == ','))
        .filter(|w| !w.is_empty())
        .collect();
    let numbers: Option<Vec<f32>> = (words.iter())
        .map(|w| w.parse().ok().filter(|v: &f32| v.is_finite()))
        .collect();
    match (numbers.as_deref(), words.as_slice()) {
        (Some(&[x, y, z, pitch, yaw, roll]), _) => {
            Ok(CameraChoice::Pose([x, y, z, pitch, yaw, roll]))
        }
        (Some(_), [index]) => (index.parse().map(CameraChoice::Index))
            .map_err(|_| "a camera's number is 0 or more".to_owned()),
        (None, [name]) => Ok(CameraChoice::Name((*name).to_owned())),
        _ => Err(
            "a camera is six numbers \"X Y Z PITCH YAW ROLL\", or the number or name of a \
                  camera of the level"
                .to_owned(),
        ),
    }
}

pub(super) fn parse_fog(text: &str) -> Result<FogKeys, String> {
    let mut words = text.split_ascii_whitespace();
    let are_so_many = (1..=4).contains(&words.clone().count());
    let are_numbers = words.all(|w| w.parse().is_ok_and(f32::is_finite));
    match FogKeys::read(text) {
        _ if text.trim() == "off" => Ok(FogKeys::OFF),
        (keys, None) if are_so_many && are_numbers => Ok(keys),
        _ => Err(format!(
            "fog is a density from 0 to {MAX_FOG_DENSITY}, with three colours from 0 to 1 or \
             without, as \"0.05 0.4 0.4 0.5\"; or off"
        )),
    }
}

/// Most light styles that compilers know.
const MOST_STYLE: u16 = 254;
/// Brightest that a light style can be made: the letter `z` is 2.15.
pub(crate) const MOST_BRIGHTNESS: f64 = 1000.0;

pub(super) fn parse_style(text: &str) -> Result<(u16, f64), String> {
    let wrong = || {
        format!(
            "a light style is NUMBER=BRIGHTNESS, 0 to {MOST_STYLE} and 0 to {MOST_BRIGHTNESS}, as 3=0.5"
        )
    };
    let (number, brightness) = text.split_once('=').ok_or_else(wrong)?;
    let number = number.trim().parse().ok().filter(|n| *n <= MOST_STYLE);
    let brightness =
        (brightness.trim().parse().ok()).filter(|b| (0.0..=MOST_BRIGHTNESS).contains(b));
    number.zip(brightness).ok_or_else(wrong)
}

/// A parser of finite numbers from `min` to `max`.
pub(super) fn number(min: f64, max: f64) -> impl Fn(&str) -> Result<f64, String> + Clone {
    move |text| {
        (text.parse().ok())
            .filter(|v| (min..=max).contains(v))
            .ok_or_else(|| format!("not a number from {min} to {max}"))
    }
}
