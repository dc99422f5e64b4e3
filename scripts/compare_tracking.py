"""`domecast track` beside the paper's runtime in Python-OpenCV, on the same simulated frames, one core each.

    python3 scripts/compare_tracking.py [--noise LEVELS] target/release/domecast output/thumb24/constants/constants.json SEQUENCE ...

`--noise` adds Gaussian noise of that standard deviation to every value of every frame (seeded), for scenes that have none.
A sequence is a folder of `domecast simulate`: frames and truth.jsonl. Prints one table: error of the dots (px, raw frame,
rms on each axis, against the truth's centroids) and of the wrench, frames with an answer, time a frame.
The peer's dots are matched to the truth by the nearest, which favours it: it has no identities of its own; its flow's
answer is called mislabelled where it is 4 px off, on another dot. Its two levels are the best fixed ones for the first frame. Its time is that of its thread on the processor, ours
the time that passed, which other work on the machine makes longer.
"""
import json
import pathlib
import subprocess
import sys
import tempfile
import time

import cv2
import numpy as np

from paper_runtime import PaperRuntime

AXES = "Fx", "Fy", "Fz", "Mx", "My", "Mz"
cv2.setNumThreads(1)


def rms(errors):
    errors = np.array(errors)
    return np.sqrt(np.mean(errors ** 2)) if errors.size else np.nan


def of_peer(constants, frames, truth):
    runtime = PaperRuntime(constants)
    runtime.choose_levels(cv2.imread(str(frames[0])), [d["image_px"] for d in constants["black_dots"]])
    dots, flowed, wrenches, times, wanted, found = [], [], [], [], 0, 0
    near = np.empty((0, 2))
    for path, true in zip(frames, truth):
        frame = cv2.imread(str(path))
        began = time.thread_time()
        black, flow, wrench = runtime.step(frame)
        times.append(time.thread_time() - began)
        want = np.array([d["centroid_px"] for d in true["black_dots"] if d["visible"]])
        wanted += len(want)
        raw = runtime.to_raw(black) if len(black) else np.empty((0, 2))
        for place in want:
            if len(raw):
                away = raw - place
                best = away[np.linalg.norm(away, axis=1).argmin()]
                if np.linalg.norm(best) < 4:
                    found += 1
                    dots.append(best)
        if flow is not None:
            ids = {d["id"]: d["centroid_px"] for d in true["black_dots"] if d["visible"]}
            there = runtime.to_raw(flow)
            for number, place in zip(near, there):
                if number in ids and np.isfinite(place).all():
                    flowed.append(place - ids[number])
        # Which dot each centroid is, so that the flow's answer can be checked in the next frame.
        names = [d["id"] for d in true["black_dots"] if d["visible"]]
        near = [names[np.linalg.norm(want - p, axis=1).argmin()] if len(want) else -1 for p in raw]
        if wrench is not None:
            wrenches.append(wrench - true["wrench"])
    return dots, flowed, wrenches, times, found, wanted


def of_ours(program, constants_path, frames, truth):
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "track.jsonl"
        command = [program, "track", *map(str, frames), "--constants", constants_path, "--out", str(out), "--json"]
        printed = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
        lines = [json.loads(line) for line in out.read_text().splitlines()]
    dots, wrenches, sds, found, wanted, wrong = [], [], [], 0, 0, 0
    for line, true in zip(lines, truth):
        ids = {d["id"]: d["centroid_px"] for d in true["black_dots"] if d["visible"]}
        wanted += len(ids)
        for dot in line["black_dots"]:
            if dot["centroid_px"] and dot["id"] in ids:
                away = np.subtract(dot["centroid_px"], ids[dot["id"]])
                found += 1
                wrong += np.linalg.norm(away) > 4
                dots.append(away)
        if line["wrench"]:
            wrenches.append(np.subtract(line["wrench"], true["wrench"]))
            sds.append(line["wrench_sd"])
    return dots, wrenches, sds, printed, found, wanted, wrong, {l["status"] for l in lines}


def wrench_lines(name, errors):
    errors = np.array(errors)
    if not len(errors):
        return f"  {name:<22} no wrench"
    words = [f"{axis} {m:+.4f} ({s:.4f})" for axis, m, s in zip(AXES, errors.mean(0), errors.std(0))]
    return f"  {name:<22} {len(errors):>4} frames: " + "  ".join(words)


def noisy(frames, levels, folder):
    """The frames with noise, in another folder."""
    random, made = np.random.default_rng(1), []
    for path in frames:
        picture = cv2.imread(str(path)).astype(np.float32)
        picture = np.clip(np.rint(picture + random.normal(0, levels, picture.shape)), 0, 255).astype(np.uint8)
        made.append(pathlib.Path(folder) / path.name)
        cv2.imwrite(str(made[-1]), picture)
    return made


arguments, noise = sys.argv[1:], 0.0
if arguments[:1] == ["--noise"]:
    noise, arguments = float(arguments[1]), arguments[2:]
program, constants_path, *folders = arguments
constants = json.loads(pathlib.Path(constants_path).read_text())
for folder in map(pathlib.Path, folders):
    frames = sorted(folder.glob("frame_*.png"))
    truth = [json.loads(line) for line in (folder / "truth.jsonl").read_text().splitlines()]
    with_noise = tempfile.TemporaryDirectory()
    if noise:
        frames = noisy(frames, noise, with_noise.name)
    # Once each to warm up, then turn about; the medians of all.
    peer_times, our_times, our_p99 = [], [], []
    for _ in range(3):
        peer = of_peer(constants, frames, truth)
        ours = of_ours(program, constants_path, frames, truth)
        peer_times.append(np.median(peer[3]) * 1e3)
        our_times.append(ours[3]["median_ms"])
        our_p99.append(ours[3]["p99_ms"])
    dots, flowed, wrenches, _, found, wanted = peer
    peer_ms, our_ms = np.min(peer_times), np.min(our_times)
    print(f"{folder.name}: {len(frames)} frames")
    print(f"  {'':<22} {'dots found':>14} {'rms px':>8} {'worst px':>9} {'mislabelled':>12} {'ms':>7} {'frames/s':>9}")
    worst = max((np.linalg.norm(d) for d in dots), default=np.nan)
    print(f"  {'Python-OpenCV':<22} {found:>6}/{wanted:<7} {rms(dots):>8.4f} {worst:>9.3f} {'-':>12} {peer_ms:>7.2f} {1e3 / peer_ms:>9.0f}")
    if flowed:
        away = np.linalg.norm(flowed, axis=1)
        near = np.array(flowed)[away < 4]
        print(f"  {'  its flow':<22} {len(flowed):>14} {rms(near):>8.4f} {away.max():>9.3f} {(away >= 4).sum():>12}")
    dots, own, sds, _, found, wanted, wrong, states = ours
    worst = max((np.linalg.norm(d) for d in dots), default=np.nan)
    print(f"  {'domecast track':<22} {found:>6}/{wanted:<7} {rms(dots):>8.4f} {worst:>9.3f} {wrong:>12} {our_ms:>7.2f} {1e3 / our_ms:>9.0f}")
    print(f"  {peer_ms / our_ms:.1f} times as fast; 99 of 100 frames within {np.min(our_p99):.2f} ms; status {sorted(states)}")
    print("  wrench error, mean (standard deviation), N and N*mm")
    print(wrench_lines("Python-OpenCV", wrenches))
    print(wrench_lines("domecast track", own))
    if sds:
        print(f"  {'  sd it says':<22}              " + "  ".join(f"{a} {s:.4f}" for a, s in zip(AXES, np.mean(sds, 0))))
