#!/usr/bin/env python3
"""The calibration wizard on sensors that are not quite their constants, in frames that domecast did not draw.

    scripts/check_calibrate.py DOMECAST BUILD [--sensors N] [--loads N] [--keep DIR] [--axe AXE.JS]

Sensors are drawn from the tolerances of the build's constants, each spring by itself (check_wrench_sd.py, spring_law.py), and a
fiftieth beside the springs' law. The
wizard gets frames by the player (draw_frames.py) and is answered, one process for each answer, with the load that it asked for,
hung a little off what is said of it. Then
- each load that it asked for must lower a covariance computed here, by numpy from the springs' law, more than nine of ten random ones;
- the constants at the end must be nearer to the truth, as it is seen through the optics that were measured, and the truth within their
  deviations;
- wrong steps (units, direction, a sensor that moves, a weight left on at rest, a turned camera, another camera's lens) must be refused
  with words that name them, and leave the session as it was;
- a wizard that is killed at random times must go on and come to the same bytes;
- the page at its end must be one that check_report lets pass.
"""
import argparse
import csv
import json
import random
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np

from check_identities import dent
from check_wrench_sd import built, middle, pose_of
from draw_frames import Sensor, rotation, turn_picture
from spring_law import SpringLaw

GRAVITY = 9.80665e-3  # N/g
LOAD_SD = 0.005, np.radians(1.0), 0.5
LAW_PART = 0.02
# the six axes of one sensor go together: as many as these tell as much
FREE_AXES = 3
DIRECTIONS = {"down": (0, 0, -1), "+x": (1, 0, 0), "-x": (-1, 0, 0), "+y": (0, 1, 0), "-y": (0, -1, 0)}
FAULTS = []


def expect(holds, what):
    if not holds:
        FAULTS.append(what)
        print(f"  FAULT: {what}")


def wrench_of(force, point, at):
    return np.concatenate([force, np.cross(np.asarray(point) - at, force)])


def held_at(law, stiffness, at, loads):
    """Where loads, each a force and a point that moves with the platform, hold it."""
    d = np.zeros(6)
    for _ in range(20):
        turn, shift = pose_of(d, at)
        wanted = sum(wrench_of(force, rotation(turn) @ point + shift, at) for force, point in loads)
        step = np.linalg.solve(stiffness, wanted - law(d))
        d = d + step
        if np.abs(step).max() < 1e-8:
            return d
    raise ArithmeticError("springs that do not settle")


class Bench:
    """A sensor as it was built, and the wizard that looks at it."""

    def __init__(self, domecast, constants_path, folder, rng):
        self.domecast, self.constants_path, self.rng = domecast, constants_path, rng
        self.constants = json.loads(Path(constants_path).read_text())
        self.sensor, springs = built(self.constants, rng)
        self.at = np.array(self.constants["springs"]["at_mm"])
        # what the law leaves out
        size = np.sqrt(np.diag(np.array(self.constants["springs"]["stiffness"])))
        beside = np.tril(rng.normal(0, LAW_PART, (6, 6)) * np.outer(size, size))
        beside += np.tril(beside, -1).T
        self.law = lambda d: springs(d) + beside @ d
        self.stiffness = np.array([(self.law(e) - self.law(-e)) / 2e-3 for e in 1e-3 * np.eye(6)]).T
        self.frames, self.session = Path(folder) / "frames", Path(folder) / "session"

    def displacement(self, force, point):
        """Where a load that moves with the platform holds it."""
        return held_at(self.law, self.stiffness, self.at, [(force, point)])

    def draw(self, name, d=np.zeros(6), count=3, change=lambda frame, k: frame, drift=0.0, skin=None):
        folder = self.frames / name
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        for k in range(count):
            turn, shift = pose_of(d + [drift * k, 0, 0, 0, 0, 0], self.at)
            frame, _ = self.sensor.draw(turn, shift, skin, seed=int(self.rng.integers(1 << 30)))
            cv2.imwrite(str(folder / f"{k:03}.png"), change(frame, k))

    def run(self, *answers, session=None, wait=True):
        script = self.frames / "answers.txt"
        script.write_text("\n".join(answers) + "\n")
        command = [self.domecast, "--json", "calibrate", f"player:{self.frames}?rate=500", "--constants", self.constants_path,
                   "--session", session or self.session, "--answers", script, "--frames", "8"]
        if not wait:
            return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode not in (0, 1):
            sys.exit(f"exit {done.returncode}: {done.stderr or done.stdout}")
        return done.returncode, json.loads(done.stdout)

    def hang(self, answer, name):
        """Frames of a load that is said, hung a little off that."""
        _, grams, unit, direction, _, place = answer.split()
        assert unit == "g"
        part, turn, place_mm = LOAD_SD
        force = float(grams) * GRAVITY * np.array(DIRECTIONS[direction]) * (1 + self.rng.normal(0, part))
        point = (0, 0, top(self.constants)) if place == "pole" else [float(v) for v in place.split(",")]
        said = float(grams) * GRAVITY * np.array(DIRECTIONS[direction], float), np.array(point, float)
        force = rotation(self.rng.normal(0, turn, 3)) @ force
        d = self.displacement(force, np.array(point) + self.rng.normal(0, place_mm, 3))
        # what touches the dome dents it: its dots say nothing of the platform then
        self.draw(name, d, skin=dent(self.sensor, said[1], 0.7 * np.linalg.norm(force) ** (2 / 3), 1.5))
        return said


