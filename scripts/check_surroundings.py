#!/usr/bin/env python3
"""What is beside a white marker and pulls its centre, in frames that domecast did not draw.

    python3 scripts/check_surroundings.py target/release/domecast output/thumb24 [...] [--random N] [--seed S] [--only NAME]

The markers' surroundings are drawn by NumPy at eight times the frame's resolution: the dome's image that ends 0 to 6 px from
the marker or runs into it, where the constants have its rim or elsewhere; light scattered at the rim, before the marker or
behind it; a bright step or speck on any side. Lens, JPEG and noise spoil the rest. Held to the truth:

- no marker called `ok` is both more than 0.05 px and more than 4 of its `sd_px` from where it was drawn;
- no frame called `ok` has a force that is 0.1 N from that of the same pose with plain surroundings;
- where a scene says that its markers can be measured, they are `ok`, nearer than a pixel's tenth.

`--random N` adds N scenes drawn from the seed.
"""
import copy
import sys

import cv2
import numpy as np

from check_identities import Build
from draw_frames import Sensor

SUB = 8
OFF_PX, OFF_SDS, OFF_N = 0.05, 4.0, 0.1
# A marker that is to be measured in spite of its surroundings, px.
MEASURED_PX = 0.1
GROUND, DOME, DOT, WHITE = 60, 165, 25, 235
failed = 0


def outside(points, corners):
    """Distance outside of a convex polygon, px, exact near its edges."""
    ahead = np.roll(corners, -1, 0)
    normals = (ahead - corners)[:, ::-1] * [1, -1]
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals * np.sign((corners[:, 0] * ahead[:, 1] - corners[:, 1] * ahead[:, 0]).sum())
    offsets = (normals * corners).sum(1)
    far = np.full(points.shape[:-1], -np.inf, np.float32)
    for (a, b), offset in zip(normals.astype(np.float32), offsets.astype(np.float32)):
        np.maximum(far, a * points[..., 0] + b * points[..., 1] - offset, out=far)
    return far


def centroid(corners):
    ahead = np.roll(corners, -1, 0)
    cross = corners[:, 0] * ahead[:, 1] - corners[:, 1] * ahead[:, 0]
    return ((corners + ahead) * cross[:, None]).sum(0) / (3 * cross.sum())


