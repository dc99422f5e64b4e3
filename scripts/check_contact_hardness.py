#!/usr/bin/env python3
"""Judges `track --travel`: the hardness of what a hand presses, from frames, by contact mechanics.

    scripts/check_contact_hardness.py domecast [--presses N] [--seed S] [--only DESIGN]

Objects of 0.05 to 5 MPa (balls, ends of pins, bars, plates) are pressed on three sensors by a hand whose way this script draws, up to 25 degrees from
the pole; each sensor is built a little off its design (modulus of the pour, wire of the springs) and read with the design's constants.
Noise of the frames and of the travel are numpy's. What must hold: the 90 % intervals, the error of log10 E on what is softer than half of the dome,
soft against hard, one touch after another, and nothing stated where nothing touches. The formula is written again here in numpy.
"""
import argparse
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from check_dataset import ROOT, check, run
from check_hardness_physics import held
from shape_frames import dome_of

DESIGNS = ("thumb24", "picam-r20", "digit-rigid")
ELEMENTS = 20
FRAMES, NOISE, TRAVEL_SD_MM = 12, 1.0, 0.02
# Below half of the dome's modulus log E is well known; above, yields are nearly the dome's own, and the interval alone is judged.
RANGE_MPA, SOFT_MPA = (0.05, 5.0), 0.28
# between soft and hard, as the shipped sets have them (0.07 and 0.9 MPa)
BORDER_MPA = 0.25
MAX_RMS = {"thumb24": 0.15, "picam-r20": 0.2, "digit-rigid": 0.25}


def shape(rng, scale):
    """An object, how far its face is from its middle, and its own axis that faces the dome."""
    kind = rng.choice(["ball", "pin", "bar", "plate"])
    if kind == "ball":
        radius = scale * rng.uniform(5, 14)
        return kind, {"kind": "sphere", "radius_mm": radius}, radius, [0, 0, 1]
    if kind == "pin":
        return kind, {"kind": "cylinder", "radius_mm": scale * rng.uniform(2.5, 5), "length_mm": 10 * scale}, 5 * scale, [0, 0, 1]
    if kind == "bar":
        radius = scale * rng.uniform(5, 10)
        return kind, {"kind": "cylinder", "radius_mm": radius, "length_mm": 16 * scale}, radius, [1, 0, 0]
    side = scale * rng.uniform(16, 24)
    return kind, {"kind": "box", "size_mm": [side, side, 10 * scale]}, 5 * scale, [0, 0, 1]


def press(rng, dome, young, times):
    """An object's way: clear of the dome, then in."""
    scale = dome["radius"] / 10 * (0.6 if dome["center_z"] < 0 else 1)
    kind, solid, face, axis = shape(rng, scale)
    polar, azimuth = np.radians([rng.uniform(0, 25), rng.uniform(0, 360)])
    out = np.array([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])
    lean = Rotation.from_rotvec(np.radians(rng.uniform(0, 6)) * np.cross(out, [1, 0.3, 0.2]))
    way = -lean.apply(out)
    turn, _ = Rotation.align_vectors([out], [axis])
    turn = Rotation.from_rotvec(np.radians(rng.uniform(-3, 3, 3))) * turn
    deep = scale * rng.uniform(0.6, 1.1)
    begin = np.array([0, 0, dome["center_z"]]) + out * (dome["radius"] + face + 0.3 * scale)
    moved = np.concatenate([[0.0], np.linspace(0.15 * scale, deep + 0.3 * scale, FRAMES - 1)])
    path = [{"time_s": float(t), "position_mm": (begin + way * m).tolist(), "rotation_deg": turn.as_rotvec(degrees=True).tolist()}
            for t, m in zip(times, moved)]
    return kind, {"name": kind, "shape": solid, "young_mpa": float(young), "poisson": float(rng.uniform(0.45, 0.49)), "path": path}, moved


def as_built(design, rng, path):
    """The sensor as it comes out: another modulus, other wire. The file keeps the design's name and place of files."""
    text = json.loads((ROOT / "designs" / f"{design}.json").read_text())
    text["elastomer"]["young_modulus_mpa"] *= 1 + 0.05 * rng.normal()
    if "springs" in text and "wire_diameter_mm" in text["springs"]:
        text["springs"]["wire_diameter_mm"] *= 1 + 0.01 * rng.normal()
    path.write_text(json.dumps(text))
    return path


