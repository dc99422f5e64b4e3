#!/usr/bin/env python3
"""The same sensor in Mitsuba 3: irradiance on the membrane, and where the camera sees dots.

    golden_light.py          renders, and writes tests/cases/golden_light.json
    golden_light.py --check  renders again, and compares with that file

Mitsuba traces light through the faces of sheet and silicone one by one, at random; domecast solves for the one way
between two points. The Rust tests compare domecast's numbers with the file. Nothing here knows domecast's formulas:
the diffuser is drawn photon by photon, the dots are meshes, and the faces are Mitsuba's dielectrics.
"""

import json
import math
import sys
from pathlib import Path

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
mi.set_log_level(mi.LogLevel.Warn)
T = mi.ScalarTransform4f
FILE = Path(__file__).resolve().parent.parent / "tests" / "cases" / "golden_light.json"

RADIUS = 10.0
SHEET = 1.0
ACRYLIC, SILICONE = 1.494, 1.412
PUPIL_Z = -10.0
FOCAL, WIDTH, HEIGHT = 138.56406460551017, 640, 480
# place of the light, its tilt to the base plane, and its side (0: a point), as in designs/thumb24.json
LIGHT = {"radius_mm": 9.07, "z_mm": -3.3, "tilt_deg": 85.0}
DIFFUSER = {"lambert_fraction": 0.6, "lobe_width_deg": 30.0}
POLAR = [0, 15, 30, 45, 60, 75]
AZIMUTHS = 12
# a spot light of Mitsuba ends somewhere; the Rust test leaves out what lies beyond
CUTOFF_DEG = 78.0


def hemisphere(name, radius, rings, columns, axis=None, reach=math.pi / 2):
    """A cap of a sphere about the origin as a mesh whose faces look inwards."""
    z = np.array([0.0, 0.0, 1.0]) if axis is None else np.asarray(axis) / np.linalg.norm(axis)
    x = np.cross([0.0, 1.0, 0.0] if abs(z[1]) < 0.9 else [1.0, 0.0, 0.0], z)
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    points = [radius * z]
    for i in range(1, rings + 1):
        polar = reach * i / rings
        for k in range(columns):
            a = 2 * math.pi * k / columns
            points.append(
                radius * (math.cos(polar) * z + math.sin(polar) * (math.cos(a) * x + math.sin(a) * y))
            )
    faces = [[0, 1 + (k + 1) % columns, 1 + k] for k in range(columns)]
    for i in range(rings - 1):
        low, high = 1 + i * columns, 1 + (i + 1) * columns
        for k in range(columns):
            j = (k + 1) % columns
            faces += [[low + k, low + j, high + k], [low + j, high + j, high + k]]
    mesh = mi.Mesh(name, len(points), len(faces))
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = np.asarray(points, dtype=np.float32).ravel().tolist()
    parameters["faces"] = np.asarray(faces, dtype=np.uint32).ravel().tolist()
    parameters.update()
    path = f"/tmp/golden_light_{name}.ply"
    mesh.write_ply(path)
    return path


def faces_of_the_sheet():
    """The sheet's underside, and its top where the dome is bonded to it."""
    return {
        "underside": {
            "type": "rectangle",
            "to_world": T().translate([0, 0, -SHEET]).scale(200.0),
            "bsdf": {"type": "dielectric", "int_ior": 1.0, "ext_ior": ACRYLIC},
        },
        "bond": {
            "type": "disk",
            "to_world": T().scale(RADIUS),
            "bsdf": {"type": "dielectric", "int_ior": ACRYLIC, "ext_ior": SILICONE},
        },
    }


def light_pose():
    """Centre, facing direction and the direction up the board, the light at azimuth 0."""
    tilt = math.radians(LIGHT["tilt_deg"])
    center = np.array([LIGHT["radius_mm"], 0.0, LIGHT["z_mm"]])
    facing = np.array([-math.sin(tilt), 0.0, math.cos(tilt)])
    up = np.array([math.cos(tilt), 0.0, math.sin(tilt)])
    return center, facing, up