class Scene:
    """A sensor at a pose, with what is beside its markers.

    `wider`: how far the dome's image goes beyond the rim, px; `glow`: light outside of the rim as (levels, decay px, whether
    it lies over the markers too); `step`: half of what is around each marker brighter, as (angle from the way outwards, px from
    the marker, level); `specks`: bright discs as (marker, angle, px from it, radius px, level)."""

    def __init__(self, sensor, shift=(0, 0, 0), turn=(0, 0, 0), dome=DOME, wider=0.0, glow=None, step=None, specks=()):
        self.sensor, self.dome, self.glow, self.step, self.specks = sensor, dome, glow, step, specks
        around = np.linspace(0, 2 * np.pi, 720, endpoint=False)
        radius = np.sqrt(sensor.radius**2 - min(sensor.center[2], 0.0) ** 2)
        rim = sensor.project(radius * np.stack([np.cos(around), np.sin(around), 0 * around], -1), turn, shift)
        self.middle = rim.mean(0)
        away = rim - self.middle
        angles, radii = np.arctan2(away[:, 1], away[:, 0]), np.hypot(*away.T) + wider
        order = np.argsort(angles)
        self.angles, self.radii = angles[order], radii[order]
        dots, markers = sensor.outlines()
        self.dots = sensor.project(dots, turn, shift)
        self.markers = [sensor.project(corners, turn, shift) for corners in markers]
        self.truth = np.array([centroid(corners) for corners in self.markers])

    def beyond_rim(self, x, y):
        angle = np.arctan2(y - self.middle[1], x - self.middle[0])
        return np.hypot(x - self.middle[0], y - self.middle[1]) - np.interp(angle, self.angles, self.radii, period=2 * np.pi)

    def window(self, index, x, y):
        """Levels of the fine pixels around a marker."""
        corners, at = self.markers[index], self.truth[index]
        points = np.stack([x, y], -1).astype(np.float32)
        outwards = (at - self.middle) / np.linalg.norm(at - self.middle)

        def way(angle):
            c, s = np.cos(angle), np.sin(angle)
            direction = np.array([[c, -s], [s, c]]) @ outwards
            return direction, ((corners - at) @ direction).max()

        def lay(level, far, new):
            part = np.clip(0.5 - far * SUB, 0, 1)
            return level * (1 - part) + part * new

        level = np.full(x.shape, float(GROUND), np.float32)
        if self.step:
            angle, gap, new = self.step
            direction, edge = way(angle)
            level = lay(level, edge + gap - (points - at) @ direction, new)
        for marker, angle, gap, radius, new in self.specks:
            if marker == index:
                direction, edge = way(angle)
                level = lay(level, np.linalg.norm(points - at - direction * (edge + gap + radius), axis=-1) - radius, new)
        beyond = self.beyond_rim(x, y)
        glow = 0
        if self.glow:
            glow = self.glow[0] * np.exp(-np.maximum(beyond, 0) / self.glow[1]) * (beyond > 0)
        over = bool(self.glow and self.glow[2])
        level = lay(level if over else level + glow, beyond, self.dome)
        for dot in self.dots[np.abs(self.dots.mean(1) - at).max(1) < 0.6 * np.ptp(x)]:
            level = lay(level, outside(points, dot), DOT)
        level = lay(level, outside(points, corners), WHITE)
        return level + glow if over else level

    def draw(self, defocus=0.0, jpeg=None, noise=1.0, seed=1):
        width, height = self.sensor.size
        frame = np.full((height, width), GROUND, np.uint8)

        def fill(outlines, level):
            for corners in np.round(np.asarray(outlines) * 16).astype(np.int32):
                cv2.fillPoly(frame, [corners], level, cv2.LINE_AA, 4)

        rim = self.middle + self.radii[:, None] * np.stack([np.cos(self.angles), np.sin(self.angles)], -1)
        fill(rim[None], self.dome)
        fill(self.dots, DOT)
        frame = frame.astype(np.float32)
        for index, (corners, at) in enumerate(zip(self.markers, self.truth)):
            half = int(np.ceil(np.linalg.norm(corners - at, axis=1).max() + 12))
            (x0, y0), (x1, y1) = np.maximum(np.round(at).astype(int) - half, 0), np.minimum(np.round(at).astype(int) + half + 1, [width, height])
            x, y = np.meshgrid((np.arange((x1 - x0) * SUB) + 0.5) / SUB - 0.5 + x0, (np.arange((y1 - y0) * SUB) + 0.5) / SUB - 0.5 + y0)
            fine = self.window(index, x, y).astype(np.float32)
            frame[y0:y1, x0:x1] = cv2.resize(fine, (x1 - x0, y1 - y0), interpolation=cv2.INTER_AREA)
        frame = cv2.GaussianBlur(frame * self.sensor.shade, (0, 0), 0.6)
        if defocus > 0:
            size = 2 * int(np.ceil(defocus)) + 3
            y, x = np.mgrid[:size * 8, :size * 8] / 8 - size / 2 + 1 / 16
            kernel = cv2.resize((np.hypot(x, y) <= defocus).astype(np.float32), (size, size), interpolation=cv2.INTER_AREA)
            frame = cv2.filter2D(frame, -1, kernel / kernel.sum())
        frame = np.clip(np.round(frame + np.random.default_rng(seed).normal(0, noise, frame.shape)), 0, 255).astype(np.uint8)
        return frame if jpeg is None else cv2.imdecode(cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, jpeg])[1], 0)


