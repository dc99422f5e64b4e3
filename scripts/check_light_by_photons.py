#!/usr/bin/env python3
"""Counts photons on the dome of built sensors, the printed platforms in their way, against `domecast illuminate`.

    check_light_by_photons.py DOMECAST BUILD...   [--photons N]

Each photon is followed by itself: drawn on a light's square, scattered by the tape, sent straight through the air past the
triangles of `parts/upper_platform.stl` and `parts/lower_platform.stl` (Embree, by trimesh), reflected or let through at random
at the sheet's faces by Fresnel's equations, thrown up and down in the sheet, and counted where it first meets the dome.
The counts, as irradiance of bins of equal area, are put beside `vector_irradiance_mw_mm2` times the normal of `illuminate.json`,
averaged over the same bins. In the mean over all bins of more than a tenth of the brightest one, weighted as they are known, both
must agree to 1 %, and in each of them to 1 % and four of the count's own standard deviations. What goes back and forth between
sheet and air, or between the sheet's faces, `illuminate` leaves out: photons that were thrown back inside the sheet are counted apart.
"""

import argparse
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import trimesh

BATCH = 500_000
RINGS, AZIMUTHS = 12, 24
SHARE, BOUND, SIGMAS = 0.1, 0.01, 4.0
# a photon is followed through the sheet so often
THROWS = 24
# a photon's way ends this far before the sheet, whose seat is in the plane of its underside, mm
BEFORE = 1e-4
COLORS = {"red": 0, "green": 1, "blue": 2}


def index_of(layer, color):
    index = layer["index"]
    return index["rgb"[color]] if isinstance(index, dict) else index


class Sensor:
    """What of a build's design the light depends on."""

    def __init__(self, domecast, build):
        def given(field):
            command = [domecast, "explain", field, "--design", str(build / "design.json"), "--json"]
            return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)["value"]

        self.leds, self.layers, dome = given("leds"), given("optics.layers"), given("dome")
        if len(self.layers) != 2 or dome.get("cylinder_height_mm") or self.leds.get("through_platform"):
            raise ValueError("one sheet, a part of a sphere, and platforms that let nothing through, are what is counted here")
        self.sheet_mm = self.layers[0]["thickness_mm"]
        self.radius = dome["radius_mm"]
        self.center_z = -self.radius * math.cos(math.radians(dome.get("rim_angle_deg", 90.0)))
        self.rim = math.sqrt(self.radius**2 - self.center_z**2)
        self.half_sheet = 0.5 * np.array(given("sheet")["size_mm"])
        parts = [trimesh.load_mesh(build / "parts" / f"{name}_platform.stl") for name in ("upper", "lower")]
        self.walls = trimesh.util.concatenate(parts)
        self.rays = trimesh.ray.ray_pyembree.RayMeshIntersector(self.walls)

    def pose(self, led):
        leds = self.leds
        azimuth, tilt = math.radians(led["azimuth_deg"]), math.radians(leds["tilt_deg"])
        out = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
        z = np.array([0.0, 0.0, 1.0])
        facing = -math.sin(tilt) * out + math.cos(tilt) * z
        up = math.cos(tilt) * out + math.sin(tilt) * z
        front = leds["diffuser_thickness_mm"] if leds.get("diffuser") else 0.0
        center = leds["center_radius_mm"] * out + leds["center_z_mm"] * z + front * facing
        return center, facing, up, np.cross(up, facing)


def about(generator, axis_cos, count):
    """Directions with given cosines to z, anywhere round it."""
    turn = generator.uniform(0, 2 * math.pi, count)
    sine = np.sqrt(np.maximum(1 - axis_cos * axis_cos, 0))
    return np.stack([sine * np.cos(turn), sine * np.sin(turn), axis_cos], axis=1)


def scattered(generator, ways, width):
    """Ways after a Gaussian lobe about them, weighted by the cosine and kept ahead of the tape: drawn until they are."""
    out = np.empty_like(ways)
    left = np.arange(len(ways))
    while len(left):
        g = width * np.sqrt(-2 * np.log(1 - generator.uniform(size=len(left))))
        keep = (g < math.pi) & (generator.uniform(size=len(left)) * g <= np.sin(g))
        axis = ways[left]
        x = np.cross(axis, np.where(np.abs(axis[:, :1]) < 0.7, [[1.0, 0, 0]], [[0, 1.0, 0]]))
        x /= np.linalg.norm(x, axis=1, keepdims=True)
        turn = generator.uniform(0, 2 * math.pi, len(left))
        aside = np.cos(turn)[:, None] * x + np.sin(turn)[:, None] * np.cross(axis, x)
        new = np.cos(g)[:, None] * axis + np.sin(g)[:, None] * aside
        keep &= generator.uniform(size=len(left)) < new[:, 2]
        out[left[keep]] = new[keep]
        left = left[~keep]
    return out