def square_light(side):
    """A Lambertian square of flux 1."""
    center, facing, up = light_pose()
    pose = T().look_at(origin=center.tolist(), target=(center + facing).tolist(), up=up.tolist())
    radiance = 1.0 / (math.pi * side * side)
    return {
        "type": "rectangle",
        "to_world": pose @ T().scale(0.5 * side),
        "emitter": {"type": "area", "radiance": {"type": "rgb", "value": radiance}},
    }


def diffused(generator, count):
    """Cosines to the axis of photons behind the diffuser, drawn one by one."""
    def direction(cos):
        a = generator.uniform(0, 2 * math.pi, len(cos))
        sin = np.sqrt(1 - cos * cos)
        return np.stack([sin * np.cos(a), sin * np.sin(a), cos], axis=1)

    # Lambert's law has a uniform square of the cosine
    into = direction(np.sqrt(generator.uniform(0, 1, count)))
    out = direction(np.sqrt(generator.uniform(0, 1, count)))
    lobe = np.nonzero(generator.uniform(0, 1, count) >= DIFFUSER["lambert_fraction"])[0]
    width = math.radians(DIFFUSER["lobe_width_deg"])
    # density cos exp(-g^2 / 2 w^2) per solid angle, in the hemisphere ahead only: drawn until it is
    while len(lobe):
        # Rayleigh's law is g exp(-g^2 / 2 w^2); kept with the chance sin(g) / g
        g = width * np.sqrt(-2 * np.log(1 - generator.uniform(0, 1, len(lobe))))
        keep = (g < math.pi) & (generator.uniform(0, 1, len(lobe)) * g <= np.sin(g))
        a = generator.uniform(0, 2 * math.pi, len(lobe))
        axis = into[lobe]
        x = np.cross(axis, np.where(np.abs(axis[:, :1]) < 0.7, [[1.0, 0, 0]], [[0, 1.0, 0]]))
        x /= np.linalg.norm(x, axis=1, keepdims=True)
        y = np.cross(axis, x)
        new = np.cos(g)[:, None] * axis + np.sin(g)[:, None] * (np.cos(a)[:, None] * x + np.sin(a)[:, None] * y)
        keep &= generator.uniform(0, 1, len(lobe)) < new[:, 2]
        out[lobe[keep]] = new[keep]
        lobe = lobe[~keep]
    return out[:, 2]


