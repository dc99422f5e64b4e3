#!/usr/bin/env python3
"""Judges `track --shape` on frames that domecast did not draw.

    check_shape_by_another_light.py DOMECAST [--designs NAME...] [--points N] [--quick] [--keep FOLDER]

A dome is pressed in along its radius by bells with a ring about them, as much rubber up as down. Every second pixel's ray goes through
OpenCV's lens and Snell's law to that skin. The light there is summed over each light's square past the triangles of the built
platforms (`check_shadow_edges.py`); where a lip lets only a strip of each light be seen, as on digit-rigid, it takes 1024 points.
What the skin throws on itself, straight and by the sheet, is a sum over places of it: what does not leave into the air comes back.
Dots stand where their directions from the dome's centre are; markers and sheet beside the dome are domecast's own, which do not move.
One gain a colour makes the frame at rest as bright as domecast's, beside which it is judged too. Noise and JPEG are `shape_frames.py`'s.
"""
import argparse
import json
import pathlib
import sys
import tempfile

import cv2
import numpy as np

import shape_frames
from check_light_by_photons import BEFORE, COLORS, Sensor
from check_shadow_edges import Light, irradiance, lobe, passed, spread
from shape_frames import built_constants, check, direction, dome_of, drawn, photograph, shown, simulate, track, within

# Depth and width in parts of the radius, polar angle and azimuth, degrees.
BELLS = {"bell on the pole": (0.04, 0.14, 0, 0), "bell at 30 deg": (0.03, 0.14, 30, 70), "wide bell at 15 deg": (0.03, 0.25, 15, 200), "small bell at 25 deg": (0.015, 0.09, 25, 310)}
# rms to 45 and to 60 degrees and the 99th percentile to 45, mm, larger on domes of more than 10 mm; the least share within three deviations
MAX_RMS_MM, MAX_WIDE_RMS_MM, MAX_P99_MM, MIN_WITHIN = 0.010, 0.020, 0.030, 0.95
# On endoscope-r5 dots hide half of the skin.
LESS_WITHIN = {"endoscope-r5": 0.9}
# Deeper ones must be stated as a touch, mm.
MIN_STATED_MM = 0.2
# The frame at rest beside domecast's: rms, part of the level.
MAX_REST = 0.02
# What dots reflect beside the membrane, of simulated scenes.
INK = 0.05
PLACES, END_DEG = 600, 75


class Skin:
    """A dome that is displaced along its radius: `depth (1 - u^2) exp(-u^2)`, `u` the angle over the width."""

    def __init__(self, sensor, depth=0.0, width=1.0, polar_deg=0.0, azimuth_deg=0.0):
        self.radius, self.center = sensor.radius, np.array([0, 0, sensor.center_z])
        self.axis = direction(polar_deg, azimuth_deg)
        self.depth, self.width = depth * sensor.radius, width

    def at(self, ways):
        """Points, outward normals and heights along directions from the centre."""
        cos, sine = ways @ self.axis, np.linalg.norm(np.cross(ways, self.axis), axis=-1)
        u = np.arctan2(sine, cos) / self.width
        inward, slope = self.depth * (1 - u * u) * np.exp(-u * u), self.depth / self.width * 2 * u * (u * u - 2) * np.exp(-u * u)
        rho = self.radius - inward
        along = (cos[..., None] * ways - self.axis) / np.maximum(sine, 1e-12)[..., None]
        normals = ways + (slope / rho)[..., None] * along
        return self.center + rho[..., None] * ways, normals / np.linalg.norm(normals, axis=-1, keepdims=True), -inward

    def met(self, starts, rays):
        """Directions from the centre of where rays from inside leave the skin."""
        from_center = starts - self.center
        along, rho = (from_center * rays).sum(-1), np.full(len(starts), self.radius)
        for _ in range(40):
            way = from_center + (-along + np.sqrt(along**2 - (from_center**2).sum(-1) + rho**2))[:, None] * rays
            way /= np.linalg.norm(way, axis=1, keepdims=True)
            rho = np.linalg.norm(self.at(way)[0] - self.center, axis=1)
        return way


def through(indices, sine):
    """Part of light without polarisation that the faces between silicone, sheet and air let through; `sine` in air."""
    acrylic, silicone = indices
    s, p = (a * b for a, b in zip(passed(silicone, acrylic, sine), passed(acrylic, 1.0, sine)))
    return 0.5 * (s + p)


