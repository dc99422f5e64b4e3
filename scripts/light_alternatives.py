#!/usr/bin/env python3
"""What other ways to light a dome would give: white or clear platforms, lights at the sheet's edge, lights in the silicone.

    light_alternatives.py DOMECAST BUILD...   [--photons N]

`illuminate --optimize` searches lights below the sheet between black platforms. Here photons are counted one by one, as in
`check_light_by_photons.py`, for what it leaves out, and put beside the same count for the design as it stands:

    black     the platforms as printed: what meets them is gone
    white     they give back 0.85 of what meets them, as Lambert's surfaces do
    clear     they are not there (a bound: clear resin also bends and loses light)
    edge      the lights shine into the sheet's edge, each at its own azimuth, and the sheet guides
    silicone  the lights stand on the sheet in the silicone, as near to the rim as their bodies allow, facing the axis, tilted as given

The number is `illuminate`'s: degrees that a normal is off for a grey level, at the 95th percentile to 60 degrees from the pole,
exposed for the brightest place; here without what the dome throws at itself, the same for all. Counts of the black platforms
must agree with the same number from `illuminate`'s own field of light to 8 %. For lights in the silicone it also says from which polar
angle on their wall hides the dome from the lens.
"""

import argparse
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from check_light_by_photons import BEFORE, BATCH, COLORS, Sensor, about, emitted, face, in_sheet, index_of, on_dome

RINGS, AZIMUTHS = 16, 24
WHITE, BOUNCES = 0.85, 12
FULL = 255.0
# most of what they differ by is the count's own noise, which makes the 95th percentile larger
AGREES = 0.08
# a wall before a light in the silicone, as thin as resin prints, and the light's body behind it, mm
WALL_MM, BODY_MM, BODY_HEIGHT_MM = 0.6, 1.4, 1.4
KINDS = ("black", "white", "clear", "edge", "silicone")


class Stand:
    """Lights that stand elsewhere than the design's."""

    pose = Sensor.pose

    def __init__(self, leds):
        self.leds = leds


class Count:
    """Vector irradiance of bins of equal area of the dome: the sum of flux times way over cosine."""

    def __init__(self, sensor):
        self.sensor = sensor
        self.area = 2 * math.pi * sensor.radius * (sensor.radius + sensor.center_z) / (RINGS * AZIMUTHS)
        self.sum = np.zeros((RINGS * AZIMUTHS, 3))

    def add(self, start, way):
        """Photons from points in the silicone (about the dome's centre) that meet the dome on ways that rise or fall."""
        end, level = on_dome(self.sensor, start, way)
        on = (level > 0) & (level < 1)
        end, way, level = end[on] / self.sensor.radius, way[on], level[on]
        cosine = np.maximum((end * way).sum(axis=1), 0.02)
        ring = (level * RINGS).astype(int)
        turn = (np.degrees(np.arctan2(end[:, 1], end[:, 0])) % 360 / 360 * AZIMUTHS).astype(int) % AZIMUTHS
        np.add.at(self.sum, ring * AZIMUTHS + turn, way / cosine[:, None])


def below(generator, count, led, color, kind):
    """Lights below the sheet, among platforms of a kind."""
    sensor = count.sensor
    points, ways, share = emitted(generator, sensor, led, BATCH)
    acrylic = index_of(sensor.layers[0], color)
    for _ in range(BOUNCES if kind == "white" else 1):
        length = np.full(len(points), np.inf)
        rises = ways[:, 2] > 1e-6
        length[rises] = (-sensor.sheet_mm - points[rises, 2]) / ways[rises, 2]
        ends = points + np.where(np.isfinite(length), length, 0)[:, None] * ways
        length[(np.abs(ends[:, :2]) > sensor.half_sheet).any(axis=1)] = np.inf
        near, facing = np.full(len(points), np.inf), np.zeros_like(points)
        if kind != "clear":
            first, ray = sensor.rays.intersects_id(points, ways, multiple_hits=False)
            normal = sensor.walls.face_normals[first]
            slope = (normal * ways[ray]).sum(axis=1)
            corner = sensor.walls.triangles[first][:, 0]
            near[ray] = ((corner - points[ray]) * normal).sum(axis=1) / np.where(slope == 0, 1e-300, slope)
            facing[ray] = -np.sign(slope)[:, None] * normal
        free = np.isfinite(length) & (near >= length - BEFORE)
        cos = ways[free, 2]
        aside = ways[free, :2] / np.maximum(np.linalg.norm(ways[free, :2], axis=1), 1e-300)[:, None]
        is_s = generator.uniform(size=len(cos)) < 0.5
        back, inside = face(generator, is_s, 1.0, acrylic, cos)
        entered = in_sheet(generator, sensor, color, ends[free][~back, :2], aside[~back], inside[~back], is_s[~back], True)
        for into in entered:
            count.add(*into)
        if kind != "white":
            break
        mirrored = ways[free][back] * [1, 1, -1]
        hit = ~free & np.isfinite(near) & (generator.uniform(size=len(points)) < WHITE)
        axis = facing[hit]
        x = np.cross(axis, np.where(np.abs(axis[:, :1]) < 0.7, [[1.0, 0, 0]], [[0, 1.0, 0]]))
        x /= np.linalg.norm(x, axis=1, keepdims=True)
        lambert = about(generator, np.sqrt(generator.uniform(size=len(axis))), len(axis))
        new = lambert[:, :1] * x + lambert[:, 1:2] * np.cross(axis, x) + lambert[:, 2:] * axis
        from_wall = points[hit] + near[hit][:, None] * ways[hit] + BEFORE * axis
        from_sheet = ends[free][back] - [0, 0, BEFORE]
        points, ways = np.concatenate([from_wall, from_sheet]), np.concatenate([new, mirrored])
    return share


