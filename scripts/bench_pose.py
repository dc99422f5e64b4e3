"""Our pose solver beside every variant of cv2.solvePnP on the same four markers, in one run."""
import re
import subprocess
import sys
import time

import cv2
import numpy as np

ran = subprocess.run(["cargo", "bench", "--bench", "pose", "--", "--warm-up-time", "1", "--measurement-time", "3"],
                     capture_output=True, text=True, check=True).stdout
unit = {"ns": 1e-3, "µs": 1.0, "us": 1.0, "ms": 1e3}
ours = {name: float(value) * unit[word] for name, value, word in
        re.findall(r"pose (\S+)\s+time:\s+\[\S+ \S+ (\S+) (\S+)", ran)}
K = np.array([[138.6, 0, 319.5], [0, 138.6, 239.5], [0, 0, 1]])
points = 7.5 * np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]], float)
pixels = cv2.projectPoints(points, np.array([0.03, -0.02, 0.02]), np.array([0.2, 0.1, 8.5]), K, None)[0]
peers = {}
for name in ("ITERATIVE", "EPNP", "P3P", "AP3P", "IPPE", "SQPNP"):
    flag = getattr(cv2, "SOLVEPNP_" + name)
    try:
        best = np.inf
        for _ in range(200):
            start = time.perf_counter()
            for _ in range(50):
                cv2.solvePnP(points, pixels, K, None, flags=flag)
            best = min(best, (time.perf_counter() - start) / 50)
        peers[name] = best * 1e6
    except cv2.error:
        print(f"cv2 {name}: refuses these points in OpenCV {cv2.__version__}")
for name, micros in ours.items():
    print(f"domecast {name}: {micros:.1f} us")
for name, micros in peers.items():
    print(f"cv2 {name}: {micros:.1f} us")
sys.exit(max(ours.values()) > min(peers.values()))
