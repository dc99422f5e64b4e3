"""Looks from the camera of a build at its dots and markers, past the parts as they were written.

    python3 scripts/check_sight.py output/thumb24 [...]

Reads `constants/constants.json` and the parts' STL files, refracts in numpy (bisection on Snell's invariant for
points on the sheet, Newton on the sphere's points for dots), and casts each ray's way in air with trimesh. The LEDs,
magnets and springs are taken from `parts/assembly.glb`. At rest no ray of a dot (centre and rim) or of a marker's
rim may end on a part; a ray bent outwards by a tenth of its angle must end on one somewhere, or nothing was looked at.
"""
import json
import pathlib
import sys

import numpy as np
import trimesh

failed = 0
RIM = 16


def check(what, holds, detail=""):
    global failed
    failed += not holds
    print(f"{'ok  ' if holds else 'FAIL'} {what:<46} {detail}")


def air_rays(constants, points):
    """Start on the axis' pupil and end at the sheet's underside of the rays to points on or above the sheet's top.

    Through flat layers the invariant s = n sin(angle) is one for all of a ray: its reach sideways is the sum of
    thickness * s / sqrt(n^2 - s^2), which grows with s. The dome's silicone fills the rest of the way up.
    """
    sensor_from_camera = np.linalg.inv(np.array(constants["camera"]["camera_from_sensor"]))
    pupil = sensor_from_camera[:3, 3]
    layers = constants["optics"]["layers"]
    flat = [(l["index"], l["thickness_mm"]) for l in layers[1:] if l["thickness_mm"]]
    fill = layers[-1]["index"]
    under = -sum(d for _, d in flat)
    points = np.asarray(points, float)
    side = points[:, :2] - pupil[:2]
    reach = np.linalg.norm(side, axis=1)
    low, high = np.zeros(len(points)), np.ones(len(points))
    for _ in range(60):
        s = 0.5 * (low + high)
        far = (under - pupil[2]) * s / np.sqrt(1 - s * s)
        far += sum(d * s / np.sqrt(n * n - s * s) for n, d in flat)
        far += points[:, 2] * s / np.sqrt(fill * fill - s * s)
        low, high = np.where(far < reach, s, low), np.where(far < reach, high, s)
    s = 0.5 * (low + high)
    way = np.c_[s[:, None] * side / np.maximum(reach, 1e-300)[:, None], np.sqrt(1 - s * s)]
    ends = pupil + way * ((under - pupil[2]) / way[:, 2])[:, None]
    return pupil, ends, s


def rims(center, normal, radius):
    """Points round a disc."""
    first = np.cross(normal, [1.0, 0, 0] if abs(normal[0]) < 0.9 else [0, 1.0, 0])
    first /= np.linalg.norm(first)
    second = np.cross(normal, first)
    turn = np.linspace(0, 2 * np.pi, RIM, endpoint=False)
    return center + radius * (np.cos(turn)[:, None] * first + np.sin(turn)[:, None] * second)


def parts_of(folder, every=False):
    """What may stand in a ray, or every body but the sheet, by name, mm in the sensor frame at rest."""
    found = {name: trimesh.load_mesh(folder / "parts" / f"{name}.stl") for name in ("upper_platform", "lower_platform")}
    scene = trimesh.load_scene(folder / "parts" / "assembly.glb")
    # glTF: metres and Y up
    to_sensor = np.diag([1e3, 1e3, 1e3, 1.0]) @ np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1.0]])
    for node in scene.graph.nodes_geometry:
        transform, geometry = scene.graph[node]
        name = node if node in scene.graph.nodes_geometry else geometry
        name = name.removesuffix(" (closed)")
        kept_out = ("platform", "sheet") if every else ("platform", "sheet", "dome", "camera")
        if any(word in name for word in kept_out):
            continue
        mesh = scene.geometry[geometry].copy()
        mesh.apply_transform(to_sensor @ transform)
        found[name] = mesh
    return found


def blocked(meshes, pupil, ends):
    """Names of the parts that each ray meets before it ends, or None."""
    names, first = np.full(len(ends), None, object), np.full(len(ends), np.inf)
    way = ends - pupil
    length = np.linalg.norm(way, axis=1)
    for name, mesh in meshes.items():
        where, ray, _ = mesh.ray.intersects_location(np.tile(pupil, (len(ends), 1)), way, multiple_hits=True)
        far = np.linalg.norm(where - pupil, axis=1)
        for r, f in zip(ray, far):
            # the seat is in the plane in which the rays end
            if f < length[r] * (1 - 1e-6) and f < first[r]:
                names[r], first[r] = name, f
    return names


def dome_of(constants):
    """Radius and centre of the sphere that the dots lie on: below the sheet's top under a cap, above it on a cylinder."""
    optics = constants["optics"]
    return optics["dome_radius_mm"], np.array([0, 0, optics.get("dome_center_z_mm", 0.0)])


def base_of(constants):
    """Radius of the circle in which the dome meets the sheet."""
    radius, centre = dome_of(constants)
    return np.sqrt(radius**2 - min(centre[2], 0.0) ** 2)


def aims(constants):
    """Points whose rays must be free, by what they belong to: dots with their rims, rims of the markers."""
    radius, centre = dome_of(constants)
    dots = []
    for dot in constants["black_dots"]:
        rim = rims(np.array(dot["surface_mm"]), np.array(dot["normal"]), dot["diameter_mm"] / 2)
        rim -= centre
        rim = centre + rim * (radius / np.linalg.norm(rim, axis=1)[:, None])
        dots += [np.array(dot["surface_mm"]), *rim[rim[:, 2] >= 0]]
    markers = [
        point
        for marker in constants["white_markers"]
        for point in rims(np.array(marker["position_mm"]), np.array([0, 0, 1.0]), marker["diameter_mm"] / 2)
    ]
    return {"dots": dots, "white markers": markers}


def sights(folder):
    """What is looked at, whether all of it is in sight, and how that was found."""
    constants = json.loads((folder / "constants/constants.json").read_text())
    meshes = parts_of(folder)
    aimed = aims(constants)
    for what, points in aimed.items():
        if not points:
            continue
        pupil, ends, sines = air_rays(constants, points)
        names = blocked(meshes, pupil, ends)
        lost = [n for n in names if n is not None]
        detail = f"{len(ends)} rays, up to {np.degrees(np.arcsin(sines.max())):.1f} degrees"
        if lost:
            worst = max(set(lost), key=lost.count)
            first = np.degrees(np.arcsin(min(s for s, n in zip(sines, names) if n is not None)))
            detail += f"; {len(lost)} blocked from {first:.1f} degrees, most by {worst}"
        yield f"no {what[:-1]} is behind a part", not lost, detail
    # The check sees walls: rays spread by a third beyond the markers (the dome's rim without them) meet the platforms.
    rim = list(rims(np.zeros(3), np.array([0, 0, 1.0]), base_of(constants)))
    pupil, ends, _ = air_rays(constants, aimed["white markers"] or rim)
    wide = pupil + (ends - pupil) * np.array([1.33, 1.33, 1.0])
    yield "wider rays do meet parts", any(n is not None for n in blocked(meshes, pupil, wide)), ""


def check_build(folder):
    print(f"== {folder}: what the camera sees")
    print(f"     {', '.join(sorted(parts_of(folder)))}")
    for found in sights(folder):
        check(*found)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    for name in sys.argv[1:]:
        check_build(pathlib.Path(name))
    print(f"{failed} failed")
    sys.exit(1 if failed else 0)
