#!/usr/bin/env python3
"""What spoils frames that domecast did not draw: named scenarios, each with what may be off and what must be named.

    python3 scripts/check_faults.py target/release/domecast output/thumb24 [...] [--frames N] [--only NAME]

Frames are drawn by scripts/draw_frames.py and spoilt here by NumPy and OpenCV alone; `domecast track` reads the clean and the
spoilt ones with the build's constants. Each frame is held to the truth:

- no dot called `ok` is both more than 1 px and more than 5 of its `sd_px` from where it was drawn, and none is another's, but in
  frames that show another moment and are named so: `frozen`, `torn`;
- no frame called `ok` has a wrench that is both 0.1 N (1 N mm) and 5 `wrench_sd` from that of the same frame unspoilt;
- what the scenario says must be named is named, on the marks or the frames that are spoilt;
- no more dots are withheld than the scenario allows, and where it says so the frames are `ok` and as exact as clean ones.

What is beside the white markers is drawn and judged by scripts/check_surroundings.py.
"""
import functools
import sys

import cv2
import numpy as np

import check_surroundings
from check_identities import Build, dent

failed = 0
# What says that a frame, or a part of it, is of another moment.
OTHER_MOMENT = {"frozen", "torn"}
OFF_PX, OFF_SDS = 1.0, 5.0
OFF_N, OFF_NMM = 0.1, 1.0


def clip(frame):
    return np.clip(np.round(frame), 0, 255).astype(np.uint8)


def draw_over(frame, paint, level, about, reach, soft=0.6):
    """Something painted at eight times the frame's resolution, no farther than `reach` from a place, blurred as the lens
    does; `paint` fills a mask."""
    fine = 8
    reach = int(np.ceil(reach + 4 * soft + 2))
    low = np.maximum(np.floor(about).astype(int) - reach, 0)
    high = np.minimum(np.ceil(about).astype(int) + reach + 1, frame.shape[::-1])
    if (low >= high).any():
        return frame
    mask = np.zeros((fine * (high - low))[::-1], np.uint8)
    paint(mask, lambda p: tuple(int(round(v)) for v in (np.asarray(p, float) - low + 0.5) * fine - 0.5), fine)
    part = cv2.resize(mask.astype(np.float32) / 255, (high - low).tolist(), interpolation=cv2.INTER_AREA)
    part = cv2.GaussianBlur(part, (0, 0), soft)
    drawn = frame.copy()
    window = np.s_[low[1]:high[1], low[0]:high[0]]
    drawn[window] = clip(frame[window] * (1 - part) + level * part)
    return drawn


def disc(frame, at, radius, level, soft):
    def paint(mask, to, fine):
        cv2.circle(mask, to(at), int(round(radius * fine)), 255, -1)
    return draw_over(frame, paint, level, at, radius, soft)


def speck(frame, at, radius, level=25):
    return disc(frame, at, radius, level, 0.6)


def hair(frame, points, width=1.6, level=30):
    middle = np.mean(points, 0)

    def paint(mask, to, fine):
        cv2.polylines(mask, [np.array([to(p) for p in points], np.int32)], False, 255, max(1, int(round(width * fine))))
    return draw_over(frame, paint, level, middle, np.abs(points - middle).max() + width)


def bright_blob(frame, at, radius, level=250, soft=1.0):
    return disc(frame, at, radius, level, soft)


def cover(frame, at, half, level=40):
    def paint(mask, to, fine):
        cv2.rectangle(mask, to(np.subtract(at, half)), to(np.add(at, half)), 255, -1)
    return draw_over(frame, paint, level, at, np.max(half))


def shadow(frame, at, way, depth, soft):
    """One side of a line through a place darker, over a width."""
    height, width = frame.shape
    y, x = np.mgrid[0:height, 0:width]
    way = np.asarray(way, float) / np.linalg.norm(way)
    beyond = (x - at[0]) * way[0] + (y - at[1]) * way[1]
    part = 1 / (1 + np.exp(-np.clip(beyond / (0.3 * soft), -60, 60)))
    return clip(frame * (1 - depth * part))


