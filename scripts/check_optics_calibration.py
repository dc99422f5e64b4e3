#!/usr/bin/env python3
"""Good and bad optics calibrations, drawn by numpy alone: which does `domecast calibrate-optics` accept?

    scripts/check_optics_calibration.py DOMECAST [--draws N] BUILD ...

Good tables: the sensor of BUILD with every number off by a random part of its tolerance, projected here through lens and
layers, frames at rest and under load, centroids with noise. Bad tables are good ones with one of the mistakes below: each
must be refused with the words of its cause and no constants written; every good one must be accepted, and of its numbers
the errors over the stated deviations must have an rms of about one. With a covariance of the intrinsics in the constants
the camera may be off too.
"""

import argparse
import copy
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np

# Of the centroids that are spoilt.
NOISE_PX = 0.1
AROUND = np.linspace(0, 2 * np.pi, 32, endpoint=False)


class Sensor:
    """What the constants say, projected by numpy."""

    def __init__(self, constants):
        c = self.constants = copy.deepcopy(constants)
        self.camera = c["camera"]
        self.matrix, self.distortion = np.array(self.camera["matrix"]), np.array(self.camera["distortion"])
        rest = np.linalg.inv(np.array(self.camera["camera_from_sensor"]))
        self.turn, self.pupil = rest[:3, :3], rest[:3, 3]
        layers = [layer for layer in c["optics"]["layers"] if layer["name"] != "air"]
        self.index = np.array([1.0] + [layer["index"] for layer in layers])
        self.thickness = np.array([layer["thickness_mm"] for layer in layers[:-1]])
        self.radius = c["optics"]["dome_radius_mm"]
        self.white = np.array([m["position_mm"] for m in c["white_markers"]])
        self.black = np.array([d["surface_mm"] for d in c["black_dots"]])
        self.half = [np.array([m["diameter_mm"] for m in c["white_markers"]]) / 2,
                     np.array([d["diameter_mm"] for d in c["black_dots"]]) / 2]

    def project(self, points, turn, shift):
        """Pixels of points on the platform, which stands at a pose in the rest frame."""
        pupil = turn.T @ (self.pupil - shift)
        depths = np.concatenate([[-pupil[2] - self.thickness.sum()], self.thickness])
        away = points[..., :2] - pupil[:2]
        distance = np.linalg.norm(away, axis=-1)
        depth = np.concatenate([np.broadcast_to(depths, points.shape[:-1] + depths.shape), points[..., 2:3]], axis=-1)
        low, high = np.zeros_like(distance), np.full_like(distance, 1 - 1e-12)
        for _ in range(60):
            sine = 0.5 * (low + high)
            part = sine[..., None] / self.index
            reach = (depth * part / np.sqrt(1 - part ** 2)).sum(-1)
            low, high = np.where(reach < distance, sine, low), np.where(reach < distance, high, sine)
        ray = np.concatenate([away * (sine / np.maximum(distance, 1e-12))[..., None], np.sqrt(1 - sine ** 2)[..., None]], -1)
        ray = ray @ turn.T @ self.turn
        return self.image(ray)

    def image(self, ray):
        flat = ray.reshape(-1, 1, 3)
        if self.camera["model"] == "kannala_brandt":
            out = cv2.fisheye.projectPoints(flat, np.zeros(3), np.zeros(3), self.matrix, self.distortion)[0]
        else:
            out = cv2.projectPoints(flat, np.zeros(3), np.zeros(3), self.matrix, self.distortion)[0]
        return out.reshape(ray.shape[:-1] + (2,))

    def centroids(self, turn, shift):
        """Of white markers and dots: the centroids of their outlines."""
        circle = np.stack([np.cos(AROUND), np.sin(AROUND)], -1)
        flat = np.concatenate([circle, np.zeros((len(AROUND), 1))], -1)
        white = self.white[:, None] + flat * self.half[0][:, None, None]
        east = np.cross([0, 0, 1.0], self.black)
        east /= np.maximum(np.linalg.norm(east, axis=1), 1e-12)[:, None]
        north = np.cross(self.black, east)
        north /= np.linalg.norm(north, axis=1)[:, None]
        black = self.black[:, None] + self.half[1][:, None, None] * (
            circle[None, :, :1] * east[:, None] + circle[None, :, 1:] * north[:, None])
        black *= self.radius / np.linalg.norm(black, axis=-1, keepdims=True)
        return [middle(self.project(points, turn, shift)) for points in (white, black)]


def middle(outline):
    a, b = outline, np.roll(outline, -1, axis=1)
    cross = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return ((a + b) * cross[..., None]).sum(1) / (3 * cross.sum(1))[:, None]


