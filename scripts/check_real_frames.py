#!/usr/bin/env python3
"""Checks what real frames have besides (dust, sharpening, defects, exposure, an uneven membrane) from outside, by NumPy and OpenCV.

Each effect's frames are rendered twice, with it and without it, and compared with what is computed here from the design's
numbers alone:

- a scratch out of focus: for each pixel rays are drawn at random through the pupil to the point on which the lens is
  focussed, and those that meet the scratch's rectangle are counted;
- sharpening: OpenCV's Gaussian on the frame without it;
- hot and dead pixels: number, level and nothing else;
- exposure and white balance: the loop in NumPy, from the frames without it;
- an uneven membrane: over many seeds, the standard deviation of one pixel's level and its correlation with another's
  against `exp(-d^2 / (2 l^2))`, the places on the dome found by Snell's law.

    scripts/check_real_frames.py target/release/domecast
"""

import json
import pathlib
import subprocess
import sys
import tempfile

import cv2
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent
DESIGN = ROOT / "designs" / "thumb24-pinhole.json"


def render(program, folder, scene, name):
    """Frames of a scene as float RGB arrays, and its truth."""
    path = folder / f"{name}.json"
    base = {
        "version": 1, "name": name, "design": str(DESIGN), "frames": {"count": 1, "rate_hz": 30},
        "tolerance": {"px": 0.001, "grey": 0.001},
    }
    path.write_text(json.dumps({**base, **scene}))
    out = folder / name
    run = subprocess.run([program, "simulate", path, "--out", out, "--quiet"], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    frames = sorted(out.glob("frame_*.png"))
    images = [cv2.imread(str(frame), cv2.IMREAD_COLOR)[..., ::-1].astype(float) for frame in frames]
    truth = [json.loads(line) for line in (out / "truth.jsonl").read_text().splitlines()]
    return images, truth


class Sensor:
    """Camera, sheet and dome of the design, read from its file."""

    def __init__(self, design):
        self.matrix = np.array(design["camera"]["matrix"], float)
        layers = design["optics"]["layers"]
        self.sheet_mm = layers[0]["thickness_mm"]
        self.gap_mm = -design["camera"]["position_mm"][2] - self.sheet_mm
        index = lambda layer: layer["index"]["g"] if isinstance(layer["index"], dict) else layer["index"]
        self.indices = [1.0, index(layers[0]), index(layers[1])]
        self.radius_mm = design["dome"]["radius_mm"]

    def ray(self, x, y):
        """Unit direction of a pixel of a pinhole, camera frame with z up."""
        way = np.linalg.solve(self.matrix, np.array([x, y, 1.0]))
        return way / np.linalg.norm(way)

    def on_dome(self, x, y):
        """Place on the dome that a pixel sees."""
        way = self.ray(x, y)
        place = way * (self.gap_mm / way[2])
        for before, after, thickness in ((self.indices[0], self.indices[1], self.sheet_mm),
                                         (self.indices[1], self.indices[2], None)):
            side = way[:2] * before / after
            way = np.array([*side, np.sqrt(1 - side @ side)])
            if thickness is not None:
                place = place + way * (thickness / way[2])
        center = np.array([0, 0, self.gap_mm + self.sheet_mm])
        off = place - center
        along = -(off @ way) + np.sqrt((off @ way) ** 2 - off @ off + self.radius_mm**2)
        return off + way * along


def check_scratch(program, folder, sensor):
    pupil_mm, sharp_mm, width_mm = 0.6, 15.5, 0.2
    ends = np.array([[0.5, 0.2], [1.7, 0.9]])
    scene = {
        "dust": {"scratches": [{"width_mm": width_mm, "opacity": 0.7, "between_mm": [ends.tolist()]}]},
        "electronics": {"focus": {"pupil_diameter_mm": pupil_mm, "distance_mm": sharp_mm}},
    }
    effects = {"dots": "never", "defocus": "never"}
    (image,), _ = render(program, folder, {**scene, "effects": effects}, "scratched")
    (clean,), _ = render(program, folder, {**scene, "effects": {**effects, "dust": "never"}}, "clean")
    taken = 1 - image[..., 1] / clean[..., 1]
    random = np.random.default_rng(1)
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    length = np.linalg.norm(ends[1] - ends[0])
    worst, seen = 0.0, 0
    for y, x in np.argwhere(taken > 0.02):
        count = 20000
        spot = np.array([x, y]) + random.uniform(-0.5, 0.5, (count, 2))
        way = np.linalg.solve(sensor.matrix, np.column_stack([spot, np.ones(count)]).T).T
        way /= np.linalg.norm(way, axis=1)[:, None]
        sharp = way * sharp_mm
        far, angle = np.sqrt(random.uniform(0, 1, count)) * pupil_mm / 2, random.uniform(0, 2 * np.pi, count)
        from_pupil = np.column_stack([far * np.cos(angle), far * np.sin(angle), np.zeros(count)])
        part = sensor.gap_mm / sharp[:, 2]
        place = (from_pupil + (sharp - from_pupil) * part[:, None])[:, :2] - ends[0]
        lengthwise, sideways = place @ along, place @ np.array([-along[1], along[0]])
        inside = (lengthwise > 0) & (lengthwise < length) & (np.abs(sideways) < width_mm / 2)
        worst = max(worst, abs(0.7 * inside.mean() - taken[y, x]))
        seen += 1
    print(f"scratch: {seen} pixels, largest difference {worst:.4f} of the light; deepest {taken.max():.3f}")
    # A pixel counts as a disc: at an edge as sharp as a pixel a hundredth or two is off.
    assert seen > 50 and worst < 0.03


def check_sharpening(program, folder):
    section = {"radius_px": 1.7, "amount": 0.6}
    scene = {"electronics": {"sharpening": section}}
    (sharp,), _ = render(program, folder, scene, "sharp")
    (plain,), _ = render(program, folder, {**scene, "effects": {"sharpening": "never"}}, "plain")
    reach = int(np.ceil(3 * section["radius_px"]))
    blurred = cv2.GaussianBlur(plain, (2 * reach + 1,) * 2, section["radius_px"], borderType=cv2.BORDER_REPLICATE)
    expected = np.clip(plain + section["amount"] * (plain - blurred), 0, 255)
    worst = np.abs(expected - sharp).max()
    # The frame without it is rounded before OpenCV sees it.
    print(f"sharpening: largest difference {worst:.2f} grey of a change of {np.abs(sharp - plain).max():.0f}")
    assert worst <= 0.5 + 0.5 * (1 + 2 * section["amount"]) and np.abs(sharp - plain).max() > 20


def check_defects(program, folder):
    defects = {"hot_per_million": 200, "dead_per_million": 100, "hot_level": [0.1, 0.2]}
    scene = {"electronics": {"defects": defects}, "seed": 3}
    (image,), _ = render(program, folder, scene, "defects")
    (plain,), _ = render(program, folder, {**scene, "effects": {"defects": "never"}}, "whole")
    change = (image - plain)[..., 0]
    pixels = image.shape[0] * image.shape[1]
    hot, dead = (change > 0).sum(), ((change < 0) & (image[..., 0] == 0)).sum()
    print(f"defects: {hot} hot and {dead} dead of {pixels} pixels, hot by {change[change > 0].min():.0f} to {change.max():.0f}")
    # Dead ones where the picture is dark anyway do not show; two may fall together.
    assert abs(hot - pixels * 200e-6) <= 2 and pixels * 100e-6 * 0.4 <= dead <= pixels * 100e-6 + 1
    assert change[change > 0].min() >= 25 and change.max() <= 52 and ((change < 0) <= (image[..., 0] == 0)).all()


def check_exposure(program, folder):
    exposure = {"target_level": 0.35, "speed": 0.6, "first_gain": 2.0, "gain": [0.5, 3.0]}
    balance = {"speed": 0.7, "first": [0.6, 1, 1.8]}
    scene = {
        "frames": {"count": 6, "rate_hz": 30}, "light": {"membrane_level": 0.6, "surround_level": 0.2},
        "electronics": {"auto_exposure": exposure, "white_balance": balance},
    }
    images, truth = render(program, folder, scene, "exposed")
    never = {"auto_exposure": "never", "white_balance": "never"}
    plain, _ = render(program, folder, {**scene, "effects": never}, "unexposed")
    gain, colours, worst = exposure["first_gain"], np.array(balance["first"]), 0.0
    for image, light, line in zip(images, plain, truth):
        light = light / 255
        worst = max(worst, abs(line["exposure"]["gain"] / gain - 1),
                    np.abs(np.array(line["exposure"]["white_balance"]) / colours - 1).max())
        expected = np.clip(np.clip(light * gain, 0, 1) * colours, 0, 1) * 255
        assert np.abs(expected - image).max() <= 0.5 + gain * colours.max()
        means = np.clip(light * gain, 0, 1).mean(axis=(0, 1))
        colours = np.clip(colours * (means[1] / (colours * means)) ** balance["speed"], 0.25, 4)
        colours[1] = 1
        gain = np.clip(gain * (exposure["target_level"] / means.mean()) ** exposure["speed"], *exposure["gain"])
    print(f"exposure: gains {[round(line['exposure']['gain'], 3) for line in truth]}, off by at most {worst:.4f} of themselves")
    assert worst < 5e-3


def check_membrane(program, folder, sensor):
    amplitude, correlation_mm, seeds = 0.08, 2.0, 60
    places = [(320, 240), (340, 240), (365, 250), (320, 300), (250, 180)]
    scene = {"uneven_membrane": {"amplitude": amplitude, "correlation_mm": correlation_mm}, "effects": {"dots": "never"}}
    levels = []
    for seed in range(seeds):
        (image,), _ = render(program, folder, {**scene, "seed": seed}, "uneven")
        levels.append([image[y, x, 1] for x, y in places])
    # Flat: 0.6 of full scale.
    field = (np.array(levels) / 153.0 - 1) / amplitude
    dome = np.array([sensor.on_dome(x, y) for x, y in places])
    found = field.T @ field / seeds
    apart = np.linalg.norm(dome[:, None] - dome[None], axis=2)
    stated = np.exp(-(apart**2) / (2 * correlation_mm**2))
    off = np.abs(found - stated).max()
    print(f"membrane: {seeds} seeds, correlations off by at most {off:.2f} (chance: {3 * np.sqrt(2 / seeds):.2f})")
    assert off < 3.5 * np.sqrt(2 / seeds)


def main():
    program = str(pathlib.Path(sys.argv[1]).resolve())
    sensor = Sensor(json.loads(DESIGN.read_text()))
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        check_scratch(program, folder, sensor)
        check_sharpening(program, folder)
        check_defects(program, folder)
        check_exposure(program, folder)
        check_membrane(program, folder, sensor)


if __name__ == "__main__":
    main()