def defocus(frame, radius):
    size = 2 * int(np.ceil(radius)) + 3
    y, x = np.mgrid[:size * 8, :size * 8] / 8 - size / 2 + 1 / 16
    kernel = cv2.resize((np.hypot(x, y) <= radius).astype(np.float32), (size, size), interpolation=cv2.INTER_AREA)
    noise = np.random.default_rng(9).normal(0, 0.8, frame.shape)
    return clip(cv2.filter2D(frame.astype(np.float32), -1, kernel / kernel.sum()) + noise)


def jpeg(frame, quality):
    return cv2.imdecode(cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, quality])[1], 0)


class Case:
    """Frames, what `track` says of clean ones of the same moments, where the dots were drawn, which dots are spoilt, and
    which lie beside what spoils them."""

    def __init__(self, build, clean):
        self.build, self.clean = build, clean
        self.frames, self.truths, self.spoilt_dots, self.beside = [], [], [], []

    def add(self, frame, truth, dots=(), beside=()):
        self.frames.append(frame)
        self.truths.append(truth)
        self.spoilt_dots.append(set(dots))
        self.beside.append(set(beside))


def moved(i):
    """The platform's motion in a moment: a push that goes round, and a slow twist."""
    return {"shift": (0.06 * np.sin(0.5 * i), 0.06 * (1 - np.cos(0.5 * i)), -0.05 * (1 - np.cos(0.4 * i))), "turn": (0, 0, 0.004 * np.sin(0.3 * i))}


def judge(case, name, must=None, allowed=None, dots_named=0.0, may_lack=0.02, must_frames=None, exact=None, also=()):
    """`must`: a status that the spoilt frames (`must_frames`; all) must have among their problems, or one of `also`; `allowed`: statuses that
    may be; `dots_named`: the share of spoilt dots that are more than 1 px off in truth or not `ok`, of ..; `exact`: rms px."""
    global failed
    build = case.build
    lines, _ = build.track(case.frames)
    why = []
    wrong, worst, swapped, lacking, squares, named, off_wrench = 0, 0.0, 0, 0, [], 0, 0
    worst_wrench = 0.0
    states = {}
    for i, (line, still, truth) in enumerate(zip(lines, case.clean, case.truths)):
        lacks = 0
        for index, dot in enumerate(line["black_dots"]):
            if dot["state"] != "ok":
                states[dot["state"]] = states.get(dot["state"], 0) + 1
                lacks += index not in case.spoilt_dots[i] | case.beside[i]
                named += index in case.spoilt_dots[i]
                continue
            off = np.hypot(*(np.array(dot["centroid_px"]) - truth[index]))
            wrong += off > OFF_PX and off > OFF_SDS * dot["sd_px"] and not OTHER_MOMENT & set(line["problems"])
            swapped += off > 0.4 * build.spacing[index]
            worst = max(worst, off)
            squares.append(off**2)
        # without its key a frame gives no dot a number
        if "key_unsure" not in line["problems"]:
            lacking = max(lacking, lacks)
        for marker in line["white_markers"]:
            if marker["state"] != "ok":
                states["marker " + marker["state"]] = states.get("marker " + marker["state"], 0) + 1
        if line["wrench"] and still["wrench"]:
            off, sd = np.abs(np.subtract(line["wrench"], still["wrench"])), np.array(line["wrench_sd"])
            limits = np.maximum([OFF_N] * 3 + [OFF_NMM] * 3, 5 * sd)
            worst_wrench = max(worst_wrench, off[:3].max())
            off_wrench += line["status"] == "ok" and bool((off > limits).any())
    said = [line["status"] for line in lines]
    if wrong:
        why.append(f"{wrong} dots wrong at ok")
    if swapped:
        why.append(f"{swapped} swapped")
    if off_wrench:
        why.append(f"wrench wrong at ok in {off_wrench}")
    if must is not None:
        frames = range(len(lines)) if must_frames is None else must_frames
        without = [i for i in frames if not {must, *also} & set(lines[i]["problems"])]
        if without:
            why.append(f"{must} not said in {without}")
    if allowed is not None and not set(said) <= set(allowed):
        why.append(f"said {sorted(set(said) - set(allowed))}")
    if lacking > max(may_lack * len(case.truths[0]), 1):
        why.append(f"{lacking} withheld")
    rms = np.sqrt(np.mean(squares)) if squares else np.inf
    if exact is not None and rms > exact:
        why.append(f"rms {rms:.4f} px")
    spoilt = sum(map(len, case.spoilt_dots))
    if spoilt and named < dots_named * spoilt:
        why.append(f"{named} of {spoilt} spoilt dots named")
    failed += bool(why)
    shown = {status: said.count(status) for status in dict.fromkeys(said)}
    print(f"{'FAIL' if why else 'ok  '} {name:<44} rms {rms:.4f} max {worst:.2f} px, wrench {worst_wrench:.3f} N, {named}/{spoilt} named, "
          f"{lacking} withheld, {shown} {states}" + (f"  <- {'; '.join(why)}" if why else ""), flush=True)


