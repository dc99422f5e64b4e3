"""Our pose solver beside every variant of cv2.solvePnP on the same four markers, in one run.

Ours goes through lens, layers and discs; cv2 gets the same pose as four undistorted pinhole points, the easier problem.
Rounds alternate, and of each program the fastest batch counts, so that whatever else runs on the machine weighs on
both alike. Fails if the fastest variant of cv2 is faster.
"""
import json
import os
import pathlib
import subprocess
import sys
import time

import cv2
import numpy as np

ROUNDS = 3
K = np.array([[138.6, 0, 319.5], [0, 138.6, 239.5], [0, 0, 1]])
points = 7.5 * np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]], float)
pixels = cv2.projectPoints(points, np.array([0.03, -0.02, 0.02]), np.array([0.2, 0.1, 8.5]), K, None)[0]
cv2.setNumThreads(1)


def ours(found):
    subprocess.run(["cargo", "bench", "--bench", "pose", "--", "--warm-up-time", "0.5", "--measurement-time", "2"],
                   capture_output=True, check=True)
    folder = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", "target")) / "criterion"
    for path in folder.glob("pose */new/sample.json"):
        sample = json.loads(path.read_text())
        micros = np.array(sample["times"]) / np.array(sample["iters"]) * 1e-3
        found.setdefault("domecast " + path.parts[-3], []).extend(micros)


def theirs(found):
    for name in ("ITERATIVE", "EPNP", "P3P", "AP3P", "IPPE", "SQPNP"):
        flag = getattr(cv2, "SOLVEPNP_" + name)
        try:
            for _ in range(100):
                start = time.perf_counter()
                for _ in range(50):
                    cv2.solvePnP(points, pixels, K, None, flags=flag)
                found.setdefault("cv2 " + name, []).append((time.perf_counter() - start) / 50 * 1e6)
        except cv2.error:
            found["refused " + name] = []


found = {}
for _ in range(ROUNDS):
    ours(found)
    theirs(found)
best = {name: min(micros) for name, micros in found.items() if micros}
for name, micros in found.items():
    print(f"{name}: fastest {best[name]:.1f} us, median {np.median(micros):.1f} us" if micros
          else f"{name}: not with these points in OpenCV {cv2.__version__}")
fastest = min(value for name, value in best.items() if name.startswith("cv2"))
ratios = {name: value / fastest for name, value in best.items() if name.startswith("domecast")}
print("of the fastest cv2 variant:", {name: round(value, 2) for name, value in ratios.items()})
sys.exit(max(ratios.values()) >= 1)
