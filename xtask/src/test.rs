//! `cargo xtask test`: what the tests need, then the tests.
//!
//! Vulkan tests run on Mesa's software driver (lavapipe), which has the ray-tracing pipeline since
//! Mesa 24.1, with the Khronos validation layer on.

use super::root;
use std::error::Error;
use std::ffi::OsStr;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

/// Packages that hold the Vulkan loader, the software driver and the validation layer; a display that
/// nobody sees, and what windows on it need.
const PACKAGES: [&str; 9] = [
    "mesa-vulkan-drivers",
    "libvulkan1",
    "vulkan-validationlayers",
    "xvfb",
    "libx11-6",
    "libx11-xcb1",
    "libxcursor1",
    "libxi6",
    "libxkbcommon-x11-0",
];

/// Where apt finds a new enough Mesa on Debian 12.
const BACKPORTS: &str = "/etc/apt/sources.list.d/runelight-backports.list";
const BACKPORTS_LINE: &str = "deb http://deb.debian.org/debian bookworm-backports main\n";

/// Oldest Mesa whose software driver traces rays.
const MESA: (u32, u32) = (24, 1);

/// Installs what is missing where it can, then runs `cargo test --workspace` with `arguments`.
///
/// # Errors
/// When something is missing that can't be installed here, or a test failed.
pub fn run(arguments: &[String]) -> Result<(), Box<dyn Error>> {
    prepare()?;
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let status = Command::new(cargo)
        .current_dir(root())
        .args(["test", "--workspace"])
        .args(arguments)
        .status()?;
    if status.success() {
        Ok(())
    } else {
        Err("tests failed".into())
    }
}

fn prepare() -> Result<(), Box<dyn Error>> {
    if has_validation_layer() && has_software_driver() && has_display() {
        return Ok(());
    }
    let os = fs::read_to_string("/etc/os-release").unwrap_or_default();
    let value = |key: &str| {
        let line = os
            .lines()
            .find_map(|l| l.strip_prefix(key)?.strip_prefix('='));
        line.unwrap_or_default().trim_matches('"').to_owned()
    };
    let debian = value("ID") == "debian" || value("ID_LIKE").contains("debian");
    if !debian || !is_root() {
        return Err(format!(
            "the Vulkan tests need Mesa's software driver (lavapipe, Mesa {}.{} or newer), the \
             Vulkan loader 1.3 and the Khronos validation layer, and a virtual display (Xvfb); on Debian and Ubuntu the packages \
             are {}{}. Run this command again as root there, or install them and run it again",
            MESA.0,
            MESA.1,
            PACKAGES.join(", "),
            if value("VERSION_CODENAME") == "bookworm" {
                " from bookworm-backports"
            } else {
                ""
            },
        )
        .into());
    }
    let backports = value("VERSION_CODENAME") == "bookworm";
    if backports && !apt_knows_backports() {
        fs::write(BACKPORTS, BACKPORTS_LINE)?;
    }
    eprintln!("installing {} for the Vulkan tests", PACKAGES.join(", "));
    apt(["update", "-qq"])?;
    let mut install = vec!["install", "-y", "-qq", "--no-install-recommends"];
    if backports {
        install.extend(["-t", "bookworm-backports"]);
    }
    apt(install.into_iter().chain(PACKAGES))?;
    if has_validation_layer() && has_software_driver() && has_display() {
        return Ok(());
    }
    let (major, minor) = MESA;
    Err(format!("after installing, there is still no software driver of Mesa {major}.{minor} or newer with a validation layer, or no Xvfb").into())
}

fn apt<S: AsRef<OsStr>>(arguments: impl IntoIterator<Item = S>) -> Result<(), Box<dyn Error>> {
    let status = Command::new("apt-get")
        .args(arguments)
        .env("DEBIAN_FRONTEND", "noninteractive")
        .stdout(Stdio::null())
        .status()
        .map_err(|e| format!("apt-get: {e}"))?;
    if status.success() {
        Ok(())
    } else {
        Err("apt-get failed, see above".into())
    }
}

fn is_root() -> bool {
    let id = Command::new("id").arg("-u").output();
    id.is_ok_and(|o| o.stdout.trim_ascii() == b"0")
}

fn has_validation_layer() -> bool {
    [
        "/usr/share/vulkan/explicit_layer.d",
        "/etc/vulkan/explicit_layer.d",
    ]
    .iter()
    .any(|folder| {
        Path::new(folder)
            .join("VkLayer_khronos_validation.json")
            .exists()
    })
}

/// Whether there is a display that nobody sees, and the libraries that windows load on it.
fn has_display() -> bool {
    let libraries = [
        "libX11.so.6",
        "libX11-xcb.so.1",
        "libXcursor.so.1",
        "libXi.so.6",
        "libxkbcommon-x11.so.0",
    ];
    let known = Command::new("ldconfig").arg("-p").output();
    // Without a list the window's test says what is missing.
    let known = known.map_or(None, |o| o.status.success().then_some(o.stdout));
    let known = known.map(|list| String::from_utf8_lossy(&list).into_owned());
    let has = |name: &&str| known.as_ref().is_none_or(|list| list.contains(*name));
    let starts = Command::new("Xvfb")
        .arg("-version")
        .stderr(Stdio::null())
        .status();
    starts.is_ok() && libraries.iter().all(has)
}

/// Whether Mesa's software driver is there and new enough, by the packages' version.
fn has_software_driver() -> bool {
    let found = Command::new("dpkg-query")
        .args(["-W", "-f", "${Version}", "mesa-vulkan-drivers"])
        .output();
    match found {
        Ok(output) if output.status.success() => {
            let version = String::from_utf8_lossy(&output.stdout).into_owned();
            let mut numbers = version.split(['.', '-']).map(|n| n.parse().unwrap_or(0));
            (numbers.next().unwrap_or(0), numbers.next().unwrap_or(0)) >= MESA
        }
        Ok(_) => false,
        // Another kind of system: the driver's manifest has to do, the tests say the rest.
        Err(_) => ["/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d"]
            .iter()
            .any(|folder| {
                let entries = fs::read_dir(folder).into_iter().flatten().flatten();
                entries
                    .into_iter()
                    .any(|e| e.file_name().to_string_lossy().starts_with("lvp_icd"))
            }),
    }
}

/// Whether apt is already set up for Debian's backports.
fn apt_knows_backports() -> bool {
    let entries = fs::read_dir("/etc/apt/sources.list.d")
        .into_iter()
        .flatten()
        .flatten();
    entries
        .map(|e| e.path())
        .chain([Path::new("/etc/apt/sources.list").to_owned()])
        .any(|file| fs::read_to_string(file).is_ok_and(|text| text.contains("bookworm-backports")))
}
