#!/usr/bin/env python3
"""The light on the edges of the platforms' shadows, pixel by pixel, against a sum over each emitter of its own.

    check_shadow_edges.py DOMECAST BUILD...   [--windows N]

Each build's sensor is drawn at rest with nothing but its lights: no dots, a membrane that hardly lights itself, one index for all
colours. Where a light is half hidden, squares of pixels are drawn by lot, half of them among the steepest edges. For each pixel of
them each light's square is summed from 1,024 points of it: Snell's way through sheet and silicone by Newton's method, Fresnel's
equations, the tape's lobe by quadrature, and the way in air past the triangles of the built platforms (Embree, by trimesh). Between
that sum and the frame stands a gain with two terms over the distance from the axis, fitted for each colour: what leaves towards the
camera. All light is judged elsewhere; here it is the edges' form.

It fails where a pixel is off by more than `MAX_LEVELS` of 255, one in a thousand by more than `P999_LEVELS`, or where levels come
in beads: the error less its mean over the pixels around it, `BEADS_LEVELS` at one in a hundred of the pixels.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from check_light_by_photons import BEFORE, COLORS, Sensor, index_of
from PIL import Image
from scipy.ndimage import uniform_filter

MAX_LEVELS, P999_LEVELS, BEADS_LEVELS = 8.0, 6.0, 1.5
SIDE, AROUND, POINTS = 16, 9, 1024
# pixels summed at a time
AT_ONCE = 512
DIM = 0.02
# Gauss's rule over the square, for a light that is seen whole
ROOTS, LINE = np.polynomial.legendre.leggauss(4)
GAUSS = np.stack(np.meshgrid(ROOTS, ROOTS), axis=-1).reshape(-1, 2)
WEIGHTS = 0.25 * np.outer(LINE, LINE).ravel()
# heights that are left out, parts of the radius
RIM = 0.08


def lobe(leds):
    """Intensity by cosine, for a flux of one: of the emitter, and behind its tape."""
    cos = (np.arange(200) + 0.5) / 200
    power = leds["lobe_exponent"]
    bare = (power + 1) / (2 * np.pi) * cos**power
    tape = leds.get("diffuser")
    if tape is None:
        return lambda c: np.interp(c, cos, bare)
    turn = (np.arange(256) + 0.5) / 256 * 2 * np.pi
    sine = np.sqrt(1 - cos * cos)
    between = cos[:, None, None] * cos[None, :, None] + sine[:, None, None] * sine[None, :, None] * np.cos(turn)
    width = np.radians(tape["lobe_width_deg"])
    # from each way in (rows) to each way out: as photons are drawn, none of them lost
    to = cos * np.exp(-np.arccos(np.clip(between, -1, 1)) ** 2 / (2 * width**2)).mean(axis=2)
    to /= to.sum(axis=1, keepdims=True)
    share = bare / bare.sum()
    solid = 2 * np.pi / len(cos)
    lambert = tape["lambert_fraction"]
    out = tape["transmittance"] * (lambert * cos / np.pi + (1 - lambert) * share @ to / solid)
    return lambda c: np.interp(c, cos, out)


def ways(sheet_mm, indices, from_z, reach, height):
    """Sine in air of Snell's way from points under the sheet to points `height` over it and `reach` aside."""
    acrylic, silicone = indices
    gap = -sheet_mm - from_z
    # the unknown is the tangent in air: its reach grows with it, concave
    t = reach / (gap + sheet_mm / acrylic + height / silicone)
    for _ in range(30):
        s2 = t * t / (1 + t * t)
        a, b = 1 / np.sqrt(acrylic**2 - s2), 1 / np.sqrt(silicone**2 - s2)
        s = np.sqrt(s2)
        off = gap * t + s * (sheet_mm * a + height * b) - reach
        slope = gap + (1 + t * t) ** -1.5 * (sheet_mm * acrylic**2 * a**3 + height * silicone**2 * b**3)
        t = np.maximum(t - off / slope, 0)
        if np.abs(off).max(initial=0) < 1e-7:
            break
    return t / np.sqrt(1 + t * t)


def passed(n_from, n_to, sine):
    """What Fresnel's equations let through a face, of light without polarisation; `sine` in air."""
    one, two = np.sqrt(1 - (sine / n_from) ** 2), np.sqrt(1 - (sine / n_to) ** 2)
    s = (n_from * one - n_to * two) / (n_from * one + n_to * two)
    p = (n_to * one - n_from * two) / (n_to * one + n_from * two)
    return 1 - s * s, 1 - p * p


