#!/usr/bin/env python3
"""Checks scenes with several objects and with a slow gel from outside, by NumPy and SciPy, from `truth.jsonl` alone.

Several objects: the objects' wrenches add to the frame's; each force that is asked for is met; a mirrored scene has mirrored
forces; far from each other each contact is the one of the object alone at the same place in the dome, and near each other it
is not.

A slow gel: the elastic force over depth is taken from a slow run without the gel, and the relaxation is integrated here:

- a step that is held loses force as the modulus does;
- loading at a constant rate: the hereditary integral over the elastic force (Lee and Radok, 1960);
- unloading: Ting's condition (1966) for the time at which the contact had the same size, and the area of the loop.

Depths are those of the ball in the dome as the platform's pose in the truth leaves it.

    scripts/check_several_and_slow.py target/release/domecast
"""
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
from scipy.integrate import trapezoid
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

DESIGN = pathlib.Path(__file__).resolve().parent.parent / "designs" / "thumb24.json"
RADIUS_MM, BALL_MM = 10.0, 4.0


def run(program, folder, name, objects, count, rate_hz=30.0, design=DESIGN, **more):
    scene = {"version": 1, "name": name, "design": str(design), "tolerance": {"px": 0.001, "grey": 1},
             "frames": {"count": count, "rate_hz": rate_hz, "images": False}, "objects": objects,
             "contact": {"level": "linear", "element_mm": 1.0}, **more}
    path = folder / f"{name}.json"
    path.write_text(json.dumps(scene))
    out = folder / name
    done = subprocess.run([program, "simulate", path, "--out", out, "--quiet"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    truth = [json.loads(line) for line in (out / "truth.jsonl").read_text().splitlines()]
    for frame in truth:
        assert frame["status"] == "ok" and frame["contact"]["status"] in ("converged", "free"), frame["contact"]
    return truth


def ball(name, keys, radius_mm=BALL_MM, press=None):
    made = {"name": name, "shape": {"kind": "sphere", "radius_mm": radius_mm},
            "path": [{"time_s": t, "position_mm": list(map(float, at))} for t, at in keys]}
    if press is not None:
        made["press"] = {"direction": [0, 0, -1], "force": [{"time_s": t, "force_n": f} for t, f in press]}
    return made


def forces(frame):
    return [np.array(part["wrench"]) for part in frame["contact"]["objects"]]


def sensor_place(frame, index):
    """A ball's centre in the moved dome's frame."""
    platform, pose = np.array(frame["pose"]), np.array(frame["contact"]["objects"][index]["pose"])
    return (np.linalg.inv(platform) @ pose)[:3, 3]


def check_several(program, folder):
    press = [(0, 0), (0.2, 0.5)]
    pair = lambda apart, a, b: [ball("a", [(0, (apart / 2, 0, 15))], 2, a), ball("b", [(0, (-apart / 2, 0, 15))], 2, b)]
    near = run(program, folder, "near", pair(4.5, press, press), 9)
    for frame in near[1:]:
        a, b = forces(frame)
        total = np.array(frame["wrench"])
        assert np.allclose(a + b, total, atol=1e-6), (a + b - total)
        wanted = min(frame["time_s"] / 0.2, 1) * 0.5
        assert abs(a[2] + wanted) < 1e-6 and abs(b[2] + wanted) < 1e-6
        mirrored = np.array([-1, 1, 1, 1, -1, -1])
        assert np.allclose(a, b * mirrored, atol=2e-4), (a, b)
    uneven = run(program, folder, "uneven", pair(4.5, press, [(0, 0), (0.2, 0.25)]), 9)
    mirror = run(program, folder, "mirror", pair(4.5, [(0, 0), (0.2, 0.25)], press), 9)
    for one, other in zip(uneven, mirror):
        assert np.allclose(np.array(one["wrench"]) * [-1, 1, 1, 1, -1, -1], other["wrench"], atol=2e-4)
    # The same places in the dome, one at a time: a ball held there alone; without friction, which remembers its way.
    smooth = folder / "smooth.json"
    design = json.loads(DESIGN.read_text())
    design["elastomer"]["friction"] = 0
    smooth.write_text(json.dumps(design))
    off = {}
    for apart in (4.5, 6.0, 11.0):
        frame = run(program, folder, f"apart{apart:.0f}", pair(apart, press, press), 7, design=smooth)[-1]
        place = sensor_place(frame, 0)
        depth = RADIUS_MM + 2 - np.linalg.norm(place)
        # Alone, the dome gives way on its springs: the pose is looked for at which the ball lies in the same place.
        held = place.copy()
        for _ in range(30):
            alone = run(program, folder, "alone", [ball("a", [(0, held)], 2)], 1, design=smooth)[0]
            found = (np.linalg.inv(np.array(alone["pose"])) @ np.append(held, 1))[:3]
            if np.linalg.norm(found - place) < 1e-6:
                break
            held = held + (place - found)
        turn = np.array(frame["pose"])[:3, :3], np.array(alone["pose"])[:3, :3]
        together = turn[0].T @ forces(frame)[0][:3]
        single = turn[1].T @ np.array(alone["wrench"][:3])
        off[apart] = np.linalg.norm(together - single) / np.linalg.norm(single)
        print(f"two balls {apart} mm apart, {depth:.2f} mm deep: the force is {100 * off[apart]:.1f} % from that of one alone")
    assert off[11.0] < 0.05 and off[11.0] < off[4.5] and 0.02 < off[4.5] < 0.2, off


TERMS = [(0.2, 0.15), (0.15, 1.0)]


def left(after_s):
    return 1 - sum(part * (1 - np.exp(-np.asarray(after_s) / tau)) for part, tau in TERMS)


def depths(truth, path):
    out = []
    for frame in truth:
        center = np.append(path(frame["time_s"]), 1)
        out.append(RADIUS_MM + BALL_MM - np.linalg.norm((np.linalg.inv(np.array(frame["pose"])) @ center)[:3]))
    return np.array(out)


def along_axis(keys):
    times, heights = zip(*keys)
    return lambda t: np.array([0, 0, np.interp(t, times, heights)])


def ting(times, depth, elastic):
    """Force over time of one push and one way back, depth linear between the times."""
    out, top = [], int(np.argmax(depth))
    fine = lambda a, b: np.unique(np.concatenate([np.linspace(a, b, 400), times[(times > a) & (times < b)]])) if b > a else np.array([a])
    at = lambda t: np.interp(t, times, depth)

    def memory(end, start):
        s = fine(start, end)
        return float(np.sum(left(end - 0.5 * (s[1:] + s[:-1])) * np.diff(at(s))))

    for k, now in enumerate(times):
        until = now
        if k > top:
            if memory(now, times[0]) <= 0:
                out.append(0.0)
                continue
            until = brentq(lambda t: memory(now, t), times[0], times[top])
        s = fine(times[0], until)
        force = elastic(np.maximum(at(s), 0.0))
        out.append(float(np.sum(left(now - 0.5 * (s[1:] + s[:-1])) * np.diff(force))))
    return np.array(out)


def check_slow(program, folder):
    # Ting's contacts slip freely: with friction the force depends on the way there as well.
    slippery = json.loads(DESIGN.read_text())
    slippery["elastomer"]["friction"] = 0
    design = folder / "slippery.json"
    design.write_text(json.dumps(slippery))
    gel = {"slow_gel": {"terms": [{"part": p, "time_s": t} for p, t in TERMS], "modulus": "instant"}}
    smooth = lambda keys: [ball("ball", [(t, (0, 0, z)) for t, z in keys])]
    down = [(0, 14.0), (1, 12.6)]
    elastic_run = run(program, folder, "elastic", smooth(down), 61, 60, design)
    d, f = depths(elastic_run, along_axis(down)), np.array([-frame["wrench"][2] for frame in elastic_run])
    order = np.argsort(d)
    elastic = PchipInterpolator(np.concatenate([[-1], d[order]]), np.concatenate([[0], f[order]]))

    # A step, held: one frame down, then still. Springs follow, so the depth is the truth's.
    step = [(0, 14.0), (1 / 60, 12.9), (2, 12.9)]
    held = run(program, folder, "held", smooth(step), 121, 60, design, **gel)
    times = np.array([frame["time_s"] for frame in held])
    measured = np.array([-frame["wrench"][2] for frame in held])
    depth = depths(held, along_axis(step))
    # The springs come back as the gel gives way: the contact goes on growing, and the integral holds throughout.
    assert np.all(np.diff(depth) > -1e-9), "a growing contact"
    expected = ting(times, depth, elastic)
    off = np.max(np.abs(measured - expected)[1:]) / measured.max()
    fall = measured[-1] / measured.max()
    print(f"held step: force falls to {fall:.3f} of its peak, at most {100 * off:.2f} % from the hereditary integral")
    assert off < 0.01 and fall < 0.9

    for name, rate_s, bound in (("ramp", 0.5, 0.02), ("slow-ramp", 3.0, 0.02)):
        keys = [(0, 14.0), (rate_s, 12.8), (2 * rate_s, 14.0)]
        count = 61
        rate_hz = (count - 1) / (2 * rate_s)
        truth = run(program, folder, name, smooth(keys), count, rate_hz, design, **gel)
        times = np.array([frame["time_s"] for frame in truth])
        depth = depths(truth, along_axis(keys))
        measured = np.array([-frame["wrench"][2] for frame in truth])
        expected = ting(times, depth, elastic)
        top = int(np.argmax(depth))
        load = np.max(np.abs(measured - expected)[: top + 1]) / measured.max()
        unload = np.max(np.abs(measured - expected)[top:]) / measured.max()
        loop = [trapezoid(force, depth) for force in (measured, expected)]
        print(f"{name}: loading {100 * load:.2f} %, unloading {100 * unload:.2f} % of the largest force; loop {loop[0]:.4f} N mm, "
              f"{loop[1]:.4f} by Ting")
        assert load < bound and unload < 0.04, (load, unload)
        assert abs(loop[0] - loop[1]) < 0.1 * loop[1] and loop[1] > 0
        assert measured[-2] == 0 and truth[-1]["contact"]["status"] == "free", "the ball is free before the gel is back"


def main():
    program = sys.argv[1]
    with tempfile.TemporaryDirectory() as folder:
        check_several(program, pathlib.Path(folder))
        check_slow(program, pathlib.Path(folder))
    print("several objects and a slow gel: all as computed here")


if __name__ == "__main__":
    main()
