"""Frames for the judges of `track --shape`: presses simulated without noise, what a camera makes of them, and how far heights are off.

Each press is simulated without noise; noise (2 levels) and JPEG (quality 90, 4:2:2) are added here with numpy and OpenCV, with
seeds of its own, to press and frame at rest alike. Angles are those about the dome's centre from its pole.
"""
import json
import pathlib
import subprocess
import sys

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

ROOT = pathlib.Path(__file__).resolve().parent.parent
NOISE_LEVELS = 2.0
JPEG = [cv2.IMWRITE_JPEG_QUALITY, 90, cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_422]
failed = 0


def check(what, holds, detail=""):
    global failed
    failed += not holds
    print(f"{'ok  ' if holds else 'FAIL'} {what:<46} {detail}", flush=True)


def direction(polar_deg, azimuth_deg):
    """The way from the dome's centre to a place of it."""
    polar, azimuth = np.radians([polar_deg, azimuth_deg])
    return np.array([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])


def ball(radius, polar_deg, azimuth_deg, depth, dome):
    """A ball pressed `depth` deep towards the dome's centre."""
    way = direction(polar_deg, azimuth_deg)
    at = np.array([0, 0, dome["center_z"]]) + way * (dome["radius"] + radius - depth)
    return [{"name": "ball", "shape": {"kind": "sphere", "radius_mm": radius},
             "path": [{"time_s": 0, "position_mm": at.tolist()}]}]


def dome_of(file):
    """The dome that presses and errors are measured from."""
    constants = json.loads(file.read_text())
    optics = constants["optics"]
    return {"radius": optics["dome_radius_mm"], "center_z": optics.get("dome_center_z_mm", 0.0), "elastomer": constants["elastomer"]}


def nut(depth, dome):
    return [{"name": "nut", "shape": {"kind": "mesh", "file": str(ROOT / "designs/scenes/meshes/nut.stl")},
             "path": [{"time_s": 0, "position_mm": [0, 0, dome["center_z"] + dome["radius"] - depth]}]}]


def edge(depth, dome):
    """The long edge of a block, laid across the pole."""
    size = [12.0, 3.0, 3.0]
    top = dome["center_z"] + dome["radius"]
    return [{"name": "edge", "shape": {"kind": "box", "size_mm": size},
             "path": [{"time_s": 0, "position_mm": [0, 0, top - depth + 1.5 * np.sqrt(2)],
                       "rotation_deg": Rotation.from_euler("ZX", [20, 45], degrees=True).as_rotvec(degrees=True).tolist()}]}]


PRESSES = {
    "thumb24": {
        "ball on the pole": lambda d: ball(5, 0, 0, 0.5, d),
        "ball at 25 deg": lambda d: ball(3, 25, 40, 0.4, d),
        "small ball at 40 deg": lambda d: ball(2, 40, 200, 0.3, d),
        "edge": lambda d: edge(0.3, d),
        "nut": lambda d: nut(0.3, d),
    },
    "digit-rigid": {"ball at 10 deg": lambda d: ball(4, 10, 100, 0.4, d), "edge": lambda d: edge(0.25, d)},
    "picam-r20": {"ball at 20 deg": lambda d: ball(6, 20, 300, 0.8, d), "nut": lambda d: nut(0.4, d)},
}


# Pixels within 1, 2, 3 deviations of a normal number.
SHARES = (0.683, 0.954, 0.997)


def within(ratio):
    return np.array([np.mean(ratio <= k) for k in (1, 2, 3)])


def shown(shares):
    return "within 1, 2, 3: " + " ".join(f"{share:.2f}" for share in shares)


def run(*words):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, words))}\n{done.stdout}{done.stderr}")
    return done.stdout


def built_constants(domecast, work, design):
    if not (work / design).exists():
        run(domecast, "build", ROOT / f"designs/{design}.json", "--out", work / design, "--quiet")
    return work / design / "constants/constants.json"


def simulate(domecast, folder, design, objects):
    """Frames of a press on a shipped design, or of rest, at the exposure of its own report."""
    level = json.loads((folder.parent / design / "report/light.json").read_text())["level_per_mw_mm2"]
    return draw(domecast, folder, ROOT / f"designs/{design}.json", level, objects, 0.5 if design != "picam-r20" else 1.0)


def draw(domecast, folder, design, level, objects, element_mm=0.5, each=None):
    """Frames of a press, or of rest, without noise; made once."""
    if (folder / "truth.jsonl").exists():
        return folder
    light = json.loads((ROOT / "designs/scenes/lit.json").read_text())["light"]
    light["leds"]["level_per_mw_mm2"] = level
    if each:
        light["leds"]["each"] = each
    scene = {"version": 1, "name": folder.name, "design": str(design),
             "frames": {"count": 1, "rate_hz": 30}, "tolerance": {"px": 0.02, "grey": 0.5}, "light": light}
    if objects:
        scene["objects"] = objects
        scene["contact"] = {"level": "linear", "element_mm": element_mm}
    file = folder.with_suffix(".json")
    file.write_text(json.dumps(scene))
    run(domecast, "simulate", file, "--out", folder, "--depth", "--quiet")
    return folder


def drawn(folder):
    return cv2.imread(str(folder / "frame_0000.png"), cv2.IMREAD_COLOR).astype(float)


def photograph(picture, seed, jpeg=True, noise=NOISE_LEVELS):
    """What a camera makes of a picture: noise, then JPEG."""
    noisy = picture + noise * np.random.default_rng(seed).standard_normal(picture.shape)
    codes = np.clip(np.rint(noisy), 0, 255).astype(np.uint8)
    if not jpeg:
        return codes
    return cv2.imdecode(cv2.imencode(".jpg", codes, JPEG)[1], cv2.IMREAD_COLOR)


def errors(truth, shape, dome, number=0):
    """Height and normal errors of a frame with the angle of their places from the pole."""
    surface = np.load(truth / "frame_0000.surface.npy").astype(float)
    normal = np.load(truth / "frame_0000.normal.npy").astype(float)
    from_center = surface - [0, 0, dome["center_z"]]
    true = np.linalg.norm(from_center, axis=2) - dome["radius"]
    polar = np.degrees(np.arctan2(np.linalg.norm(from_center[..., :2], axis=2), from_center[..., 2]))
    found, sd, own = (np.load(shape / f"frame_{number:04}.{kind}.npy") for kind in ("height", "height_sd", "normal"))
    cosine = np.clip((own * normal).sum(axis=2), -1, 1)
    return {"polar": polar, "true": true, "off": found - true, "sd": sd, "turned": np.degrees(np.arccos(cosine)),
            "known": np.isfinite(found) & np.isfinite(true)}


def track(domecast, frame, rest, constants, out):
    line = run(domecast, "track", frame, "--constants", constants, "--shape", out, "--rest", rest, "--force")
    return json.loads(line.splitlines()[0])
