#!/usr/bin/env python3
"""Judges `domecast hardness`: hardness by contact mechanics, on shapes, loads and sensors of the test split.

    scripts/check_hardness_physics.py [domecast] [--set DIR] [--videos N]

Two second opinions: the same slope of approach over the integral of dF/(2a), written again in numpy with trapezoids and radii
that need not grow as a power; and, for balls only, Hertz' force over depth with the true radius (scipy), which needs no contact radius.
The intervals must hold.
"""
import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

sys.path.insert(0, str(Path(__file__).resolve().parent))
from check_dataset import ROOT, binomial_interval, check, read_set, run, small_spec  # noqa: E402


def approach(index, video):
    """Force and approach of the frames in contact, from the readings alone."""
    r = video["readings.npy"].astype(float)
    at = np.array(index["dome"]["reference_mm"])
    radius = index["dome"]["radius_mm"]
    force, depth, contact = [], [], []
    for row in r:
        f, m, t, w = row[1:4], row[4:7], row[7:10], row[10:13]
        n = np.linalg.norm(f)
        if n < 0.02 or not row[17] > 0 or not np.isfinite(row[13]):
            continue
        way = f / n
        near = at + np.cross(f, m) / n**2
        b = near @ way
        p = near - way * (b + np.sqrt(max(0.0, b * b - near @ near + radius**2)))
        force.append(n)
        depth.append(row[13] - (t + np.cross(w, p - at)) @ way)
        contact.append(row[17])
    return np.array(force), np.array(depth), np.array(contact)


def held(center):
    """What a dome's base holds back, in F/(E* R), from the table of golden_held.py."""
    table = json.loads((ROOT / "tests/cases/golden_held.json").read_text())["held"]
    return np.interp(center, [line["center_z"] for line in table], [line["held"] for line in table])


def held_mm(index, force):
    """What the dome's base holds back of its own yield."""
    dome = index["dome"]
    own = (1 - dome["poisson"] ** 2) / dome["youngs_modulus_mpa"]
    return held(dome.get("center_z_mm", 0.0) / dome["radius_mm"]) * own * force / dome["radius_mm"]


def by_slope(index, force, depth, contact):
    """1/E* by trapezoids; the contact's radius is that of the punch whose pressure a growing force adds: a^2 = 3/5 d(F rho^2)/dF."""
    degree = 2 if np.ptp(np.log(force)) > 0.5 and len(force) > 3 else 1
    rho = np.polyfit(np.log(force), np.log(contact), degree, w=contact)
    x = [0.0]
    for i in range(1, len(force)):
        f = np.linspace(force[i - 1], force[i], 33)
        power = np.clip(np.polyval(np.polyder(rho), np.log(f)), 0, 0.5)
        a = np.exp(np.polyval(rho, np.log(f))) * np.sqrt(0.6 * (1 + 2 * power))
        x.append(x[-1] + np.trapezoid(1 / (2 * a), f))
    return np.polyfit(x, depth + held_mm(index, force), 1)[0]


def by_hertz(index, video, force, depth):
    """E* of a ball whose radius is known: F over d^(3/2), the begin of the contact free."""
    dome = index["dome"]
    curved = 1 / (1 / dome["radius_mm"] + 1 / video["json"]["shape"]["radius_mm"])
    def left(p):
        d0, logs = p
        modulus = np.exp(logs)
        d = (0.75 * force / (modulus * np.sqrt(curved))) ** (2 / 3) - held_mm(index, force)
        return d0 + d - depth
    fit = least_squares(left, [depth[0], np.log(0.3)])
    return 1 / np.exp(fit.x[1])


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program", nargs="?", default=str(ROOT / "target/release/domecast"))
    parser.add_argument("--spec", type=Path, default=ROOT / "designs/datasets/hardness-range.json")
    parser.add_argument("--set", type=Path)
    parser.add_argument("--videos", type=int, default=88)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        folder = arguments.set
        if folder is None:
            folder = Path(place) / "set"
            spec = small_spec(arguments.spec, Path(place) / "spec.json", arguments.videos,
                              frames={**json.loads(arguments.spec.read_text())["frames"], "width": 64, "height": 48})
            run(arguments.program, "dataset", spec, "--out", folder)
        index, videos = read_set(folder)
        out = Path(place) / "found.jsonl"
        told = json.loads(run(arguments.program, "hardness", folder, "--out", out, "--json").stdout)
        found = {line["key"]: line for line in map(json.loads, out.read_text().splitlines())}
    check(set(found) == set(videos), f"{len(found)} videos judged")
    dome = index["dome"]
    own = (1 - dome["poisson"] ** 2) / dome["youngs_modulus_mpa"]
    slopes, balls = [], []
    for key, video in videos.items():
        force, depth, contact = approach(index, video)
        if len(force) < 3:
            continue
        label = video["json"]
        true = own + (1 - label["poisson"] ** 2) / label["youngs_modulus_mpa"]
        slopes.append((label["split"], by_slope(index, force, depth, contact) / true, label["shape"]["name"],
                       label["youngs_modulus_mpa"]))
        if label["shape"]["kind"] == "sphere":
            balls.append(by_hertz(index, video, force, depth) / true)
    for name in sorted({s[2] for s in slopes}):
        part = np.log([max(s[1], 1e-3) for s in slopes if s[2] == name])
        print(f"      {name}: 1/E* over the true one, mean of logarithm {part.mean():+.3f}, spread {part.std():.3f}, {len(part)} videos")
    if balls:
        print(f"      balls by Hertz with known radius: {np.log(balls).mean():+.3f}, spread {np.log(balls).std():.3f}")
        check(abs(np.log(balls).mean()) < 0.1, "Hertz' law with the balls' own radius finds their E* within 10 %")
    for split, tally in told["splits"].items():
        keys = [k for k, v in videos.items() if v["json"]["split"] == split]
        truth = np.array([videos[k]["json"]["log10_youngs_modulus_mpa"] for k in keys])
        mine = np.array([found[k]["log10_youngs_modulus_mpa"] for k in keys])
        low, high = np.array([found[k]["interval_90"] for k in keys]).T
        inside = int(((low <= truth) & (truth <= high)).sum())
        a, b = binomial_interval(inside, len(keys))
        check(abs(inside / len(keys) - tally["interval_90_holds"]) < 1e-9
              and abs(np.sqrt(np.mean((mine - truth) ** 2)) - tally["rms_log10"]) < 1e-5, f"{split}: the summary is that of the lines")
        check(b >= 0.88, f"{split}: the 90 % interval holds {inside} of {len(keys)} ({inside / len(keys):.3f}; 99 %: {a:.3f} to {b:.3f}), "
              f"rms {np.sqrt(np.mean((mine - truth) ** 2)):.3f} of a decade, R2 {tally['r2']}, class right {tally['class_right']}")
    wide = [f for f in found.values() if f["status"] == "saturated"]
    hard = [k for k in found if videos[k]["json"]["youngs_modulus_mpa"] > 2]
    narrow = [k for k in hard if np.diff(found[k]["interval_90"])[0] < 0.15]
    check(not narrow, f"no narrow interval where the object is four times as hard as the dome ({len(hard)} such; {len(wide)} saturated)")
    sys.exit(1 if check.faults else 0)


if __name__ == "__main__":
    main()