def gap_of(sensor, place, diameter):
    """From a marker's outline to the rim along the way to the axis, px."""
    way = place / np.linalg.norm(place)
    rim = np.sqrt(sensor.radius**2 - min(sensor.center[2], 0.0) ** 2)
    return np.linalg.norm(sensor.project(place - 0.5 * diameter * way) - sensor.project(rim * way))


def moved_to(build, gap):
    """Constants of a sensor whose markers end so many px from the rim."""
    constants, sensor = copy.deepcopy(build.constants), build.sensor
    rim = np.sqrt(sensor.radius**2 - min(sensor.center[2], 0.0) ** 2)
    for marker in constants["white_markers"]:
        way = np.array(marker["position_mm"]) / np.linalg.norm(marker["position_mm"])
        low, high = rim + 0.5 * marker["diameter_mm"], rim + 0.5 * marker["diameter_mm"] + 2.0
        for _ in range(40):
            middle = 0.5 * (low + high)
            near = gap_of(sensor, middle * way, marker["diameter_mm"]) < gap
            low, high = (middle, high) if near else (low, middle)
        marker["position_mm"] = (low * way).tolist()
    return constants


def judge(build, name, scene, lens, constants=None, measured=True, frames=2, seed=0, quiet=False):
    """A scene in some poses, each with a clean frame of the same pose."""
    global failed
    sensor = Sensor(constants) if constants else build.sensor
    random = np.random.default_rng(seed)
    poses = [{"shift": (*random.uniform(-0.06, 0.06, 2), -0.05 * random.random()), "turn": (0, 0, random.uniform(-0.004, 0.004))} for _ in range(frames)]
    scenes = [Scene(sensor, **pose, **scene) for pose in poses]
    lines, _ = build.track([drawn.draw(**lens, seed=1000 * seed + i) for i, drawn in enumerate(scenes)], constants=constants)
    plain, _ = build.track([Scene(sensor, **pose).draw(seed=1000 * seed + i) for i, pose in enumerate(poses)], constants=constants)
    why, offs, parts, states, force = [], [0.0], [0.0], [], 0.0
    for line, clean, drawn in zip(lines, plain, scenes):
        for marker, truth in zip(line["white_markers"], drawn.truth):
            states.append(marker["state"])
            if marker["state"] == "ok":
                off = np.hypot(*(np.array(marker["centroid_px"]) - truth))
                offs.append(off)
                if off > OFF_PX:
                    parts.append(off / marker["sd_px"])
                if off > OFF_PX and off > OFF_SDS * marker["sd_px"]:
                    why.append(f"{off:.3f} px off, {off / marker['sd_px']:.1f} sd")
        if line["wrench"] and clean["wrench"] and line["status"] == "ok":
            force = max(force, np.abs(np.subtract(line["wrench"], clean["wrench"])[:3]).max())
    if force > OFF_N:
        why.append(f"force off by {force:.3f} N")
    if measured and not (set(states) == {"ok"} and max(offs) < MEASURED_PX):
        why.append("not measured")
    failed += bool(why)
    if why or not quiet:
        shown = {state: states.count(state) for state in dict.fromkeys(states)}
        print(f"{'FAIL' if why else 'ok  '} {name:<58} off by {max(offs):.3f} px, {max(parts):.1f} sd, {force:.3f} N, {shown}"
              + (f"  <- {'; '.join(why[:3])}" if why else ""), flush=True)


