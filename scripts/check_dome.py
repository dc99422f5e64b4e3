#!/usr/bin/env python3
"""Measures the dome of a build by its files, against closed forms of cap, hemisphere and cylinder.

    python3 scripts/check_dome.py output/digit-rigid [...]

From `design.json` only the four numbers are taken that say what was asked for: radius, rim angle, cylinder, shrinkage
with sealer. The dome of `parts/assembly.glb` must lie on that face and enclose its volume; so must the silicone that
the mould's cavity holds, less a sealer's thickness all round, after it has shrunk. Dots lie on the sphere, and the ray
through each, by Snell's law and the lens's formula in numpy, ends in the pixel that the constants state. Where the robot's
files name a mesh of the dome, it is closed and encloses the volume too.
"""
import json
import pathlib
import sys

import numpy as np
import trimesh

from check_sight import air_rays, check, dome_of
import check_sight


def whole_design(folder):
    """The design with the fields that rules gave."""
    design = json.loads((folder / "design.json").read_text())
    derived = folder / "derived.json"
    for given in json.loads(derived.read_text()) if derived.exists() else []:
        place = design
        *path, last = given["field"].split(".")
        for key in path:
            place = place.setdefault(key, {})
        place.setdefault(last, given["value"])
    return design


def shape_of(design):
    """Radius, height of the sphere's centre, rim radius, height and volume of the dome that was asked for."""
    dome = design["dome"]
    radius, rim = dome["radius_mm"], np.radians(dome.get("rim_angle_deg", 90.0))
    pillar = dome.get("cylinder_height_mm", 0.0)
    height = radius * (1 - np.cos(rim)) + pillar
    volume = np.pi * radius**3 * (2 + np.cos(rim)) * (1 - np.cos(rim)) ** 2 / 3 + np.pi * radius**2 * pillar
    return radius, height - radius, radius * np.sin(rim), height, volume


def off_face(points, radius, centre, heights):
    """Distance of points from sphere or cylinder; those on the base, z = 0, are left out."""
    above = points[:, 2] - centre
    above = np.where((centre > 0) & (above < 0), 0.0, above)
    off = np.sqrt(points[:, 0] ** 2 + points[:, 1] ** 2 + above**2) - radius
    inside = (points[:, 2] > heights[0]) & (points[:, 2] < heights[1])
    return np.abs(off[inside]).max()


def brown(matrix, k, ray):
    """Brown-Conrady with five numbers."""
    x, y = ray[:, 0] / ray[:, 2], ray[:, 1] / ray[:, 2]
    r2 = x * x + y * y
    k1, k2, p1, p2, k3 = (list(k) + [0] * 5)[:5]
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    v = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    m = np.array(matrix)
    return np.c_[m[0, 0] * u + m[0, 1] * v + m[0, 2], m[1, 1] * v + m[1, 2]]


def say(what, holds, detail=""):
    return what, holds, detail


def dots(constants):
    points = np.array([d["surface_mm"] for d in constants["black_dots"]])
    pixels = np.array([d["image_px"] for d in constants["black_dots"]])
    radius, centre = dome_of(constants)
    off = np.abs(np.linalg.norm(points - centre, axis=1) - radius).max()
    yield say("dots lie on the sphere", off < 1e-9 and points[:, 2].min() > 0, f"{len(points)} dots, {off:.1e} mm")
    camera = constants["camera"]
    if camera["model"] != "brown_conrady" or len(camera["distortion"]) > 5 or camera.get("pupil_shift_mm"):
        return
    pupil, ends, _ = air_rays(constants, points)
    ray = (ends - pupil) @ np.array(camera["camera_from_sensor"])[:3, :3].T
    off = np.abs(brown(camera["matrix"], camera["distortion"], ray) - pixels).max()
    yield say("each dot's ray ends in its pixel", off < 1e-6, f"{off:.1e} px")


def measured(folder):
    """What is measured, whether it holds, and how well."""
    design = whole_design(folder)
    constants = json.loads((folder / "constants/constants.json").read_text())
    radius, centre, rim, height, volume = shape_of(design)
    found = dome_of(constants)
    yield say("constants carry the shape", abs(found[0] - radius) + abs(found[1][2] - centre) < 1e-9)
    yield from dots(constants)
    scene = trimesh.load_scene(folder / "parts" / "assembly.glb")
    name = next(n for n in scene.graph.nodes_geometry if n.startswith("dome") and "membrane" not in n)
    transform, geometry = scene.graph[name]
    mesh = scene.geometry[geometry].copy()
    mesh.apply_transform(np.diag([1e3, 1e3, 1e3, 1.0]) @ np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1.0]]) @ transform)
    mesh.merge_vertices(digits_vertex=6)
    base = mesh.bounds[0][2]
    at = mesh.vertices - [0, 0, base]
    yield say("the assembly's dome has rim and height", np.allclose(mesh.extents, [2 * rim, 2 * rim, height], atol=0.03), f"{mesh.extents}")
    off = off_face(at, radius, centre, (1e-4, 1e9))
    yield say("its corners lie on the face", off < 1e-3, f"{off:.1e} mm")
    yield say("it encloses the volume", mesh.is_watertight and 0 < 1 - mesh.volume / volume < 0.01, f"{mesh.volume:.1f} of {volume:.1f} mm^3")
    # What the mould casts: its cavity below the parting plane, upside down.
    cavity = trimesh.load_mesh(folder / "parts/mould_cavity.stl")
    grow = 1 / (1 - 0.01 * design["elastomer"]["shrinkage_percent"])
    sealer = design["mould"]["sealer_thickness_mm"]
    reach = rim * grow + 2.0 * sealer + 1e-3
    near = cavity.vertices[np.linalg.norm(cavity.vertices[:, :2], axis=1) < reach]
    near = near * [1, 1, -1] - [0, 0, sealer]
    off = off_face(near, radius * grow + sealer, centre * grow, (1e-6, height * grow + 2 * sealer))
    tolerance = design.get("mesh", {}).get("optical_chord_tolerance_mm", 0.05)
    yield say("the mould's cavity is that face, grown", off < 2 * tolerance, f"{off:.1e} mm")
    block = trimesh.creation.box(bounds=[[-reach, -reach, -height * grow - 3 * sealer - 1e-3], [reach, reach, -sealer]])
    cast = trimesh.boolean.difference([block, cavity], engine="manifold")
    cast = max(cast.split(only_watertight=True), key=lambda body: body.volume)
    wall = sealer * 2 * np.pi * radius * height * grow**2
    yield say("it holds the shrunk dome's volume", abs((cast.volume - wall) / grow**3 / volume - 1) < 2e-3, f"{(cast.volume - wall) / grow**3:.2f} of {volume:.2f} mm^3")
    robot = folder / "constants/dome.obj"
    yield say("a dome that is no hemisphere has a mesh for robots", robot.exists() == (abs(centre) > 1e-9))
    if robot.exists():
        mesh = trimesh.load_mesh(robot)
        yield say("it is closed, and encloses the volume", mesh.is_watertight and 0 < 1 - mesh.volume / volume < 0.01, f"{mesh.volume:.1f} mm^3")


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    for name in sys.argv[1:]:
        print(f"== {name}: the dome")
        for found in measured(pathlib.Path(name)):
            check(*found)
    print(f"{check_sight.failed} failed")
    sys.exit(1 if check_sight.failed else 0)