class Light:
    def __init__(self, sensor, led, spread):
        center, self.facing, up, side = sensor.pose(led)
        half = 0.5 * sensor.leds["emitter_mm"]
        self.points = center + half * (spread[:, :1] * side + spread[:, 1:] * up)
        self.flux = sensor.leds["radiant_flux_mw"][led["color"][0]]

    def shares(self, sensor, places, normals, some):
        """What some of the light's points give places of the dome, mW/mm^2 for the whole light's flux, and whether they see them."""
        source = self.points[some][None, :, :]
        aside = places[:, None, :2] - source[..., :2]
        reach = np.linalg.norm(aside, axis=2)
        aside /= np.maximum(reach, 1e-12)[..., None]
        gap = -sensor.sheet_mm - source[..., 2]
        height = places[:, None, 2]
        acrylic, silicone = sensor.indices
        sine = ways(sensor.sheet_mm, sensor.indices, source[..., 2], reach, height)
        cos = np.sqrt(1 - sine * sine)
        under = source[..., :2] + aside * (gap * sine / cos)[..., None]
        a, b = np.sqrt(acrylic**2 - sine**2), np.sqrt(silicone**2 - sine**2)
        at_top = under + aside * (sensor.sheet_mm * sine / a)[..., None]
        way = np.concatenate([aside * sine[..., None], cos[..., None]], axis=2)
        # solid angle in air for an area across the way in the silicone: the tube's two widths, aside and along
        cos_in = b / silicone
        along = gap / cos**3 + sensor.sheet_mm * acrylic**2 / a**3 + height * silicone**2 / b**3
        ring = gap / cos + sensor.sheet_mm / a + height / b
        per_mm2 = 1 / np.maximum(along * ring * cos * cos_in, 1e-300)
        s1, p1 = passed(1.0, acrylic, sine)
        s2, p2 = passed(acrylic, silicone, sine)
        arriving = np.concatenate([aside * (sine / silicone)[..., None], cos_in[..., None]], axis=2)
        flux = self.flux * sensor.lobe(way @ self.facing) * 0.5 * (s1 * s2 + p1 * p2) * per_mm2
        flux *= np.maximum(np.einsum("pni,pi->pn", arriving, normals), 0) * (way @ self.facing > 0)
        sees = (np.abs(under) <= sensor.half_sheet).all(axis=2) & (np.linalg.norm(at_top, axis=2) <= sensor.rim)
        starts = np.broadcast_to(source, way.shape)[sees]
        sees[sees] = ~sensor.below.intersects_any(starts, way[sees])
        return flux, sees


def spread(count):
    """Points evenly over the square from -1 to 1 (the R2 sequence of M. Roberts): a straight edge cuts them without steps. Then Gauss's."""
    step = np.array([0.7548776662466927, 0.5698402909980532])
    even = 2 * ((0.5 + np.arange(1, count + 1)[:, None] * step) % 1) - 1
    return np.concatenate([even, GAUSS])


def irradiance(sensor, lights, places, normals, points):
    """Of the red, green and blue lights; and of each, whether one of them is half hidden."""
    out, half = np.zeros((len(places), 3)), np.zeros((len(places), 3), bool)
    few, gauss = slice(0, 32), slice(-len(WEIGHTS), None)
    for color, light in lights:
        for begin in range(0, len(places), AT_ONCE):
            span = slice(begin, begin + AT_ONCE)
            _, sees = light.shares(sensor, places[span], normals[span], few)
            flux, whole = light.shares(sensor, places[span], normals[span], gauss)
            edge = ~(sees.all(axis=1) & whole.all(axis=1)) & (sees.any(axis=1) | whole.any(axis=1))
            out[span, color] += np.where(edge, 0, (flux * whole) @ WEIGHTS)
            half[span, color] |= edge
            if edge.any():
                more = np.flatnonzero(edge) + begin
                flux, sees = light.shares(sensor, places[more], normals[more], slice(0, points))
                out[more, color] += (flux * sees).mean(axis=1)
    return out, half


def drawn(domecast, design, folder):
    """Levels of a frame at rest, of 255, and each pixel's place on the dome."""
    level, shown = 200.0, None
    for step in range(2):
        leds = {"level_per_mw_mm2": level, "stray_level": 0, "crosstalk": 0}
        leds["why"] = dict.fromkeys(leds, "choice: only the lights")
        scene = {
            "version": 1, "name": "edges", "design": str(design), "frames": {"count": 1, "rate_hz": 30},
            "tolerance": {"px": 0.02, "grey": 0.5}, "ink": {"reflectance": 1},
            "light": {"surround_level": 0, "leds": leds},
        }
        (folder / "scene.json").write_text(json.dumps(scene))
        out = folder / f"frame-{step}"
        command = [domecast, "simulate", str(folder / "scene.json"), "--depth", "--out", str(out), "--quiet"]
        subprocess.run(command, check=True)
        shown = np.array(Image.open(out / "frame_0000.png").convert("RGB"), float)
        lit = shown[shown < 255]
        level *= 220 / max(np.percentile(lit[lit > 0], 99.9), 1.0) if lit.any() else 0.1
    return shown, np.load(out / "frame_0000.surface.npy").astype(float)


