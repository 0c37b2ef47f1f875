//! `cargo xtask accuracy`: measures how exact the program is, and writes `docs/accuracy.md`.

use std::error::Error;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{SystemTime, UNIX_EPOCH};

/// What the parts of the report are, and what makes them.
const PARTS: [(&str, &str, &[&str]); 3] = [
    (
        "Which error each stage adds",
        "Against double precision. Rows marked \"not used\" are what the chosen form avoids.",
        &[
            "bench",
            "--quiet",
            "--package=runelight-tests",
            "--bench=precision",
            "--",
        ],
    ),
    (
        "Hard cases",
        "Scenes with known answers, on the Vulkan device and on the processor.",
        &["run", "--quiet", "--release", "--", "bench", "--hard"],
    ),
    (
        "Speed against error, at a glance",
        "Two views of the bundled level on the processor; what the columns mean is in \
         [performance.md](performance.md).",
        &["run", "--quiet", "--release", "--", "bench", "--quick"],
    ),
];

/// Runs all parts and writes `docs/accuracy.md`. `arguments` are `--device TEXT` for the Vulkan
/// device, the software driver by default.
///
/// # Errors
/// A part fails, or the file cannot be written; a report already there is then left as it was.
pub fn run(arguments: &[String]) -> Result<(), Box<dyn Error>> {
    let device = match arguments {
        [] => "llvmpipe",
        [option, device] if option == "--device" => device,
        _ => return Err("accuracy takes --device TEXT and no more".into()),
    };
    let docs = crate::root().join("docs");
    let plots = std::env::temp_dir().join(format!("runelight-accuracy-{}", std::process::id()));
    let mut report = format!(
        "# Accuracy\n\n\
         Written by `cargo xtask accuracy` on {}, {}. Do not edit.\n\n\
         How both renderers compare with an independent one is in [export.md](export.md); how bench\n\
         measures, and long runs on a fast device, are in [performance.md](performance.md).\n",
        today()?,
        processor(),
    );
    for (title, text, command) in PARTS {
        eprintln!("xtask: {title}");
        let mut cargo = Command::new(env!("CARGO"));
        cargo.args(command).stderr(Stdio::inherit());
        let quick = command.contains(&"--quick");
        if quick {
            cargo.args(["--device", "cpu", "--output"]).arg(&plots);
        } else {
            cargo.args(["--device", device]);
        }
        let output = cargo.current_dir(crate::root()).output()?;
        if !output.status.success() {
            return Err(format!("{title}: cargo {} failed", command.join(" ")).into());
        }
        let shown = if quick { "cpu" } else { device };
        let said = String::from_utf8(output.stdout)?;
        let said = said.trim();
        // Tables of the program are for terminals, that of the precision bench is Markdown.
        let said = if said.contains("|---|") {
            said.to_owned()
        } else {
            format!("```text\n{said}\n```")
        };
        report += &format!(
            "\n## {title}\n\n{text}\n\n```sh\ncargo {} --device {shown}\n```\n\n{said}\n",
            command.join(" ")
        );
    }
    // Absent if the run ended early.
    let _ = fs::remove_dir_all(plots);
    crate::sample::write(&docs.join("accuracy.md"), report.as_bytes())
}

/// The name of the processor and the number of its threads, where the system tells.
fn processor() -> String {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let model = fs::read_to_string(Path::new("/proc/cpuinfo"))
        .ok()
        .and_then(|text| {
            let line = text.lines().find(|l| l.starts_with("model name"))?;
            Some(line.split_once(':')?.1.trim().to_owned())
        });
    let model = model.unwrap_or_else(|| std::env::consts::ARCH.to_owned());
    format!("{threads} threads of {model}")
}

#[expect(
    clippy::disallowed_methods,
    reason = "a report says when it was measured"
)]
/// Today's date, UTC, as `2026-01-31`.
fn today() -> Result<String, Box<dyn Error>> {
    let days = SystemTime::now().duration_since(UNIX_EPOCH)?.as_secs() / 86_400;
    let (year, month, day) = civil(days);
    Ok(format!("{year}-{month:02}-{day:02}"))
}

/// Year, month and day of a number of days since 1970-01-01 (Hinnant, "chrono-Compatible Low-Level
/// Date Algorithms").
fn civil(days: u64) -> (u64, u64, u64) {
    let z = days + 719_468;
    let (era, day_of_era) = (z / 146_097, z % 146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted + 2) / 5 + 1;
    let month = if shifted < 10 {
        shifted + 3
    } else {
        shifted - 9
    };
    let year = year_of_era + era * 400 + u64::from(month <= 2);
    (year, month, day)
}

#[cfg(test)]
mod tests {
    use super::civil;

    #[test]
    fn days_become_dates() {
        assert_eq!(civil(0), (1970, 1, 1));
        assert_eq!(civil(11_016), (2000, 2, 29));
        assert_eq!(civil(20_454), (2026, 1, 1));
    }
}
