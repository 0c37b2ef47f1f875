//! `runelight devices`.

use super::Context;
use crate::Outcome;
use crate::device::{self, CPU, CPU_DRIVER};
use anyhow::Result;
use rt::DeviceInfo;
use serde_json::{Value, json};

/// Runs the command. A machine without Vulkan still has its processor, so that is no failure.
///
/// # Errors
/// When stdout is closed.
pub fn run(context: &Context) -> Result<Outcome> {
    let listed = rt::Vulkan::new(rt::Options::default()).and_then(|v| v.devices());
    let (devices, why_none) = match listed {
        Ok(devices) => (devices, None),
        Err(why) => (Vec::new(), Some(why.to_string())),
    };
    let auto = device::pick("auto", &devices)?.map_or(CPU, |d| d.name.as_str());
    context.print(&if context.json {
        json_of(&devices, why_none.as_deref(), auto).to_string()
    } else {
        text(&devices, why_none.as_deref(), auto)
    })?;
    Ok(Outcome::Done)
}

fn json_of(devices: &[DeviceInfo], why_none: Option<&str>, auto: &str) -> Value {
    let vulkan: Vec<Value> = (devices.iter())
        .map(|d| {
            json!({
                "index": d.index,
                "name": d.name,
                "driver": d.driver,
                "vulkan": d.api_version,
                "kind": d.kind.name(),
                "usable": d.is_usable(),
                "lacking": d.lacking,
            })
        })
        .collect();
    json!({
        "devices": vulkan,
        "vulkan_error": why_none,
        "cpu": { "name": CPU, "driver": CPU_DRIVER, "threads": threads() },
        "auto": auto,
    })
}

fn text(devices: &[DeviceInfo], why_none: Option<&str>, auto: &str) -> String {
    let mut lines: Vec<String> = Vec::new();
    for d in devices {
        lines.push(format!("{:<4} {}", d.index, d.name));
        lines.push(format!(
            "     {}, {}, Vulkan {}",
            d.kind.name(),
            d.driver,
            d.api_version
        ));
        lines.push(match d.lacking.as_slice() {
            [] => "     can be used".to_owned(),
            lacking => format!("     cannot be used: it lacks {}", lacking.join(", ")),
        });
    }
    lines.extend(why_none.map(str::to_owned));
    lines.push(format!("{CPU:<4} {CPU_DRIVER}, {} threads", threads()));
    lines.push(format!("--device auto takes {auto}"));
    lines.join("\n")
}

fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, Into::into)
}
