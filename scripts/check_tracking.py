#!/usr/bin/env python3
"""Simulates a press and pushes on built sensors under their own lights, tracks the frames, and compares with the truth.

    python3 scripts/check_tracking.py target/release/domecast output/thumb24 [...]

For each build a short scene is written from its design's claimed loads: a press, pushes along x and y under it, and back
to rest (on a rigid mount a ball is pressed on beside the pole by a force that rises and falls, or the sensor rests where
the dome is no hemisphere), lit with the exposure that `report/light.json` states, with the noise of a usual
camera. `domecast simulate` draws it and `domecast track` reads frames and constants only. Held to the truth:

- every frame has an answer and is `ok`, and no dot that the camera sees whole is missing or taken for another (some in a
  thousand, on the edge of a shadow at the rim, may be withheld);
- dots: rms and largest distance of the centroids, as shares of a dot's diameter;
- raw frames with blue first, given as red first, are named; with their own name they give the lines of the pictures;
- wrench, where the build promises one: each error within six of the standard deviations that the line itself states
  without the constants' tolerances (the drawn sensor is built as they say), and the mean of the squared ones not above four, so that neither the number nor its spread is wrong in silence.
"""
import json
import pathlib
import subprocess
import sys
import tempfile

import cv2
import numpy as np

FRAMES = 21
RATE_HZ = 30
# Of a dot's diameter in the image: 0.1 and 0.7 px for dots of 7 px.
MAX_RMS_SHARE, MAX_SHARE = 0.0145, 0.1
MAX_SDS, MAX_MEAN_SQUARE = 6.0, 4.0
# What six springs' law is linear in, and what a frame of steps leaves: a floor under the stated deviations, N and N mm.
FLOOR = np.array([0.002, 0.002, 0.005, 0.02, 0.02, 0.005])
# Dots at the dome's rim, in part on the edge of a shadow, that do not look like dots.
MAX_WITHHELD = 0.006
failed = 0


def check(what, holds, detail=""):
    global failed
    failed += not holds
    print(f"{'ok  ' if holds else 'FAIL'} {what:<52} {detail}")


def scene_of(build):
    """A scene on a copy of the build's own design, with loads in proportion to its dome."""
    constants = json.loads((build / "constants/constants.json").read_text())
    light = json.loads((build / "report/light.json").read_text())
    radius = constants["optics"]["dome_radius_mm"]
    pole = [0, 0, radius + constants["optics"].get("dome_center_z_mm", 0.0)]
    press, push = 0.5 * radius, 0.04 * radius
    # a ball of half of the dome's radius goes some hundredths of it deep
    press_n = 0.012 * radius * radius
    forces = [[0, 0, 0], [0, 0, -press], [push, 0, -press], [0, push, -press], [0, 0, 0]]
    times = np.linspace(0, (FRAMES - 1) / RATE_HZ, len(forces)).tolist()
    motion = {"wrench": [{"time_s": t, "force_n": f, "point_mm": pole} for t, f in zip(times, forces)]}
    scene = {
        "version": 1,
        "name": "pushed",
        "design": str((build / "design.json").resolve()),
        "frames": {"count": FRAMES, "rate_hz": RATE_HZ},
        "tolerance": {"px": 0.02, "grey": 2},
        "seed": 3,
        "light": {
            "surround_level": 0.02,
            "leds": {"level_per_mw_mm2": light["level_per_mw_mm2"], "stray_level": 0.005, "crosstalk": 0.08},
        },
        "electronics": {"noise": {"full_scale_electrons": 8000, "read_electrons": 4, "bits": 10}},
    }
    if constants.get("springs"):
        return scene | {"motion": motion}
    if constants["optics"].get("dome_center_z_mm", 0.0) != 0.0:
        return scene
    ball = {
        "name": "ball",
        "shape": {"kind": "sphere", "radius_mm": 0.5 * radius},
        "path": [{"time_s": 0, "position_mm": [0.1 * radius, 0.05 * radius, 1.8 * radius]}],
        "press": {
            "direction": [0, 0, -1],
            "force": [{"time_s": t, "force_n": f} for t, f in zip(times, [0, 0.004 * press_n, press_n, 0.5 * press_n, 0])],
        },
    }
    return scene | {"objects": [ball], "contact": {"level": "linear", "element_mm": 0.1 * radius}}


def press_n_of(build):
    """The largest force of the ball, N."""
    return max(key["force_n"] for key in scene_of(build)["objects"][0]["press"]["force"])


def run(program, *arguments):
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{' '.join(map(str, arguments))}: {done.stderr.strip() or done.stdout.strip()}")
    return done.stdout


# As the guide's file formats give it.
RECORD = np.dtype([("frame", "<u8"), ("time_s", "<f8"), ("problems", "<u8"), ("dots_ok", "<u8"), ("displacement", "<f8", 6),
                   ("pose_sd", "<f8", 6), ("wrench", "<f8", 6), ("wrench_sd", "<f8", 6), ("pose_rms_px", "<f8"), ("_", "<f8")])


def turned(vector):
    """The matrix of a rotation vector (Rodrigues)."""
    angle = np.linalg.norm(vector)
    x, y, z = vector / angle if angle > 0 else vector
    across = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * across + (1 - np.cos(angle)) * across @ across


def check_raw(program, constants, frames, lines):
    pictures = [cv2.imread(str(path)) for path in frames]
    height, width = pictures[0].shape[:2]
    said = {}
    for given, order in (("rgb", "rgb"), ("bgr", "rgb"), ("bgr", "bgr")):
        stream = b"".join(np.ascontiguousarray(p if given == "bgr" else p[..., ::-1]).tobytes() for p in pictures)
        track = [program, "track", "-", "--raw", f"{width}x{height}:{order}", "--constants", constants]
        done = subprocess.run(track, input=stream, capture_output=True)
        is_same = [json.loads(line) for line in done.stdout.splitlines()] == lines
        said[given, order] = is_same, b"red and blue swapped" in done.stderr
    good = said["rgb", "rgb"] == (True, False) == said["bgr", "bgr"] and said["bgr", "rgb"][1]
    check("raw colours in another order are named", good, "" if good else str(said))


