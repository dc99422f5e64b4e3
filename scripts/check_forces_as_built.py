#!/usr/bin/env python3
"""Judges `track --traction` on sensors as they come out: nothing may be felt on a skin that nothing touches.

    scripts/check_forces_as_built.py domecast BUILD.. [--sensors N] [--seed S]

Sensors are drawn from the tolerances of each build's constants (numpy and OpenCV: `draw_frames.py`) and shown untouched. `domecast track
--traction` reads them with the nominal constants and with those that `calibrate-optics` makes of a table of centroids, with a rest (`--reference`, `--rest`) and without. Tractions at the dots must lie within three of their deviations
of nothing for 97 of 100 dots. In at most one of 50 frames may a touch be stated; deviations with a rest must be small enough to be of use.
"""
import argparse
import json
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np

from check_wrench_sd import Bench, built, optics_table

# Frames of the reference, and others.
RESTS, STILL = 4, 6
# Largest deviation of a traction in the middle of the dots with a rest, over Young's modulus: a light touch's pressure is a tenth.
MAX_SD = 0.01


def draw_frames(sensor, folder, seed):
    folder.mkdir()
    for k in range(RESTS + STILL):
        cv2.imwrite(str(folder / f"frame_{k:04d}.png"), sensor.draw(noise=2.0, seed=seed + k)[0])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("domecast")
    parser.add_argument("builds", nargs="+")
    parser.add_argument("--sensors", type=int, default=3)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    failed = False
    for build in given.builds:
        nominal = Path(build) / "constants/constants.json"
        constants = json.loads(nominal.read_text())
        at = constants["springs"]["at_mm"] if constants.get("springs") else None
        young = constants["elastomer"]["young_modulus_mpa"]
        rng = np.random.default_rng(given.seed)
        found = {}
        for number in range(given.sensors):
            with tempfile.TemporaryDirectory() as folder:
                bench, folder = Bench(given.domecast, folder), Path(folder)
                sensor, _ = built(constants, rng)
                frames = folder / "frames"
                draw_frames(sensor, frames, 1000 * number)
                kinds = {"nominal": nominal}
                if at is not None:
                    table = folder / "table.csv"
                    table.write_text(optics_table(sensor, at, constants["tolerances"]["white_centroid_px"], rng))
                    kinds["measured"] = folder / "measured.json"
                    bench.run("calibrate-optics", table, nominal, "--rest-frames", 4, "--out", kinds["measured"])
                for kind, path in kinds.items():
                    for rest in ((), ("--reference", RESTS), ("--rest", frames / "frame_0000.png")):
                        lines = bench.track(frames, path, "--traction", *rest)[RESTS:]
                        found.setdefault((kind, *rest[:1]), []).append(lines)
        for name, sensors in found.items():
            lines = [line for lines in sensors for line in lines]
            dots = [dot for line in lines for dot in line["traction"]]
            over = np.array([np.linalg.norm(dot["n_mm2"]) / dot["sd"] for dot in dots])
            sds = np.array([dot["sd"] for line in lines for dot in line["traction"]]) / young
            touched = [line["contact"] for line in lines if line["contact"]]
            stated = [line for line in lines if line["traction_status"] == "ok"]
            share = np.mean(over <= 3) if len(over) else 0.0
            good = len(stated) >= 0.9 * len(lines) and share >= 0.97
            good &= len(touched) <= 0.02 * len(lines)
            good &= len(name) == 1 or np.median(sds) < MAX_SD
            failed |= not good
            forces = ", ".join(f"{np.linalg.norm(c['force_n']):.3f}" for c in touched[:6])
            print(f"{'ok  ' if good else 'FAIL'} {Path(build).name}, {' '.join(name)}: {len(stated)} of {len(lines)} frames, {100 * share:.1f} % of the "
                  f"tractions within 3 sd, median sd {np.median(sds):.4f} of the modulus, {len(touched)} of {len(lines)} untouched frames with a "
                  f"contact{' of ' + forces + ' N' if forces else ''}")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