def emitted(generator, sensor, led, count):
    leds, (center, facing, up, side) = sensor.leds, sensor.pose(led)
    at = generator.uniform(-0.5, 0.5, (2, count)) * leds["emitter_mm"]
    # intensity cos^m: the cosine to the power of m + 1 is uniform
    ways = about(generator, generator.uniform(size=count) ** (1 / (leds["lobe_exponent"] + 1)), count)
    tape, share = leds.get("diffuser"), 1.0
    if tape:
        share = tape["transmittance"]
        is_lambert = generator.uniform(size=count) < tape["lambert_fraction"]
        lambert = about(generator, np.sqrt(generator.uniform(size=is_lambert.sum())), is_lambert.sum())
        ways[is_lambert] = lambert
        ways[~is_lambert] = scattered(generator, ways[~is_lambert], math.radians(tape["lobe_width_deg"]))
    points = center + at[0][:, None] * side + at[1][:, None] * up
    return points, ways @ np.stack([side, up, facing]), share


def face(generator, is_s, n_from, n_to, cos):
    """Whether each photon is thrown back, and its cosine behind the face."""
    sine = n_from / n_to * np.sqrt(np.maximum(1 - cos * cos, 0))
    behind = np.sqrt(np.maximum(1 - sine * sine, 0))
    s = (n_from * cos - n_to * behind) / np.maximum(n_from * cos + n_to * behind, 1e-300)
    p = (n_to * cos - n_from * behind) / np.maximum(n_to * cos + n_from * behind, 1e-300)
    chance = np.where(sine >= 1, 1.0, np.where(is_s, s * s, p * p))
    return generator.uniform(size=len(cos)) < chance, behind


def moved(at, aside, cos, height):
    return at + aside * (height * np.sqrt(np.maximum(1 - cos * cos, 0)) / np.maximum(cos, 1e-12))[:, None]


def through_air(sensor, points, ways):
    """Which photons rise to the sheet with no platform before it, and where they meet it."""
    rises = ways[:, 2] > 1e-6
    points, ways = points[rises], ways[rises]
    length = (-sensor.sheet_mm - points[:, 2]) / ways[:, 2]
    ends = points + length[:, None] * ways
    on_sheet = (np.abs(ends[:, :2]) <= sensor.half_sheet).all(axis=1)
    points, ways, length, ends = points[on_sheet], ways[on_sheet], length[on_sheet], ends[on_sheet]
    first, ray = sensor.rays.intersects_id(points, ways, multiple_hits=False)
    distance = np.full(len(points), np.inf)
    normal = sensor.walls.face_normals[first]
    corner = sensor.walls.triangles[first][:, 0]
    slope = (normal * ways[ray]).sum(axis=1)
    distance[ray] = ((corner - points[ray]) * normal).sum(axis=1) / np.where(slope == 0, 1e-300, slope)
    free = distance >= length - BEFORE
    return ends[free, :2], ways[free]


def in_sheet(generator, sensor, color, at, aside, cos, is_s, goes_up):
    """Follows photons inside the sheet from the face they left; at each rise gives points and ways of those that enter the silicone."""
    acrylic, silicone = (index_of(layer, color) for layer in sensor.layers)
    for _ in range(THROWS):
        at = moved(at, aside, cos, sensor.sheet_mm)
        stays = (np.abs(at) <= sensor.half_sheet).all(axis=1)
        at, aside, cos, is_s = at[stays], aside[stays], cos[stays], is_s[stays]
        if not len(at):
            return
        in_foot = np.hypot(at[:, 0], at[:, 1]) <= sensor.rim
        back, behind = face(generator, is_s, acrylic, np.where(in_foot & goes_up, silicone, 1.0), cos)
        if goes_up:
            into = ~back & in_foot
            rise = behind[into]
            way = np.column_stack([aside[into] * np.sqrt(np.maximum(1 - rise * rise, 0))[:, None], rise])
            yield np.column_stack([at[into], np.full(into.sum(), -sensor.center_z)]), way
        at, aside, cos, is_s = at[back], aside[back], cos[back], is_s[back]
        goes_up = not goes_up


def on_dome(sensor, start, way):
    """Where ways from points about the dome's centre meet it, and how far up it that is, from rim to pole 0 to 1: rings of equal height
    on a sphere have equal areas (Archimedes)."""
    along = (start * way).sum(axis=1)
    end = start + (-along + np.sqrt(np.maximum(along**2 - (start**2).sum(axis=1) + sensor.radius**2, 0)))[:, None] * way
    low = -sensor.center_z / sensor.radius
    return end, (end[:, 2] / sensor.radius - low) / (1 - low)


