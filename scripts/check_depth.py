#!/usr/bin/env python3
"""Checks `simulate --depth` from outside, by NumPy, SciPy and OpenCV, on the files alone.

- Every sampled point of the maps, at rest and under load, is brought back to its pixel: Snell's law through the flat layers solved
  here, the lens by cv2.projectPoints, the platform at the pose of the truth.
- At rest the points lie on the dome; with the displacement taken off, those of a touched dome do, too.
- Normals are those of the surface's own finite differences, outward.
- Traction, integrated over the seen surface as it is now, is the contact's force; pressure is its part against the normal.
- A rigid ball's area and largest pressure are Hertz' to what a bonded dome of finite size is off; contact point and normal lie on the
  line between the centres.

    scripts/check_depth.py target/release/domecast
"""
import json
import pathlib
import subprocess
import sys
import tempfile

import cv2
import numpy as np
from scipy.optimize import brentq

DESIGNS = pathlib.Path(__file__).resolve().parent.parent / "designs"


def simulate(program, folder, name, design, keys, radius_mm, light):
    scene = {"version": 1, "name": name, "design": str(DESIGNS / f"{design}.json"),
             "frames": {"count": len(keys), "rate_hz": 10}, "tolerance": {"px": 0.001, "grey": 8},
             "contact": {"level": "linear", "element_mm": 0.5},
             "objects": [{"name": "ball", "shape": {"kind": "sphere", "radius_mm": radius_mm},
                          "path": [{"time_s": 0.1 * k, "position_mm": at} for k, at in enumerate(keys)]}]}
    if light:
        scene["light"] = {"leds": {"level_per_mw_mm2": 285}}
    path = folder / f"{name}.json"
    path.write_text(json.dumps(scene))
    out = folder / name
    subprocess.run([program, "simulate", path, "--depth", "--out", out, "--quiet"], check=True)
    maps = lambda k: {m: np.load(out / f"frame_{k:04}.{m}.npy") for m in
                      ("surface", "normal", "displacement", "pressure", "traction")}
    truth = [json.loads(line) for line in (out / "truth.jsonl").read_text().splitlines()]
    pictures = [cv2.imread(str(out / "depth" / f"frame_{k:04}.png"), cv2.IMREAD_UNCHANGED) for k in range(len(keys))]
    return truth, [maps(k) for k in range(len(keys))], pictures


def project(constants, pose, point):
    """The pixel of a point of the platform: along its ray the tangential part of n sin is one number."""
    camera_from_platform = np.array(constants["camera"]["camera_from_sensor"]) @ pose
    pupil = np.linalg.inv(camera_from_platform)[:3, 3]
    plates = constants["optics"]["layers"][1:-1]
    gap = -sum(p["thickness_mm"] for p in plates) - pupil[2]
    ways = [(gap, 1.0)] + [(p["thickness_mm"], p["index"]) for p in plates]
    ways.append((point[2], constants["optics"]["layers"][-1]["index"]))
    aside = point[:2] - pupil[:2]
    reach = np.hypot(*aside)
    run = lambda s: sum(d * s / np.sqrt(n * n - s * s) for d, n in ways) - reach
    s = brentq(run, 0, 1 - 1e-12, xtol=1e-15) if reach > 1e-9 else 0.0
    ray = np.array([*(s * aside / max(reach, 1e-12)), np.sqrt(1 - s * s)])
    seen = camera_from_platform[:3, :3] @ ray
    camera = constants["camera"]
    return cv2.projectPoints(seen.reshape(1, 3), np.zeros(3), np.zeros(3), np.array(camera["matrix"]),
                             np.array(camera["distortion"]))[0].ravel()