def top(constants):
    return constants["optics"]["dome_radius_mm"] + constants["optics"].get("dome_center_z_mm", 0.0)


class Knowledge:
    """Covariance of the 36 entries of the stiffness, by the springs' law written a second time."""

    def __init__(self, constants, limits):
        springs, t = constants["springs"], constants["tolerances"]["springs"]
        self.limits, self.at = limits, np.array(springs["at_mm"])
        law = springs["law"]
        self.nominal = SpringLaw(springs).stiffness()
        self.covariance = np.diag([(LAW_PART**2 * self.nominal[i, i] * self.nominal[j, j]) for i in range(6) for j in range(6)])

        def of(law):
            return SpringLaw({"at_mm": springs["at_mm"], "law": law}).stiffness().ravel()

        changes = [("wire_diameter_mm", t["wire_diameter_mm"]), (None, t["modulus_part"])]
        vectors = [np.zeros(36), np.zeros(36)]
        for end in law["upper_ends_mm"]:
            alone = {**law, "upper_ends_mm": [end], "weight_n": [v / len(law["upper_ends_mm"]) for v in law["weight_n"]]}
            here = of(alone)
            for k, (name, sd) in enumerate(changes):
                changed = {name: law[name] + 0.1 * sd} if name else {
                    m: law[m] * (1 + 0.1 * sd) for m in ("shear_modulus_mpa", "elastic_modulus_mpa")}
                vectors[k] += (of({**alone, **changed}) - here) / 0.1
            for name in ("outer_diameter_mm", "active_coils"):
                vectors.append((of({**alone, name: law[name] + 0.1 * t[name]}) - here) / 0.1)
        self.covariance += sum(np.outer(v, v) for v in vectors)
        pixel = constants["tolerances"]["white_centroid_px"]
        self.motion = np.diag(np.array([1, 1, 1.5, 0.15, 0.15, 0.1]) * 0.05 * pixel) ** 2

    def parts(self, force, point):
        w = wrench_of(force, point, self.at)
        d = np.linalg.solve(self.nominal, w)
        part, turn, place = LOAD_SD
        noise = part**2 * np.outer(w, w) + self.nominal @ self.motion @ self.nominal.T
        for axis in np.eye(3):
            turned = np.cross(axis, force) * turn
            for change in (wrench_of(turned, point, self.at), np.concatenate([np.zeros(3), np.cross(axis * place, force)])):
                noise += np.outer(change, change)
        h = np.kron(np.eye(6), d)
        return h, noise

    def gain(self, force, point):
        h, noise = self.parts(force, point)
        return np.linalg.slogdet(noise + h @ self.covariance @ h.T)[1] - np.linalg.slogdet(noise)[1]

    def add(self, force, point):
        h, noise = self.parts(force, point)
        weight = self.covariance @ h.T @ np.linalg.inv(noise + h @ self.covariance @ h.T)
        self.covariance = self.covariance - weight @ h @ self.covariance

    def random(self, rng, constants):
        """A load that the springs bear: any direction that does not lift, any place to 60 degrees of the pole, a weight at hand."""
        radius, center = constants["optics"]["dome_radius_mm"], constants["optics"].get("dome_center_z_mm", 0.0)
        while True:
            force = rng.normal(size=3)
            force = np.array([*force[:2], -abs(force[2])]) / np.linalg.norm(force)
            polar, around = np.arccos(rng.uniform(0.5, 1)), rng.uniform(0, 2 * np.pi)
            point = radius * np.array([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)])
            point[2] += center
            force = force * rng.choice([10, 20, 50, 100, 200, 500]) * GRAVITY
            w = np.abs(wrench_of(force, point, self.at))
            if max(w / self.limits) < 0.7 and np.hypot(*(w / self.limits)[3:5]) < 0.7:
                return force, point