def straight(places, normals, others, other_normals, own):
    """Of each place, the part of the other patches' exitance times pi that comes straight, by area; `own` is that of a patch for itself."""
    way = others[None] - places[:, None]
    far = (way**2).sum(-1)
    part = np.maximum(-(way * normals[:, None]).sum(-1), 0) * np.maximum((way * other_normals[None]).sum(-1), 0) / np.maximum(far, 1e-9) ** 2
    return part if own is None else part * (1 - np.eye(len(part))) + own * np.eye(len(part))


def by_sheet(sensor, places, normals, others, other_normals):
    """The same by way of the sheet's underside, thrice refracted, where the way crosses the sheet's top under the dome twice."""
    acrylic, silicone = sensor.indices
    aside = places[:, None, :2] - others[None, :, :2]
    distance = np.maximum(np.linalg.norm(aside, axis=2), 1e-6)
    high = places[:, None, 2] + others[None, :, 2]
    ratio = silicone / acrylic
    # the tangent in the silicone by Newton: what a way reaches grows with it, and ever less where the sheet is the denser
    assert ratio <= 1
    tangent = distance / (high + 2 * sensor.sheet_mm * ratio)
    for _ in range(8):
        flatter = 1 / np.sqrt(1 + (1 - ratio**2) * tangent**2)
        there = high * tangent + 2 * sensor.sheet_mm * ratio * tangent * flatter
        tangent += (distance - there) / (high + 2 * sensor.sheet_mm * ratio * flatter**3)
    assert np.abs(there - distance).max() < 1e-6
    sine = tangent / np.sqrt(1 + tangent**2)
    cos, cos_sheet = np.sqrt(1 - sine**2), np.sqrt(1 - (ratio * sine) ** 2)
    # steradians that one mm2 across the way takes in
    spread_mm = high / cos**2 + 2 * sensor.sheet_mm * ratio * cos / cos_sheet**3
    per_mm2 = sine / (distance * spread_mm * cos)
    flat = aside / distance[..., None] * sine[..., None]
    down, up = (np.dstack([flat, sign * cos]) for sign in (-1, 1))
    part = np.maximum(-(down * other_normals[None]).sum(-1), 0) * np.maximum((up * normals[:, None]).sum(-1), 0) * per_mm2
    foot = [np.linalg.norm(end[..., :2] + sign * flat * (end[..., 2:] / cos[..., None]), axis=2) for end, sign in ((others[None], 1), (places[:, None], -1))]
    sine_air = silicone * sine
    returned = np.where(sine_air >= 1, 1.0, 1 - through(sensor.indices, np.minimum(sine_air, 1 - 1e-9)))
    return part * returned * (foot[0] <= sensor.rim) * (foot[1] <= sensor.rim)


def thrown(sensor, places, normals, others, other_normals, area, is_self=False):
    """Part of the exitance of patches of the skin that comes to places of it."""
    own = 1 / (4 * sensor.radius**2) if is_self else None
    return (straight(places, normals, others, other_normals, own) + by_sheet(sensor, places, normals, others, other_normals)) * area / np.pi


class Camera:
    """Every second pixel's rays, and what each colour sees along them."""

    def __init__(self, constants):
        self.of = constants["camera"]
        self.size = self.of["height"], self.of["width"]
        grid = np.mgrid[0 : self.size[0] : 2, 0 : self.size[1] : 2]
        self.grid = grid[::-1].reshape(2, -1).T.astype(float)
        matrix, distortion = np.array(self.of["matrix"]), np.array(self.of["distortion"] or [0.0] * 4)
        if self.of["model"] == "kannala_brandt":
            flat = cv2.fisheye.undistortPoints(self.grid[:, None], matrix, distortion)[:, 0]
        else:
            flat = cv2.undistortPointsIter(self.grid[:, None], matrix, distortion, None, None, (3, 200, 1e-12))[:, 0]
        tangent = np.linalg.norm(flat, axis=1)
        self.aside, self.sine = flat / np.maximum(tangent, 1e-12)[:, None], tangent / np.sqrt(1 + tangent**2)

    def rays(self, sensor):
        """Where rays enter the silicone, their directions there, and which do so under the dome."""
        acrylic, silicone = sensor.indices
        s, gap = np.minimum(self.sine, 1 - 1e-12), self.of["camera_from_sensor"][2][3] - sensor.sheet_mm
        reach = gap * s / np.sqrt(1 - s * s) + sensor.sheet_mm * s / np.sqrt(acrylic**2 - s * s)
        starts = np.column_stack([self.aside * reach[:, None], np.zeros(len(s))])
        return starts, np.column_stack([self.aside * (s / silicone)[:, None], np.sqrt(1 - (s / silicone) ** 2)]), reach < 0.999 * sensor.rim


