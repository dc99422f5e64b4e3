#!/usr/bin/env python3
"""Does `wrench_sd` hold in frames that domecast did not draw, of sensors that are not quite their constants?

    python3 scripts/check_wrench_sd.py target/release/domecast output/thumb24 [--sensors N] [--seed N]

Sensors are drawn from the tolerances of the build's constants: camera, layers, markers, dots, and each spring by itself
(scripts/spring_law.py). Their frames are drawn by scripts/draw_frames.py, each at a load of its own, some with a marker under
a cover. `domecast track` reads them with the nominal constants, with those that `calibrate-optics` makes of a table of
centroids, and with those that `calibrate-force` makes of these. Of all readings the shares within one, two and three
deviations must be those of a normal distribution, as closely as so few tell; the share that changes from frame to frame
must be what a still sensor scatters by.
"""
import argparse
import copy
import json
import subprocess
import sys
import tempfile
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np

from draw_frames import Sensor, rotation
from spring_law import SpringLaw

# the magnets of all sensors are the same: their integrals are taken once
PULL = SpringLaw.pull_energy


@lru_cache
def pull(text, free):
    law = SpringLaw.__new__(SpringLaw)
    law.free = free
    return PULL(law, json.loads(text))


SpringLaw.pull_energy = lambda self, magnets: pull(json.dumps(magnets), self.free)


def built(constants, rng):
    """The sensor as it may have been made: constants that nobody knows, and its springs one by one."""
    c, t = copy.deepcopy(constants), constants["tolerances"]
    camera = c["camera"]
    rest = np.linalg.inv(np.array(camera["camera_from_sensor"]))
    rest[:3, 3] += rng.normal(0, t["pupil_mm"])
    rest[:3, :3] = rest[:3, :3] @ rotation(rng.normal(0, t["camera_rotation_rad"]))
    camera["camera_from_sensor"] = np.linalg.inv(rest).tolist()
    for layer in c["optics"]["layers"]:
        if layer["name"] != "air":
            layer["index"] += rng.normal(0, t["index"])
            if layer["thickness_mm"] is not None:
                layer["thickness_mm"] += rng.normal(0, t["layer_thickness_mm"])
    for marker in c["white_markers"]:
        marker["position_mm"][:2] = (np.array(marker["position_mm"][:2]) + rng.normal(0, t["white_marker_mm"], 2)).tolist()
    center = np.array([0, 0, c["optics"].get("dome_center_z_mm", 0.0)])
    for dot in c["black_dots"]:
        at = np.array(dot["surface_mm"]) - center + rng.normal(0, t["black_dot_mm"], 3)
        dot["surface_mm"] = (center + at * c["optics"]["dome_radius_mm"] / np.linalg.norm(at)).tolist()
    if not c.get("springs"):
        return Sensor(c), None
    law, s = c["springs"]["law"], t["springs"]
    wire, moduli = rng.normal(0, s["wire_diameter_mm"]), 1 + rng.normal(0, s["modulus_part"])
    springs = []
    for end in law["upper_ends_mm"]:
        own = copy.deepcopy(law)
        own["upper_ends_mm"] = [end]
        own["weight_n"] = [v / len(law["upper_ends_mm"]) for v in law["weight_n"]]
        own["wire_diameter_mm"] += wire
        own["outer_diameter_mm"] += rng.normal(0, s["outer_diameter_mm"])
        own["active_coils"] += rng.normal(0, s["active_coils"])
        own["shear_modulus_mpa"] *= moduli
        own["elastic_modulus_mpa"] *= moduli
        springs.append(SpringLaw({"at_mm": c["springs"]["at_mm"], "law": own}))
    return Sensor(c), Springs(springs)


class Springs:
    """The wrench of a displacement, by springs one by one."""

    def __init__(self, springs):
        self.springs = springs

    def __call__(self, d):
        return sum(spring.wrench(d) for spring in self.springs)

    def stiffer(self, factor):
        """The same with the wire's moduli times a factor; displacements count from where they rested before."""
        def one(spring):
            made = copy.copy(spring)
            for name in ("k", "twist", "bend", "shear"):
                setattr(made, name, factor * getattr(spring, name))
            made.rest_load = spring.at_rest()
            return made
        return Springs([one(spring) for spring in self.springs])


def drifted(sensor, tolerances, rng):
    """The sensor after its camera has moved in its mount, as tolerances say that it does."""
    moved = copy.copy(sensor)
    moved.pupil = sensor.pupil + rng.normal(0, tolerances["camera_drift_mm"], 3)
    moved.camera_rotation = rotation(rng.normal(0, tolerances["camera_drift_rad"], 3)).T @ sensor.camera_rotation
    return moved


def motion(rng):
    even = lambda size: rng.uniform(-size, size)
    return np.array([even(0.15), even(0.15), -0.6 + even(0.7), even(0.025), even(0.025), even(0.03)])


def pose_of(d, at):
    """Turn (rotation vector) and shift about the origin of a displacement about `at`."""
    at = np.array(at)
    return d[3:], at + d[:3] - rotation(d[3:]) @ at


def middle(outline):
    a, b = outline, np.roll(outline, -1, axis=-2)
    cross = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return ((a + b) * cross[..., None]).sum(-2) / (3 * cross.sum(-1))[..., None]