def limits_of(build):
    """Largest single loads of the build's envelope."""
    rows = {row["load"]: float(row["size"]) for row in csv.DictReader(open(Path(build) / "report/load_envelope.csv"))}
    push = min(v for k, v in rows.items() if k.startswith("push"))
    tilt = min(v for k, v in rows.items() if k.startswith("tilt"))
    return np.array([push, push, rows["press"], tilt, tilt, rows["twist"]])


def calibrate(bench, build, loads, rng):
    """A whole calibration; ranks of the loads that were asked for."""
    bench.draw("01-rest", count=8)
    code, state = bench.run("rest")
    expect(code == 0, f"rest is refused: {state.get('error')}")
    knowledge, ranks = Knowledge(bench.constants, limits_of(build)), []
    for k in range(loads):
        said = bench.hang(state["next"], f"{k + 2:02}-weight")
        asked = knowledge.gain(*said)
        others = [knowledge.gain(*knowledge.random(rng, bench.constants)) for _ in range(60)]
        ranks.append(np.mean(asked > np.array(others)))
        knowledge.add(*said)
        code, state = bench.run(state["next"])
        if code:
            expect(False, f"a good load is refused: {state['error']['problem']}")
            return ranks
    return ranks


def stiffness_as_seen(bench, measured):
    """The stiffness that turns motions into loads where they are seen through the measured optics: what these are off by, the scale of a
    motion say, goes into the springs, and out again when the sensor is read."""
    other = Sensor(measured)

    def seen(sensor, d):
        turn, shift = pose_of(d, bench.at)
        return np.concatenate([middle(sensor.project(outline, turn, shift)) for outline in sensor.outlines()[1]])

    def motion(pixels):
        d, steps = np.zeros(6), np.diag([1e-4] * 3 + [1e-5] * 3)
        for _ in range(6):
            slope = np.array([(seen(other, d + e) - seen(other, d - e)) / (2 * e.sum()) for e in steps]).T
            d = d + np.linalg.lstsq(slope, pixels - seen(other, d), rcond=None)[0]
        return d

    sizes = np.diag([0.05] * 3 + [0.005] * 3)
    ways = np.array([(motion(seen(bench.sensor, e)) - motion(seen(bench.sensor, -e))) / (2 * e.sum()) for e in sizes]).T
    return bench.stiffness @ np.linalg.inv(ways)


