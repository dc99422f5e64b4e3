#!/usr/bin/env python3
"""Which mark is which, in frames that domecast did not draw: named scenarios, each with what may be said of it.

    python3 scripts/check_identities.py target/release/domecast output/thumb24 [output/digit-rigid ...] [--only NAME] [--random N] [--seed S]

For each build frames are drawn by scripts/draw_frames.py (its own projector and its own skin), `domecast track` reads them
with the build's constants, and every frame is held to the truth:

- a dot that is called `ok` is no other dot: nearer than two fifths of the spacing to where it was drawn;
- the status of the frames is one of those that the scenario names;
- no more dots are withheld than the scenario allows.

`--random N` adds N frames under touches drawn from the seed, each unlike the one before, and half as many with a patch of the
skin beside its place: no dot called `ok` is another.
"""
import copy
import json
import pathlib
import subprocess
import sys
import tempfile

import cv2
import numpy as np

from draw_frames import Sensor, rotation, turn_picture

failed = 0
# What two markers and the dots may say beside four markers, N.
MAX_HELPED_N = 0.06
# noise does not become smaller for trying
FAST_PNG = [cv2.IMWRITE_PNG_COMPRESSION, 1]


def dent(sensor, center, depth, width):
    """The skin pushed in by a finger's tip at a place, and pushed aside a little."""
    center = np.asarray(center, float)
    inward = (sensor.center - center) / np.linalg.norm(sensor.center - center)

    def skin(points):
        away = points - center
        bell = np.exp(-(away**2).sum(-1) / (2 * width**2))[..., None]
        aside = away - (away @ inward)[..., None] * inward
        return points + depth * bell * inward + 0.25 * depth / width * aside * bell

    return skin


def shear(sensor, way):
    """The skin pulled sideways, the rim held."""
    height = sensor.radius + sensor.center[2]
    return lambda points: points + np.asarray(way) * np.clip(points[..., 2:] / height, 0, 1)


def pull(sensor, center, way, width):
    """A patch of the skin pulled along the dome, the more the nearer to its middle."""
    center = np.asarray(center, float)
    return lambda points: points + np.asarray(way) * np.exp(-((points - center)**2).sum(-1) / (2 * width**2))[..., None]


def slip(sensor, axis, angle):
    """The whole skin turned over the dome."""
    turn = rotation(np.asarray(axis, float) * angle)
    return lambda points: (points - sensor.center) @ turn.T + sensor.center


def patch(sensor, middle, turn, radius, stretch=1.0):
    """A patch with a sharp edge moved over the dome as a whole: `turn` about the sphere's centre (a rotation vector), of the
    dots within a radius, or in a box that is longer along the turn."""
    turned = rotation(turn)
    along = np.asarray(turn) / np.linalg.norm(turn)

    def skin(points):
        # a dot moves whole or not at all
        away = (points.mean(-2, keepdims=True) if points.ndim > 2 else points) - middle
        part = away @ along
        across = np.sqrt(np.maximum((away**2).sum(-1) - part**2, 0))
        inside = np.hypot(part, across) < radius if stretch == 1.0 else (np.abs(part) < radius * stretch) & (across < radius / stretch)
        return np.where(inside[..., None], (points - sensor.center) @ turned.T + sensor.center, points)

    return skin


