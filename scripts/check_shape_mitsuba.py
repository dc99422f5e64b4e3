"""Judges `track --shape` on frames that domecast's simulator has no part in.

    python3 scripts/check_shape_mitsuba.py DOMECAST [--keep FOLDER]

The skin is an analytic surface: a ball's cap in the dome, with a shoulder around it. NumPy follows each pixel's ray through sheet and silicone to it
(Snell) and the way of each lamp's light (bisection of Snell's law, Fresnel's losses, the ray tube's spread). What the membrane throws
back onto itself is Mitsuba 3's: its light tracer follows photons through the same faces, reflectance 0.55, and what is more than the lamps'
own light is kept, smoothed. thumb24's camera, sheet, dome and dots; lamps of this script's own, without a platform in their way. Noise of 2
levels and JPEG 90. Heights are compared with the analytic ones.
"""
import argparse
import json
import math
import pathlib
import sys
import tempfile

import cv2
import mitsuba as mi
import numpy as np

import check_shape as judge
from draw_frames import Sensor

ALBEDO = 0.55
# Side of the lamps, mm, and how many sub-lamps stand for one along it; two lamps of each colour.
SIDE, PARTS = 1.0, 3
LAMPS = [(c, azimuth + 60 * k) for k in (0, 3) for c, azimuth in enumerate((0.0, 120.0, 240.0))]
LAMP_RADIUS, LAMP_Z, LAMP_TILT = 9.8, -6.0, 70.0
PHOTONS = 30_000_000


class Skin:
    """The dome with a ball of radius `ball` pressed `depth` deep at an angle from the pole; `depth` 0: at rest."""

    def __init__(self, radius, ball=3.0, depth=0.0, polar=20.0, azimuth=40.0):
        polar, azimuth = np.radians([polar, azimuth])
        self.radius, self.depth, self.ball = radius, depth, ball
        self.axis = np.array([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])
        self.away = radius + ball - depth
        if depth:
            # the ball touches up to where its cap is half as deep; beyond, an exponential goes on with its height and slope
            angles = np.linspace(0, 0.5, 200001)
            height = self.cap(angles)
            self.edge = angles[np.argmin(np.abs(height + 0.4 * depth))]
            step = 1e-6
            self.there, self.slope = self.cap(self.edge), (self.cap(self.edge + step) - self.cap(self.edge - step)) / (2 * step)

    def cap(self, angle):
        return self.away * np.cos(angle) - np.sqrt(np.maximum(self.ball**2 - (self.away * np.sin(angle)) ** 2, 0)) - self.radius

    def height(self, way):
        """Height over the dome in a unit direction from its centre."""
        if not self.depth:
            return np.zeros(way.shape[:-1])
        angle = np.arctan2(np.linalg.norm(np.cross(way, self.axis), axis=-1), way @ self.axis)
        tail = self.there * np.exp(-np.maximum(angle - self.edge, 0) * self.slope / -self.there)
        return np.where(angle < self.edge, self.cap(np.minimum(angle, self.edge)), tail)

    def at(self, way):
        return way * (self.radius + self.height(way))[..., None]

    def normal(self, way):
        """Outward unit normal, by differences."""
        first = np.cross(way, np.where(np.abs(way[..., :1]) < 0.7, [1.0, 0, 0], [0, 1.0, 0]))
        first /= np.linalg.norm(first, axis=-1, keepdims=True)
        second = np.cross(way, first)
        step, sides = 1e-4, []
        for along in (first, second):
            ends = [way + sign * step * along for sign in (1, -1)]
            ends = [self.at(end / np.linalg.norm(end, axis=-1, keepdims=True)) for end in ends]
            sides.append(ends[0] - ends[1])
        out = np.cross(*sides)
        return out / np.linalg.norm(out, axis=-1, keepdims=True)


def passed(indices, momentum):
    """Share of unpolarised light that gets through faces between these indices at a transverse momentum (n sin)."""
    total = np.ones_like(momentum)
    for n1, n2 in zip(indices, indices[1:]):
        c1, c2 = np.sqrt(1 - (momentum / n1) ** 2), np.sqrt(np.maximum(1 - (momentum / n2) ** 2, 0))
        rs, rp = (n1 * c1 - n2 * c2) / (n1 * c1 + n2 * c2), (n2 * c1 - n1 * c2) / (n2 * c1 + n1 * c2)
        total *= 1 - 0.5 * (rs**2 + rp**2)
    return total