def diffused_light(generator):
    """A point of flux 1 with the diffuser's intensity as the picture of a spot light."""
    count, bins = 4_000_000, 90
    histogram = np.zeros(bins)
    edges = np.cos(np.linspace(0, math.pi / 2, bins + 1))
    for _ in range(10):
        cosines = diffused(generator, count // 10)
        histogram += np.histogram(-cosines, -edges)[0]
    per_sr = histogram / count / (2 * math.pi * -np.diff(edges))
    middles = 0.5 * (np.arange(bins) + 0.5) * math.pi / bins
    size = 1001
    half = math.tan(math.radians(CUTOFF_DEG))
    at = (np.arange(size) + 0.5) / size * 2 - 1
    angle = np.arctan(half * np.hypot(at[:, None], at[None, :]))
    picture = np.interp(angle, middles, per_sr).astype(np.float32)
    center, facing, up = light_pose()
    return {
        "type": "spot",
        "to_world": T().look_at(origin=center.tolist(), target=(center + facing).tolist(), up=up.tolist()),
        "cutoff_angle": CUTOFF_DEG,
        "beam_width": CUTOFF_DEG - 1e-3,
        "intensity": {"type": "rgb", "value": 1.0},
        "texture": {
            "type": "bitmap",
            "bitmap": mi.Bitmap(np.repeat(picture[:, :, None], 3, axis=2)),
            "raw": True,
            "wrap_mode": "clamp",
        },
    }


def irradiance(light, samples):
    """Mean irradiance of the membrane in bins of polar angle and azimuth, for a flux of 1."""
    # so dark that what the membrane gives itself is nothing even where the light hardly comes
    pixels, albedo, fov = 400, 1e-4, 156.0
    scene = mi.load_dict(
        {
            "type": "scene",
            **faces_of_the_sheet(),
            "light": light,
            "membrane": {
                "type": "ply",
                "filename": hemisphere("membrane", RADIUS, 160, 320),
                "face_normals": False,
                "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": albedo}},
            },
            # a camera inside the silicone sees the membrane without any face between
            "sensor": {
                "type": "perspective",
                "to_world": T().look_at(origin=[0, 0, 1e-3], target=[0, 0, 1], up=[0, -1, 0]),
                "fov": fov,
                "near_clip": 1e-3,
                "film": {
                    "type": "hdrfilm", "width": pixels, "height": pixels, "pixel_format": "luminance",
                    "rfilter": {"type": "box"},
                },
            },
        }
    )
    integrator = mi.load_dict({"type": "ptracer", "max_depth": 8})
    image = np.array(integrator.render(scene, scene.sensors()[0], spp=samples, seed=1)).reshape(pixels, pixels)
    # each pixel in quarters of its sides, so that the bins' edges do not step
    image = image.repeat(4, axis=0).repeat(4, axis=1)
    pixels *= 4
    at = ((np.arange(pixels) + 0.5) / pixels * 2 - 1) * math.tan(math.radians(fov / 2))
    x, y = np.meshgrid(at, at)
    cos = 1 / np.sqrt(1 + x * x + y * y)
    weight = cos**3
    polar, azimuth = np.degrees(np.arccos(cos)), np.degrees(np.arctan2(y, x)) % 360
    bins = []
    for low, high in zip(POLAR, POLAR[1:]):
        row = []
        for k in range(AZIMUTHS):
            # the middle bin looks at the light
            turned = (azimuth + 180 / AZIMUTHS) % 360
            inside = (polar >= low) & (polar < high) & (np.floor(turned * AZIMUTHS / 360) == k)
            row.append(float(math.pi / albedo * (image * weight)[inside].sum() / weight[inside].sum()))
        bins.append(row)
    return bins


def dots():
    """Small caps of the dome: rings about the pole."""
    places = []
    for ring, polar_deg in enumerate([6, 17, 28, 39, 51]):
        count = 3 + 3 * ring
        for k in range(count):
            polar, azimuth = math.radians(polar_deg), 2 * math.pi * (k + 0.37 * ring) / count
            places.append(
                [
                    RADIUS * math.sin(polar) * math.cos(azimuth),
                    RADIUS * math.sin(polar) * math.sin(azimuth),
                    RADIUS * math.cos(polar),
                ]
            )
    return places


DOT_RADIUS = 0.35  # along the dome, as an arc, mm