def built(rng, constants, covariance=None):
    """The sensor as it may have been made; how far its first numbers are off."""
    sensor, t = Sensor(constants), constants["tolerances"]
    off = {}
    step = rng.normal(0, t["pupil_mm"])
    sensor.pupil = sensor.pupil + step
    off.update(zip(("pupil.x", "pupil.y", "pupil.z"), step))
    turn = rng.normal(0, t["camera_rotation_rad"])
    sensor.turn = sensor.turn @ cv2.Rodrigues(turn)[0]
    off.update(zip((f"camera_rotation.{a}" for a in "xyz"), turn))
    sensor.thickness = sensor.thickness + rng.normal(0, t["layer_thickness_mm"], len(sensor.thickness))
    sensor.index[1:] += rng.normal(0, t["index"], len(sensor.index) - 1)
    sensor.white[:, :2] += rng.normal(0, t["white_marker_mm"], (len(sensor.white), 2))
    moved = sensor.black + rng.normal(0, t["black_dot_mm"], sensor.black.shape)
    sensor.black = moved * (sensor.radius / np.linalg.norm(moved, axis=1, keepdims=True))
    if covariance is not None:
        change = rng.multivariate_normal(np.zeros(len(covariance)), covariance)
        sensor.matrix = sensor.matrix + np.array([[change[0], 0, change[2]], [0, change[1], change[3]], [0, 0, 0]])
        sensor.distortion = sensor.distortion + change[4:]
        off.update(zip(("camera.fx", "camera.fy", "camera.cx", "camera.cy"), change))
    return sensor, off


def observe(rng, sensor, frames=(4, 5), noise=NOISE_PX, first_loaded=False):
    """Rows of frame, kind, id, u, v."""
    at = np.array(sensor.constants.get("springs", {}).get("at_mm", [0, 0, -5.0]))
    rows = []
    for frame in range(sum(frames)):
        turn, shift = np.eye(3), np.zeros(3)
        if frame >= frames[0] or first_loaded and frame == 0:
            turn = cv2.Rodrigues(rng.uniform(-1, 1, 3) * [0.03, 0.03, 0.02])[0]
            shift = at - turn @ at + rng.uniform(-1, 1, 3) * [0.15, 0.15, 0.4] + [0, 0, -0.6]
        for kind, ids, found in zip(("white", "black"), ("white_markers", "black_dots"), sensor.centroids(turn, shift)):
            found = found + rng.normal(0, noise, found.shape)
            rows += [[frame, kind, mark["id"], *at] for mark, at in zip(sensor.constants[ids], found)]
    return rows


def place(function):
    return lambda rng, rows, sensor: [row[:3] + list(function(np.array(row[3:]), sensor)) for row in rows]


def size(sensor):
    return np.array([sensor.camera["width"], sensor.camera["height"]])


def swapped(first, second, frames=None):
    other = {first: second, second: first}
    def change(rng, rows, sensor):
        wanted = lambda row: row[1] == "white" and (frames is None or row[0] in frames)
        return [row[:2] + [other.get(row[2], row[2])] + row[3:] if wanted(row) else row for row in rows]
    return change


def cycled(rng, rows, sensor):
    return [row[:2] + [(row[2] + 1) % 4] + row[3:] if row[1] == "white" else row for row in rows]


def one_centroid(value):
    def change(rng, rows, sensor):
        rows[int(rng.integers(0, len(rows)))][3] = value
        return rows
    return change


def one_dot_later(rng, rows, sensor):
    black = [row for row in rows if row[1] == "black"]
    return [row for row in rows if row[1] == "white"] + [
        [row[0], "black", follower[2], *row[3:]] for row, follower in zip(black, black[1:]) if row[0] == follower[0]]


def noisy(rng, rows, sensor):
    return [row[:3] + list(np.array(row[3:]) + rng.normal(0, 0.8, 2)) for row in rows]


def undistorted(p, sensor):
    call = cv2.fisheye.undistortPoints if sensor.camera["model"] == "kannala_brandt" else cv2.undistortPoints
    return call(p.reshape(1, 1, 2), sensor.matrix, sensor.distortion, P=np.array(sensor.camera["undistorted_matrix"]))[0, 0]


def half_of_the_frames(rng, rows, sensor):
    return [row[:3] + [2 * row[3], 2 * row[4]] if row[0] >= 6 else row for row in rows]


BAD = {
    "two markers swapped": (swapped(0, 1), ["markers 0 and 1 swapped"]),
    "u and v swapped": (place(lambda p, s: p[::-1]), ["u and v swapped"]),
    "pixels doubled": (place(lambda p, s: 2 * p + 0.5), ["doubled"]),
    "pixels halved": (place(lambda p, s: p / 2 - 0.25), ["halved"]),
    "one centroid of 1e308": (one_centroid(1e308), ["beyond the sensor"]),
    "noise of 0.8 px": (noisy, ["beyond the noise"]),
    # beyond the issue's
    "one centroid is NaN": (one_centroid(float("nan")), ["finite"]),
    "opposite markers swapped under load": (swapped(0, 2, range(4, 9)), ["markers 0 and 2 swapped", "another order"]),
    "markers swapped in one frame": (swapped(1, 2, [6]), ["markers 1 and 2 swapped in frame 6"]),
    "markers counted one further": (cycled, ["another order"]),
    "frames mirrored": (place(lambda p, s: [s.camera["width"] - 1 - p[0], p[1]]), ["mirrored"]),
    "v from the bottom": (place(lambda p, s: [p[0], s.camera["height"] - 1 - p[1]]), ["bottom"]),
    "turned by 180": (place(lambda p, s: size(s) - 1 - p), ["180"]),
    "parts of the image": (place(lambda p, s: (p + 0.5) / size(s)), ["parts of the image"]),
    "undistorted frames": (place(undistorted), ["undistorted"]),
    "dots one further": (one_dot_later, ["numbered one"]),
    "rows twice": (lambda rng, rows, s: rows + rows, ["twice"]),
    "half the frames doubled": (half_of_the_frames, ["beyond the sensor", "frame"]),
}


