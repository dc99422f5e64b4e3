#!/usr/bin/env python3
"""domecast and OpenCV on the same pixels in the same run: speed and error side by side.

    scripts/compare_opencv.py [--points N] [--crates] [--json FILE]

Needs numpy and opencv-python; the Rust side is benches/peer.rs, built and run
from here, and with --crates the separate project in scripts/compare_crates. Both sides use one thread. The lenses are those of tests/cases/lenses.

The truth of each pixel is known before it exists: rays are drawn first, evenly
in field angle, and projected with the lens formula in extended precision
(numpy longdouble); the pixel is what is handed to both sides. The error is the
angle between the ray that comes back and the ray that was drawn.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np

ROOT = Path(__file__).resolve().parent.parent
LENSES = ROOT / "tests" / "cases" / "lenses"
WRONG_DEG = 0.01
# Timed in pieces of which each counts with the median of its rounds: a piece is
# shorter than a scheduler's slice, so a busy machine does not blur the comparison.
# OpenCV and domecast take turns (PASSES), and the median over the turns is shown.
ROUNDS = 9
PASSES = 5
PIECE = 1000
CRATES = ("opencv-ros-camera", "apex-camera-models")
CONVERGED = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-12)


def distort(lens, theta, phi):
    """Pixels of rays by the lens's own formula, in extended precision."""
    big = np.longdouble
    theta, phi = theta.astype(big), phi.astype(big)
    k = [big(v) for v in lens["distortion"]]
    cos, sin = np.cos(phi), np.sin(phi)
    if lens["model"] == "kannala_brandt":
        u = theta * theta
        radius = theta * (1 + u * (k[0] + u * (k[1] + u * (k[2] + u * k[3]))))
        x, y = radius * cos, radius * sin
    else:
        k1, k2, p1, p2, k3, k4, k5, k6 = (k + [big(0)] * 8)[:8]
        r = np.tan(theta)
        a, b, u = r * cos, r * sin, r * r
        factor = (1 + u * (k1 + u * (k2 + u * k3))) / (1 + u * (k4 + u * (k5 + u * k6)))
        x = a * factor + 2 * p1 * a * b + p2 * (u + 2 * a * a)
        y = b * factor + p1 * (u + 2 * b * b) + 2 * p2 * a * b
    m = lens["matrix"]
    pixels = np.stack([x * big(m[0][0]) + big(m[0][2]), y * big(m[1][1]) + big(m[1][2])], axis=1)
    return pixels.astype(np.float64)


def rays_of(theta, phi):
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=1)


def angle_deg(a, b):
    """Angle between unit vectors; NaN where one is missing."""
    cross = np.linalg.norm(np.cross(a, b), axis=1)
    return np.degrees(np.arctan2(cross, np.sum(a * b, axis=1)))


def opencv(lens, pixels, mode):
    """Rays by OpenCV and nanoseconds a point."""
    matrix = np.array(lens["matrix"], dtype=np.float64)
    dist = np.array(lens["distortion"], dtype=np.float64)
    points = pixels.reshape(-1, 1, 2)
    if lens["model"] == "kannala_brandt" and mode == "default":
        call = lambda part: cv2.fisheye.undistortPoints(part, matrix, dist)
    elif lens["model"] == "kannala_brandt":
        call = lambda part: cv2.fisheye.undistortPoints(part, matrix, dist, criteria=CONVERGED)
    elif mode == "default":
        call = lambda part: cv2.undistortPoints(part, matrix, dist)
    elif hasattr(cv2, "undistortPointsIter"):
        call = lambda part: cv2.undistortPointsIter(part, matrix, dist, None, None, CONVERGED)
    else:
        call = lambda part: cv2.undistortPoints(part, matrix, dist, None, None, None, CONVERGED)
    planes, total = [], 0.0
    for part in (points[i:i + PIECE] for i in range(0, len(points), PIECE)):
        seconds = []
        for _ in range(ROUNDS):
            start = time.perf_counter()
            plane = call(part)
            seconds.append(time.perf_counter() - start)
        total += np.median(seconds)
        planes.append(plane)
    plane = np.concatenate(planes)
    plane = plane.reshape(-1, 2)
    rays = np.concatenate([plane, np.ones((len(plane), 1))], axis=1)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    return rays, total * 1e9 / len(pixels)


def first_wrong(theta_deg, error):
    """Smallest field angle at which the error passes the bound; None if never."""
    wrong = ~(error <= WRONG_DEG)
    return float(theta_deg[wrong].min()) if wrong.any() else None