def centroids(places, samples):
    """Centroid of each dot in the camera's image: dark caps on a shining membrane."""
    scene = {
        "type": "scene",
        **faces_of_the_sheet(),
        "membrane": {
            "type": "ply",
            "filename": hemisphere("membrane", RADIUS, 160, 320),
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 1.0}},
        },
        "sensor": {
            "type": "perspective",
            "to_world": T().look_at(origin=[0, 0, PUPIL_Z], target=[0, 0, 0], up=[0, -1, 0]),
            "fov": math.degrees(2 * math.atan(WIDTH / 2 / FOCAL)),
            "fov_axis": "x",
            "near_clip": 1e-2,
            "film": {
                "type": "hdrfilm", "width": WIDTH, "height": HEIGHT, "pixel_format": "luminance",
                "crop_offset_x": 120, "crop_offset_y": 40, "crop_width": 400, "crop_height": 400,
                "rfilter": {"type": "box"},
            },
            "sampler": {"type": "stratified"},
        },
    }
    for i, place in enumerate(places):
        scene[f"dot{i}"] = {
            "type": "ply",
            "filename": hemisphere(f"dot{i}", RADIUS - 5e-4, 3, 48, place, DOT_RADIUS / RADIUS),
            "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}},
        }
    loaded = mi.load_dict(scene)
    image = np.array(
        mi.load_dict({"type": "path", "max_depth": 6, "rr_depth": 100}).render(loaded, spp=samples, seed=2)
    ).reshape(400, 400)
    out = []
    for place in places:
        # about where it is, from the pinhole's own image of a point seen through the flat faces: searched
        u, v = seen(place)
        x0, y0 = int(round(u)) - 120 - 9, int(round(v)) - 40 - 9
        window = image[y0 : y0 + 19, x0 : x0 + 19]
        # the light varies over the window by Fresnel's losses alone: a plane through its border
        yy, xx = np.mgrid[0:19, 0:19]
        far = np.hypot(xx - (u - 120 - x0), yy - (v - 40 - y0)) > 6.5
        basis = np.stack([np.ones_like(xx), xx, yy], axis=2).astype(float)
        plane = basis @ np.linalg.lstsq(basis[far], window[far], rcond=None)[0]
        dark = np.where(far, 0.0, 1 - window / plane)
        out.append([float((dark * (xx + x0 + 120)).sum() / dark.sum()), float((dark * (yy + y0 + 40)).sum() / dark.sum())])
    return out


def seen(place):
    """Pixel of a point, by bisection of Snell's law: only to know where to look."""
    reach, z = math.hypot(place[0], place[1]), place[2]
    low, high = 0.0, 1.0 - 1e-12
    for _ in range(80):
        s = 0.5 * (low + high)
        tan = lambda n: s / math.sqrt(n * n - s * s)
        x = (-SHEET - PUPIL_Z) * tan(1.0) + SHEET * tan(ACRYLIC) + z * tan(SILICONE)
        low, high = (s, high) if x < reach else (low, s)
    t = low / math.sqrt(1 - low * low)
    return (WIDTH - 1) / 2 + FOCAL * t * place[0] / reach, (HEIGHT - 1) / 2 + FOCAL * t * place[1] / reach


def main():
    check = sys.argv[1:] == ["--check"]
    if sys.argv[1:] and not check:
        sys.exit(f"usage: {sys.argv[0]} [--check]")
    generator = np.random.default_rng(5)
    places = dots()
    found = {
        "made_by": f"scripts/golden_light.py with Mitsuba {mi.__version__}, scalar_rgb",
        "dome_radius_mm": RADIUS,
        "sheet_mm": SHEET,
        "acrylic_index": ACRYLIC,
        "silicone_index": SILICONE,
        "light": LIGHT,
        "diffuser": DIFFUSER,
        "cutoff_deg": CUTOFF_DEG,
        "polar_edges_deg": POLAR,
        "azimuths": AZIMUTHS,
        "square_side_mm": 1.0,
        "square": irradiance(square_light(1.0), 8 if check else 160),
        "diffused": irradiance(diffused_light(generator), 8 if check else 160),
        "pupil_z_mm": PUPIL_Z,
        "focal_px": FOCAL,
        "size_px": [WIDTH, HEIGHT],
        "dot_radius_mm": DOT_RADIUS,
        "dots_mm": places,
        "dots_px": centroids(places, 16 if check else 64),
    }
    if not check:
        FILE.write_text(json.dumps(found, indent=1) + "\n")
        print(f"wrote {FILE.name}")
        return
    held = json.loads(FILE.read_text())
    bad = 0
    for name in ["square", "diffused"]:
        a, b = np.array(held[name]), np.array(found[name])
        off = np.abs(a - b) / np.maximum(b, 0.1 * b.max())
        print(f"{name}: {off.size} bins, at most {100 * off.max():.2f} % from the file")
        bad += off.max() > 0.1
    off = np.linalg.norm(np.array(held["dots_px"]) - np.array(found["dots_px"]), axis=1)
    print(f"dots: {len(off)}, at most {off.max():.3f} px from the file")
    bad += off.max() > 0.3
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