def full(camera, values):
    """Values of every second pixel at all pixels, and which have no part in one that has none."""
    half = values.reshape(camera.size[0] // 2, camera.size[1] // 2, -1)
    x, y = np.meshgrid(np.arange(camera.size[1]) / 2, np.arange(camera.size[0]) / 2)
    return np.dstack([cv2.remap(np.ascontiguousarray(half[..., k]), x.astype(np.float32), y.astype(np.float32), cv2.INTER_LINEAR) for k in range(half.shape[2])])


def draw(sensor, constants, camera, skin, points):
    """Linear levels of red, green and blue up to a gain, heights, and angles from the pole, of all pixels; NaN beside the dome."""
    light, planes = constants["light"], []
    k = np.arange(PLACES) + 0.5
    level, turn = 1 - k / PLACES * (1 - sensor.center_z / -sensor.radius), k * np.pi * (1 + 5**0.5)
    around = np.sqrt(1 - level**2)
    others, other_normals, _ = skin.at(np.column_stack([around * np.cos(turn), around * np.sin(turn), level]))
    area = 2 * np.pi * sensor.radius * (sensor.radius + sensor.center_z) / PLACES
    for color, name in enumerate(COLORS):
        sensor.indices = [layer["index_rgb"][color] for layer in constants["optics"]["layers"][1:]]
        starts, rays, seen = camera.rays(sensor)
        ways = skin.met(starts[seen], rays[seen])
        places, normals, heights = skin.at(ways)
        polar = np.degrees(np.arctan2(np.linalg.norm(ways[:, :2], axis=1), ways[:, 2]))
        lit = polar < END_DEG
        lights = [(color, Light(sensor, led, spread(points))) for led in sensor.leds["list"] if led["color"] == name]
        direct, _ = irradiance(sensor, lights, np.vstack([places[lit], others]), np.vstack([normals[lit], other_normals]), points)
        direct = direct[:, color]
        mean = light["mean_reflectance"][color]
        exchange = thrown(sensor, others, other_normals, others, other_normals, area, True)
        exitance = mean * np.linalg.solve(np.eye(PLACES) - mean * exchange, direct[lit.sum() :])
        own = np.concatenate([thrown(sensor, p, n, others, other_normals, area) @ exitance for p, n in zip(np.array_split(places[lit], 40), np.array_split(normals[lit], 40))])
        plane = np.full((len(seen), 5), np.nan)
        at = np.flatnonzero(seen)[lit]
        plane[at] = np.column_stack([(direct[: lit.sum()] + own) * light["reflectance"][color] * through(sensor.indices, camera.sine[at]), heights[lit], ways[lit]])
        planes.append(full(camera, plane))
    return planes


def picture(constants, planes):
    """Levels with dots and crosstalk, heights and angles by green's rays, and where ink is."""
    levels, inks = [], []
    for plane in planes:
        ways = plane[..., 2:] / np.linalg.norm(plane[..., 2:], axis=2, keepdims=True)
        ink = np.zeros(plane.shape[:2])
        center = np.array([0, 0, constants["optics"].get("dome_center_z_mm", 0.0)])
        pixel_mm = np.nanmedian(np.linalg.norm(np.diff(ways, axis=1), axis=2)) * constants["optics"]["dome_radius_mm"]
        for dot in constants["black_dots"]:
            to = np.array(dot["surface_mm"]) - center
            away_mm = np.linalg.norm(to) * np.linalg.norm(ways - to / np.linalg.norm(to), axis=2)
            # about a pixel of soft edge stands for the pixel's own area
            ink = np.fmax(ink, np.clip((0.5 * dot["diameter_mm"] - away_mm) / pixel_mm + 0.5, 0, 1))
        levels.append(plane[..., 0] * (1 - (1 - INK) * ink))
        inks.append(ink)
    mixed = np.einsum("ck,kyx->yxc", np.array(constants["light"]["crosstalk"]), np.array(levels))[..., ::-1]
    green = planes[1]
    polar = np.degrees(np.arctan2(np.hypot(green[..., 2], green[..., 3]), green[..., 4]))
    return mixed, green[..., 1], polar, np.max(inks, axis=0)


def judge(domecast, work, design, points, bells):
    file = built_constants(domecast, work, design)
    constants = json.loads(file.read_text())
    sensor, camera = Sensor(domecast, work / design), Camera(constants)
    sensor.lobe = lobe(sensor.leds)
    sensor.below = type(sensor.rays)(sensor.walls.slice_plane([0, 0, -sensor.sheet_mm - BEFORE], [0, 0, -1]))
    theirs = drawn(simulate(domecast, work / f"{design}-rest", design, None))
    stray, radius = 255 * constants["light"]["stray"], dome_of(file)["radius"]
    folder = work / f"{design}-another"
    folder.mkdir(exist_ok=True)
    gain = None
    for number, (name, bell) in enumerate({"at rest": (), **bells}.items()):
        mixed, true, polar, ink = picture(constants, draw(sensor, constants, camera, Skin(sensor, *bell), points))
        inside = np.isfinite(mixed).all(axis=2)
        if gain is None:
            bare = inside & (polar < 60) & (cv2.dilate(ink, np.ones((7, 7))) == 0)
            gain = np.median((theirs[bare] - stray) / mixed[bare], axis=0)
            off = ((mixed * gain + stray - theirs) / theirs)[bare]
            rms = np.sqrt((off**2).mean(axis=0))
            check(f"{design}: the frame at rest is domecast's", (rms <= MAX_REST).all(), f"rms {rms[::-1].round(4)} of the level to 60 deg")
        mine = np.where(inside[..., None], mixed * gain + stray, theirs)
        frame, shape = folder / f"{'abcde'[number]}.png", folder / f"shape-{number}"
        cv2.imwrite(str(frame), photograph(mine, 10 + number))
        if number == 0:
            cv2.imwrite(str(folder / "camera_rest.png"), photograph(mine, 1))
        line = track(domecast, frame, folder / "camera_rest.png", file, shape)
        height, sd = (np.load(shape / f"frame_0000.{kind}.npy") for kind in ("height", "height_sd"))
        off = height - true
        known = np.isfinite(off)
        inner, wide = (known & (polar < limit) for limit in (45, 60))
        rms, outer, p99 = np.sqrt((off[inner] ** 2).mean()), np.sqrt((off[wide] ** 2).mean()), np.percentile(abs(off[inner]), 99)
        shares = within(abs(off / sd)[wide])
        size = max(radius / 10, 1)
        holds = rms <= MAX_RMS_MM * size and outer <= MAX_WIDE_RMS_MM * size and p99 <= MAX_P99_MM * size and shares[2] >= LESS_WITHIN.get(design, MIN_WITHIN)
        deepest, touched = np.nanmax(abs(true)), bool(line.get("contact"))
        holds &= not touched if number == 0 else touched or deepest < MIN_STATED_MM
        check(f"{design}: {name}", holds, f"rms {rms:.4f} to 45, {outer:.4f} to 60 deg, p99 {p99:.4f}, of {deepest:.2f} mm; {shown(shares)}{', a touch' * touched}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("domecast", type=pathlib.Path)
    parser.add_argument("--designs", nargs="+", default=["thumb24", "endoscope-r5"])
    parser.add_argument("--points", type=int, default=256, help="of each light's square")
    parser.add_argument("--quick", action="store_true", help="the frame at rest and two bells")
    parser.add_argument("--keep", type=pathlib.Path, help="folder that frames are kept in")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        work = (chosen.keep or pathlib.Path(scratch)).resolve()
        work.mkdir(parents=True, exist_ok=True)
        for design in chosen.designs:
            judge(chosen.domecast, work, design, chosen.points, dict(list(BELLS.items())[1::2]) if chosen.quick else BELLS)
    sys.exit(1 if shape_frames.failed else 0)


if __name__ == "__main__":
    main()