def table(rows):
    return "frame,kind,id,u,v\n" + "".join(f"{f},{k},{i},{u!r},{v!r}\n" for f, k, i, u, v in
                                           ([*row[:3], float(row[3]), float(row[4])] for row in rows))


def run(domecast, folder, constants, rows):
    paths = [folder / name for name in ("table.csv", "constants.json", "out.json")]
    paths[0].write_text(table(rows))
    paths[1].write_text(json.dumps(constants))
    paths[2].unlink(missing_ok=True)
    done = subprocess.run([domecast, "--json", "calibrate-optics", paths[0], paths[1], "--out", paths[2], "--rest-frames", "4"],
                          capture_output=True, text=True)
    if done.returncode not in (0, 1) or paths[2].exists() != (done.returncode == 0):
        sys.exit(f"exit {done.returncode}: {done.stderr or done.stdout}")
    return done.returncode, json.loads(done.stdout)


def with_covariance(constants):
    """Constants whose camera was calibrated to fractions of a pixel."""
    made = copy.deepcopy(constants)
    sd = np.array([0.8, 0.8, 0.6, 0.6] + [0.0] * len(made["camera"]["distortion"]))
    covariance = np.diag(sd ** 2)
    covariance[0, 1] = covariance[1, 0] = 0.9 * 0.64
    made["camera"]["intrinsics_covariance"] = covariance.tolist()
    return made, covariance


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("domecast")
    parser.add_argument("builds", nargs="+")
    parser.add_argument("--draws", type=int, default=18)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    sensors = [json.loads((Path(build) / "constants/constants.json").read_text()) for build in given.builds]
    for constants in sensors:
        # dots this dense say no more than a quarter of them
        constants["black_dots"] = constants["black_dots"][::4]
    rng = np.random.default_rng(given.seed)
    worst = max(np.abs(Sensor(c).project(Sensor(c).black, np.eye(3), np.zeros(3))
                       - [d["image_px"] for d in c["black_dots"]]).max() for c in sensors)
    print(f"dots of the constants against this projection: {worst:.1e} px")
    wrong_good, wrong_bad, unnamed, z = [], [], [], []
    names = list(BAD)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for k in range(given.draws):
            constants, covariance = sensors[k % len(sensors)], None
            if k % 3 == 2:
                constants, covariance = with_covariance(constants)
            sensor, off = built(rng, constants, covariance)
            code, answer = run(given.domecast, folder, constants, observe(rng, sensor, noise=rng.choice([0.03, 0.1])))
            if code:
                wrong_good.append(f"{constants['design']}: {answer['error']['problem'][:200]}")
            else:
                z += [(p["value"] - p["nominal"] - off[p["name"]]) / p["sd"] for p in answer["parameters"] if p["name"] in off]
        for k in range(given.draws):
            constants = sensors[(k // len(names)) % len(sensors)]
            change, expected = BAD[names[k % len(names)]]
            sensor, _ = built(rng, constants)
            good = observe(rng, sensor)
            bad = change(rng, copy.deepcopy(good), sensor)
            code, answer = run(given.domecast, folder, constants, bad)
            if len(bad) == len(good) and np.abs(np.subtract([r[2:] for r in bad], [r[2:] for r in good])).max() < NOISE_PX:
                # A lens without distortion: nothing was spoilt.
                continue
            case = f"{constants['design']}: {names[k % len(names)]}"
            if code == 0:
                wrong_bad.append(case)
            elif not any(word in answer["error"]["problem"] for word in expected):
                unnamed.append(f"{case}: {answer['error']['problem'][:200]}")
    for title, cases in (("good, refused", wrong_good), ("bad, accepted", wrong_bad), ("bad, refused without its name", unnamed)):
        print(f"{title}: {len(cases)} of {given.draws}")
        for case in cases:
            print(f"    {case}")
    rms = np.sqrt(np.mean(np.square(z)))
    print(f"errors over stated deviations: rms {rms:.2f} of {len(z)} numbers")
    sys.exit(1 if wrong_good or wrong_bad or unnamed or not rms < 1.25 or worst > 1e-6 else 0)


if __name__ == "__main__":
    main()