def compare(program, build, folder):
    scene = folder / "scene.json"
    scene.write_text(json.dumps(scene_of(build)))
    run(program, "simulate", scene, "--out", folder / "frames", "--quiet")
    truth = [json.loads(line) for line in (folder / "frames/truth.jsonl").read_text().splitlines()]
    frames = sorted((folder / "frames").glob("frame_*.png"))
    # The drawn sensor is built as its constants say: what they may be off by does not count.
    constants = folder / "constants.json"
    exact = json.loads((build / "constants/constants.json").read_text())
    constants.write_text(json.dumps({name: value for name, value in exact.items() if name != "tolerances"}))
    track = ["track", *frames, "--constants", constants, "--out", folder / "track.jsonl", "--quiet"]
    run(program, *track)
    lines = [json.loads(line) for line in (folder / "track.jsonl").read_text().splitlines()]
    check("a line for each frame", len(lines) == len(truth) == FRAMES, f"{len(lines)} of {FRAMES}")
    statuses = [line["status"] for line in lines]
    read = set(statuses) == {"ok"}
    check("every frame is read", read, ", ".join(sorted(set(statuses))))

    run(program, "track", *frames, "--constants", constants, "--out", folder / "track.bin", "--format", "records", "--quiet")
    records = np.fromfile(folder / "track.bin", RECORD)
    same = len(records) == len(lines) and all(
        r["frame"] == line["frame"] and r["problems"] == 0
        and r["dots_ok"] == sum(dot["state"] == "ok" for dot in line["black_dots"])
        and all(np.isnan(r[name]).all() if line[name] is None else np.allclose(r[name], line[name], atol=1e-6)
                for name in ("pose_sd", "wrench", "wrench_sd"))
        and (np.isnan(r["displacement"]).all() if line["pose"] is None
             else np.allclose(turned(r["displacement"][3:]), np.array(line["pose"])[:3, :3], atol=1e-8))
        for r, line in zip(records, lines))
    check("binary records say what the lines say", same)

    check_raw(program, constants, frames[:3], lines[:3])

    away, lost, wanted = [], 0, 0
    for line, true in zip(lines, truth):
        found = {d["id"]: d["centroid_px"] for d in line["black_dots"] if d["centroid_px"]}
        for dot in true["black_dots"]:
            if not dot["visible"]:
                continue
            wanted += 1
            if dot["id"] in found:
                away.append(np.hypot(*np.subtract(found[dot["id"]], dot["centroid_px"])))
            else:
                lost += 1
    away = np.array(away if away else [np.inf])
    rms = np.sqrt(np.mean(away**2))
    check("no visible dot is missing", lost <= MAX_WITHHELD * wanted and wanted > 0, f"{lost} of {wanted}")
    size_px = json.loads((build / "artwork/layout.json").read_text())["dot_diameter_px"]
    good = rms <= MAX_RMS_SHARE * size_px and away.max() <= MAX_SHARE * size_px
    check("dots lie where they are", good, f"rms {rms:.4f} px, max {away.max():.3f} px of {size_px:.1f} px")

    if not json.loads(constants.read_text()).get("springs"):
        unknown = all(line[name] is None for line in lines for name in ("pose", "pose_sd", "wrench", "wrench_sd"))
        check("no springs, no pose, no wrench", unknown and not any(line["white_markers"] for line in lines))
        still = all(np.allclose(true["pose"], np.eye(4)) for true in truth)
        check("the platform is still", still)
        if not scene_of(build).get("objects"):
            return
        rest = np.array([dot["surface_mm"] for dot in json.loads(constants.read_text())["black_dots"]])
        moved = [np.linalg.norm(np.array([d["surface_mm"] for d in true["black_dots"]]) - rest, axis=1).max() for true in truth]
        deep = 0.03 * np.linalg.norm(rest[0])
        check("the dots move as the ball presses", max(moved) > deep, f"{max(moved):.2f} mm")
        asked = [l["wrench"][2] for l in truth]
        check("the ball presses as hard as was asked", abs(min(asked) + press_n_of(build)) < 1e-4, f"{min(asked):.4f} N")
        return
    told = [(l["wrench"], l["wrench_sd"], t["wrench"]) for l, t in zip(lines, truth) if l["wrench"]]
    check("a wrench for each frame", len(told) == FRAMES, f"{len(told)}")
    if told:
        got, sd, want = (np.array(part, float) for part in zip(*told))
        off = got - want
        parts = off / np.hypot(sd, FLOOR)
        worst = np.abs(parts).max(0)
        square = (parts**2).mean(0)
        words = " ".join(f"{name} {e:.3f}" for name, e in zip(("Fx", "Fy", "Fz", "Mx", "My", "Mz"), np.sqrt((off**2).mean(0))))
        check("the wrench is within its stated deviations", worst.max() <= MAX_SDS, f"worst {worst.max():.1f}; rms {words}")
        check("the stated deviations are those of the errors", square.max() <= MAX_MEAN_SQUARE, np.array2string(square, precision=2))


def main(program, *builds):
    for build in map(pathlib.Path, builds):
        print(build)
        with tempfile.TemporaryDirectory() as folder:
            compare(program, build, pathlib.Path(folder))
    print("tracked as the truth says" if failed == 0 else f"{failed} faults")
    return 1 if failed else 0


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