def counted(generator, sensor, led, color, count):
    """Photons of a light that meet each bin of the dome: straight, and after being thrown back in the sheet."""
    acrylic = index_of(sensor.layers[0], color)
    points, ways, share = emitted(generator, sensor, led, count)
    at, ways = through_air(sensor, points, ways)
    is_s = generator.uniform(size=len(at)) < 0.5
    cos = ways[:, 2]
    aside = ways[:, :2] / np.maximum(np.linalg.norm(ways[:, :2], axis=1), 1e-300)[:, None]
    back, inside = face(generator, is_s, 1.0, acrylic, cos)
    at, aside, is_s = at[~back], aside[~back], is_s[~back]
    hits = [binned(sensor, *into) for into in in_sheet(generator, sensor, color, at, aside, inside[~back], is_s, True)]
    nothing = np.zeros((RINGS, AZIMUTHS))
    return share * hits[0] if hits else nothing, share * sum(hits[1:], start=nothing)


def binned(sensor, start, way):
    end, level = on_dome(sensor, start, way)
    azimuth = np.degrees(np.arctan2(end[:, 1], end[:, 0])) % 360
    bins = [np.linspace(0, 1, RINGS + 1), np.linspace(0, 360, AZIMUTHS + 1)]
    return np.histogram2d(level, azimuth, bins=bins)[0]


def stated(report):
    """Irradiance of each colour in the same bins, by `illuminate`."""
    places = report["places"]
    light, normals = np.array(places["vector_irradiance_mw_mm2"]), np.array(places["normal"])
    direct = np.maximum(np.einsum("pcx,px->pc", light, normals), 0)
    rings, per_ring = places["rings"], places["per_ring"]
    if rings % RINGS or per_ring % AZIMUTHS:
        raise ValueError("the grid of places does not fit the bins")
    grid = direct.reshape(RINGS, rings // RINGS, AZIMUTHS, per_ring // AZIMUTHS, 3)
    return grid.mean(axis=(1, 3)).transpose(2, 0, 1)


def compare(domecast, build, photons):
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "light"
        command = [domecast, "illuminate", str(build / "design.json"), "--out", str(out)]
        subprocess.run(command, check=True, capture_output=True, text=True)
        report = json.loads((out / "illuminate.json").read_text())
    sensor = Sensor(domecast, build)
    said = stated(report)
    area = 2 * math.pi * sensor.radius * (sensor.radius + sensor.center_z) / (RINGS * AZIMUTHS)
    flux = [sensor.leds["radiant_flux_mw"][c] for c in "rgb"]
    hits, again = np.zeros_like(said), np.zeros_like(said)
    generator = np.random.default_rng(9)
    shares = np.zeros(3)
    for led in sensor.leds["list"]:
        color = COLORS[led["color"]]
        shares[color] += 1
        for _ in range(max(1, photons // BATCH)):
            straight, thrown = counted(generator, sensor, led, color, BATCH)
            hits[color] += straight
            again[color] += thrown
    per_photon = np.array(flux) / (max(1, photons // BATCH) * BATCH)
    share = (sensor.leds.get("diffuser") or {}).get("transmittance", 1.0)
    found = hits * per_photon[:, None, None] / area
    sd = np.sqrt(np.maximum(hits / share, 1)) * share * per_photon[:, None, None] / area
    faults = []
    for color, name in enumerate(COLORS):
        bright = said[color] > SHARE * said[color].max()
        weight = 1 / sd[color][bright] ** 2
        ratio = (weight * found[color][bright] * said[color][bright]).sum() / (weight * said[color][bright] ** 2).sum()
        known = 1 / math.sqrt((weight * said[color][bright] ** 2).sum())
        off = np.abs(found[color] - said[color])[bright] - BOUND * said[color][bright]
        worst = (off / sd[color][bright]).max()
        extra = again[color].sum() / max(hits[color].sum(), 1)
        print(f"  {name}: {bright.sum()} bins, counted over stated {ratio:.4f} (sd {known:.4f}), worst bin {worst:.1f} sd beyond "
              f"{BOUND:.0%}; thrown back in the sheet first: {extra:.2%} more")
        if abs(ratio - 1) > BOUND:
            faults.append(f"{build.name}: {name} counted over stated is {ratio:.4f}")
        if worst > SIGMAS:
            faults.append(f"{build.name}: a bin of {name} is {worst:.1f} sd beyond {BOUND:.0%}")
    return faults


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("domecast")
    parser.add_argument("builds", nargs="+", type=Path)
    parser.add_argument("--photons", type=int, default=6_000_000, help="for each light")
    chosen = parser.parse_args()
    faults = []
    for build in chosen.builds:
        print(build.name)
        faults += compare(chosen.domecast, build, chosen.photons)
    for fault in faults:
        print(f"FAIL {fault}")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