def build_peer():
    """benches/peer.rs as a program."""
    lines = subprocess.run(["cargo", "bench", "--bench", "peer", "--no-run", "--message-format=json"],
                           cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines()
    messages = [json.loads(line) for line in lines if line.startswith("{")]
    return next(m["executable"] for m in messages
                if m["reason"] == "compiler-artifact" and m["target"]["name"] == "peer" and m["executable"])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=int, default=10000)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--crates", action="store_true",
                        help="also ask the Rust crates of scripts/compare_crates; only their error is shown")
    parser.add_argument("--peer", type=Path, metavar="PROGRAM", help="benches/peer.rs where it is built already")
    args = parser.parse_args()
    cv2.setNumThreads(1)
    lenses = [json.loads(path.read_text()) for path in sorted(LENSES.glob("*.json"))]
    rng = np.random.default_rng(1)
    work = Path(tempfile.mkdtemp(prefix="compare-"))

    program = args.peer or build_peer()

    def ask(cases):
        (work / "in.json").write_text(json.dumps(cases))
        subprocess.run([str(program), str(work / "in.json"), str(work / "out.json")], check=True)
        return json.loads((work / "out.json").read_text())

    # First pass without pixels: where does each domain end?
    ends = [a["max_field_angle_deg"] for a in ask([dict(lens, pixels=[]) for lens in lenses])]
    drawn = []
    for lens, end in zip(lenses, ends):
        # Up to the last 1e-6 of the domain, every angle alike, shuffled.
        theta = np.radians(end) * (1 - 1e-6) * (np.arange(args.points) + 0.5) / args.points
        rng.shuffle(theta)
        drawn.append((theta, rng.uniform(0, 2 * np.pi, args.points)))
    pixels = [distort(lens, *rays) for lens, rays in zip(lenses, drawn)]
    cases = [dict(lens, pixels=p.tolist()) for lens, p in zip(lenses, pixels)]
    turns = []
    for _ in range(PASSES):
        ours = ask(cases)
        theirs = [{mode: opencv(lens, p, mode) for mode in ("default", "converged")} for lens, p in zip(lenses, pixels)]
        turns.append((ours, theirs))
    for i, mine in enumerate(ours):
        for key in ("lens_ns", "trace_ns", "project_ns"):
            mine[key] = float(np.median([turn[0][i][key] for turn in turns]))
        for mode in ("default", "converged"):
            theirs[i][mode] = theirs[i][mode][0], float(np.median([turn[1][i][mode][1] for turn in turns]))
        base = "default" if lenses[i]["model"] == "kannala_brandt" else "converged"
        for key, name in (("lens_ns", "lens_times"), ("trace_ns", "whole_times")):
            # The ratio of each turn, so that a change of the machine's speed falls out.
            mine[name] = float(np.median([turn[1][i][base][1] / turn[0][i][key] for turn in turns[:-1]]
                                         or [theirs[i][base][1] / mine[key]]))
    peers = {}
    for name in CRATES if args.crates else ():
        manifest = ROOT / "scripts" / "compare_crates" / "Cargo.toml"
        subprocess.run(["cargo", "run", "--quiet", "--release", "--locked", "--manifest-path", str(manifest),
                        "--target-dir", str(ROOT / "target" / "compare_crates"), "--", name,
                        str(work / "in.json"), str(work / "peer.json")], check=True)
        peers[name] = json.loads((work / "peer.json").read_text())

    print(f"OpenCV {cv2.__version__}, {args.points} points a lens, one thread, medians")
    print("ns: nanoseconds a point; wrong: first field angle (degrees) with an error above 0.01 degrees\n")
    head = ("lens", "domain", "default ns", "wrong", "converged ns", "wrong", "domecast ns", "wrong",
            "worst error", "times", "whole way ns", "times", "project ns")
    print("{:20}{:>8}{:>12}{:>7}{:>14}{:>7}{:>13}{:>7}{:>13}{:>7}{:>14}{:>7}{:>12}".format(*head))
    rows = []
    for i, (lens, end, (theta, phi), p, mine) in enumerate(zip(lenses, ends, drawn, pixels, ours)):
        truth, degrees = rays_of(theta, phi), np.degrees(theta)
        row = {"name": lens["name"], "model": lens["model"], "domain_deg": end, "limit_fold": mine["fold_angle_deg"]}
        for mode in ("default", "converged"):
            rays, ns = theirs[i][mode]
            error = angle_deg(rays, truth)
            row[mode] = {"ns": ns, "wrong_from_deg": first_wrong(degrees, error),
                         "error_at_60_deg": float(np.max(error[np.abs(degrees - 60) < 0.5])) if end > 60.5 else None}
        rays = np.array([r if r else [np.nan] * 3 for r in mine["rays"]])
        error = angle_deg(rays, truth)
        row["domecast"] = {"ns": mine["lens_ns"], "wrong_from_deg": first_wrong(degrees, error),
                           "worst_error_deg": float(np.nanmax(error)), "trace_ns": mine["trace_ns"],
                           "project_ns": mine["project_ns"], "unanswered": int(np.isnan(error).sum())}
        row["lens_times_faster"], row["whole_way_times_faster"] = mine["lens_times"], mine["whole_times"]
        show = lambda a: "never" if a is None else f"{a:.1f}"
        print("{:20}{:8.2f}{:12.0f}{:>7}{:14.0f}{:>7}{:13.1f}{:>7}{:13.1e}{:7.1f}{:14.1f}{:7.1f}{:12.1f}".format(
            lens["name"], end, row["default"]["ns"], show(row["default"]["wrong_from_deg"]),
            row["converged"]["ns"], show(row["converged"]["wrong_from_deg"]), mine["lens_ns"],
            show(row["domecast"]["wrong_from_deg"]), row["domecast"]["worst_error_deg"],
            row["lens_times_faster"], mine["trace_ns"], row["whole_way_times_faster"], mine["project_ns"]))
        for name, answers in peers.items():
            rays = answers[i]["rays"]
            if all(r is None for r in rays):
                continue
            error = angle_deg(np.array([r if r else [np.nan] * 3 for r in rays]), truth)
            refused = np.isnan(error)
            row[name] = {"wrong_from_deg": first_wrong(degrees, error), "worst_error_deg": float(np.nanmax(error)),
                         "refused_from_deg": float(degrees[refused].min()) if refused.any() else None}
            print(f"    {name}: wrong from {show(row[name]['wrong_from_deg'])}, worst {np.nanmax(error):.2g} degrees, "
                  f"refused from {show(row[name]['refused_from_deg'])}")
        rows.append(row)
    if args.json:
        args.json.write_text(json.dumps(rows, indent=1))
    bad = [r["name"] for r in rows if r["domecast"]["wrong_from_deg"] is not None]
    if bad:
        print("domecast is wrong on:", ", ".join(bad))
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
