"""Judges `height_sd` of `track --shape` from both sides: neither too small nor too large.

    python3 scripts/check_shape_sd.py DOMECAST [--quick] [--keep FOLDER] [--only DESIGN]

Presses of three designs, and the untouched dome, are seen through cameras of 0.5, 2 and 4 levels of noise, as they are and through
JPEG (quality 90, 4:2:2), with seeds of their own for press and frame at rest. Errors of one frame go together over the dome, so one
frame says little of its deviations: what is judged is the share of pixels within 1, 2, 3 deviations of many frames together, for each
camera, which must be 68, 95 and 99.7 % within 4 % (of one design: within 10 %).
"""
import argparse
import json
import pathlib
import shutil
import sys
import tempfile

import cv2
import numpy as np

import check_shape as judge

CAMERAS = [(noise, jpeg) for noise in (0.5, 2.0, 4.0) for jpeg in (False, True)]
WANTED = np.array([0.683, 0.954, 0.997])
ALL, ONE = 0.04, 0.10
STEP = 3  # every third pixel across and down


def ratios(domecast, work, design, dome, constants, camera, seeds):
    """Errors over deviations to 60 degrees by press, from frames that one camera takes."""
    noise, jpeg = camera
    folder = work / f"sd-{design}-{noise}-{'jpeg' if jpeg else 'raw'}"
    shutil.rmtree(folder, ignore_errors=True)
    rest = judge.simulate(domecast, work / f"{design}-rest", design, None)
    found = {}
    for seed in range(seeds):
        frames = folder / f"{seed}"
        frames.mkdir(parents=True)
        still = folder / f"rest-{seed}.png"
        cv2.imwrite(str(still), judge.photograph(judge.drawn(rest), 1000 * seed + 7, jpeg, noise))
        truths = [rest]
        for name, objects in judge.PRESSES[design].items():
            truths.append(judge.simulate(domecast, work / f"{design}-{name.replace(' ', '-')}", design, objects(dome)))
        for number, truth in enumerate(truths):
            cv2.imwrite(str(frames / f"frame_{number:04}.png"), judge.photograph(judge.drawn(truth), 1000 * seed + 11 + number, jpeg, noise))
        out = folder / f"shape-{seed}"
        judge.run(domecast, "track", frames, "--constants", constants, "--shape", out, "--rest", still, "--force", "--quiet",
                  "--out", folder / f"{seed}.jsonl")
        for number, truth in enumerate(truths):
            e = judge.errors(truth, out, dome, number)
            here = e["known"] & (e["polar"] <= 60)
            here[np.arange(here.shape[0]) % STEP != 0] = False
            here[:, np.arange(here.shape[1]) % STEP != 0] = False
            found.setdefault(truth.name, []).append((e["off"] / e["sd"])[here])
        shutil.rmtree(out)
    return {name: np.concatenate(values) for name, values in found.items()}


def within(values):
    return np.array([np.mean(np.abs(values) <= k) for k in (1, 2, 3)])


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("domecast", type=pathlib.Path)
    parser.add_argument("--quick", action="store_true", help="two cameras")
    parser.add_argument("--keep", type=pathlib.Path, help="folder that simulated frames are kept in")
    parser.add_argument("--only", help="a design")
    parser.add_argument("--seeds", type=int, default=2)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        work = (arguments.keep or pathlib.Path(scratch)).resolve()
        work.mkdir(parents=True, exist_ok=True)
        for camera in CAMERAS[2:4] if arguments.quick else CAMERAS:
            label = f"{camera[0]} levels, {'JPEG' if camera[1] else 'raw'}"
            together = []
            for design in judge.PRESSES:
                if arguments.only not in (None, design):
                    continue
                built = work / design
                if not built.exists():
                    judge.run(arguments.domecast, "build", judge.ROOT / f"designs/{design}.json", "--out", built, "--quiet")
                constants = built / "constants/constants.json"
                optics = json.loads(constants.read_text())["optics"]
                dome = {"radius": optics["dome_radius_mm"], "center_z": optics.get("dome_center_z_mm", 0.0)}
                found = ratios(arguments.domecast, work, design, dome, constants, camera, arguments.seeds)
                # every press counts alike
                many = min(map(len, found.values()))
                thinned = [values[:: max(1, len(values) // many)][:many] for values in found.values()]
                together += thinned
                share = within(np.concatenate(thinned))
                judge.check(f"{design}, {label}", np.all(np.abs(share - WANTED) <= ONE), f"within 1, 2, 3: {share[0]:.3f} {share[1]:.3f} {share[2]:.3f}; "
                            + ", ".join(f"{name.removeprefix(design + '-')} {within(values)[0]:.2f}" for name, values in found.items()))
            many = min(map(len, together))
            share = within(np.concatenate([values[:many] for values in together]))
            judge.check(f"all, {label}", np.all(np.abs(share - WANTED) <= ALL), f"within 1, 2, 3: {share[0]:.3f} {share[1]:.3f} {share[2]:.3f}")
    sys.exit(1 if judge.failed else 0)


if __name__ == "__main__":
    main()
