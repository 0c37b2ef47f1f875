#!/usr/bin/env python3
"""An independent judge: the same views by Runelight and by Mitsuba 3, compared pixel by pixel.

For every view the scene is exported, rendered by Mitsuba and by Runelight on each device asked for,
and every pair of pictures is put to the z-test of tests/src/stats.rs: per pixel and channel, at a
significance of 0.01 with Sidak's correction for the number of comparisons; at least 99.75 % must
agree, and the means of the pictures must lie within 4.5 standard errors. See README.md.

Exit codes: 0 all agree, 1 some do not or a renderer failed, 2 wrong usage.
"""

import argparse
import gc
import json
import math
import os
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
SIGNIFICANCE = 0.01
PASS_SHARE = 0.9975
MEAN_LIMIT = 4.5
FLOOR = 1e-5
# Samples per pixel of the passes that find the pixels in which the camera sees a lamp or the sky.
SEEN_SPP = 1024


def parse_arguments():
    parser = argparse.ArgumentParser(
        description=__doc__.splitlines()[0],
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    parser.add_argument("--runelight", required=True, help="the binary to judge")
    parser.add_argument("--views", default=str(HERE / "views.json"), help="levels and cameras")
    parser.add_argument("--level", action="append", help="only levels of this name; repeatable")
    parser.add_argument("--view", action="append", type=int, help="only views of this number")
    parser.add_argument("--basedir", help="Quake directory of the levels that are not bundled")
    parser.add_argument("--device", action="append", help="devices as for runelight --device; "
                        "repeatable (default: cpu and llvmpipe)")
    parser.add_argument("--size", default="96x54", help="picture size")
    parser.add_argument("--depth", type=int, default=4, help="path vertices")
    parser.add_argument("--spp", type=int, default=1024, help="samples of Runelight")
    parser.add_argument("--device-spp", action="append", default=[], metavar="DEVICE=N",
                        help="samples of one device, instead of --spp")
    parser.add_argument("--mitsuba-spp", type=int, default=2048, help="samples of Mitsuba")
    parser.add_argument("--batches", type=int, default=32, help="independent batches of Mitsuba, "
                        "whose spread gives its error")
    parser.add_argument("--seed", type=int, default=1, help="seed of everything")
    parser.add_argument("--variant", help="of Mitsuba (default: llvm_ad_rgb if LLVM is there, "
                        "else scalar_rgb)")
    parser.add_argument("--without-sky", action="store_true",
                        help="leave out the pixels in which the camera sees a scrolling sky")
    parser.add_argument("--keep", help="directory for exports, pictures and maps of z")
    parser.add_argument("--json", help="file for the results")
    return parser.parse_args()


def start_mitsuba(variant):
    """Imports Mitsuba in a variant that works here."""
    import mitsuba as mi

    if variant is None:
        libraries = sorted(pathlib.Path("/usr/lib").glob("**/libLLVM*.so*19*"))
        if "DRJIT_LIBLLVM_PATH" not in os.environ and libraries:
            os.environ["DRJIT_LIBLLVM_PATH"] = str(libraries[0])
        variant = "llvm_ad_rgb" if "DRJIT_LIBLLVM_PATH" in os.environ else "scalar_rgb"
    mi.set_variant(variant)
    mi.set_log_level(mi.LogLevel.Error)
    return mi


def runelight(options, *args):
    """Runs the binary and returns its JSON."""
    command = [options.runelight, *args, "--json", "--quiet"]
    if options.basedir:
        command += ["--basedir", options.basedir]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(command)}: {done.stderr.strip()}")
    return json.loads(done.stdout)


class Picture:
    """Mean and variance of the mean, per pixel and channel, as arrays of height, width, 3."""

    def __init__(self, name, mean, variance, seconds, spp):
        self.name, self.mean, self.variance = name, mean, variance
        self.seconds, self.spp = seconds, spp


def by_runelight(mi, np, options, view, device, spp, scratch):
    """Renders a view with Runelight; the variance is its own layer."""
    path = scratch / f"{device.replace(' ', '-')}.exr"
    level = [] if view["level"] == "sample" else [view["level"]]
    result = runelight(
        options, "render", *level, *view["options"], "--camera", view["camera"],
        "--size", options.size, "--depth", str(options.depth), "--spp", str(spp),
        "--seed", str(options.seed), "--estimator", "mis", "--device", device,
        "--layers", "variance", "-o", str(path),
    )
    if result["nonfinite"] or (result["escaped"] and view["sealed"]):
        print(f"  {device}: {result['nonfinite']} not finite, {result['escaped']} escaped")
    planes = {name: np.array(bitmap) for name, bitmap in mi.Bitmap(str(path)).split()}
    mean = planes.get("<root>", planes.get("image"))
    return Picture(device, mean.astype("f8")[..., :3], planes["variance"].astype("f8")[..., :3],
                   result["seconds"]["render"], result["spp"])


