#!/usr/bin/env python3
"""Runs every command of README.md and of the guide's pages, as a reader would type them.

    check_commands.py DOMECAST [--all]

Each line of a fenced `sh` block is run, in order, in a fresh folder for each page that holds the shipped designs and what a
reader brings: a calibration, constants, frames, tables. `cargo run --release --` and `domecast` are the program given. A
command fails by its exit code. A mark in the line's own comment says what keeps it from being run everywhere:

    (minutes ...)   only run with --all
    (... network)   not run here: `scripts/test` itself is the one such command, and would run itself

`--watch` does not end by itself: it is stopped by Ctrl-C once the page is there. A search for lights looks at as few as it may,
whatever number its line gives: how it goes on is judged by check_optimize.py. `accuracy` takes its first look, `--quick`. Of commands that stand in a sentence,
`domecast NAME --flag`, name and flags must be known to the program, and `scripts/NAME` must exist.
"""

import csv
import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

REPOSITORY = Path(__file__).resolve().parent.parent
PAGES = [REPOSITORY / "README.md", *sorted((REPOSITORY / "src/guide").glob("*.md"))]
# longer is a hang
LIMIT_S = 900
# the fewest that a search may look at
EVALUATIONS = 20
BLOCK = re.compile(r"^```sh\n(.*?)^```", re.M | re.S)
MARK = re.compile(r"\(([^()]*\b(minutes|network)\b[^()]*)\)")
INLINE = re.compile(r"`(domecast [^`]+|scripts/[\w./]+)`")


def write_csv(path, head, rows):
    with path.open("w", newline="") as file:
        csv.writer(file).writerows([head, *rows])


def bring(domecast, folder):
    """What a reader has who follows the pages: their sensor's calibration, constants, frames and measured tables."""
    run = lambda *arguments: subprocess.run([domecast, *arguments, "--quiet"], cwd=folder, check=True)
    shutil.copytree(REPOSITORY / "designs", folder / "designs")
    run("build", "designs/thumb24.json", "--out", "sensor")
    shutil.copy(folder / "sensor/constants/opencv.yaml", folder / "cal.yaml")
    shutil.copy(folder / "sensor/constants/constants.json", folder / "constants.json")
    run("simulate", "designs/scenes/push.json", "--frames", "12", "--out", "simulated")
    frames = folder / "frames"
    frames.mkdir()
    for frame in sorted((folder / "simulated").glob("frame_*.png")):
        shutil.copy(frame, frames)
    # a bench on which nothing moves, and what is answered to the wizard
    (folder / "bench/01-rest").mkdir(parents=True)
    for k in range(3):
        shutil.copy(sorted(frames.iterdir())[0], folder / f"bench/01-rest/{k}.png")
    (folder / "answers.txt").write_text("rest\ndone\n")
    run("simulate", "designs/scenes/lit.json", "--out", "lit")
    shutil.copy(folder / "lit/frame_0000.png", folder / "rest.png")
    shutil.rmtree(folder / "lit")
    run("simulate", "designs/scenes/ball.json", "--frames", "3", "--out", "simulated-ball")
    (folder / "pressed").mkdir()
    for frame in sorted((folder / "simulated-ball").glob("frame_*.png")):
        shutil.copy(frame, folder / "pressed")
    shutil.rmtree(folder / "simulated-ball")
    # the hand of that press
    (folder / "travel.txt").write_text("0.0\n0.13\n0.27\n")
    (folder / "gravity.txt").write_text("0 0 -9.81\n" * 100)
    bring_presses(run, folder)
    constants = json.loads((folder / "constants.json").read_text())
    scatter = np.random.default_rng(25)
    dots = [(dot["id"], *dot["surface_mm"][:2]) for dot in constants["black_dots"]]
    write_csv(folder / "print.csv", ["id", "x_mm", "y_mm"],
              [(i, *(1.002 * np.array([x, y]) + scatter.normal(0, 0.01, 2))) for i, x, y in dots])
    rows = []
    for line in (folder / "simulated/truth.jsonl").read_text().splitlines():
        truth = json.loads(line)
        for kind in ("white", "black"):
            marks = [m for m in truth["white_markers" if kind == "white" else "black_dots"] if m["visible"]]
            rows += [(truth["frame"], kind, m["id"], *(np.array(m["centroid_px"]) + scatter.normal(0, 0.02, 2))) for m in marks]
    write_csv(folder / "centroids.csv", ["frame", "kind", "id", "u", "v"], rows)
    # a stage that moves the platform about, and a load cell of half a percent
    stiffness = np.array(constants["springs"]["stiffness"])
    motions = scatter.uniform(-1, 1, (80, 6)) * [0.1, 0.1, 0.1, 0.005, 0.005, 0.005]
    wrenches = motions @ stiffness.T * (1 + scatter.normal(0, 0.005, (80, 6)))
    write_csv(folder / "force.csv", "tx ty tz rx ry rz Fx Fy Fz Mx My Mz".split(), np.hstack([motions, wrenches]).tolist())
    shutil.rmtree(folder / "simulated")
    shutil.rmtree(folder / "sensor")