class Build:
    def __init__(self, program, folder):
        self.program = program
        self.path = pathlib.Path(folder) / "constants/constants.json"
        self.constants = json.loads(self.path.read_text())
        self.sensor = Sensor(self.constants)
        self.rest = self.sensor.project(self.sensor.dots)
        apart = np.linalg.norm(self.rest[:, None] - self.rest[None], axis=2) + 1e9 * np.eye(len(self.rest))
        self.spacing = apart.min(1)
        self.center = self.sensor.matrix[:2, 2]
        self.is_rigid = not self.constants["white_markers"]
        self.at_rest = {}

    def draw(self, seed, **scene):
        """A frame and the places of its dots. What is at rest is drawn once a seed: most scenarios have such frames."""
        if scene:
            return self.sensor.draw(seed=seed, **scene)
        if seed not in self.at_rest:
            self.at_rest[seed] = self.sensor.draw(seed=seed)
        return self.at_rest[seed]

    def at(self, polar_deg, azimuth_deg=30):
        p, a = np.radians([polar_deg, azimuth_deg])
        outward = np.array([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)])
        return self.sensor.center + self.sensor.radius * outward

    def pitch_rad(self):
        """The angle on the dome between the dots nearest to the pole and their neighbours."""
        dots = (self.sensor.dots - self.sensor.center) / self.sensor.radius
        middle = dots[np.argmax(dots[:, 2])]
        return np.sort(np.arccos(np.clip(dots @ middle, -1, 1)))[1]

    def patch(self, place, way, moved, steps, stretch=1.0):
        """A patch about the dot nearest to a place, so many steps of the pattern wide to each side, that lies so many steps
        beside its place towards its neighbour number `way`, or anywhere (a vector)."""
        sensor = self.sensor
        dots = (sensor.dots - sensor.center) / sensor.radius
        middle = np.argmax(dots @ (place - sensor.center))
        nearest = np.argsort(-(dots @ dots[middle]))
        axis = np.cross(dots[middle], dots[nearest[1 + way]] if np.isscalar(way) else way)
        step = np.arccos(np.clip(dots[middle] @ dots[nearest[1 + way if np.isscalar(way) else 1]], -1, 1))
        return patch(sensor, sensor.dots[middle], axis / np.linalg.norm(axis) * step * moved, step * steps * sensor.radius, stretch)

    def track(self, frames, *options, constants=None):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            path = self.path
            if constants is not None:
                path = folder / "constants.json"
                path.write_text(json.dumps(constants))
            (folder / "frames").mkdir()
            for index, frame in enumerate(frames):
                cv2.imwrite(str(folder / f"frames/frame_{index:04d}.png"), frame, FAST_PNG)
            out = folder / "track.jsonl"
            done = subprocess.run([self.program, "track", folder / "frames", "--constants", path, "--out", out, *options],
                                  capture_output=True, text=True)
            if done.returncode:
                raise SystemExit(done.stderr)
            return [json.loads(line) for line in out.read_text().splitlines()], done.stderr


def judge(build, name, lines, truths, statuses, may_lack=0.02, drawn=None):
    """Every line against where the dots were drawn."""
    global failed
    swapped, worst, lacking, said = 0, 0.0, 0, []
    for line, truth in zip(lines, truths):
        said.append(line["status"])
        lacks = 0
        for index, dot in enumerate(line["black_dots"]):
            if dot["state"] != "ok" or dot["centroid_px"] is None:
                lacks += 1
                continue
            off = np.hypot(*(np.array(dot["centroid_px"]) - truth[index]))
            swapped += off > 0.4 * build.spacing[index]
            worst = max(worst, off)
        lacking = max(lacking, lacks)
    count = len(truths[0])
    # a scene that holds still draws its frame again: that is named
    good = swapped == 0 and set(said) <= {*statuses, "frozen"} and lacking <= max(may_lack * count, 1) and len(lines) == len(truths)
    failed += not good
    shown = {status: said.count(status) for status in dict.fromkeys(said)}
    print(f"{'ok  ' if good else 'FAIL'} {name:<46} swapped {swapped} of {count * len(lines)}, off by {worst:.3f} px at most, "
          f"{lacking} withheld, {shown}")


def two_markers(build, pair, moments, name):
    """The dots take the part of two markers that are hidden: what is said is what all four say."""
    def run():
        global failed
        drawn = [build.sensor.draw(seed=i, **moment) for i, moment in enumerate(moments)]
        whole, _ = build.track([frame for frame, _ in drawn])
        lines, _ = build.track([build.sensor.draw(seed=i, hidden=pair, **moment)[0] for i, moment in enumerate(moments)])
        judge(build, name, lines, [truth for _, truth in drawn], ["two_markers"])
        off = [np.subtract(line["wrench"] or [np.inf] * 6, other["wrench"])[:3] for line, other in zip(lines, whole)]
        good = np.abs(off).max() < MAX_HELPED_N
        failed += not good
        print(f"{'ok  ' if good else 'FAIL'} {name + ': force':<46} off by {np.abs(off).max():.3f} N at most")
    return name, run