def check_frame(constants, frame, maps, picture, rng):
    surface, normal = maps["surface"].astype(float), maps["normal"].astype(float)
    seen = ~np.isnan(surface[..., 0])
    assert seen.sum() == frame["depth"]["seen_px"]
    for name in ("normal", "displacement", "traction"):
        assert (np.isnan(maps[name]).any(-1) == ~seen).all(), name
    assert (np.isnan(maps["pressure"]) == ~seen).all()
    # the pixel of each point
    pose = np.array(frame["pose"])
    rows, columns = np.nonzero(seen)
    pressed = np.flatnonzero(np.linalg.norm(maps["displacement"][rows, columns], axis=-1) > 0.02)
    picks = rng.choice(len(rows), 250, replace=False)
    if len(pressed):
        picks = np.concatenate([picks, rng.choice(pressed, 250)])
    off = [project(constants, pose, surface[r, c]) - (c, r) for r, c in zip(rows[picks], columns[picks])]
    # 32-bit floats and the search's own end leave a micrometre
    assert np.abs(off).max() < 2e-3, np.abs(off).max()
    # the material lies on the dome at rest
    dome, center = constants["optics"]["dome_radius_mm"], constants["optics"].get("dome_center_z_mm", 0.0)
    rest = surface - maps["displacement"]
    if center <= 0:
        assert np.nanmax(np.abs(np.linalg.norm(rest - [0, 0, center], axis=-1) - dome)) < 2e-5
    # normals
    a, b, c, d = surface[:-1, :-1], surface[:-1, 1:], surface[1:, :-1], surface[1:, 1:]
    cross = 0.5 * np.cross(d - a, b - c)
    area = np.linalg.norm(cross, axis=-1)
    mean = lambda m: 0.25 * (m[:-1, :-1] + m[:-1, 1:] + m[1:, :-1] + m[1:, 1:])
    mean_normal = mean(normal)
    cosine = (cross * mean_normal).sum(-1) / area / np.linalg.norm(mean_normal, axis=-1)
    angle = np.degrees(np.arccos(np.clip(np.abs(cosine), -1, 1)))
    assert (np.sign(cosine[~np.isnan(cosine)]) == np.sign(np.nanmedian(cosine))).all()
    assert ((normal * (rest - [0, 0, center])).sum(-1)[seen] > 0).all(), "outward"
    assert np.nanpercentile(angle, 99) < 0.1 and np.nanmax(angle) < 0.5, np.nanpercentile(angle, [99, 100])
    # what bears on it
    force = np.nansum(mean(maps["traction"]) * area[..., None], axis=(0, 1))
    against = -(maps["traction"] * normal).sum(-1)
    assert np.nanmax(np.abs(against - maps["pressure"])) < 1e-6
    assert np.nanmin(maps["pressure"]) >= 0
    # depth
    camera = np.array(constants["camera"]["camera_from_sensor"]) @ pose
    depth = surface @ camera[2, :3] + camera[2, 3]
    step = frame["depth"]["mm_per_level"]
    assert ((picture > 0) == seen).all() and np.abs(picture * step - depth)[seen].max() < 0.51 * step
    return force, np.abs(off).max(), np.nanpercentile(angle, 99), np.nanmax(maps["pressure"])


def main():
    program = pathlib.Path(sys.argv[1]).resolve()
    rng = np.random.default_rng(5)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for design, at, light in (("thumb24", (3.0, -1.0), True), ("thumb24", (0.0, 0.0), False),
                                  ("digit-rigid", (-2.0, 1.5), False)):
            built = folder / design
            if not built.exists():
                subprocess.run([program, "build", DESIGNS / f"{design}.json", "--out", built, "--quiet"], check=True)
            constants = json.loads((built / "constants" / "constants.json").read_text())
            radius, center = constants["optics"]["dome_radius_mm"], constants["optics"].get("dome_center_z_mm", 0.0)
            # large enough for elements of half a millimetre
            ball, depth = 12.0, 0.7
            touch = center + np.sqrt((radius + ball) ** 2 - np.hypot(*at) ** 2)
            keys = [[*at, touch + 0.5], [*at, touch - depth]]
            truth, maps, pictures = simulate(program, folder, f"{design}-{int(at[0])}", design, keys, ball, light)
            rest, pressed = truth
            force, *_ = check_frame(constants, rest, maps[0], pictures[0], rng)
            assert np.abs(force).max() == 0 and rest["contact"]["area_mm2"] is None
            assert np.abs(maps[0]["displacement"][~np.isnan(maps[0]["displacement"])]).max() == 0
            force, px, degrees, peak = check_frame(constants, pressed, maps[1], pictures[1], rng)
            contact = pressed["contact"]
            wanted = np.array(contact["force_n"])
            load = np.linalg.norm(wanted)
            assert np.linalg.norm(force - wanted) < 0.005 * load, (force, wanted)
            pose = np.array(pressed["pose"])
            assert np.allclose(pose[:3, :3] @ wanted, pressed["wrench"][:3], atol=1e-6 + 1e-5 * load)
            middle = np.linalg.inv(pose) @ [*keys[1], 1]
            axis = (middle[:3] - [0, 0, center]) / np.linalg.norm(middle[:3] - [0, 0, center])
            on_axis = np.array(contact["point_mm"]) - [0, 0, center]
            assert np.linalg.norm(np.cross(on_axis, axis)) < 0.1, contact["point_mm"]
            assert np.degrees(np.arccos(axis @ contact["normal"])) < 1.0
            # Hertz: a^3 = 3 F Re / 4 E*, p0 = 3 F / 2 pi a^2
            young, poisson = 0.56, 0.49
            a = (0.75 * load / (1 / radius + 1 / ball) * (1 - poisson**2) / young) ** (1 / 3)
            p0 = 1.5 * load / np.pi / a**2
            assert abs(contact["area_mm2"] / (np.pi * a * a) - 1) < 0.1, (contact["area_mm2"], np.pi * a * a)
            assert abs(peak / p0 - 1) < 0.1, (peak, p0)
            print(f"{design} at {at}: {load:.3f} N, force of the maps off by {np.linalg.norm(force - wanted) / load:.1e}, points by "
                  f"{px:.1e} px, normals by {degrees:.3f} degrees (99 of 100), area and peak over Hertz' "
                  f"{contact['area_mm2'] / np.pi / a / a:.3f} {peak / p0:.3f}")


main()