def bring_presses(run, folder):
    """Frames for the calibration of the light: the untouched sensor, then presses of a ball of 4 mm."""
    scene = json.loads((folder / "designs/scenes/lit.json").read_text())
    path, frame = [], 1
    for polar, azimuth in ((0, 0), (25, 0), (25, 120), (25, 240), (40, 60)):
        polar, azimuth = np.radians([polar, azimuth])
        way = np.array([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])
        path += [{"time_s": time, "position_mm": (away * way).tolist()} for time, away in ((frame - 1, 20), (frame, 13.6), (frame + 0.5, 20))]
        frame += 2
    scene |= {"name": "presses", "frames": {"count": frame, "rate_hz": 1}, "contact": {"level": "closed_form"},
              "objects": [{"name": "ball", "shape": {"kind": "sphere", "radius_mm": 4}, "path": path}]}
    (folder / "designs/scenes/presses.json").write_text(json.dumps(scene))
    run("simulate", "designs/scenes/presses.json", "--out", "simulated-presses")
    (folder / "presses").mkdir()
    for number in (0, *range(1, frame, 2)):
        shutil.copy(folder / f"simulated-presses/frame_{number:04}.png", folder / "presses")
    shutil.rmtree(folder / "simulated-presses")
    (folder / "designs/scenes/presses.json").unlink()


def commands(page):
    """Line number and text of each command of a page."""
    text = page.read_text()
    for block in BLOCK.finditer(text):
        first = text.count("\n", 0, block.start(1)) + 1
        yield from ((first + k, line) for k, line in enumerate(block[1].splitlines()) if line.strip())


def run_watching(words, folder):
    """Until the first build is there; then Ctrl-C, which must end it in good order."""
    page = folder / "output" / Path(words[2]).stem / "report/index.html"
    child = subprocess.Popen(words, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    until = time.monotonic() + LIMIT_S
    while not page.exists() and child.poll() is None and time.monotonic() < until:
        time.sleep(0.1)
    child.send_signal(signal.SIGINT)
    output = child.communicate(timeout=60)[0]
    stopped = child.returncode in (0, 130, -signal.SIGINT)
    return None if page.exists() and stopped else f"exit code {child.returncode}: {output[-800:]}"


def shorter(words):
    """A command with as short a search, or as quick a sweep, as there is."""
    if words[1] == "accuracy" and "--quick" not in words:
        return [*words, "--quick"]
    if "--optimize" not in words:
        return words
    at = words.index("--evaluations") if "--evaluations" in words else len(words)
    if at < len(words) and not "".join(words[at + 1:at + 2]).isdecimal():
        return words
    return [*words[:at], "--evaluations", str(EVALUATIONS), *words[at + 2:]]


def run(domecast, line, folder):
    """What is wrong with a command; `None` if it ran well."""
    words = shlex.split(line.replace("cargo run --release --", "domecast"), comments=True)
    if words[0] != "domecast":
        return f"not a command of this program: {words[0]}"
    words[0] = domecast
    if "--watch" in words:
        return run_watching(words, folder)
    done = subprocess.run(shorter(words), cwd=folder, capture_output=True, text=True, timeout=LIMIT_S, stdin=subprocess.DEVNULL)
    return None if done.returncode == 0 else f"exit code {done.returncode}: {(done.stderr + done.stdout)[-800:]}"


def inline_faults(domecast, page):
    """Commands in sentences whose name, flag or file does not exist."""
    faults = []
    for found in INLINE.finditer(page.read_text()):
        words = found[1].split()
        if words[0].startswith("scripts/"):
            if not (REPOSITORY / words[0]).exists():
                faults.append(f"{found[1]}: no such file")
            continue
        shown = subprocess.run([domecast, words[1], "--help"], capture_output=True, text=True)
        if shown.returncode != 0:
            faults.append(f"{found[1]}: no such command")
        faults += [f"{found[1]}: no {flag}" for flag in re.findall(r"--[a-z-]+", found[1]) if flag not in shown.stdout]
    return faults


def main():
    arguments = [word for word in sys.argv[1:] if word != "--all"]
    if len(arguments) != 1:
        sys.exit(__doc__)
    domecast, do_all = os.path.abspath(arguments[0]), "--all" in sys.argv
    failed = count = 0
    with tempfile.TemporaryDirectory() as base:
        brought = Path(base) / "brought"
        brought.mkdir()
        bring(domecast, brought)
        for page in PAGES:
            name = page.relative_to(REPOSITORY)
            folder = Path(base) / page.stem
            shutil.copytree(brought, folder)
            faults = inline_faults(domecast, page)
            for number, line in commands(page):
                mark = MARK.search(line)
                if mark and ("network" in mark[1] or not do_all):
                    print(f"!! NOT RUN: {name}:{number}: {line.strip()}")
                    continue
                began = time.monotonic()
                count += 1
                fault = run(domecast, line, folder)
                print(f"{name}:{number}: {'ok' if fault is None else 'FAILED'} {time.monotonic() - began:.1f} s  {line.split('#')[0].strip()}")
                faults += [f"{name}:{number}: {fault}"] if fault else []
            for fault in faults:
                print(f"  {fault}")
            failed += len(faults)
    print(f"commands: {count} run, {failed} faults")
    return 1 if failed or not count else 0


if __name__ == "__main__":
    sys.exit(main())