def scenarios(build):
    """Name, and what draws and judges it."""
    sensor = build.sensor
    key = build.constants["key"]

    def plain(name, poses_and_skins, statuses, may_lack=0.02, **drawing):
        def run():
            drawn = [build.draw(i, **{**drawing, **scene}) for i, scene in enumerate(poses_and_skins)]
            lines, _ = build.track([frame for frame, _ in drawn])
            judge(build, name, lines, [truth for _, truth in drawn], statuses, may_lack)
        return name, run

    def lying(name, turned, mirrored, statuses, options=(), may_lack=1.0, constants=None, says="", **drawing):
        def run():
            pictures, truths = [], []
            for seed in range(3):
                frame, truth = build.draw(seed, **drawing)
                picture, matrix = turn_picture(frame, turned, mirrored, build.center)
                pictures.append(picture)
                truth = truth @ matrix[:, :2].T + matrix[:, 2]
                if "--camera-mirrored" in options:
                    truth[:, 0] = sensor.size[0] - 1 - truth[:, 0]
                truths.append(truth)
            lines, told = build.track(pictures, *options, constants=constants)
            judge(build, name, lines, truths, statuses, may_lack)
            if says not in told:
                global failed
                failed += 1
                print(f"FAIL {name}: does not say '{says}': {told.strip()[-200:]}")
        return name, run

    own = [turn for turn in key["images"] if not turn["mirrored"]]
    yield lying("as built", 0, False, ["ok"], may_lack=0.02)
    for turn in key["images"]:
        deg, mirrored = turn["turned_deg"], turn["mirrored"]
        how = f"{'mirrored, ' if mirrored else ''}turned by {deg:g}"
        yield lying(how, deg, mirrored, ["mirrored" if mirrored else "turned"], says=f"by {deg:g} degrees")
    yield lying("turned by 37, no symmetry", 37, False, ["turned"])
    yield lying("mirrored, turned by 37", 37, True, ["mirrored"])
    deg = own[0]["turned_deg"]
    yield lying(f"turned by {deg:g}, accepted", deg, False, ["ok"], ["--camera-turned", f"{deg:g}"], 0.02)
    yield lying("turned by 37, accepted", 37, False, ["ok"], ["--camera-turned", "37"], 0.02)
    yield lying("mirrored, accepted", 0, True, ["ok"], ["--camera-mirrored"], 0.02)
    yield lying("mirrored, turned by 180, accepted", 180, True, ["ok"], ["--camera-mirrored", "--camera-turned", "180"], 0.02)
    image = own[0]["dot"]
    others = [dot for dot in range(len(sensor.dots)) if dot not in [i["dot"] for i in key["images"]] + key["neighbors"]]
    rng = np.random.default_rng(5)
    broken = tuple(rng.choice(others, 6, replace=False))
    yield lying("six broken dots", 0, False, ["ok", "dots_lost"], may_lack=max(0.05, 7.5 / len(sensor.dots)), without=broken)
    yield lying("six broken dots, turned", deg, False, ["turned"], without=broken)
    yield lying("a broken dot at an image of the key", 0, False, ["key_unsure"], without=(image,), says="--camera-turned 0")
    yield lying("the same, told how it lies", 0, False, ["ok"], ["--camera-turned", "0"], 0.02, without=(image,))
    dirt = [(key["surface_mm"], key["diameter_mm"])]
    yield lying("dirt on the key", 0, False, ["key_unsure"], specks=dirt)
    yield lying("dirt on the key, turned", deg, False, ["key_unsure", "turned"], specks=dirt)
    old = copy.deepcopy(build.constants)
    del old["key"]
    yield lying("constants without a key", 0, False, ["ok"], may_lack=0.02, constants=old, says="no `key`")
    # touches
    usual = ["ok", "dots_lost"]
    # at the start nothing tells a skin pulled all over from another sensor's constants
    start = usual + ["foreign_constants"]
    r = sensor.radius
    for polar in (0, 25, 40):
        touch = dent(sensor, build.at(polar), 0.19 * r, 0.22 * r)
        yield plain(f"touch of 1.9 mm in 10 at {polar} deg, on and off", [{}, {"skin": touch}, {"skin": touch}, {}, {}], usual, 0.15)
        press = dent(sensor, build.at(polar), 0.2 * r, 0.25 * r)
        yield plain(f"start under a press of 2 mm in 10 at {polar} deg", [{"skin": press}] * 3 + [{}], start, 0.15)
    for polar in (10, 30):
        narrow = dent(sensor, build.at(polar, 20), 0.2 * r, 0.19 * r)
        yield plain(f"touch of 2 mm in 10, 1.9 mm wide, at {polar} deg", [{}, {"skin": narrow}, {"skin": narrow}, {}], usual, 0.2)
    for azimuth in (0, 30):
        way = 0.2 * r * np.array([np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth)), 0])
        yield plain(f"start under 2 mm in 10 of shear to {azimuth} deg", [{"skin": shear(sensor, way)}] * 3, start, 0.2)
        steps = [{"skin": shear(sensor, 1.5 * way * i / 15)} for i in range(16)]
        yield plain(f"3 mm in 10 of shear in 15 frames to {azimuth} deg", steps, usual, 0.2)
        slid = slip(sensor, [-np.sin(np.radians(azimuth)), np.cos(np.radians(azimuth)), 0], build.pitch_rad())
        yield plain(f"skin slips by a pitch to {azimuth} deg", [{}, {"skin": slid}, {"skin": slid}], usual + ["key_unsure"], 0.35)
        yield plain(f"start slipped by a pitch to {azimuth} deg", [{"skin": slid}] * 3, start + ["key_unsure"], 0.35)
    # silicone does not move so; a number that is wrong in silence is the worse for it. The patch's dots and those beside them may be withheld:
    # of a sensor of 59 dots that is 0.61
    for polar in (0, 35):
        for moved in (0.65, 0.8, 1.2):
            skin = build.patch(build.at(polar), 0, moved, 2.4)
            yield plain(f"a patch beside its place by {moved:g} steps at {polar} deg", [{}, {"skin": skin}, {"skin": skin}, {}], usual, 0.62)
            # where the patch covers an image of the key, all numbers are withheld
            named = start + ["key_unsure", "mirrored", "turned"]
            yield plain(f"start with that, {moved:g} at {polar} deg", [{"skin": skin}] * 2, named, 1.0)
    if build.is_rigid:
        return
    # markers
    for hidden in range(len(sensor.markers)):
        yield plain(f"marker {hidden} hidden from the start", [{}] * 3, ["three_markers"], hidden=(hidden,))
    tilted = {"shift": (0.004 * r, 0, -0.05 * r), "turn": (0.01, 0.005, 0.01)}
    pulled = {**tilted, "skin": shear(sensor, (0.02 * r, 0.01 * r, 0))}
    for pair in ((0, 1), (0, 2), (1, 3)):
        yield two_markers(build, pair, [{}, tilted], f"markers {pair} hidden from the start")
        yield two_markers(build, pair, [pulled] * 2, f"markers {pair} hidden, pressed and sheared")
    press = [{"shift": (0, 0, -0.3)}, {"shift": (0.1, 0, -0.5), "turn": (0.01, 0, 0.01)}]
    yield plain("marker 2 hidden, pressed from the start", press, ["three_markers"], hidden=(2,))

    bad = ["ok", "blurred", "no_marks", "markers_missing", "markers_do_not_fit", "dots_lost", "three_markers", "two_markers", "foreign_constants",
           "key_unsure"]

    def blurred(at, way):
        def run():
            drawn = [sensor.draw(seed=i, shift=(0.02 * i, 0, -0.02 * i)) for i in range(6)]
            frames = [frame for frame, _ in drawn]
            frames[at] = cv2.blur(frames[at], way)
            lines, _ = build.track(frames)
            others = [i for i in range(6) if i != at]
            judge(build, f"frames beside a blurred one, {way}", [lines[i] for i in others], [drawn[i][1] for i in others], ["ok"])
            judge(build, "the blurred frame itself", [lines[at]], [drawn[at][1]], bad, 1.0)
        return run

    for at in (0, 3):
        for way in ((9, 1), (9, 9), (1, 15)):
            yield f"9 px of motion blur in frame {at}", blurred(at, way)