def scenarios(build):
    """Name, and what draws and judges it."""
    sensor = build.sensor
    gap = gap_of(sensor, sensor.markers[0], sensor.marker_diameters[0])
    soft = {"defocus": 1.0, "jpeg": 90, "noise": 2.0}

    def case(name, scene, lens={}, measured=True, to=None):
        constants = None if to is None else moved_to(build, to)
        return name, lambda: judge(build, name, scene, lens, constants, measured)

    for beside in (0.0, 1.0, 3.0):
        yield case(f"a marker {beside:g} px from the rim", {}, to=beside)
    yield case("a marker that touches the rim, out of focus by 1.5 px", {}, {**soft, "defocus": 1.5}, measured=False, to=0.0)
    for ends, dome in ((0.0, 165), (1.0, 230), (1.5, 110), (3.0, 230)):
        yield case(f"the dome's image of {dome} levels ends {ends:g} px beside", {"wider": gap - ends, "dome": dome}, measured=ends > 1.2)
    for levels, decay, over in ((20, 4.0, True), (50, 1.5, False), (50, 10.0, True), (100, 4.0, True), (100, 10.0, False)):
        far = gap if decay * 3 < gap else 0.0
        name = f"light of {levels} levels over {decay + far:.3g} px {'before' if over else 'behind'} the markers"
        yield case(name, {"glow": (levels, decay + far, over)}, measured=levels <= 50)
        yield case(name + ", soft", {"glow": (levels, decay + far, over)}, soft, measured=levels < 50)
    for angle, beside, level in ((1.5, 0.0, 100), (2.5, 1.0, 200), (0.0, 2.0, 200)):
        yield case(f"a step to {level} levels {beside:g} px beside at {angle:g} rad", {"step": (angle, beside, level)}, measured=level < 150)
    yield case("bright specks at two markers", {"specks": [(0, 1.5, 0.0, 2, 200), (2, 0.0, 1.0, 6, 200)]}, measured=False)
    yield case("plain surroundings, soft", {}, soft)


def random_scene(build, random):
    """Anything beside the markers, through any lens."""
    sensor = build.sensor
    gap = gap_of(sensor, sensor.markers[0], sensor.marker_diameters[0])
    lens = {"defocus": random.choice([0.0, 0.75, 1.5]), "jpeg": random.choice([None, 90]), "noise": random.choice([1.0, 2.0])}
    scene, constants = {"dome": int(random.integers(100, 231))}, None
    angle, beside = random.uniform(-np.pi, np.pi), random.uniform(0, 6)
    kind = random.integers(5)
    if kind == 0:
        constants = moved_to(build, beside)
    elif kind == 1:
        scene["wider"] = gap - beside
    elif kind == 2:
        scene["glow"] = (random.uniform(10, 100), random.uniform(1, 12), bool(random.integers(2)))
    elif kind == 3:
        scene["step"] = (angle, beside, int(random.integers(80, 221)))
    else:
        scene["specks"] = [(k, angle, beside, random.uniform(1, 8), int(random.integers(100, 251))) for k in range(random.integers(1, 5))]
    what = ", ".join(f"{key} {np.round(value[0] if key == 'specks' else value, 2)}" for key, value in scene.items())
    through = ", ".join(f"{key} {value}" for key, value in lens.items() if value)
    return f"{f'{beside:.2f} px from the rim, ' if constants else ''}{what}; {through}", scene, lens, constants


def check(build, count=0, seed=1, only=None):
    """All scenarios, then so many random ones; the number that fail."""
    before = failed
    for name, run in scenarios(build):
        if only is None or only in name:
            run()
    random = np.random.default_rng(seed)
    for i in range(count):
        name, scene, lens, constants = random_scene(build, random)
        judge(build, f"random {i}: {name}", scene, lens, constants, measured=False, seed=seed * 1000 + i, quiet=True)
    return failed - before


def main(program, *builds):
    builds, given = list(builds), {"--random": "0", "--seed": "1", "--only": None}
    for option in given:
        if option in builds:
            at = builds.index(option)
            given[option] = builds[at + 1]
            del builds[at:at + 2]
    for folder in builds:
        print(folder)
        check(Build(program, folder), int(given["--random"]), int(given["--seed"]), given["--only"])
    print("what is beside a marker moves nothing in silence" if failed == 0 else f"{failed} faults")
    return 1 if failed else 0


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