def noisy(folder, rng):
    for file in sorted(folder.glob("frame_*.png")):
        frame = cv2.imread(str(file)).astype(float)
        cv2.imwrite(str(file), np.clip(np.round(frame + rng.normal(0, NOISE, frame.shape)), 0, 255).astype(np.uint8))


def second_opinion(lines, travel, rest, constants):
    """log10 E by the guide's formula: median and 90 % interval, from the lines of `track` and the travel alone."""
    elastomer, optics, springs = constants["elastomer"], constants["optics"], constants.get("springs")
    radius, center = optics["dome_radius_mm"], np.array([0, 0, optics.get("dome_center_z_mm", 0.0)])
    at = np.array(springs["at_mm"]) if springs else np.zeros(3)
    own = (1 - elastomer["poisson_ratio"] ** 2) / elastomer["young_modulus_mpa"]
    base = held(center[2] / radius) * own / radius

    def motion(line):
        pose = np.array(line["pose"])
        return pose[:3, :3] @ at + pose[:3, 3] - at, Rotation.from_matrix(pose[:3, :3]).as_rotvec()

    force, depth, rho, gain = [], [], [], 0.0
    for line, travel_mm in zip(lines, travel):
        contact, seen = line["contact"], line["shape"]["contact"]
        if line["status"] != "ok" or not contact or not seen or not 0.5 <= contact["area_mm2"] / seen["area_mm2"] <= 2:
            continue
        f = np.array(contact["force_n"])
        if springs:
            load = np.array(line["wrench"]) - rest["wrench"]
            f, moment = load[:3], load[3:]
            (shift, turn), (shift0, turn0) = motion(line), motion(rest)
        else:
            moment, shift, turn, shift0, turn0 = np.cross(np.array(contact["point_mm"]) - at, f), *np.zeros((4, 3))
        n = np.linalg.norm(f)
        if n < 0.02:
            continue
        way = f / n
        near = at - center + np.cross(f, moment) / n**2
        b = near @ way
        touched = center + near - way * (b + np.sqrt(max(0.0, b * b - near @ near + radius**2)))
        depth.append(travel_mm - (shift - shift0 + np.cross(turn - turn0, touched - at)) @ way + base * n)
        force.append(n)
        rho.append(np.sqrt(contact["area_mm2"] / np.pi))
        sd = np.array(contact["force_sd_n"])
        if springs:
            sd = np.sqrt(np.maximum(np.square(line["wrench_sd"][:3]) - np.square(rest["wrench_sd"][:3]), 0))
        gain = np.linalg.norm(way * sd) / n
    if len(force) < 3:
        return None
    force, depth, rho = map(np.array, (force, depth, rho))
    weight = (rho / 0.05) ** 2
    x, y = np.log(force), np.log(rho)
    x0, y0 = np.average(x, weights=weight), np.average(y, weights=weight)
    # a straight line with a prior on its slope
    slope = ((weight * (x - x0) * (y - y0)).sum() + (1 / 3) / 0.15**2) / ((weight * (x - x0) ** 2).sum() + 1 / 0.15**2)
    slope = np.clip(slope, 0, 0.5)
    grid = np.linspace(1e-6, force.max(), 4001)
    a = np.exp(y0 + slope * (np.log(grid) - x0)) * np.sqrt(0.6 * (1 + 2 * slope))
    # the integral's part below the first place of the grid is the same for all frames
    integral = np.concatenate([[0], np.cumsum(np.diff(grid) / (a[1:] + a[:-1]))])
    across = np.interp(force, grid, integral)
    (yields, _), left, *_ = np.polyfit(across, depth, 1, full=True)
    sd = max(TRAVEL_SD_MM, np.sqrt((left[0] if len(left) else 0.0) / (len(force) - 2))) / np.sqrt(((across - across.mean()) ** 2).sum())
    logs = np.linspace(-2, 1, 6001)
    total = own + (1 - 0.47**2) / 10**logs
    yields = max(yields, own * np.exp(-0.2))
    spread = np.sqrt(0.10**2 + (sd / yields) ** 2 + gain**2 + (own / total * elastomer["young_modulus_sd_mpa"] / elastomer["young_modulus_mpa"]) ** 2)
    sums = np.cumsum(np.exp(-0.5 * (np.log(yields / total) / spread) ** 2) / spread)
    return np.interp([0.5, 0.05, 0.95], sums / sums[-1], logs)


