//! The hard-case gallery on both renderers; `bench --hard` prints the same figures.

use gallery::{Case, cases};
use runelight_tests::devices::{Device, render};
use std::convert::Infallible;

/// Renders the cases that `wanted` names, by each of their estimators, and lists what failed.
fn failures(device: Device, scale: f64, wanted: impl Fn(&Case) -> bool) -> Vec<String> {
    let mut all = Vec::new();
    for case in cases().iter().filter(|c| wanted(c)) {
        for &estimator in &case.estimators {
            let verdict = case.run::<Infallible>(
                estimator,
                case.plan(scale),
                &mut |scene, settings, samples| Ok(render(device, scene, settings, samples)),
                &mut |scene, settings, samples| Ok(render(Device::Cpu, scene, settings, samples)),
            );
            let Ok((film, verdict)) = verdict;
            println!(
                "{device:?} {}, {}: {:.3e} +- {:.1e} of {:?}, z {:?}, {} rays, {} escaped",
                case.name,
                estimator.name(),
                verdict.error,
                verdict.interval,
                verdict.expected,
                verdict.z,
                film.counters.rays,
                film.counters.escaped,
            );
            for failure in &verdict.failures {
                all.push(format!("{}, {}: {failure}", case.name, estimator.name()));
            }
        }
    }
    all
}

#[track_caller]
fn assert_none(failures: &[String]) {
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn the_f64_renderer_passes_every_hard_case() {
    assert_none(&failures(Device::Cpu, 1.0, |_| true));
}

#[test]
fn the_gpu_passes_every_hard_case() {
    assert_none(&failures(Device::Vulkan, 0.25, |case| !case.fixed));
}

#[test]
fn the_gpu_keeps_a_mean_over_a_million_samples() {
    assert_none(&failures(Device::Vulkan, 1.0, |case| case.fixed));
}