def at_edge(generator, count, led, color):
    """A light on the sheet's edge at its azimuth, its tape on it, shining inward through the edge's face."""
    sensor, leds = count.sensor, count.sensor.leds
    turn = math.radians(led["azimuth_deg"])
    out = np.array([math.cos(turn), math.sin(turn)])
    side = int(np.argmax(np.abs(out) / sensor.half_sheet))
    where = out * sensor.half_sheet[side] / abs(out[side])
    stand = Stand(dict(leds, tilt_deg=90.0, center_radius_mm=0.0, center_z_mm=0.0, diffuser_thickness_mm=0.0))
    azimuth_deg = 90.0 * side + (180.0 if out[side] < 0 else 0.0)
    points, ways, share = emitted(generator, stand, {"azimuth_deg": azimuth_deg}, BATCH)
    height = points[:, 2] + 0.5 * sensor.sheet_mm
    acrylic = index_of(sensor.layers[0], color)
    normal = np.zeros(3)
    normal[side] = -math.copysign(1, out[side])
    cos = ways @ normal
    back, inside = face(generator, generator.uniform(size=len(cos)) < 0.5, 1.0, acrylic, cos)
    ways = (ways - cos[:, None] * normal) / acrylic + inside[:, None] * normal
    # what is higher than the sheet misses its edge
    enters = ~back & (height > 0) & (height < sensor.sheet_mm)
    ways, height, at = ways[enters], height[enters], where + points[enters, :2]
    for goes_up in (True, False):
        some = (ways[:, 2] > 0) == goes_up
        cos = np.maximum(np.abs(ways[some, 2]), 1e-6)
        aside = ways[some, :2] / np.linalg.norm(ways[some, :2], axis=1, keepdims=True)
        # as if it came from the face behind, at the same slope
        travelled = height[some] if goes_up else sensor.sheet_mm - height[some]
        start = at[some] - aside * (travelled * np.sqrt(1 - cos * cos) / cos)[:, None]
        # the edge's face and the sheet's lie across each other: polarised anew
        is_s = generator.uniform(size=len(start)) < 0.5
        for entered in in_sheet(generator, sensor, color, start, aside, cos, is_s, goes_up):
            count.add(*entered)
    return share


def in_silicone(generator, count, led, color):
    """A light standing on the sheet in the silicone behind a wall of its own height, tilted as given."""
    sensor, leds = count.sensor, count.sensor.leds
    wall, outer = stand_at(sensor)
    stand = Stand(dict(leds, center_radius_mm=0.5 * (wall + WALL_MM + outer), center_z_mm=0.5 * BODY_HEIGHT_MM))
    points, ways, share = emitted(generator, stand, led, BATCH)
    # over the wall, or stopped by it: the wall is as high as the light's upper edge
    inward = -(points[:, :2] * ways[:, :2]).sum(axis=1) / np.linalg.norm(points[:, :2], axis=1)
    reach = np.linalg.norm(points[:, :2], axis=1) - wall
    at_wall = points[:, 2] + np.where(inward > 0, reach / np.maximum(inward, 1e-12), 0) * ways[:, 2]
    over = (ways[:, 2] > 0) & ((inward <= 0) | (at_wall >= BODY_HEIGHT_MM))
    count.add(points[over] - [0, 0, sensor.center_z], ways[over])
    return share


def stand_at(sensor):
    """Radii of the wall's inner face and of a light's back where its upper edge keeps inside the dome."""
    top = BODY_HEIGHT_MM - sensor.center_z
    outer = math.sqrt(sensor.radius**2 - top * top) - WALL_MM
    return outer - BODY_MM - WALL_MM, outer


