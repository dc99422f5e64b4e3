#!/usr/bin/env python3
"""Calibrations written by OpenCV and PyYAML, read by domecast: every projection against OpenCV's.

    scripts/check_calibrations.py DOMECAST [BUILD ...]

For each lens model, cv2.FileStorage writes YAML, XML and JSON, and PyYAML a ROS camera_info and, where it has a word for
the lens, a Kalibr camchain. A design names the file; its layers have index 1, so that what `domecast project` says of
points on the dome must be what cv2.projectPoints or cv2.fisheye.projectPoints says, to 1e-9 px. The calibrations in the
constants/ folders of BUILDs must be read as the camera of their constants.json.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np
import yaml

ALLOWED_PX = 1e-9
SIZE = (640, 480)
RADIUS_MM, DEPTH_MM = 10.0, 25.0
FAMILIES = {
    "four": ("brown", [-0.21, 0.06, 8e-4, -6e-4]),
    "five": ("brown", [-0.2917, 0.0878, 1e-3, -2e-3, -0.01156]),
    "eight": ("brown", [0.93, 0.166, -2.4e-3, 1.4e-3, 0.0029, 1.33, 0.436, 0.0276]),
    "twelve": ("brown", [-0.2, 0.05, 1e-3, -2e-3, -0.005, 0.01, 0.02, -0.01, 2e-3, -4e-4, -3e-3, 5e-4]),
    "fourteen": ("brown", [-0.2, 0.05, 1e-3, 2e-3, -0.005, 0.01, 0.02, -0.01, 1e-3, 1e-4, -2e-3, 1e-4, 0.03, -0.05]),
    "fisheye": ("fisheye", [-0.0133, 0.0541, -0.0516, 0.0107]),
    "none": ("brown", [0.0, 0.0, 0.0, 0.0, 0.0]),
}


def storage(path, matrix, coefficients, fisheye):
    """OpenCV's own file."""
    out = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    out.write("calibration_time", "Tue 03 Mar 2026 10:00:00")
    out.write("nr_of_frames", 25)
    out.write("image_width", SIZE[0])
    out.write("image_height", SIZE[1])
    out.write("fisheye_model", int(fisheye))
    out.write("camera_matrix", matrix)
    out.write("distortion_coefficients", np.array(coefficients).reshape(-1, 1))
    out.write("avg_reprojection_error", 0.123)
    out.write("image_points", np.zeros((2, 3, 2)).reshape(2, 6))
    out.release()


def ros(path, matrix, coefficients, fisheye):
    name = "equidistant" if fisheye else "plumb_bob" if len(coefficients) <= 5 else "rational_polynomial"
    node = lambda rows, cols, data: {"rows": rows, "cols": cols, "data": [float(v) for v in data]}
    info = {
        "image_width": SIZE[0], "image_height": SIZE[1], "camera_name": "finger",
        "camera_matrix": node(3, 3, matrix.ravel()), "distortion_model": name,
        "distortion_coefficients": node(1, len(coefficients), coefficients),
        "rectification_matrix": node(3, 3, np.eye(3).ravel()),
        "projection_matrix": node(3, 4, np.hstack([matrix, np.zeros((3, 1))]).ravel()),
    }
    path.write_text(yaml.safe_dump(info))


def kalibr(path, matrix, coefficients, fisheye):
    camera = {
        "cam_overlaps": [], "camera_model": "pinhole", "rostopic": "/cam0/image_raw", "resolution": list(SIZE),
        "intrinsics": [float(matrix[0, 0]), float(matrix[1, 1]), float(matrix[0, 2]), float(matrix[1, 2])],
        "distortion_model": "equidistant" if fisheye else "radtan",
        "distortion_coeffs": [float(v) for v in coefficients],
    }
    path.write_text(yaml.safe_dump({"cam0": camera}))


def design(calibration):
    return {
        "name": "calibrated",
        "camera": {"calibration": calibration, "field_of_view_deg": 170, "position_mm": [0, 0, -DEPTH_MM]},
        "optics": {"layers": [{"name": "air", "index": 1.0, "thickness_mm": 1.0}, {"name": "air", "index": 1.0}]},
        "dome": {"radius_mm": RADIUS_MM},
    }


def run(*arguments):
    done = subprocess.run(arguments, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(arguments)}\n{done.stderr or done.stdout}")
    return done.stdout


def project(domecast, folder, calibration, points):
    (folder / "design.json").write_text(json.dumps(design(calibration)))
    (folder / "points.csv").write_text("x,y,z\n" + "".join(f"{x!r},{y!r},{z!r}\n" for x, y, z in points.tolist()))
    lines = run(domecast, "project", str(folder / "design.json"), "--points", str(folder / "points.csv")).splitlines()
    # a point that has no pixel is a miss like any other
    return np.array([json.loads(line)["image_px"] or [np.nan, np.nan] for line in lines])


def main(domecast, *builds):
    rng = np.random.default_rng(5)
    polar, azimuth = np.radians(80) * np.sqrt(rng.uniform(size=400)), rng.uniform(0, 2 * np.pi, 400)
    points = RADIUS_MM * np.stack(
        [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=1)
    seen = points + [0, 0, DEPTH_MM]
    matrix = np.array([[431.25, 0, 322.125], [0, 433.5, 237.75], [0, 0, 1]])
    worst, files = 0.0, 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for family, (kind, coefficients) in FAMILIES.items():
            fisheye = kind == "fisheye"
            call = cv2.fisheye.projectPoints if fisheye else cv2.projectPoints
            truth = call(seen.reshape(-1, 1, 3), np.zeros(3), np.zeros(3), matrix, np.array(coefficients))[0]
            forms = {"cv.yaml": storage, "cv.xml": storage, "cv.json": storage, "ros.yaml": ros}
            if len(coefficients) == 4:
                forms["kalibr.yaml"] = kalibr
            for form, write in forms.items():
                write(folder / form, matrix, coefficients, fisheye)
                miss = np.abs(project(domecast, folder, form, points) - truth.reshape(-1, 2)).max()
                files += 1
                if not miss <= ALLOWED_PX:
                    sys.exit(f"{family} {form}: {miss} px off OpenCV's projection")
                worst = max(worst, miss)
        for build in builds:
            camera = json.loads((Path(build) / "constants/constants.json").read_text())["camera"]
            for form in ("opencv.yaml", "camera_info.yaml", "kalibr.yaml"):
                path = Path(build).resolve() / "constants" / form
                if not path.exists():
                    continue
                (folder / "own.json").write_text(json.dumps(design(str(path))))
                read = json.loads(run(domecast, "--json", "explain", "camera", "--design", str(folder / "own.json")))
                files += 1
                for field in ("width", "height", "matrix"):
                    if read["value"][field] != camera[field]:
                        sys.exit(f"{path}: {field} is read as {read['value'][field]}, not {camera[field]}")
                if np.trim_zeros(read["value"]["distortion"], "b") != np.trim_zeros(camera["distortion"], "b"):
                    sys.exit(f"{path}: distortion is read as {read['value']['distortion']}")
    print(f"calibrations: {files} files read, projections within {worst:.1e} px of OpenCV's")


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    main(*sys.argv[1:])