def tracked(program, frames, constants, travel, out):
    run(program, "track", frames, "--constants", constants, "--rest", frames / "frame_0000.png", "--traction", "--shape",
        f"{out}-shape", "--travel", travel, "--out", f"{out}.jsonl", "--quiet", "--force")
    # a hundred megabytes a frame
    shutil.rmtree(f"{out}-shape")
    return [json.loads(line) for line in Path(f"{out}.jsonl").read_text().splitlines()]


class Bench:
    """A design, and presses on sensors as they come out."""

    def __init__(self, program, design, place, seed, level):
        self.program, self.design, self.place, self.level = program, design, place, level
        self.rng = np.random.default_rng([seed, DESIGNS.index(design)])
        build = place / design
        run(program, "build", ROOT / "designs" / f"{design}.json", "--out", build, "--quiet", "--force")
        self.file = build / "constants/constants.json"
        self.constants = json.loads(self.file.read_text())
        self.dome = dome_of(self.file)
        self.grey = json.loads((build / "report/light.json").read_text())["level_per_mw_mm2"]

    def press(self, name, young):
        """Frames of a press with noise, and the hand's travel with its own."""
        rng, sensor = self.rng, self.place / f"{name}-sensor.json"
        as_built(self.design, rng, sensor)
        kind, solid, moved = press(rng, self.dome, young, 0.1 * np.arange(FRAMES))
        leds = {"level_per_mw_mm2": self.grey, "stray_level": 0.005, "crosstalk": 0.08, "why": "choice: as lit.json"}
        level = {"level": "linear", "element_mm": self.dome["radius"] / ELEMENTS} if self.level == "linear" else {"level": self.level}
        scene = {"version": 1, "name": name, "design": str(sensor), "frames": {"count": FRAMES, "rate_hz": 10},
                 "tolerance": {"px": 0.02, "grey": 4}, "contact": level, "objects": [solid], "light": {"surround_level": 0.02, "leds": leds}}
        file, frames = self.place / f"{name}.json", self.place / name
        file.write_text(json.dumps(scene))
        run(self.program, "simulate", file, "--out", frames, "--quiet", "--force")
        noisy(frames, rng)
        travel = self.place / f"{name}.travel"
        # from anywhere: 7 mm are the hand's own
        travel.write_text("".join(f"{m + 7.0 + TRAVEL_SD_MM * rng.normal():.6f}\n" for m in moved))
        return kind, frames, travel

    def judge(self, name, young):
        kind, frames, travel = self.press(name, young)
        lines = tracked(self.program, frames, self.file, travel, self.place / name)
        said = [line["contact_hardness"] for line in lines]
        ok = said[0] is None and all((one is None) == (line["contact"] is None) for one, line in zip(said, lines) if line["status"] == "ok")
        check(ok, f"{name}: hardness is stated where something touches, and nowhere else")
        check(not any(one and one["status"] == "impossible" for one in said), f"{name}: no frame of the press is called impossible")
        last, other = said[-1], second_opinion(lines, np.loadtxt(travel), lines[0], self.constants)
        if last is None or last["status"] == "not_measured":
            check(other is None or last is None, f"{name}: nothing is measured where the second opinion has nothing either")
            return None
        got = np.array([last["log10_youngs_modulus_mpa"], *last["interval_90"]])
        check(np.abs(got - other).max() < 0.02, f"{name}: {kind}, {young:.3f} MPa: {10**got[0]:.3f} ({10**got[1]:.3f} to {10**got[2]:.3f}), "
              f"{last['status']}; the second opinion is {np.abs(got - other).max():.4f} of a decade away")
        return got