def by_mitsuba(mi, np, options, scene):
    """Renders an export with Mitsuba in batches with seeds of their own."""
    start = time.monotonic()
    spp = max(1, options.mitsuba_spp // options.batches)
    # Welford's sums: batches are many, and their pictures need not be kept.
    mean = square = 0.0
    for i in range(options.batches):
        image = np.array(mi.render(scene, spp=spp, seed=options.seed * 1000 + i)).astype("f8")
        if not np.isfinite(image).all():
            raise RuntimeError("Mitsuba rendered pixels that are not finite")
        delta = image - mean
        mean = mean + delta / (i + 1)
        square = square + delta * (image - mean)
    variance = square / (options.batches - 1) / options.batches
    return Picture("mitsuba", mean, variance, time.monotonic() - start, spp * options.batches)


def pixels_that_show(mi, np, options, scene, pattern):
    """Which pixels show an emitter whose parameter's name matches: those that change when it goes
    out and only what the camera itself sees is rendered. None if there is no such emitter."""
    params = mi.traverse(scene)
    keys = [key for key in params.keys() if re.fullmatch(pattern, key)]
    if not keys:
        return None
    seen = mi.load_dict({"type": "volpath", "max_depth": 1})

    def render():
        return np.array(mi.render(scene, integrator=seen, spp=SEEN_SPP, seed=options.seed))

    lit = render()
    shine = {key: type(params[key])(params[key]) for key in keys}
    for key in keys:
        params[key] = type(params[key])(0.0)
    params.update()
    changed = np.abs(lit - render()).max(axis=-1) > 1e-6
    for key in keys:
        params[key] = shine[key]
    params.update()
    # A rim may lie in a pixel in which none of these samples found it.
    grown = np.pad(changed, 1)
    height, width = changed.shape
    return np.any([grown[y:y + height, x:x + width] for y in range(3) for x in range(3)], axis=0)


LAMPS = r"lamp-\d+\.emitter\.radiance\.value"
SCROLLING_SKY = r".*\.emitter\.scale"


def z_test(np, a, b, left_out, sky):
    """The test of tests/src/stats.rs."""
    keep = np.ones(a.mean.shape[:2], bool) if left_out is None else ~left_out
    x, y = a.mean[keep], b.mean[keep]
    variance = a.variance[keep] + b.variance[keep]
    comparisons = x.size
    alpha = 1.0 - (1.0 - SIGNIFICANCE) ** (1.0 / comparisons)
    limit = statistics.NormalDist().inv_cdf(1.0 - alpha / 2.0)
    error = np.maximum(np.sqrt(variance), FLOOR * np.maximum(np.abs(x), np.abs(y)))
    z = np.divide(x - y, error, out=np.zeros_like(x), where=error > 0)
    z[(error == 0) & (x != y)] = math.inf
    sums = x.sum(axis=0), y.sum(axis=0), variance.sum(axis=0)
    largest = np.maximum(np.abs(sums[0]), np.abs(sums[1]))
    mean_error = np.maximum(np.maximum(np.sqrt(sums[2]), FLOOR * largest), 1e-30)
    map_of_z = np.zeros_like(a.mean)
    map_of_z[keep] = z
    passed = float((np.abs(z) <= limit).mean())
    mean_z = float(np.max(np.abs(sums[0] - sums[1]) / mean_error))
    total = float(sums[1].sum())
    # Failures where the scrolling sky is seen, whose texels have soft borders in Mitsuba.
    failed_sky = 0 if sky is None else int((np.abs(map_of_z[sky]) > limit).sum())
    # What difference of a pixel channel would have been seen, relative to the picture's mean.
    power = limit * float(np.median(error)) / max(float(y.mean()), 1e-30)
    return {
        "pair": [a.name, b.name],
        "passed": passed,
        "failed": int((np.abs(z) > limit).sum()),
        "failed_sky": failed_sky,
        "comparisons": int(comparisons),
        "limit": limit,
        "spread": float(np.sqrt(np.mean(np.clip(z, -limit, limit) ** 2))),
        "mean_z": mean_z,
        "mean_ratio": float(sums[0].sum()) / total if total else math.nan,
        "mean_ratio_error": float(np.sqrt(sums[2].sum())) / total if total else math.nan,
        "pixel_visible": power,
        "agrees": passed >= PASS_SHARE and mean_z <= MEAN_LIMIT,
    }, map_of_z


def save_png(mi, np, path, image):
    """A picture to look at: sRGB, a little brighter than it is."""
    scale = 0.5 / max(float(np.median(image[image > 0])) if (image > 0).any() else 1.0, 1e-6)
    mi.util.write_bitmap(str(path), (image * min(scale, 4.0)).astype("f4"), write_async=False)


def judge_view(mi, np, options, view, scratch):
    """Judges one view; returns what is known about it."""
    level = [] if view["level"] == "sample" else [view["level"]]
    folder = scratch / "export"
    export = runelight(
        options, "export", *level, *view["options"], "--camera", view["camera"],
        "--size", options.size, "--depth", str(options.depth), "-o", str(folder),
    )
    view["sealed"] = export["sealed"]
    scene = mi.load_file(str(folder / "scene.xml"))
    pictures = [by_mitsuba(mi, np, options, scene)]
    lamps = pixels_that_show(mi, np, options, scene, LAMPS)
    sky = pixels_that_show(mi, np, options, scene, SCROLLING_SKY)
    masks = [mask for mask in (lamps, sky if options.without_sky else None) if mask is not None]
    left_out = np.any(masks, axis=0) if masks else None
    # A second scene in the same process is more than OptiX takes.
    del scene
    gc.collect()
    own = dict(entry.split("=") for entry in options.device_spp)
    for device in options.device or ["cpu", "llvmpipe"]:
        spp = int(own.get(device, options.spp))
        pictures.append(by_runelight(mi, np, options, view, device, spp, scratch))
    result = {
        "level": view["level"], "camera": view["camera"], "options": view["options"],
        "exact": export["exact"], "differences": export["differences"],
        "left_out": 0 if left_out is None else int(left_out.sum()),
        "pictures": [{"name": p.name, "spp": p.spp, "seconds": p.seconds,
                      "mean": p.mean.mean(axis=(0, 1)).tolist(),
                      "relative_error": float(np.sqrt(p.variance.sum()) / p.mean.sum())}
                     for p in pictures],
        "pairs": [],
    }
    for i, a in enumerate(pictures):
        if options.keep:
            save_png(mi, np, scratch / f"{a.name}.png", a.mean)
            np.savez_compressed(scratch / f"{a.name}.npz", mean=a.mean, variance=a.variance)
        for b in pictures[:i]:
            verdict, z = z_test(np, a, b, left_out, sky)
            result["pairs"].append(verdict)
            if options.keep:
                np.savez_compressed(scratch / f"z_{a.name}_{b.name}.npz", z=z)
                red = np.clip(np.abs(z) / verdict["limit"], 0, 1)
                mi.util.write_bitmap(str(scratch / f"z_{a.name}_{b.name}.png"),
                                     red.astype("f4"), write_async=False)
            worst = np.abs(z).max(axis=-1)
            for at in np.argsort(worst, axis=None)[::-1][:min(verdict["failed"], 8)]:
                row, column = divmod(int(at), z.shape[1])
                if worst[row, column] <= verdict["limit"]:
                    break
                verdict.setdefault("worst", []).append({
                    "pixel": [column, row], "z": z[row, column].tolist(),
                    a.name: a.mean[row, column].tolist(), b.name: b.mean[row, column].tolist(),
                })
    return result


def views_of(options):
    """The views asked for, each with its level, camera and options."""
    with open(options.views, encoding="utf-8") as file:
        levels = json.load(file)
    for level in levels:
        if options.level and level["level"] not in options.level:
            continue
        if level["level"] != "sample" and not options.basedir:
            print(f"SKIPPED: {level['level']}: give its Quake directory with --basedir")
            continue
        for i, camera in enumerate(level["cameras"]):
            if not options.view or i in options.view:
                yield i, {"level": level["level"], "camera": camera,
                          "options": level.get("options", [])}


def main():
    options = parse_arguments()
    mi = start_mitsuba(options.variant)
    import numpy as np

    print(f"Mitsuba {mi.__version__} {mi.variant()}, {options.size}, depth {options.depth}")
    print(f"{'view':<16}{'pair':<24}{'passed':>9}{'failed':>8}{'in sky':>8}{'mean z':>8}{'ratio':>10}"
          f"{'+-':>9}{'spread':>8}{'visible':>9}")
    results = []
    for number, view in views_of(options):
        name = f"{view['level']} {number}"
        with tempfile.TemporaryDirectory() as temporary:
            scratch = pathlib.Path(options.keep or temporary) / name.replace(" ", "-")
            scratch.mkdir(parents=True, exist_ok=True)
            try:
                result = judge_view(mi, np, options, view, scratch)
            except RuntimeError as error:
                result = {**view, "error": str(error), "pairs": []}
                print(f"{name:<16}{error}")
        result["view"] = number
        results.append(result)
        for pair in result["pairs"]:
            print(f"{name:<16}{' / '.join(pair['pair']):<24}{100 * pair['passed']:>8.3f}%"
                  f"{pair['failed']:>8}{pair['failed_sky']:>8}{pair['mean_z']:>8.2f}{pair['mean_ratio']:>10.5f}"
                  f"{pair['mean_ratio_error']:>9.5f}{pair['spread']:>8.3f}"
                  f"{100 * pair['pixel_visible']:>8.1f}%{'' if pair['agrees'] else '  DIFFERENT'}",
                  flush=True)
        if result.get("left_out"):
            print(f"{name:<16}{result['left_out']} pixels left out",
                  flush=True)
        if options.json:
            # After every view, so that a run that is cut short leaves what it has.
            summary = {"mitsuba": mi.__version__, "variant": mi.variant(), "size": options.size,
                       "depth": options.depth, "results": results}
            pathlib.Path(options.json).write_text(json.dumps(summary, indent=1) + "\n",
                                                  encoding="utf-8")
    agree = [r for r in results if r["pairs"] and all(p["agrees"] for p in r["pairs"])]
    print(f"{len(agree)} of {len(results)} views agree")
    return 0 if results and len(agree) == len(results) else 1


if __name__ == "__main__":
    sys.exit(main())