def optics_table(sensor, at, noise, rng):
    rims, markers = sensor.outlines()
    rows = ["frame,kind,id,u,v"]
    for frame in range(10):
        turn, shift = pose_of(motion(rng) if frame >= 4 else np.zeros(6), at)
        for kind, ids, outlines in (("white", range(len(markers)), np.array(markers)), ("black", sensor.ids, rims)):
            centers = middle(sensor.project(outlines, turn, shift)) + rng.normal(0, noise, (len(outlines), 2))
            rows += [f"{frame},{kind},{mark},{u!r},{v!r}" for mark, (u, v) in zip(ids, centers.tolist())]
    return "\n".join(rows) + "\n"


def force_table(wrench, rng):
    rows = ["tx,ty,tz,rx,ry,rz,Fx,Fy,Fz,Mx,My,Mz"]
    for _ in range(80):
        d = motion(rng)
        w = wrench(d) + rng.normal(0, [0.02, 0.02, 0.05, 0.2, 0.2, 0.2])
        rows.append(",".join(repr(float(v)) for v in (*d, *w)))
    return "\n".join(rows) + "\n"


class Bench:
    def __init__(self, domecast, folder):
        self.domecast, self.folder = domecast, Path(folder)

    def run(self, *arguments):
        done = subprocess.run([self.domecast, *map(str, arguments)], capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"{arguments[0]}: {done.stderr}")

    def track(self, frames, constants, *options):
        out = self.folder / "track.jsonl"
        self.run("track", frames, "--constants", constants, "--out", out, *options)
        return [json.loads(line) for line in out.read_text().splitlines()]

    def calibrated(self, nominal, sensor, wrench, at, noise, rng):
        """The constants of a sensor: as designed, with its optics calibrated, with its springs as well."""
        paths = [self.folder / name for name in ("table.csv", "optics.json", "force.csv", "both.json")]
        for path in paths:
            path.unlink(missing_ok=True)
        paths[0].write_text(optics_table(sensor, at, noise, rng))
        paths[2].write_text(force_table(wrench, rng))
        self.run("calibrate-optics", paths[0], nominal, "--rest-frames", 4, "--out", paths[1])
        self.run("calibrate-force", paths[2], paths[1], "--motion-sd", "0,0", "--out", paths[3])
        return nominal, paths[1], paths[3]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("domecast")
    parser.add_argument("build")
    parser.add_argument("--sensors", type=int, default=12)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    nominal = Path(given.build) / "constants/constants.json"
    constants = json.loads(nominal.read_text())
    at, noise = constants["springs"]["at_mm"], constants["tolerances"]["white_centroid_px"]
    rng = np.random.default_rng(given.seed)
    z = {"nominal": [], "optics": [], "optics and force": []}
    scatter = []
    with tempfile.TemporaryDirectory() as folder:
        bench, folder = Bench(given.domecast, folder), Path(folder)
        for number in range(given.sensors):
            sensor, wrench = built(constants, rng)
            frames = folder / f"frames{number}"
            frames.mkdir()
            later = drifted(sensor, constants["tolerances"], rng)
            moved = [motion(rng), np.zeros(6)]
            for k, d in enumerate(moved):
                hidden = [int(rng.integers(0, 4))] if rng.uniform() < 0.15 else []
                turn, shift = pose_of(d, at)
                picture, _ = later.draw(turn, shift, hidden=hidden, noise=2.0, seed=2 * number + k)
                cv2.imwrite(str(frames / f"frame_{k:04d}.png"), picture)
            sets = bench.calibrated(nominal, sensor, wrench, at, noise, rng)
            for name, used in zip(z, sets):
                for line, d in zip(bench.track(frames, used), moved):
                    if line["wrench"] is not None:
                        z[name].append((np.array(line["wrench"]) - wrench(d)) / np.array(line["wrench_sd"]))
        # one sensor that stands still: its frames scatter by the random share
        sensor, _ = built(constants, rng)
        frames = folder / "still"
        frames.mkdir()
        for k in range(30):
            cv2.imwrite(str(frames / f"frame_{k:04d}.png"), sensor.draw(noise=2.0, seed=9000 + k)[0])
        lines = bench.track(frames, nominal)[5:]
        found = np.array([line["wrench"] for line in lines])
        said = np.sqrt(np.mean([np.square(line["wrench_sd_random"]) for line in lines], axis=0))
        scatter = found.std(axis=0, ddof=1) / said
        failed = False
    for name, values in z.items():
        values = np.abs(np.array(values))
        shares = [100 * np.mean(values <= k) for k in (1, 2, 3)]
        # the six axes of a wrench go together: they tell as much as two or three that do not
        room = [260 * np.sqrt(p * (1 - p) / (2.5 * len(values))) for p in (0.683, 0.954, 0.997)]
        good = (len(values) >= 1.9 * given.sensors and abs(shares[0] - 68.3) <= max(room[0], 7.5)
                and abs(shares[1] - 95.4) <= max(room[1], 2.5) and shares[2] >= 99.7 - max(room[2], 0.7))
        failed |= not good
        print(f"{'ok  ' if good else 'FAIL'} {name:<17} {len(values)} wrenches, within 1, 2, 3 sd: "
              f"{shares[0]:.1f} {shares[1]:.1f} {shares[2]:.1f} %, by axis {np.round(np.sqrt((values ** 2).mean(0)), 2)} rms")
    good = bool(np.all(scatter < 1.5) and np.all(scatter > 0.5))
    failed |= not good
    print(f"{'ok  ' if good else 'FAIL'} a still sensor's scatter over wrench_sd_random: {np.round(scatter, 2)}")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