def judge_constants(bench):
    """(errors before and after as parts, z of the diagonal, wrench errors before and after)."""
    code, state = bench.run("done")
    expect(code == 0 and state["page"], f"done fails: {state}")
    measured = json.loads((bench.session / "constants.measured.json").read_text())
    before, after = np.array(bench.constants["springs"]["stiffness"]), np.array(measured["springs"]["stiffness"])
    expect(measured["springs"]["source"] == "measured", "the constants are not measured")
    truth = np.diag(stiffness_as_seen(bench, measured))
    sd = np.array([np.sqrt(axis["covariance"][i][i]) for i, axis in enumerate(measured["springs"]["uncertainty"]["axes"])])
    camera = [np.array(c["camera"]["camera_from_sensor"]) for c in (bench.constants, measured, bench.sensor.constants)]
    pupil = [-m[:3, :3].T @ m[:3, 3] for m in camera]
    moved = [np.linalg.norm(p - pupil[2]) for p in pupil[:2]]
    return np.diag(before) / truth - 1, np.diag(after) / truth - 1, (np.diag(after) - truth) / sd, moved


def wrong_steps(bench, loads):
    """Each must be refused by name, and the session stays as it was."""
    index = bench.session / "session.json"
    step = f"{loads + 2:02}"

    def refused(answer, words, what):
        before = index.read_bytes()
        code, state = bench.run(answer)
        problem = json.dumps(state.get("error", ""))
        expect(code == 1 and any(word in problem for word in words), f"{what}: {code}, {problem[:300]}")
        expect(index.read_bytes() == before, f"{what}: the session changed")

    bench.hang("weight 50 g +x at pole", f"{step}-weight")
    refused("weight 50 kg +x at pole", ["g instead of kg"], "kg for g")
    refused("weight 50 N +x at pole", ["g instead of N"], "N for g")
    refused("weight 50 g -x at pole", ["along +x"], "direction")
    refused("weight 50 g +y at pole", ["along +x"], "axes swapped")
    refused("weight 50 ounces +x at pole", ["none of g"], "unknown unit")
    refused("lens camera.yaml", ["comes before rest"], "lens after rest")
    bench.draw(f"{step}-weight", bench.displacement(0.3 * np.array([1.0, 0, 0]), [0, 0, top(bench.constants)]), drift=0.05)
    refused("weight 30.6 g +x at pole", ["moved while"], "moving sensor")
    bench.draw(f"{step}-rest", bench.displacement(np.array([0, 0, -1.0]), [0, 0, top(bench.constants)]))
    refused("rest", ["not at rest"], "weight left on")
    center = bench.sensor.size[0] / 2, bench.sensor.size[1] / 2
    bench.draw(f"{step}-rest", change=lambda frame, k: turn_picture(frame, 180, False, center)[0])
    refused("rest", ["turned"], "turned camera")
    bench.draw(f"{step}-rest")
    code, state = bench.run("rest", "undo")
    expect(code == 0 and len(state["steps"]) == loads + 1, "a right step after wrong ones")


def lens(bench, folder):
    """The camera's own calibration by OpenCV: its true one goes in, another camera's is refused."""
    def write(name, matrix):
        storage = cv2.FileStorage(str(folder / name), cv2.FILE_STORAGE_WRITE)
        storage.write("image_width", bench.sensor.size[0])
        storage.write("image_height", bench.sensor.size[1])
        if bench.constants["camera"]["model"] == "kannala_brandt":
            storage.write("camera_model", "kannala_brandt")
        storage.write("camera_matrix", matrix)
        storage.write("distortion_coefficients", np.array([bench.constants["camera"]["distortion"]]))
        storage.release()

    matrix = np.array(bench.constants["camera"]["matrix"])
    write("own.yaml", matrix * [[1.01, 1, 1], [1, 1.01, 1], [1, 1, 1]])
    write("other.yaml", matrix * [[1.4, 1, 1], [1, 1.4, 1], [1, 1, 1]])
    other = folder / "lens-session"
    code, state = bench.run(f"lens {folder / 'other.yaml'}", session=other)
    expect(code == 1 and "another camera" in state["error"]["problem"], f"another camera's lens: {state}")
    code, state = bench.run(f"lens {folder / 'own.yaml'}", session=other)
    expect(code == 0 and len(state["steps"]) == 1, f"own lens: {state}")