def random_skin(build, random):
    """A skin that is at rest, pressed in, pulled at a patch, sheared, or two of these at once."""
    sensor, r = build.sensor, build.sensor.radius
    pitch = r * build.pitch_rad()

    def one():
        place = build.at(random.uniform(0, 50), random.uniform(0, 360))
        kind = random.integers(4)
        if kind <= 1:
            return dent(sensor, place, r * random.uniform(0.05, 0.22), r * random.uniform(0.15, 0.4))
        along = np.cross(place - sensor.center, random.normal(size=3))
        way = along / np.linalg.norm(along) * pitch * random.uniform(0.3, 1.5)
        return pull(sensor, place, way, r * random.uniform(0.12, 0.4)) if kind == 2 else shear(sensor, way * [1, 1, 0])

    skins = [one() for _ in range(random.choice([0, 1, 1, 2]))]

    def skin(points):
        for change in skins:
            points = change(points)
        return points
    return skin


def random_patch(build, random):
    """A patch with a sharp edge anywhere, of a third of the dots at most, that lies 0.5 to 0.9 steps beside its place: of one of
    half of the dots it is not clear which half moved."""
    widest = min(5.0, np.sqrt(len(build.sensor.dots) / 3 / np.pi))
    way = random.integers(4) if random.random() < 0.6 else random.normal(size=3)
    stretch = random.uniform(1, 2) if random.random() < 0.4 else 1.0
    return build.patch(build.at(random.uniform(0, 50), random.uniform(0, 360)), way, random.uniform(0.5, 0.9), random.uniform(0.6, widest), stretch)