def judge_touches(bench):
    """A soft and a hard object one after the other, in one run: each touch for itself. And lines of travel that are missing."""
    ends, rows, folder = [], [], bench.place / "both"
    folder.mkdir(exist_ok=True)
    sensor = bench.rng.bit_generator.state
    for at, young in enumerate((0.08, 1.2)):
        # the same sensor, place and shape
        bench.rng.bit_generator.state = sensor
        _, frames, travel = bench.press(f"alone-{at}", young)
        ends.append(tracked(bench.program, frames, bench.file, travel, bench.place / f"alone-{at}")[-1]["contact_hardness"])
        rows.append(travel.read_text())
        for k in range(FRAMES):
            (folder / f"frame_{at * FRAMES + k:04d}.png").write_bytes((frames / f"frame_{k:04d}.png").read_bytes())
    travel = bench.place / "both.travel"
    travel.write_text("".join(rows))
    lines = tracked(bench.program, folder, bench.file, travel, bench.place / "both")
    both = [lines[FRAMES - 1]["contact_hardness"], lines[2 * FRAMES - 1]["contact_hardness"]]
    # the second counts from a frame at rest with other noise
    near = [np.allclose(a["interval_90"], b["interval_90"], atol=0.06) and abs(a["frames"] - b["frames"]) <= 1 for a, b in zip(both, ends)]
    check(all(near), f"two touches one after the other, each as alone: {[10 ** one['log10_youngs_modulus_mpa'] for one in both]} MPa")
    # another sign and other units are no object's, hard or soft: the last frames say so
    for what, by in (("backwards", -1), ("in metres", 1e-3), ("in inches", 1 / 25.4), ("in micrometres", 1e3)):
        travel.write_text("".join(f"{by * float(value)}\n" for value in "".join(rows).split()))
        lines = tracked(bench.program, folder, bench.file, travel, bench.place / "both")
        said = [lines[at * FRAMES - 1]["contact_hardness"]["status"] for at in (1, 2)]
        check(said == ["impossible"] * 2, f"travel {what}: {', '.join(said)}")
    travel.write_text(rows[0])
    done = subprocess.run([bench.program, "track", folder, "--constants", bench.file, "--rest", folder / "frame_0000.png", "--traction", "--shape",
                           bench.place / "short-shape", "--travel", travel, "--out", bench.place / "short.jsonl"], capture_output=True, text=True)
    check(done.returncode == 1 and "both.travel" in done.stderr and f"line {FRAMES + 1}" in done.stderr and not (bench.place / "short.jsonl").exists(),
          f"travel that ends too early is refused by name: {done.stderr.strip().splitlines()[-1][:140] if done.stderr else ''}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("domecast")
    parser.add_argument("--presses", type=int, default=5, help="of each design")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", choices=DESIGNS)
    parser.add_argument("--level", default="linear", help="of contact")
    given = parser.parse_args()
    held = measured = 0
    for design in [given.only] if given.only else DESIGNS:
        with tempfile.TemporaryDirectory() as place:
            bench = Bench(given.domecast, design, Path(place), given.seed, given.level)
            off = []
            for number, place_of in enumerate((np.arange(given.presses) + bench.rng.uniform(size=given.presses)) / given.presses):
                young = 10 ** np.interp(place_of, [0, 1], np.log10(RANGE_MPA))
                found = bench.judge(f"{design}-{number}", young)
                if found is None:
                    continue
                median, low, high = found
                held, measured = held + (low <= np.log10(young) <= high), measured + 1
                if young < SOFT_MPA:
                    off.append(median - np.log10(young))
                if not BORDER_MPA / 2 < young < 2 * BORDER_MPA:
                    check((median > np.log10(BORDER_MPA)) == (young > BORDER_MPA), f"{design}-{number}: soft or hard")
            rms = float(np.sqrt(np.mean(np.square(off)))) if off else 0.0
            check(rms < MAX_RMS[design], f"{design}: log10 E of {len(off)} objects softer than half of the dome is {rms:.3f} of a decade rms off, "
                  f"{np.mean(off) if off else 0.0:+.3f} in the mean")
            if design == "thumb24":
                judge_touches(bench)
    check(measured >= 0.8 * given.presses * (1 if given.only else len(DESIGNS)) and held >= 0.75 * measured,
          f"the 90 % interval holds {held} of {measured}")
    sys.exit(1 if check.faults else 0)


if __name__ == "__main__":
    main()