def scenarios(build, count):
    sensor = build.sensor
    rng = np.random.default_rng(11)
    ok = ["ok"]
    height = sensor.size[1]
    near = [i for i in range(len(build.rest)) if np.hypot(*(build.rest[i] - build.center)) < 0.42 * height]
    dot_px = 0.5 * np.median(sensor.diameters) * np.linalg.norm(build.rest[near[0]] - build.rest[near[1]]) / np.linalg.norm(
        sensor.dots[near[0]] - sensor.dots[near[1]])

    length = max(8, count)
    usual_way = (lambda i: {}) if build.is_rigid else moved

    # Scenarios one after the other mostly share their frames.
    @functools.lru_cache(maxsize=3)
    def drawn(way):
        """Clean frames along a way (what to draw in a moment), where their dots are, and what `track` says of them."""
        frames, truths = zip(*(sensor.draw(seed=i, **way(i)) for i in range(length)))
        return frames, truths, build.track(frames)[0]

    def changed(frame, spoilt, truth):
        """Dots within their diameter of something that was painted."""
        far = cv2.absdiff(spoilt, frame) <= 20
        near = cv2.distanceTransform(far.astype(np.uint8), cv2.DIST_L2, 5) < 2 * dot_px
        at = np.clip(np.round(truth).astype(int), 0, np.array(near.shape[::-1]) - 1)
        return np.flatnonzero(near[at[:, 1], at[:, 0]])

    def spoil(name, effect, n=count, way=usual_way, **what):
        """`effect(frame, truth, i)` gives the frame, or the frame and which dots it spoilt."""
        def run():
            frames, truths, clean = drawn(way)
            case = Case(build, clean)
            for i, frame, truth in zip(range(n), frames, truths):
                spoilt = effect(frame, truth, i)
                spoilt, dots = spoilt if isinstance(spoilt, tuple) else (spoilt, ())
                case.add(spoilt, truth, dots, changed(frame, spoilt, truth) if len(dots) else ())
            judge(case, name, **what)
        return name, run

    def picked(i):
        return np.random.default_rng(100 + i // 3).choice(near, min(10, len(near) // 8), replace=False)

    # --- frames that are well, whatever the camera does to them
    yield spoil("clean", lambda f, t, i: f, allowed=ok, exact=0.035)
    yield spoil("gamma 0.6", lambda f, t, i: clip(255 * (f / 255.0) ** 0.6), allowed=ok, exact=0.04)
    yield spoil("gamma 1.6", lambda f, t, i: clip(255 * (f / 255.0) ** 1.6), allowed=ok, exact=0.04)
    yield spoil("flicker of 5 %", lambda f, t, i: clip(f * (1 + 0.05 * (-1) ** i)), allowed=ok, exact=0.035)
    yield spoil("noise of 4 levels", lambda f, t, i: clip(f + rng.normal(0, 4, f.shape)), allowed=ok, exact=0.06)
    yield spoil("JPEG 15", lambda f, t, i: jpeg(f, 15), allowed=["ok", "three_markers"], exact=0.12)
    yield spoil("JPEG 60", lambda f, t, i: jpeg(f, 60), allowed=ok, exact=0.05)
    yield spoil("sharpened by the camera", lambda f, t, i: clip(2 * f.astype(float) - cv2.GaussianBlur(f, (0, 0), 1.2)), allowed=ok, exact=0.04)
    yield spoil("light from one side", lambda f, t, i: clip(f * np.linspace(0.6, 1.1, f.shape[1])[None]), allowed=ok, exact=0.035)
    yield spoil("half of the light", lambda f, t, i: clip(0.5 * f), allowed=ok, exact=0.04)
    yield spoil("a lens a little soft", lambda f, t, i: clip(cv2.GaussianBlur(f, (0, 0), 0.6)), allowed=ok, exact=0.035)
    for polar in (0, 35):
        touch = dent(sensor, build.at(polar), 0.1 * sensor.radius, 0.25 * sensor.radius)
        yield spoil(f"a touch of 1 mm in 10 at {polar} deg", lambda f, t, i: f, way=lambda i, touch=touch: {**usual_way(i), "skin": touch}, allowed=ok, exact=0.04)

    # --- dots
    def specks(radius, far):
        def effect(frame, truth, i):
            dots = picked(i)
            for k, dot in enumerate(dots):
                a = 0.7 * k
                frame = speck(frame, truth[dot] + far * dot_px * np.array([np.cos(a), np.sin(a)]), radius * dot_px)
            return frame, dots
        return effect

    usual = ["ok", "dots_lost"]
    yield spoil("10 specks of dust at dots' edges", specks(0.6, 1.2), allowed=usual, dots_named=0.8)
    yield spoil("10 small specks at dots' edges", specks(0.3, 1.1), allowed=usual)
    yield spoil("10 specks of a dot's size beside dots", specks(1.0, 1.9), allowed=usual, dots_named=0.5)
    yield spoil("10 grey specks", lambda f, t, i: (
        [f := speck(f, t[d] + dot_px * np.array([1.2, 0.3]), 0.7 * dot_px, 90) for d in picked(i)][-1], picked(i)), allowed=usual)

    def hairs(frame, truth, i):
        local = np.random.default_rng(50 + i // 3)
        points = [build.center + 0.3 * height * np.array([np.cos(a), np.sin(a)]) * (1 + 0.2 * local.normal()) for a in np.linspace(0, 4, 12)]
        spoilt = hair(frame, points)
        return spoilt, changed(frame, spoilt, truth)
    yield spoil("a hair", hairs, allowed=usual + ["three_markers"])
    yield spoil("a thin hair", lambda f, t, i: hair(f, [build.center + np.array([-200, -20 + i % 60]), build.center + np.array([200, 40])], 0.8, 60), allowed=usual, may_lack=0.1)

    def blobs(size, far, level=250):
        def effect(frame, truth, i):
            dots = picked(i)
            for k, dot in enumerate(dots):
                a = 0.7 * k
                frame = bright_blob(frame, truth[dot] + far * dot_px * np.array([np.cos(a), np.sin(a)]), size * dot_px, level)
            return frame, dots
        return effect
    yield spoil("10 specular blobs on dots' edges", blobs(0.7, 0.8), allowed=usual, dots_named=0.8)
    yield spoil("10 specular blobs beside dots", blobs(1.0, 1.6), allowed=usual)
    yield spoil("10 broad specular blobs", blobs(2.5, 2.0, 220), allowed=usual + ["key_unsure"], may_lack=0.25)

    def prints(steps, length):
        def effect(frame, truth, i):
            dots = picked(i)
            for k, dot in enumerate(dots):
                a = 0.7 * k
                for s in np.linspace(0, length, steps + 1)[1:]:
                    frame = speck(frame, truth[dot] + s * dot_px * np.array([np.cos(a), np.sin(a)]), dot_px)
            return frame, dots
        return effect
    yield spoil("10 dots printed double", prints(1, 1.2), allowed=usual, dots_named=0.8)
    yield spoil("10 dots printed double, far", prints(1, 1.8), allowed=usual, dots_named=0.8)
    yield spoil("10 dots smeared", prints(4, 1.6), allowed=usual, dots_named=0.8)
    yield spoil("10 dots half covered", lambda f, t, i: (
        [f := cover(f, t[d] + [dot_px, 0], [dot_px, 1.5 * dot_px], 150) for d in picked(i)][-1], picked(i)), allowed=usual, dots_named=0.8)

    # --- light
    for depth in (0.3, 0.6):
        for soft in (1.0, 3.0, 8.0):
            def effect(frame, truth, i, depth=depth, soft=soft):
                return shadow(frame, build.center + [0.1 * height * np.sin(i), 13.0 * i % 156 - 40], [1, 0.4 * np.cos(i)], depth, soft)
            yield spoil(f"the edge of a shadow of {100 * depth:.0f} %, {soft:g} px wide", effect, allowed=usual + ["exposure_jump", "three_markers"], may_lack=0.1)

    # --- frames
    yield spoil("defocus of 1 px", lambda f, t, i: defocus(f, 1.0), allowed=["ok", "blurred"])
    yield spoil("defocus of 2 px", lambda f, t, i: defocus(f, 2.0), must="blurred", may_lack=1)
    yield spoil("defocus of 3 px", lambda f, t, i: defocus(f, 3.0), must="blurred", may_lack=1)
    for way in ((5, 1), (1, 5), (9, 1)):
        yield spoil(f"motion blur {way} of one frame", lambda f, t, i, way=way: cv2.blur(f, way) if i == 3 else f,
                    n=max(6, count), must="blurred", must_frames=[3], may_lack=1)

    def sequence(name, make, step, **what):
        """`make(frames)` changes a sequence that moves by `step` (shift mm, turn rad) a frame."""
        def run():
            frames, truths, clean = drawn(step)
            case = Case(build, clean)
            for frame, truth in zip(make(list(frames)), truths):
                case.add(frame, truth)
            judge(case, name, **what)
        return name, run

    def back(i):
        """On for seven frames, back for seven."""
        return abs((i + 7) % 14 - 7)

    step = (lambda i: {}) if build.is_rigid else (lambda i: {"shift": (0.05 * back(i), 0.02 * back(i), -0.02 * back(i))})
    up = (lambda i: {}) if build.is_rigid else (lambda i: {"shift": (0.0, 0.06 * back(i), 0)})
    # Where the way turns nothing says that it should go on.
    every = lambda first: range(first, length, 14)
    wherever = range(5, length, 15)

    def woven(frames):
        spoilt = [f.copy() for f in frames]
        for i in range(1, len(frames)):
            spoilt[i][1::2] = frames[i - 1][1::2]
        return spoilt

    def torn(at):
        def make(frames):
            whole = frames[:]
            for i in every(4):
                frames[i] = frames[i].copy()
                frames[i][at:] = whole[i - 1][at:]
            return frames
        return make

    def again(noise, moments):
        def make(frames):
            for i in moments:
                frames[i] = clip(frames[i - 1] + np.random.default_rng(3 + i).normal(0, noise, frames[i - 1].shape))
            return frames
        return make

    def brighter(by):
        def make(frames):
            return [clip(f * by) if i % 14 > 3 else f for i, f in enumerate(frames)]
        return make

    if not build.is_rigid:
        # where the way turns a woven frame is the last one, its rows exchanged
        everywhere = range(1, length)
        yield sequence("interlaced, moving sideways", woven, step, must="interlaced", also=["frozen"], must_frames=everywhere, may_lack=1)
        yield sequence("interlaced, moving along columns", woven, up, must="interlaced", also=["frozen"], must_frames=everywhere, may_lack=1)
        yield sequence("torn in the middle", torn(height // 2), step, must="torn", must_frames=every(4), may_lack=1)
        yield sequence("torn above", torn(height // 3), step, must="torn", also=["frozen"], must_frames=every(4), may_lack=1)
        yield sequence("torn, moving along columns", torn(height // 2), up, must="torn", must_frames=every(4), may_lack=1)
        yield sequence("a frame again", again(0, wherever), step, must="frozen", must_frames=wherever)
        yield sequence("a frame again, with a little noise", again(0.4, wherever), step, must="frozen", must_frames=wherever)
        yield sequence("a frame again, with as much noise", again(1.0, every(5)), step, must="frozen", must_frames=every(5))
        yield sequence("moving", lambda f: f, step, allowed=ok, exact=0.035)
        yield sequence("starting and stopping", lambda f: f, lambda i: {"shift": (0.05 * min(max(i % 14 - 2, 0), 3), 0, 0)}, allowed=["ok", "frozen"], exact=0.03)
    for by in (0.6, 1.4):
        yield sequence(f"exposure jumps to {100 * by:.0f} %", brighter(by), step, must="exposure_jump", must_frames=every(4))
    yield sequence("exposure creeps by 3 % a frame", lambda fs: [clip(f * 0.97**back(i)) for i, f in enumerate(fs)], step, allowed=ok, exact=0.035)

    # --- markers
    if build.is_rigid:
        return
    marker_at = lambda i, k: sensor.project(sensor.markers[k], **{"turn": moved(i).get("turn"), "shift": moved(i)["shift"]})
    marker_px = 0.5 * sensor.marker_diameters[0] * np.linalg.norm(sensor.project(sensor.markers[0] + [0.1, 0, 0]) - sensor.project(sensor.markers[0])) / 0.1

    def on_marker(effect):
        return lambda f, t, i: effect(f, marker_at(i, i // 3 % 4), i)
    marked = ["ok", "three_markers"]
    yield spoil("glare beside a marker", on_marker(lambda f, at, i: bright_blob(f, at + marker_px * np.array([1.0, 0.4]), 0.8 * marker_px)), allowed=marked)
    yield spoil("broad glare on a marker", on_marker(lambda f, at, i: bright_blob(f, at + marker_px * np.array([0.9, -0.5]), 1.2 * marker_px, 235, 2.5)), allowed=marked)
    yield spoil("a marker a third covered", on_marker(lambda f, at, i: cover(f, at + marker_px * np.array([1.2, 0]), 0.9 * marker_px)), allowed=marked)
    yield spoil("a marker a tenth covered", on_marker(lambda f, at, i: cover(f, at + marker_px * np.array([1.7, 0]), 0.9 * marker_px)), allowed=marked)
    yield spoil("dirt on a marker's edge", on_marker(lambda f, at, i: speck(f, at + marker_px * np.array([0.6, 0.7]), 0.4 * marker_px, 50)), allowed=marked)
    yield spoil("a shadow across a marker", on_marker(lambda f, at, i: shadow(f, at, [1, 0.3], 0.4, 2.0)), allowed=marked + ["exposure_jump", "markers_missing", "two_markers"], may_lack=0.3)


def main(program, *arguments):
    global failed
    arguments = list(arguments)
    only, count = None, 4
    for option in ("--only", "--frames"):
        if option in arguments:
            at = arguments.index(option)
            value = arguments[at + 1]
            del arguments[at:at + 2]
            only, count = (value, count) if option == "--only" else (only, int(value))
    for folder in arguments:
        print(folder)
        build = Build(program, folder)
        listed = list(scenarios(build, count))
        for name, run in listed:
            if only is None or only in name:
                run()
        if not build.is_rigid:
            failed += check_surroundings.check(build, 0 if only else 8, only=only)
        print(f"     {len(listed)} scenarios")
    print("nothing is wrong in silence" if failed == 0 else f"{failed} faults")
    return 1 if failed else 0


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