def hidden_from_deg(sensor, camera_z):
    """The polar angle from which on a wall hides the dome: the sight line over its inner upper edge, traced from the pupil."""
    wall, _ = stand_at(sensor)
    acrylic, silicone = (index_of(layer, 1) for layer in sensor.layers)

    def radius_at(sine):
        spans = [(-sensor.sheet_mm - camera_z, 1.0), (sensor.sheet_mm, acrylic), (BODY_HEIGHT_MM, silicone)]
        return sum(height * (sine / n) / math.sqrt(1 - (sine / n) ** 2) for height, n in spans)

    low, high = 0.0, 1 - 1e-12
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if radius_at(middle) < wall else (low, middle)
    sine = low / silicone
    start, way = np.array([wall, BODY_HEIGHT_MM - sensor.center_z]), np.array([sine, math.sqrt(1 - sine * sine)])
    along = start @ way
    end = start + (-along + math.sqrt(along**2 - start @ start + sensor.radius**2)) * way
    return math.degrees(math.acos(end[1] / sensor.radius))


def error_deg(vectors, normals, crosstalk):
    """The 95th percentile to 60 degrees of `||(1 - n n^T)(C L)^-1||_F / sqrt 2`, exposed for the brightest place."""
    light = np.einsum("ck,pkx->pcx", crosstalk, vectors)
    light *= FULL / np.einsum("pcx,px->pc", light, normals).max()
    within = normals[:, 2] >= math.cos(math.radians(60))
    light, normals = light[within], normals[within]
    across = np.eye(3) - normals[:, :, None] * normals[:, None, :]
    ok = np.abs(np.linalg.det(light)) > 1e-12
    errors = np.full(len(light), np.inf)
    errors[ok] = np.linalg.norm(across[ok] @ np.linalg.inv(light[ok]), axis=(1, 2)) / math.sqrt(2)
    return math.degrees(float(np.percentile(errors, 95, method="lower")))


def counted(sensor, kind, photons, normals, crosstalk):
    generator = np.random.default_rng(4)
    vectors = np.zeros((len(normals), 3, 3))
    for led in sensor.leds["list"]:
        color, count = COLORS[led["color"]], Count(sensor)
        batches = max(1, photons // BATCH)
        for _ in range(batches):
            if kind == "edge":
                share = at_edge(generator, count, led, color)
            elif kind == "silicone":
                share = in_silicone(generator, count, led, color)
            else:
                share = below(generator, count, led, color, kind)
        flux = sensor.leds["radiant_flux_mw"]["rgb"[color]]
        vectors[:, color] += count.sum * share * flux / (batches * BATCH * count.area)
    return error_deg(vectors, normals, crosstalk)


def stated(report, crosstalk):
    """The same number from `illuminate`'s vectors, averaged over the same bins."""
    places = report["places"]
    shape = (RINGS, places["rings"] // RINGS, AZIMUTHS, places["per_ring"] // AZIMUTHS)
    vectors = np.array(places["vector_irradiance_mw_mm2"]).reshape(*shape, 3, 3).mean(axis=(1, 3)).reshape(-1, 3, 3)
    normals = np.array(places["normal"]).reshape(*shape, 3).mean(axis=(1, 3)).reshape(-1, 3)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return normals, error_deg(vectors, normals, crosstalk)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("domecast")
    parser.add_argument("builds", nargs="+", type=Path)
    parser.add_argument("--photons", type=int, default=2_000_000, help="for each light")
    chosen = parser.parse_args()
    faults = []
    for build in chosen.builds:
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "light"
            command = [chosen.domecast, "illuminate", str(build / "design.json"), "--out", str(out)]
            subprocess.run(command, check=True, capture_output=True, text=True)
            report = json.loads((out / "illuminate.json").read_text())
        sensor, crosstalk = Sensor(chosen.domecast, build), np.array(report["crosstalk"])
        normals, said = stated(report, crosstalk)
        found = {kind: counted(sensor, kind, chosen.photons, normals, crosstalk) for kind in KINDS}
        explain = [chosen.domecast, "explain", "camera", "--design", str(build / "design.json"), "--json"]
        camera = json.loads(subprocess.run(explain, check=True, capture_output=True, text=True).stdout)["value"]
        hides = hidden_from_deg(sensor, camera["position_mm"][2])
        print(f"{build.name}: {said:.2f} degrees a level by illuminate; counted: "
              + ", ".join(f"{kind} {value:.2f}" if math.isfinite(value) else f"{kind} lacks colours" for kind, value in found.items())
              + f"; walls before lights in the silicone hide the dome from {hides:.0f} degrees on")
        if abs(found["black"] / said - 1) > AGREES:
            faults.append(f"{build.name}: counted {found['black']:.3f}, stated {said:.3f}")
    for fault in faults:
        print(f"FAIL {fault}")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