class Room:
    """Sheet and silicone, with the lamps below."""

    def __init__(self, constants):
        layers = constants["optics"]["layers"]
        assert len(layers) == 3, "air, sheet, silicone"
        self.sheet, self.acrylic, self.silicone = layers[1]["thickness_mm"], layers[1]["index"], layers[2]["index"]
        self.radius = constants["optics"]["dome_radius_mm"]
        self.lamps = []
        for channel, azimuth in LAMPS:
            a, t = np.radians([azimuth, LAMP_TILT])
            outward, up = np.array([np.cos(a), np.sin(a), 0]), np.array([0, 0, 1.0])
            axis, side = up * np.cos(t) - outward * np.sin(t), up * np.sin(t) + outward * np.cos(t)
            self.lamps.append((channel, outward * LAMP_RADIUS + up * LAMP_Z, axis, np.cross(side, axis), side))

    def direct(self, points, normals):
        """Irradiance of each channel by the lamps of flux 1."""
        light = np.zeros((len(points), 3))
        for channel, center, axis, across, side in self.lamps:
            for i in range(PARTS * PARTS):
                shift = SIDE * ((np.array([i % PARTS, i // PARTS]) + 0.5) / PARTS - 0.5)
                source = center + across * shift[0] + side * shift[1]
                light[:, channel] += self.one(source, axis, points, normals) / PARTS**2
        return light

    def one(self, source, axis, points, normals):
        flat = points[:, :2] - source[:2]
        reach = np.linalg.norm(flat, axis=1)
        ways = [(1.0, -self.sheet - source[2]), (self.acrylic, self.sheet), (self.silicone, points[:, 2])]
        low, high = np.zeros(len(points)), np.full(len(points), 1 - 1e-9)
        for _ in range(45):
            s = 0.5 * (low + high)
            far = sum(t * s / np.sqrt(n * n - s * s) for n, t in ways) > reach
            low, high = np.where(far, low, s), np.where(far, s, high)
        cosine = np.sqrt(1 - s * s)
        inside = np.sqrt(1 - (s / self.silicone) ** 2)
        unit = flat / np.maximum(reach, 1e-12)[:, None]
        leaves = np.column_stack([unit * s[:, None], cosine])
        arrives = np.column_stack([unit * (s / self.silicone)[:, None], inside])
        # the tube's solid angle over its section across the ray: s ds dphi / cos over (reach dphi)(d reach/ds ds inside)
        spread = sum(t * n * n / (n * n - s * s) ** 1.5 for n, t in ways)
        tube = s / cosine / np.maximum(reach * spread * inside, 1e-12)
        lobe = np.maximum(leaves @ axis, 0) / np.pi
        across = np.maximum(np.einsum("ij,ij->i", arrives, normals), 0)
        return lobe * tube * passed([1.0, self.acrylic, self.silicone], s) * across

    def more(self, skin, folder, name):
        """What the membrane gives itself, of each channel: Mitsuba's photons less the lamps' own, as a picture over the plane above the middle."""
        pixels, fov = 120, 156.0
        T = mi.ScalarTransform4f
        faces = {
            "underside": {"type": "rectangle", "to_world": T().translate([0, 0, -self.sheet]).scale(200.0),
                          "bsdf": {"type": "dielectric", "int_ior": 1.0, "ext_ior": self.acrylic}},
            "bond": {"type": "disk", "to_world": T().scale(self.radius),
                     "bsdf": {"type": "dielectric", "int_ior": self.acrylic, "ext_ior": self.silicone}},
        }
        for k, (channel, center, axis, _, side) in enumerate(self.lamps):
            color = [0.0, 0.0, 0.0]
            color[channel] = 1 / (math.pi * SIDE * SIDE)
            pose = T().look_at(origin=center.tolist(), target=(center + axis).tolist(), up=side.tolist())
            faces[f"lamp{k}"] = {"type": "rectangle", "to_world": pose @ T().scale(0.5 * SIDE),
                                 "emitter": {"type": "area", "radiance": {"type": "rgb", "value": color}}}
        scene = mi.load_dict({
            "type": "scene", **faces,
            "membrane": {"type": "ply", "filename": mesh(skin, folder / f"{name}.ply"), "face_normals": False,
                         "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": ALBEDO}}},
            "sensor": {"type": "perspective", "to_world": T().look_at(origin=[0, 0, 1e-3], target=[0, 0, 1], up=[0, -1, 0]),
                       "fov": fov, "near_clip": 1e-3,
                       "film": {"type": "hdrfilm", "width": pixels, "height": pixels, "pixel_format": "rgb", "rfilter": {"type": "box"}}},
        })
        tracer = mi.load_dict({"type": "ptracer", "max_depth": 40, "rr_depth": 12})
        seen = np.array(tracer.render(scene, scene.sensors()[0], spp=max(1, PHOTONS // pixels**2), seed=1)).astype(float)
        half = math.tan(math.radians(fov / 2))
        at = ((np.arange(pixels) + 0.5) / pixels * 2 - 1) * half
        # the picture's columns lie as the camera turns them: right is -x where up is -y
        x, y = np.meshgrid(at, at)
        way = np.dstack([x, y, np.ones_like(x)])
        way /= np.linalg.norm(way, axis=2, keepdims=True)
        rays = self.orient(seen, skin, way)
        total = math.pi / ALBEDO * rays
        own = self.direct(skin.at(way.reshape(-1, 3)), skin.normal(way.reshape(-1, 3))).reshape(total.shape)
        # what varies slowly over the dome, each place by what it weighs in the picture
        weight = way[..., 2] ** 3
        smoothed = [cv2.GaussianBlur((total - own)[..., c] * weight, (0, 0), 4.0) / cv2.GaussianBlur(weight, (0, 0), 4.0) for c in range(3)]
        return np.dstack(smoothed), half, total, own

    def orient(self, seen, skin, way):
        """Mitsuba's picture turned as `way` lies: of the four mirrorings the one that fits the lamps' own light."""
        own = self.direct(skin.at(way.reshape(-1, 3)), skin.normal(way.reshape(-1, 3))).reshape(seen.shape)
        middle = np.s_[20:-20, 20:-20]
        turned = [seen, seen[::-1], seen[:, ::-1], seen[::-1, ::-1]]
        return max(turned, key=lambda picture: np.corrcoef(picture[middle].ravel(), own[middle].ravel())[0, 1])


def mesh(skin, path, rings=500, columns=720):
    """The skin's upper half as triangles that face inwards."""
    polar = np.concatenate([[0], np.linspace(0, np.pi / 2, rings + 1)[1:]])
    turn = 2 * np.pi * np.arange(columns) / columns
    way = np.stack([np.sin(polar)[:, None] * np.cos(turn), np.sin(polar)[:, None] * np.sin(turn), np.repeat(np.cos(polar)[:, None], columns, 1)], -1)
    points = skin.at(way.reshape(-1, 3))
    i, k = np.meshgrid(np.arange(rings), np.arange(columns), indexing="ij")
    a, b = i * columns + k, i * columns + (k + 1) % columns
    c, d = a + columns, b + columns
    faces = np.concatenate([np.stack([a, d, c], -1).reshape(-1, 3), np.stack([a, b, d], -1)[1:].reshape(-1, 3)])
    normals = -skin.normal(way.reshape(-1, 3))
    made = mi.Mesh("skin", len(points), len(faces), has_vertex_normals=True)
    values = mi.traverse(made)
    for key, list_ in (("vertex_positions", points), ("vertex_normals", normals)):
        values[key] = list_.astype(np.float32).ravel()
    values["faces"] = faces.astype(np.uint32).ravel()
    values.update()
    made.write_ply(str(path))
    return str(path)


def rays(constants):
    """Unit directions in air of all pixels, sensor frame, and the pupil."""
    sensor = Sensor(constants)
    height, width = constants["camera"]["height"], constants["camera"]["width"]
    matrix = np.array(constants["camera"]["matrix"])
    u, v = np.meshgrid(np.arange(width), np.arange(height))
    x, y = (u - matrix[0, 2]) / matrix[0, 0], (v - matrix[1, 2]) / matrix[1, 1]
    ray = np.dstack([x, y, np.ones_like(x, float)])
    ray /= np.linalg.norm(ray, axis=2, keepdims=True)
    return ray @ sensor.camera_rotation, sensor.pupil


def see(room, skin, pupil, ray):
    """Places of the skin that rays come to: directions from the middle; NaN where none."""
    momentum = np.linalg.norm(ray[..., :2], axis=-1)
    unit = ray[..., :2] / np.maximum(momentum, 1e-12)[..., None]
    tan = lambda n: momentum / np.sqrt(n * n - momentum**2)
    start = pupil[:2] + unit * ((-room.sheet - pupil[2]) * tan(1.0) + room.sheet * tan(room.acrylic))[..., None]
    inside = np.dstack([unit * (momentum / room.silicone)[..., None], np.sqrt(1 - (momentum / room.silicone) ** 2)])
    origin = np.dstack([start, np.zeros(start.shape[:2])])
    radius = np.full(start.shape[:2], room.radius)
    for _ in range(30):
        half = (origin * inside).sum(axis=2)
        way = -half + np.sqrt(np.maximum(half**2 - (origin**2).sum(axis=2) + radius**2, 0))
        point = origin + inside * way[..., None]
        unit_way = point / np.linalg.norm(point, axis=2, keepdims=True)
        radius = room.radius + skin.height(unit_way)
    unit_way[(np.linalg.norm(start, axis=2) >= room.radius) | (ray[..., 2] <= 0)] = np.nan
    return unit_way, momentum


def picture(room, skin, constants, folder, name, level=None):
    """What the camera sees without noise, levels in the order red, green, blue; the directions of its pixels; the exposure."""
    ray, pupil = rays(constants)
    way, momentum = see(room, skin, pupil, ray)
    known = np.isfinite(way[..., 0])
    seen = way[known]
    more, half, total, own = room.more(skin, folder, name)
    at = (seen[:, :2] / np.maximum(seen[:, 2:], 1e-3) / half + 1) / 2 * more.shape[0] - 0.5
    indirect = np.stack([cv2.remap(more[..., c].astype(np.float32), at[None, :, 0].astype(np.float32), at[None, :, 1].astype(np.float32),
                                   cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)[0] for c in range(3)], -1)
    light = room.direct(skin.at(seen), skin.normal(seen)) + indirect
    light *= passed([1.0, room.acrylic, room.silicone], momentum[known])[:, None]
    for dot in constants["black_dots"]:
        place = np.array(dot["surface_mm"]) / np.linalg.norm(dot["surface_mm"])
        light[seen @ place > math.cos(0.5 * dot["diameter_mm"] / room.radius)] *= 0.05
    level = level or 200 / np.percentile(light, 99)
    levels = np.full((*known.shape, 3), 3.0)
    levels[known] = np.minimum(level * light, 255)
    return cv2.GaussianBlur(levels, (0, 0), 0.5), way, level


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("domecast", type=pathlib.Path)
    parser.add_argument("--keep", type=pathlib.Path, help="folder that pictures are kept in")
    arguments = parser.parse_args()
    mi.set_variant("scalar_rgb")
    mi.set_log_level(mi.LogLevel.Warn)
    with tempfile.TemporaryDirectory() as scratch:
        work = (arguments.keep or pathlib.Path(scratch)).resolve()
        work.mkdir(parents=True, exist_ok=True)
        built = work / "thumb24"
        if not built.exists():
            judge.run(arguments.domecast, "build", judge.ROOT / "designs/thumb24.json", "--out", built, "--quiet")
        constants = own_constants(json.loads((built / "constants/constants.json").read_text()))
        file = work / "mitsuba-constants.json"
        file.write_text(json.dumps(constants))
        room = Room(constants)
        rest, _, level = picture(room, Skin(room.radius), constants, work, "mitsuba-rest")
        still = work / "mitsuba-rest.png"
        cv2.imwrite(str(still), judge.photograph(rest[..., ::-1], 2))
        for number, skin in enumerate([Skin(room.radius, 4.0, 0.5, 0.0, 0.0), Skin(room.radius, 3.0, 0.4, 25.0, 40.0)]):
            drawn, way, _ = picture(room, skin, constants, work, f"mitsuba-{number}", level)
            frame = work / f"mitsuba-{number}.png"
            cv2.imwrite(str(frame), judge.photograph(drawn[..., ::-1], 1))
            out = work / f"mitsuba-shape-{number}"
            judge.track(arguments.domecast, frame, still, file, out)
            found, sd = (np.load(out / f"frame_0000.{kind}.npy") for kind in ("height", "height_sd"))
            for limit, rms, p99 in ((45, 0.010, 0.030), (60, 0.020, 0.060)):
                here = np.isfinite(found) & (way[..., 2] >= math.cos(math.radians(limit)))
                off = found[here] - skin.height(way[here])
                size = np.sqrt(np.mean(off**2))
                judge.check(f"ball {number} to {limit} deg", size <= rms and np.percentile(np.abs(off), 99) <= p99,
                            f"rms {size:.4f} p99 {np.percentile(np.abs(off), 99):.4f} mean {off.mean():.4f} mm; within 1, 2, 3 sd: "
                            + " ".join(f"{np.mean(np.abs(off) <= k * sd[here]):.2f}" for k in (1, 2, 3)))
    sys.exit(1 if judge.failed else 0)


def own_constants(constants):
    """thumb24's constants on a rigid mount, with this script's lamps and a camera without distortion."""
    constants["white_markers"] = []
    constants.pop("springs", None)
    constants["camera"] |= {"model": "pinhole", "distortion": []}
    constants["camera"].pop("intrinsics_covariance", None)
    light = constants["light"]
    lamps = []
    for channel, center, axis, across, _ in Room(constants).lamps:
        lamps.append({"color": ("red", "green", "blue")[channel], "position_mm": center.tolist(), "axis": axis.tolist(),
                      "across": across.tolist(), "side_mm": SIDE, "flux": 1.0, "lobe": {"exponent": 1.0}})
    light |= {"leds": lamps, "crosstalk": np.eye(3).tolist(), "reflectance": [ALBEDO] * 3, "mean_reflectance": [ALBEDO] * 3,
              "stray": 0.0, "gamma": 1.0, "through_platform": 1.0}
    return constants


if __name__ == "__main__":
    main()
