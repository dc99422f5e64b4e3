#!/usr/bin/env python3
"""Photons counted where they meet the dome: lamps under its middle, under the edge of its foot, and outside of it.

    count_photons.py          counts, and writes tests/cases/photons_at_the_foot.json
    count_photons.py --check  counts a tenth as many, and compares with that file

Each photon is followed by itself: drawn on the lamp's square by Lambert's law, with one of the two polarisations, and at
each face reflected or let through at random by Fresnel's equations. In the sheet it may be thrown up and down. Through the
sheet's top it gets into the dome under the dome's foot only; beside it, into air, and is lost. Nothing here knows domecast's formulas.
"""

import json
import math
import sys
from pathlib import Path

import numpy as np

FILE = Path(__file__).resolve().parent.parent / "tests" / "cases" / "photons_at_the_foot.json"
RADIUS, SHEET, HALF_SIDE = 7.0, 1.0, 12.0
ACRYLIC, SILICONE = 1.494, 1.412
LAMP_SIDE = 1.0
# distance from the axis, height, tilt of the facing direction from straight up towards the axis
LAMPS = {
    "inside": (4.0, -3.3, 30.0),
    "under": (7.0, -3.0, 60.0),
    "outside": (9.07, -3.3, 85.0),
}
POLAR = [0, 15, 30, 45, 60, 75, 90]
AZIMUTHS = 12
BATCH, BATCHES = 1_000_000, 160
MAX_FACES = 24


def reflects(generator, is_s, n_from, n_to, cos):
    """Whether each photon is reflected, and its cosine to the axis behind the face."""
    sin = n_from / n_to * np.sqrt(np.maximum(1 - cos * cos, 0))
    total = sin >= 1
    behind = np.sqrt(np.maximum(1 - sin * sin, 0))
    s = (n_from * cos - n_to * behind) / np.maximum(n_from * cos + n_to * behind, 1e-300)
    p = (n_to * cos - n_from * behind) / np.maximum(n_to * cos + n_from * behind, 1e-300)
    chance = np.where(total, 1.0, np.where(is_s, s * s, p * p))
    return generator.uniform(size=len(cos)) < chance, behind


def lamp(generator, place, count):
    """Places and directions of photons of a lamp at azimuth 0."""
    radius, z, tilt_deg = place
    tilt = math.radians(tilt_deg)
    facing = np.array([-math.sin(tilt), 0.0, math.cos(tilt)])
    up = np.array([math.cos(tilt), 0.0, math.sin(tilt)])
    side = np.array([0.0, 1.0, 0.0])
    at = generator.uniform(-0.5 * LAMP_SIDE, 0.5 * LAMP_SIDE, (2, count))
    points = np.array([radius, 0.0, z]) + at[0][:, None] * up + at[1][:, None] * side
    square = generator.uniform(size=count)
    turn = generator.uniform(0, 2 * math.pi, count)
    cos, sin = np.sqrt(1 - square), np.sqrt(square)
    ways = cos[:, None] * facing + (sin * np.cos(turn))[:, None] * up + (sin * np.sin(turn))[:, None] * side
    return points, ways


def moved(at, aside, cos, height):
    """Where photons are after they have risen or sunk by a height."""
    return at + aside * (height * np.sqrt(np.maximum(1 - cos * cos, 0)) / np.maximum(cos, 1e-12))[:, None]


def count(generator, place):
    """Photons of a batch that meet each bin of the dome."""
    points, ways = lamp(generator, place, BATCH)
    rising = ways[:, 2] > 1e-9
    points, ways = points[rising], ways[rising]
    is_s = generator.uniform(size=len(ways)) < 0.5
    cos = ways[:, 2]
    flat = ways[:, :2]
    aside = flat / np.maximum(np.linalg.norm(flat, axis=1), 1e-300)[:, None]
    at = moved(points[:, :2], aside, cos, -SHEET - points[:, 2])
    back, inside = reflects(generator, is_s, 1.0, ACRYLIC, cos)
    keep = ~back & (np.abs(at) <= HALF_SIDE).all(axis=1)
    at, aside, cos, is_s = at[keep], aside[keep], inside[keep], is_s[keep]
    hits = np.zeros((len(POLAR) - 1, AZIMUTHS))
    goes_up = True
    for _ in range(MAX_FACES):
        if not len(at):
            break
        at = moved(at, aside, cos, SHEET)
        on_sheet = (np.abs(at) <= HALF_SIDE).all(axis=1)
        at, aside, cos, is_s = at[on_sheet], aside[on_sheet], cos[on_sheet], is_s[on_sheet]
        in_foot = np.hypot(at[:, 0], at[:, 1]) <= RADIUS
        beyond = np.where(in_foot, SILICONE, 1.0) if goes_up else np.ones(len(at))
        back, behind = reflects(generator, is_s, ACRYLIC, beyond, cos)
        if goes_up:
            into = ~back & in_foot
            hits += meet(at[into], aside[into], behind[into])
        at, aside, cos, is_s = at[back], aside[back], cos[back], is_s[back]
        goes_up = not goes_up
    return hits