def windows(generator, steep, count):
    """Corners of squares on shadows' edges, half of them where the light changes most from a pixel to the next."""
    at = np.argwhere(steep > 0)
    steepest = at[np.argsort(-steep[tuple(at.T)], kind="stable")[: max(len(at) // 8, count)]]
    chosen = np.concatenate([generator.permutation(steepest)[: count // 2], generator.permutation(at)[: count - count // 2]])
    limit = np.array(steep.shape) - SIDE
    return np.unique(np.clip(chosen - SIDE // 2, 0, limit), axis=0)


def compare(domecast, build, count):
    sensor = Sensor(domecast, build)
    for layer in sensor.layers:
        layer["index"] = index_of(layer, 1)
    sensor.indices = [layer["index"] for layer in sensor.layers]
    sensor.lobe = lobe(sensor.leds)
    walls = sensor.walls.slice_plane([0, 0, -sensor.sheet_mm - BEFORE], [0, 0, -1])
    sensor.below = type(sensor.rays)(walls)
    lights = [(COLORS[led["color"]], Light(sensor, led, spread(POINTS))) for led in sensor.leds["list"]]
    design = json.loads((build / "design.json").read_text())
    design.setdefault("optics", {})["layers"] = sensor.layers
    design.setdefault("elastomer", {})["membrane_reflectance"] = dict.fromkeys("rgb", DIM)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "design.json").write_text(json.dumps(design))
        levels, surface = drawn(domecast, folder / "design.json", folder)
    on_dome = np.isfinite(surface).all(axis=2)
    middle = np.array([0, 0, sensor.center_z])
    normals = (surface - middle) / sensor.radius
    on_dome &= surface[..., 2] > RIM * sensor.radius
    # where lights are half hidden, at every fourth pixel
    coarse = on_dome[::4, ::4]
    light, half = np.zeros((*coarse.shape, 3)), np.zeros((*coarse.shape, 3), bool)
    light[coarse], half[coarse] = irradiance(sensor, lights, surface[::4, ::4][coarse], normals[::4, ::4][coarse], 64)
    steep = np.hypot(*np.gradient(light, axis=(0, 1))).max(axis=2) / max(light.max(), 1e-300)
    edge = np.zeros(on_dome.shape)
    edge[::4, ::4] = np.where(half.any(axis=2), np.maximum(steep, 1e-12), 0)
    if not edge.any():
        print(f"{build.name}: no shadow's edge on the dome")
        return []
    corners = windows(np.random.default_rng(7), edge, count)
    rows, columns = (corners[:, k, None, None] + np.arange(SIDE)[:, None] * (k == 0) + np.arange(SIDE) * (k == 1) for k in (0, 1))
    rows, columns = np.broadcast_arrays(rows, columns)
    held = on_dome[rows, columns] & (levels[rows, columns].max(axis=-1) < 254)
    places = surface[rows, columns]
    known, half = np.zeros(places.shape), np.zeros(places.shape, bool)
    known[held], half[held] = irradiance(sensor, lights, places[held], normals[rows, columns][held], POINTS)
    faults, all_off, all_beads = [], [], []
    for color in range(3):
        shown, own = levels[rows, columns, color], known[..., color]
        aside = (places[..., :2] ** 2).sum(axis=-1) / sensor.radius**2
        terms = np.stack([own, own * aside, own * aside**2, np.ones_like(own)], axis=-1)
        fit = np.linalg.lstsq(terms[held], shown[held], rcond=None)[0]
        off = np.where(held, shown - np.where(held[..., None], terms, 0) @ fit, 0)
        weight = held.astype(float)
        size = (0, AROUND, AROUND)
        mean = uniform_filter(off, size, mode="constant") / np.maximum(uniform_filter(weight, size, mode="constant"), 1e-9)
        counts = held & half[..., color]
        all_off.append(np.abs(off[counts]))
        all_beads.append(np.abs(off - mean)[counts])
    off, beads = np.concatenate(all_off), np.concatenate(all_beads)
    if not len(off):
        return [f"{build.name}: no pixel on an edge"]
    found = [off.max(), np.percentile(off, 99.9), np.percentile(beads, 99)]
    text = f"{len(off)} levels on {len(corners)} squares off by at most {found[0]:.1f}, 1 in 1000 by {found[1]:.1f}, beads of {found[2]:.2f}"
    print(f"{build.name}: {text}; root mean square {np.sqrt((off**2).mean()):.2f}")
    if any(value > bound for value, bound in zip(found, (MAX_LEVELS, P999_LEVELS, BEADS_LEVELS))):
        faults.append(f"{build.name}: {text}; allowed {MAX_LEVELS}, {P999_LEVELS}, {BEADS_LEVELS}")
    return faults


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("domecast")
    parser.add_argument("builds", nargs="+", type=Path)
    parser.add_argument("--windows", type=int, default=32)
    chosen = parser.parse_args()
    faults = [fault for build in chosen.builds for fault in compare(chosen.domecast, build, chosen.windows)]
    for fault in faults:
        print(f"FAIL {fault}")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