def kills(bench, folder, count, rng):
    """Killed again and again, the wizard comes to the bytes of one that was not."""
    answers = [step["said"] for step in json.loads((bench.session / "session.json").read_text())["steps"]][:4]
    whole, often = folder / "whole", folder / "often"
    bench.run(*answers, "done", session=whole)
    began = time.monotonic()
    bench.run(*answers, session=folder / "timed")
    took = time.monotonic() - began
    killed = 0
    for _ in range(count):
        index = often / "session.json"
        done = len(json.loads(index.read_text())["steps"]) if index.exists() else 0
        process = bench.run(*answers[done:], session=often, wait=False)
        time.sleep(rng.uniform(0, took))
        killed += process.poll() is None
        process.kill()
        process.wait()
    index = often / "session.json"
    done = len(json.loads(index.read_text())["steps"]) if index.exists() else 0
    code, state = bench.run(*answers[done:], "done", session=often)
    expect(code == 0, f"after kills: {state}")
    same = (whole / "constants.measured.json").read_bytes() == (often / "constants.measured.json").read_bytes()
    expect(same, "killed and whole sessions differ")
    print(f"killed {killed} times, went on, same bytes: {same}")


def page(path, axe):
    """As every page: units, a browser's console, phones, axe-core."""
    words = [sys.executable, Path(__file__).with_name("check_report"), *(["--axe", axe.resolve()] if axe else []), path]
    done = subprocess.run(words, capture_output=True, text=True)
    print(done.stdout.strip())
    expect(done.returncode == 0, f"the page: {done.stderr}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("domecast")
    parser.add_argument("build")
    parser.add_argument("--sensors", type=int, default=2)
    parser.add_argument("--loads", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--axe", type=Path, help="axe.min.js of npm's axe-core")
    given = parser.parse_args()
    rng = np.random.default_rng(given.seed)
    constants = Path(given.build) / "constants/constants.json"
    ranks, before, after, z, moved = [], [], [], [], []
    with tempfile.TemporaryDirectory() as place:
        for k in range(given.sensors):
            folder = (given.keep or Path(place)) / f"sensor-{k}"
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir(parents=True)
            bench = Bench(given.domecast, constants, folder, rng)
            ranks += calibrate(bench, given.build, given.loads, rng)
            if k == 0:
                wrong_steps(bench, given.loads)
                lens(bench, folder)
                kills(bench, folder, 6, random.Random(given.seed))
            own = judge_constants(bench)
            if k == 0:
                page(bench.session / "calibration.html", given.axe)
            for all, one in zip((before, after, z, moved), own):
                all.append(one)
    rms = lambda v: float(np.sqrt(np.mean(np.square(v))))
    moved = np.array(moved)
    print(f"{given.sensors} sensors, {given.loads} loads each: stiffness off by {100 * rms(before):.1f} % before, {100 * rms(after):.1f} % after; "
          f"over its deviation {rms(z):.2f} rms, {np.abs(z).max():.1f} at most; pupil {moved[:, 0].mean():.3f} mm off before, "
          f"{moved[:, 1].mean():.3f} after")
    print(f"loads that were asked for: better than {100 * np.mean(ranks):.0f} % of random ones, the least {100 * min(ranks):.0f} %")
    expect(np.mean(ranks) > 0.9, "the loads asked for are not better than nine of ten")
    # two sensors can both have been bought near their nominal springs
    expect(rms(after) < max(0.5 * rms(before), 0.02), "the stiffness is not nearer to the truth")
    # what a right deviation leaves of chance, two and a half times over, and no more than before that was counted
    chance = 2.5 / np.sqrt(2 * FREE_AXES * given.sensors)
    expect(max(1 - chance, 0.3) < rms(z) < min(1 + chance, 1.3) and np.abs(z).max() < 4, "the deviations do not hold")
    expect((moved[:, 1] < moved[:, 0] + 0.02).all(), "the pupil is not nearer to the truth")
    sys.exit(1 if FAULTS else 0)


if __name__ == "__main__":
    main()