def meet(at, aside, cos):
    """Where photons from places of the foot meet the dome, counted by bins."""
    way = np.column_stack([aside * np.sqrt(np.maximum(1 - cos * cos, 0))[:, None], cos])
    start = np.column_stack([at, np.zeros(len(at))])
    along = (start * way).sum(axis=1)
    far = -along + np.sqrt(np.maximum(along**2 - (start**2).sum(axis=1) + RADIUS**2, 0))
    end = start + far[:, None] * way
    polar = np.degrees(np.arccos(np.clip(end[:, 2] / RADIUS, 0, 1)))
    # the first bin looks at the lamp with its middle
    azimuth = (np.degrees(np.arctan2(end[:, 1], end[:, 0])) + 180 / AZIMUTHS) % 360
    return np.histogram2d(polar, azimuth, bins=[POLAR, np.linspace(0, 360, AZIMUTHS + 1)])[0]


def bin_mm2(ring):
    low, high = (math.cos(math.radians(polar)) for polar in POLAR[ring : ring + 2])
    return 2 * math.pi * RADIUS**2 * (low - high) / AZIMUTHS


def measure(name, batches):
    """Mean irradiance of each bin for a flux of 1, mirrored halves averaged, and the share that comes to the dome."""
    generator = np.random.default_rng([ord(c) for c in name])
    hits = sum(count(generator, LAMPS[name]) for _ in range(batches))
    hits = 0.5 * (hits + hits[:, (-np.arange(AZIMUTHS)) % AZIMUTHS])
    total = batches * BATCH
    per_mm2 = [[hits[r, k] / total / bin_mm2(r) for k in range(AZIMUTHS)] for r in range(len(POLAR) - 1)]
    return {"irradiance": per_mm2, "share": hits.sum() / total}


def main():
    check = sys.argv[1:] == ["--check"]
    if sys.argv[1:] and not check:
        sys.exit(f"usage: {sys.argv[0]} [--check]")
    found = {name: measure(name, BATCHES // 10 if check else BATCHES) for name in LAMPS}
    if not check:
        lamps = {
            name: {"radius_mm": radius, "z_mm": z, "tilt_deg": tilt, **found[name]}
            for name, (radius, z, tilt) in LAMPS.items()
        }
        held = {
            "made_by": "scripts/count_photons.py",
            "photons": BATCH * BATCHES,
            "dome_radius_mm": RADIUS,
            "sheet_mm": SHEET,
            "sheet_half_mm": HALF_SIDE,
            "acrylic_index": ACRYLIC,
            "silicone_index": SILICONE,
            "lamp_side_mm": LAMP_SIDE,
            "polar_edges_deg": POLAR,
            "azimuths": AZIMUTHS,
            "lamps": lamps,
        }
        FILE.write_text(json.dumps(held, indent=1) + "\n")
        print(f"wrote {FILE.name}: " + ", ".join(f"{n} {found[n]['share']:.5f}" for n in LAMPS))
        return
    held = json.loads(FILE.read_text())["lamps"]
    bad = False
    for name in LAMPS:
        a, b = (np.array(one[name]["irradiance"]) for one in (held, found))
        off = np.abs(a - b) / np.maximum(a, 0.1 * a.max())
        share = found[name]["share"] / held[name]["share"] - 1
        print(f"{name}: {off.size} bins, at most {100 * off.max():.2f} % from the file, all together {100 * share:.2f} %")
        bad |= bool(off.max() > 0.03 or abs(share) > 0.005)
    sys.exit(bad)


if __name__ == "__main__":
    main()
