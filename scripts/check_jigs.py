#!/usr/bin/env python3
"""Puts sheet and dome into each printing jig of a build, and looks at them from where the pad comes.

    python3 scripts/check_jigs.py output/thumb24 [...]

The jig's STL alone says where the sheet lies: the largest flat region that is as wide as the sheet's file is the seat. From
it follow the stroke's direction in the sensor's frame and the dome's place, which must be those that `artwork/layout.json`
states for the pass: tilt, azimuth, and the dome's centre on the jig's axis half-way between the register pins. The sheet,
so placed, fits with the stated clearance and is held on its sides. Each dot of the pass, by its place on the dome in
`constants/constants.json`, lies where its place on the film says, and the way from it up along the stroke is free of jig and sheet.
"""
import json
import pathlib
import sys

import numpy as np
import trimesh

failed = 0


def check(what, holds, detail=""):
    global failed
    failed += not holds
    print(f"{'ok  ' if holds else 'FAIL'} {what:<52} {detail}")


def stroke(tilt_deg, azimuth_deg):
    """Turns a direction of the sensor's frame into the jig's: about the level line across the azimuth, by the tilt."""
    tilt, azimuth = np.radians([tilt_deg, azimuth_deg])
    axis = np.array([-np.sin(azimuth), np.cos(azimuth), 0])
    return trimesh.transformations.rotation_matrix(-tilt, axis)[:3, :3]


def seat_of(jig, sheet_size, normal):
    """Height along the normal of the flat region that carries the sheet: the largest one that faces that way and is
    no wider than the sheet with its clearance."""
    facing = jig.face_normals @ normal > 1 - 1e-6
    heights = jig.triangles_center @ normal
    areas = {}
    for height, area in zip(np.round(heights[facing], 3), jig.area_faces[facing]):
        areas[height] = areas.get(height, 0.0) + area
    fitting = {h: a for h, a in areas.items() if a <= 1.1 * sheet_size[0] * sheet_size[1]}
    seat = max(fitting, key=fitting.get)
    # the group's own height, not the rounded one
    return np.mean(heights[facing & (np.abs(heights - seat) < 1e-3)])


def check_jig(jig, sheet, hit, dots, name, sphere):
    turn = stroke(hit["tilt_deg"], hit["azimuth_deg"])
    normal = turn @ [0, 0, 1]
    low, high = sheet.bounds
    size, thick = (high - low)[:2], high[2] - low[2]
    seat = seat_of(jig, size, normal)
    # the sheet's underside on the seat, the centre of the dome's sphere on the jig's axis
    aside = -(turn @ sphere)[:2]
    centre_z = (seat + thick - normal[:2] @ aside) / normal[2]
    place = np.eye(4)
    place[:3, :3] = turn
    place[:3, 3] = [*aside, centre_z]
    held = sheet.copy()
    held.apply_transform(place)
    common = trimesh.boolean.intersection([jig, held], engine="manifold")
    shared = 0.0 if common.is_empty else abs(common.volume)
    check(f"{name}: the sheet fits in", shared < 1e-2, f"{shared:.1e} mm^3 shared")

    # rays from the sheet's middle plane outwards: all four sides are held, by a gap that is the same on opposite ones
    middle = place[:3, :3] @ [0, 0, -0.75 * thick] + place[:3, 3]
    gaps = []
    for way in ([1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]):
        way = np.array(way, float)
        across = np.array([-way[1], way[0], 0])
        # beside the finger slot
        starts = [middle + turn @ (across * s * 0.4 * size[0]) for s in (-1, 1)]
        hits, _, _ = jig.ray.intersects_location(starts, [turn @ way] * 2, multiple_hits=False)
        reach = [abs((h - middle) @ (turn @ way)) - size[0 if way[0] else 1] / 2 for h in hits]
        gaps.append(max(reach) if len(reach) == 2 else np.inf)
    check(f"{name}: held on four sides", max(gaps) < 0.5 and min(gaps) > 0, " ".join(f"{g:.3f}" for g in gaps))
    check(f"{name}: the dome's centre is on the axis", max(abs(gaps[0] - gaps[1]), abs(gaps[2] - gaps[3])) < 1e-3)
    floor = [middle + turn @ [x * size[0], y * size[1], 0] for x in (-0.35, 0.35) for y in (-0.45, 0.45)]
    below, _, _ = jig.ray.intersects_location(floor, [-normal] * 4, multiple_hits=False)
    on = [(b - place[:3, 3]) @ normal + thick for b in below]
    check(f"{name}: the sheet lies on its seat", len(on) == 4 and np.abs(on).max() < 1e-3)

    surface = np.array([d["surface_mm"] for d in dots])
    turned = (surface - sphere) @ turn.T
    film = np.abs(turned[:, :2] - [d["plate_mm"] for d in dots]).max()
    check(f"{name}: dots lie under their film", film < 1e-9, f"{len(dots)} dots, {film:.1e} mm")
    starts = turned + turn @ sphere + place[:3, 3] + 1e-3 * turned / np.linalg.norm(turned, axis=1)[:, None]
    ways = np.tile([0, 0, 1.0], (len(dots), 1))
    free = not (jig.ray.intersects_any(starts, ways).any() or held.ray.intersects_any(starts, ways).any())
    steep = np.degrees(np.arccos(turned[:, 2] / np.linalg.norm(turned, axis=1))).max()
    check(f"{name}: the stroke reaches every dot", free, f"up to {steep:.1f} degrees from it")
    highest = max(jig.vertices[:, 2].max(), held.vertices[:, 2].max()) - centre_z
    radius = np.linalg.norm(surface - sphere, axis=1).mean() + (turn @ sphere)[2]
    check(f"{name}: the pad meets the dome first", highest < radius, f"sheet and jig {radius - highest:.2f} mm lower")


def check_build(build):
    print(build)
    layout = json.loads((build / "artwork/layout.json").read_text())
    constants = json.loads((build / "constants/constants.json").read_text())
    dots, sphere = constants["black_dots"], np.array([0, 0, constants["optics"].get("dome_center_z_mm", 0.0)])
    sheet = trimesh.load_mesh(build / "parts/acrylic_sheet.stl")
    hits = layout["hits"]
    turns = np.array([stroke(h["tilt_deg"], h["azimuth_deg"])[2] for h in hits])
    # a dot belongs to the pass whose film shows it; between two that are equally near, the film decides
    by_pass = [[] for _ in hits]
    for dot in dots:
        at = np.array(dot["surface_mm"]) - sphere
        off = [np.abs((stroke(h["tilt_deg"], h["azimuth_deg"]) @ at)[:2] - dot["plate_mm"]).max() for h in hits]
        by_pass[int(np.argmin(off))].append(dot)
    nearest = [(turns @ d["normal"]).max() - turns[i] @ d["normal"] for i, group in enumerate(by_pass) for d in group]
    check("each dot is in its nearest pass", max(nearest) < 1e-9)
    check("passes have the dots that they state", [len(g) for g in by_pass] == [h["dots"] for h in hits])
    for index, (hit, group) in enumerate(zip(hits, by_pass)):
        name = "print_jig" if len(hits) == 1 else f"print_jig_{index}"
        check_jig(trimesh.load_mesh(build / f"parts/{name}.stl"), sheet, hit, group, name, sphere)


def main(*builds):
    for build in map(pathlib.Path, builds):
        check_build(build)
    print("all jigs hold" if failed == 0 else f"{failed} faults")
    return 1 if failed else 0


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