def random_frames(build, count, seed, name, skin):
    """Frames that have nothing to do with each other but their sensor: whatever may jump, jumps."""
    global failed
    random = np.random.default_rng(seed)
    drawn = [build.sensor.draw(seed=i, skin=skin(build, random)) for i in range(count)]
    lines, _ = build.track([frame for frame, _ in drawn])
    wrong, named, seen = [], 0, 0
    for i, (line, (_, truth)) in enumerate(zip(lines, drawn)):
        for index, dot in enumerate(line["black_dots"]):
            if dot["state"] != "ok":
                named += 1
                continue
            seen += 1
            off = np.hypot(*(np.array(dot["centroid_px"]) - truth[index]))
            if off > 0.4 * build.spacing[index]:
                wrong.append((i, index, round(float(off), 1)))
    failed += bool(wrong) or len(lines) != count
    print(f"{'FAIL' if wrong else 'ok  '} {count} random {name}, seed {seed}: {len(wrong)} swapped of {seen}, {named} withheld "
          f"{wrong[:12]}", flush=True)


def main(program, *builds):
    given = {"--only": None, "--random": 0, "--seed": 1}
    builds = list(builds)
    for option in given:
        if option in builds:
            at = builds.index(option)
            given[option] = type(given[option] or "")(builds[at + 1])
            del builds[at:at + 2]
    only, count, seed = given["--only"], int(given["--random"]), int(given["--seed"])
    for folder in builds:
        print(folder)
        build = Build(program, folder)
        off = np.abs(build.rest - [dot["image_px"] for dot in build.constants["black_dots"]]).max()
        print(f"     both projectors agree to {off:.1e} px")
        if not build.constants.get("key"):
            print("     no key: its pattern has no symmetry, or its design wants none")
            continue
        for name, run in scenarios(build):
            if only is None or only in name:
                run()
        if count:
            random_frames(build, count, seed, "touches", random_skin)
            random_frames(build, count // 2, seed, "patches", random_patch)
    print("every mark is itself, or named" if failed == 0 else f"{failed} faults")
    return 1 if failed else 0


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
