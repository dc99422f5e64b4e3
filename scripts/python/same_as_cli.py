"""The installed wheel gives what the command line gives, bit for bit; it runs where only the wheel and numpy are installed.

    same_as_cli.py DOMECAST REPOSITORY WORK MODEL FRAMES [ACCURACY]

MODEL: one of hardness. FRAMES: how many frames must leave the memory as it was. ACCURACY: the folder of `domecast accuracy --quick` of thumb24, which is made
where it is not given.
"""

import importlib.util
import json
import os
import subprocess
import sys
import threading
import time
import warnings
import zlib
from pathlib import Path

BEGAN = time.perf_counter()
import domecast  # noqa: E402

IMPORT_S = time.perf_counter() - BEGAN
NUMPY_CAME_WITH_IT = "numpy" in sys.modules

import numpy as np  # noqa: E402

DOMECAST, REPOSITORY, WORK, MODEL, FRAMES = sys.argv[1], *map(Path, sys.argv[2:5]), int(sys.argv[5])
DESIGN = REPOSITORY / "designs/thumb24.json"
FAULTS = []


def check(is_so, what):
    print(f"{'ok  ' if is_so else 'FAIL'} {what}")
    if not is_so:
        FAULTS.append(what)


def cli(*words, inputs=None):
    done = subprocess.run([DOMECAST, *map(str, words)], capture_output=True, text=True, cwd=WORK, input=inputs)
    if done.returncode != 0:
        sys.exit(f"{words}: {done.stdout[-500:]}{done.stderr[-2000:]}")
    return done.stdout


def read_png(path):
    """A PNG of 8 bits, grey or RGB: numpy alone is installed here."""
    data = path.read_bytes()
    at, body, head = 8, b"", None
    while at < len(data):
        length, kind = int.from_bytes(data[at:at + 4], "big"), data[at + 4:at + 8]
        chunk = data[at + 8:at + 8 + length]
        head = chunk if kind == b"IHDR" else head
        body += chunk if kind == b"IDAT" else b""
        at += 12 + length
    width, height, step = int.from_bytes(head[:4], "big"), int.from_bytes(head[4:8], "big"), 3 if head[9] == 2 else 1
    rows = np.frombuffer(zlib.decompress(body), np.uint8).reshape(height, 1 + width * step)
    out = np.zeros((height, width, step), np.uint8)
    above = np.zeros((width, step), np.uint8)
    for y in range(height):
        row = rows[y, 1:].reshape(width, step)
        match rows[y, 0]:
            case 0: above = row
            case 1: above = np.cumsum(row, axis=0, dtype=np.uint8)
            case 2: above = row + above
            case _: above = slow_filter(rows[y, 0], row, above)
        out[y] = above
    return out if step == 3 else out[:, :, 0]


def slow_filter(kind, row, above):
    now, left, corner = np.zeros_like(row), np.zeros(row.shape[1], int), np.zeros(row.shape[1], int)
    for x in range(len(row)):
        up = above[x].astype(int)
        if kind == 3:
            guess = (left + up) // 2
        else:
            sums = left + up - corner
            ways = np.abs([sums - left, sums - up, sums - corner])
            guess = np.where((ways[0] <= ways[1]) & (ways[0] <= ways[2]), left, np.where(ways[1] <= ways[2], up, corner))
        corner = up
        left = (row[x] + guess) & 255
        now[x] = left
    return now


def optics(design):
    random = np.random.default_rng(1)
    uv = random.uniform([-20, -20], [660, 500], (500, 2))
    lines = cli("trace", DESIGN, "--pixels", "-", inputs=json.dumps(uv.tolist())).splitlines()
    told = [json.loads(line) for line in lines]
    xyz, status = design.optics().trace(uv)
    check([one["status"] for one in told] == status.tolist(), f"trace: statuses of {len(uv)} pixels, {len(set(status.tolist()))} kinds")
    check(all(one["surface_mm"] is None and np.isnan(at).all() or one["surface_mm"] == at.tolist() for one, at in zip(told, xyz)),
          "trace: points")
    seen = xyz[status == "ok"]
    lines = cli("project", DESIGN, "--points", "-", inputs=json.dumps(seen.tolist())).splitlines()
    back, states = design.optics().project(seen)
    check([json.loads(line)["image_px"] for line in lines] == back.tolist() and set(states.tolist()) == {"ok"}, "project: pixels")
    same, _ = design.optics().trace(np.asfortranarray(uv))
    check(np.array_equal(same, xyz, equal_nan=True), "trace: of an array that is not contiguous")


def builds(design):
    made = design.build(WORK / "by-python")
    cli("build", DESIGN, "--out", WORK / "by-cli", "--quiet")
    own, other = [json.loads((WORK / place / "manifest.json").read_text()) for place in ("by-python", "by-cli")]
    check(own == other and made["manifest"] == own, f"build: a manifest of {len(own['files'])} hashed files")
    cli("check", WORK / "by-python", "--quiet")
    constants = (WORK / "by-cli/constants/constants.json").read_text()
    check(design.sensor().json() == constants, "sensor() of a design: the build's constants.json")
    check(domecast.Sensor.from_str(constants).json() == constants, "a Sensor keeps its file")
    (WORK / "by-python/mine.txt").write_text("mine")
    try:
        design.build(WORK / "by-python")
        check(False, "a folder that holds a user's file is not built over")
    except domecast.DomecastError as error:
        check("mine.txt" in str(error), "a folder that holds a user's file is not built over")


def edits(design):
    edited = design.copy()
    edited["leds"]["tilt_deg"] = np.float64(80)
    edited.save(WORK / "edited.json")
    check(domecast.Design.load(WORK / "edited.json").text == edited.text, "an edited design is saved as it stands")
    check(design.text == DESIGN.read_text() and design["leds"] != edited["leds"], "the other stays as it was read")
    for field, value, named in [("leds", {"tilt_deg": "steep"}, "leds.tilt_deg"), ("dome", {"radius_mm": -1}, "dome.radius_mm"),
                                ("dome", {"radius_mm": float("nan")}, "dome.radius_mm"), ("dome", {"radius_mm": object()}, "dome.radius_mm")]:
        wrong = design.copy()
        wrong[field].update(value)
        try:
            wrong.layout()
            check(False, f"{value} is refused")
        except domecast.DomecastError as error:
            check(error.field == named and bool(error.allowed), f"{value}: `{error.field}`; allowed: {error.allowed}")


def simulated(name, *options, **keywords):
    out = WORK / f"simulated-{name}"
    cli("simulate", REPOSITORY / f"designs/scenes/{name}.json", "--out", out, *options, "--quiet")
    scene = domecast.Scene.load(REPOSITORY / f"designs/scenes/{name}.json", **keywords)
    truths = [json.loads(line) for line in (out / "truth.jsonl").read_text().splitlines()]
    frames = []
    for (frame, truth), known in zip(scene.frames(), truths, strict=True):
        pixels = read_png(out / f"frame_{known['frame']:04}.png")
        check(np.array_equal(frame, pixels) and truth == known, f"simulate {name}: frame {known['frame']} and its truth")
        frames.append(np.array(frame))
    check(scene.plan() == {key: value for key, value in json.loads((out / "plan.json").read_text()).items()}, f"simulate {name}: plan")
    return out, frames


def tracks(folder, frames):
    constants = WORK / "by-cli/constants/constants.json"
    sensor = domecast.Sensor.load(constants)
    lines = cli("track", folder, "--constants", constants).splitlines()

    def lines_of(frames, rgb, **options):
        tracker = domecast.Tracker(sensor, **options)
        return [tracker.update(frame, rgb=rgb) for frame in frames]

    readings = lines_of(frames, True)
    check([reading.json() for reading in readings] == lines, f"track: {len(lines)} lines")
    check([reading.json() for reading in lines_of([frame[:, :, ::-1] for frame in frames], False)] == lines, "track: blue first, a view")
    some = cli("track", folder, "--constants", constants, "--fields", "wrench,pose").splitlines()
    check([reading.json(["wrench", "pose"]) for reading in readings] == some, "track: chosen fields")
    gray = cli("track", folder, "--constants", constants, "--channel", "green", "--reference", "2").splitlines()
    check([reading.json() for reading in lines_of(frames, True, channel="green", reference=2)] == gray, "track: options")
    gravity = [(9.81 * np.sin(k), 0.1 * k, -9.81 * np.cos(k)) for k in range(len(frames))]
    (WORK / "gravity.txt").write_text("".join(" ".join(repr(float(v)) for v in one) + "\n" for one in gravity))
    weighed = cli("track", folder, "--constants", constants, "--reference", "2", "--gravity", WORK / "gravity.txt").splitlines()
    tracker = domecast.Tracker(sensor, reference=2)
    told = []
    for frame, one in zip(frames, gravity):
        tracker.set_gravity(one)
        told.append(tracker.update(frame, rgb=True).json())
    check(told == weighed, "track --gravity: lines")
    try:
        domecast.Tracker(sensor).set_gravity((0, 0, -9.81))
        check(False, "gravity without a reference is refused")
    except domecast.DomecastError as error:
        check("reference" in str(error), f"gravity without a reference: {error}")
    forces = domecast.Traction(sensor)
    pressed = cli("track", folder, "--constants", constants, "--traction").splitlines()
    check([forces.update(reading).json() for reading in readings] == pressed, "track --traction: lines")
    for reading, line in zip(readings, map(json.loads, lines)):
        same = [reading.status == line["status"], reading.problems == line["problems"]]
        for name in ("wrench", "wrench_sd"):
            value = getattr(reading, name)
            same.append(line[name] is None if value is None else np.allclose(value, line[name], atol=6e-7, rtol=0))
        dots = reading.dots
        same.append(dots["state"].tolist() == [dot["state"] for dot in line["black_dots"]])
        same += [bool(np.isnan(own).all()) if dot["image_px"] is None else bool(np.allclose(own, dot["image_px"], atol=6e-5, rtol=0))
                 for own, dot in zip(dots["image_px"], line["black_dots"])]
        if not all(same):
            check(False, f"attributes of frame {reading.frame} are those of the line")
            break
    return sensor, lines


def shapes(folder, frames, rest):
    constants = WORK / "by-cli/constants/constants.json"
    lines = cli("track", folder, "--constants", constants, "--shape", WORK / "maps", "--rest", rest, "--traction").splitlines()
    sensor = domecast.Sensor.load(constants)
    tracker = domecast.Tracker(sensor)
    shape, forces = domecast.Shape(sensor, tracker), domecast.Traction(sensor, correlation_mm=1)
    shape.set_rest(read_png(rest), rgb=True)
    forces.set_rest(domecast.Tracker(sensor).update(read_png(rest), rgb=True))
    for number, (frame, line) in enumerate(zip(frames, lines, strict=True)):
        reading = tracker.update(frame, rgb=True)
        found = shape.update(frame, reading, rgb=True)
        same = [np.array_equal(getattr(found, own), np.load(WORK / f"maps/frame_{number:04}.{name}.npy"), equal_nan=True)
                for own, name in [("height_mm", "height"), ("height_sd_mm", "height_sd"), ("normal", "normal"), ("touched", "contact")]]
        pressed = forces.update(reading, shape=found)
        pressure = forces.pressure(found)[0]
        same.append(np.array_equal(pressure, np.load(WORK / f"maps/frame_{number:04}.pressure.npy"), equal_nan=True))
        check(all(same) and pressed.json(shape=found) == line, f"track --shape --traction: frame {number}, its maps and line")
        if number:
            pictures = [found._repr_png_(), reading._repr_png_(), reading.overlay_png(frame, rgb=True, shape=found, forces=pressed)]
            check(all(one.startswith(b"\x89PNG") for one in pictures), "pictures of a touch")
    for order in ([2, 1, 0], [1, 2, 0], [0, 2, 1]):
        try:
            shape.update(np.ascontiguousarray(frames[-1][:, :, order]), reading, rgb=True)
            check(False, f"shape: a frame with its colours as {order} is refused")
        except domecast.DomecastError as error:
            check("another order" in str(error), f"shape: {error}")
    for name in ("picam-r20", "thumb24-wide"):
        found = domecast.Traction(domecast.Design.load(REPOSITORY / f"designs/{name}.json").sensor()).update(reading)
        check(found.status == "foreign_reading" and found.contact is None and not len(found.dots), f"traction by the constants of {name}: {found!r}")
    for magnify in (1e5, 1e9, -1e9, 1e300, float("inf"), float("nan")):
        check(reading.overlay_png(frames[-1], rgb=True, magnify=magnify).startswith(b"\x89PNG"), f"an overlay magnified {magnify} times")
    swapped = read_png(rest)[:, :, ::-1]
    for name, call in [("tracker", lambda: domecast.Tracker(sensor).update(swapped, rgb=True)),
                       ("shape", lambda: shape.set_rest(swapped, rgb=True))]:
        try:
            call()
            check(False, f"{name}: colours that fit only when swapped are refused")
        except domecast.DomecastError as error:
            check("swapped" in str(error), f"{name}: {error}")


def hardness(folder, frames, rest):
    """By contact mechanics, and by MODEL beside it: the members of the lines that `track` writes."""
    constants, travel = WORK / "by-cli/constants/constants.json", WORK / "travel.txt"
    moved = [0.4 * number for number in range(len(frames))]
    travel.write_text("".join(f"{mm}\n" for mm in moved))
    sensor = domecast.Sensor.load(constants)
    lines = cli("track", folder, "--constants", constants, "--shape", WORK / "maps", "--rest", rest, "--traction",
                "--travel", travel, "--travel-sd", 0.05, "--hardness", MODEL, "--force").splitlines()
    tracker, plain = domecast.Tracker(sensor), read_png(rest)
    untouched = tracker.update(plain, rgb=True)
    tracker.restart()
    shape, forces = domecast.Shape(sensor, tracker), domecast.Traction(sensor, correlation_mm=1)
    shape.set_rest(plain, rgb=True)
    forces.set_rest(untouched)
    touch, model = domecast.ContactHardness(sensor, untouched, travel_sd_mm=0.05), domecast.HardnessModel.load(MODEL)
    model.set_rest(plain, untouched, rgb=True)
    said = set()
    for frame, travel_mm, line in zip(frames, moved, map(json.loads, lines), strict=True):
        reading = tracker.update(frame, rgb=True)
        skin = shape.update(frame, reading, rgb=True)
        by_contact = touch.update(forces.update(reading, shape=skin), skin, travel_mm=travel_mm)
        by_model = model.update(frame, reading, rgb=True, shape=skin, contact=by_contact)
        for found, wanted in ((by_contact, line["contact_hardness"]), (by_model, line["hardness"])):
            said.add(found and (found.status, found.reason))
            same = found is None if wanted is None else found is not None and json.loads(found.json()) == wanted
            if found is not None and wanted is not None:
                same &= found.log10_youngs_modulus_mpa == wanted["log10_youngs_modulus_mpa"] and found.status == wanted["status"]
                same &= found.interval_90 == (wanted["interval_90"] and tuple(wanted["interval_90"]))
                same &= (found.class_name, found.frames) == (wanted.get("class"), wanted.get("frames"))
            if not same:
                check(False, f"hardness of frame {reading.frame}: {found and found.json()} of {wanted}")
    check(len(said) > 3, f"hardness as track --travel --hardness states it: {said}")
    turned = domecast.Tracker(sensor, camera_turned_deg=90.0).update(plain, rgb=True)
    refused = [("a model without a rest", lambda: domecast.HardnessModel.load(MODEL).update(frame, reading, rgb=True)),
               ("a turned camera", lambda: model.set_rest(plain, turned, rgb=True)),
               ("a rest without a wrench", lambda: domecast.ContactHardness(sensor, tracker.skip())),
               ("a model's hardness for contact mechanics'", lambda: model.update(frame, reading, rgb=True, contact=by_model)),
               ("travel that is none", lambda: touch.update(forces.update(reading, shape=skin), skin, travel_mm=float("nan")))]
    for what, call in refused:
        try:
            call()
            check(False, f"{what} is refused")
        except domecast.DomecastError as error:
            check(True, f"{what}: {error}")


def calibrations(simulated):
    constants = WORK / "by-cli/constants/constants.json"
    tree = json.loads(constants.read_text())
    random = np.random.default_rng(3)
    motions = random.uniform(-1, 1, (40, 6)) * [0.1, 0.1, 0.1, 0.005, 0.005, 0.005]
    wrenches = motions @ np.array(tree["springs"]["stiffness"]).T * (1 + random.normal(0, 0.005, (40, 6)))
    table = ["tx,ty,tz,rx,ry,rz,Fx,Fy,Fz,Mx,My,Mz", *(",".join(map(repr, map(float, row))) for row in np.hstack([motions, wrenches]))]
    (WORK / "force.csv").write_text("\n".join(table) + "\n")
    rows = ["frame,kind,id,u,v"]
    for line in (simulated / "truth.jsonl").read_text().splitlines():
        truth = json.loads(line)
        for kind, name in (("white", "white_markers"), ("black", "black_dots")):
            rows += [f"{truth['frame']},{kind},{one['id']},{u!r},{v!r}" for one in truth[name] if one["visible"] for u, v in [one["centroid_px"]]]
    (WORK / "seen.csv").write_text("\n".join(rows) + "\n")
    for command, call, table in [("calibrate-force", domecast.calibrate_force, "force.csv"), ("calibrate-optics", domecast.calibrate_optics, "seen.csv")]:
        known = json.loads(cli(command, table, constants, "--out", WORK / f"{command}-1.json", "--json"))
        found = call(WORK / table, constants, out=WORK / f"{command}-2.json")
        same = (WORK / f"{command}-1.json").read_bytes() == (WORK / f"{command}-2.json").read_bytes()
        check(same and {**found, "constants": ""} == {**known, "constants": ""}, f"{command}: file and result")
        try:
            call(WORK / "missing.csv", constants, out=WORK / "none.json")
            check(False, f"{command}: a table that is not there")
        except domecast.DomecastError as error:
            check(error.file is not None and "missing.csv" in error.file, f"{command}: {error}")


def lights(constants, frames):
    """Frames that no lights can be fitted to: the same fault. What is fitted is judged by check_light_calibration.py."""
    words = [frames, constants, "--ball-radius-mm", "4"]
    done = subprocess.run([DOMECAST, "calibrate-light", *map(str, words), "--json"], capture_output=True, text=True, cwd=WORK)
    known = json.loads(done.stdout)["error"]
    try:
        domecast.calibrate_light(frames, constants, ball_radius_mm=4)
        check(False, "calibrate-light: frames of no ball are refused")
    except domecast.DomecastError as error:
        same = (error.file, error.allowed) == (known["file"], known["allowed"])
        check(done.returncode == 1 and same and str(error) == known["message"], f"calibrate-light: {error}")


def prints():
    """A measured test print: file and result."""
    tree = json.loads((WORK / "by-cli/constants/constants.json").read_text())
    random = np.random.default_rng(25)
    rows = [(dot["id"], *(1.002 * np.array(dot["surface_mm"][:2]) + random.normal(0, 0.01, 2)).tolist()) for dot in tree["black_dots"]]
    (WORK / "print.csv").write_text("id,x_mm,y_mm\n" + "".join(f"{i},{x!r},{y!r}\n" for i, x, y in rows))
    known = json.loads(cli("calibrate-print", "print.csv", DESIGN, "--out", WORK / "print-1.json", "--json"))
    found = domecast.calibrate_print(WORK / "print.csv", DESIGN, out=WORK / "print-2.json")
    # the designs are named by their files
    texts = [(WORK / f"print-{k}.json").read_text().replace(f"print-{k}", "print") for k in (1, 2)]
    told = [json.dumps(one).replace(f"print-{k}", "print") for k, one in ((1, known), (2, found))]
    check(texts[0] == texts[1] and told[0] == told[1], "calibrate-print: file and result")


# what the clock says of a sample of a sweep, and what is chosen by it; among its notes those that are named seconds
TIMES = {"time", "per_item_s", "dominated", "meets"}


def timeless(tree):
    """A measurement of accuracy without its times."""
    if isinstance(tree, dict):
        notes = {"notes": [one for one in tree["notes"] if not one[0].startswith("seconds ")]} if "notes" in tree else {}
        return {key: timeless(value) for key, value in {**tree, **notes}.items() if key not in TIMES}
    return [timeless(one) for one in tree] if isinstance(tree, list) else tree


def accuracies(folder):
    """What accuracy costs: every number that is no time, bit for bit."""
    if folder is None:
        folder = WORK / "accuracy-1"
        cli("accuracy", DESIGN, "--quick", "--out", folder, "--quiet")
    known = json.loads((folder / "accuracy.json").read_text())
    found = domecast.accuracy(DESIGN, out=WORK / "accuracy-2", quick=True)
    check(json.loads((WORK / "accuracy-2/accuracy.json").read_text()) == found["accuracy"], "accuracy: the result is its file's")
    samples = [sample for sweep in found["accuracy"]["sweeps"] for sample in sweep["samples"]]
    same = json.dumps(timeless(known)) == json.dumps(timeless(found["accuracy"]))
    check(same and len(samples) > 50, f"accuracy: {len(samples)} samples, all but times")
    names = [sorted(one.name for one in place.iterdir()) for place in (folder, WORK / "accuracy-2")]
    check(names[0] == names[1], f"accuracy: {len(names[0])} files")


def resident_mb():
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def flat(what, count, run):
    """Runs `count` frames after some that warm up; the memory must be where it was."""
    run(min(300, count))
    before, began = resident_mb(), time.perf_counter()
    run(count)
    took, after = time.perf_counter() - began, resident_mb()
    check(after - before < 2.0, f"memory of {what}, {count} frames in {took:.0f} s: {before:.1f} to {after:.1f} MB")


def follow(sensor, frames):
    """What tracks frames from one array that is written anew, and asks for everything now and then; a frame that is none beside it."""
    tracker, place = domecast.Tracker(sensor), np.empty_like(frames[0])

    def run(count):
        for number in range(count):
            place[:] = frames[number % len(frames)]
            reading = tracker.update(place, rgb=True, time=None)
            if number % 10 == 0:
                assert len(reading.json()) + len(reading.dots) + len(reading.markers) > 0
            if number % 50 == 0:
                try:
                    tracker.update(place[:, :, :2], rgb=True)
                except domecast.DomecastError:
                    pass
    return run


def memory(sensor, frames, rest, pressed):
    flat("a tracker", FRAMES, follow(sensor, frames))
    both = [follow(sensor, frames) for _ in range(2)]

    def at_once(count):
        running = [threading.Thread(target=run, args=(count // 2,)) for run in both]
        [one.start() for one in running]
        [one.join() for one in running]
    flat("trackers in two threads", FRAMES, at_once)
    tracker = domecast.Tracker(sensor)
    shape, forces = domecast.Shape(sensor, tracker), domecast.Traction(sensor)
    shape.set_rest(rest, rgb=True)

    def feel(count):
        for number in range(count):
            frame = pressed[number % len(pressed)]
            reading = tracker.update(frame, rgb=True)
            skin = shape.update(frame, reading, rgb=True)
            if number % 10 == 0:
                assert len(forces.update(reading, shape=skin).json(shape=skin)) + skin.height_mm.size + len(skin.surface()) > 0
    flat("tracker, shape and forces", max(FRAMES // 20, 50), feel)


def threads(sensor, frames, lines):
    found = {}

    def follow(name):
        tracker = domecast.Tracker(sensor)
        found[name] = [tracker.update(frame, rgb=True).json() for frame in frames * 4][:len(lines)]
    running = [threading.Thread(target=follow, args=(name,)) for name in "ab"]
    [one.start() for one in running]
    [one.join() for one in running]
    check(found["a"] == lines and found["b"] == lines, "two threads at once give the same lines")
    shared, faults = domecast.Tracker(sensor), []

    def share():
        for frame in frames * 4:
            try:
                shared.update(frame, rgb=True)
            except RuntimeError as error:
                faults.append(error)
    running = [threading.Thread(target=share) for _ in range(2)]
    [one.start() for one in running]
    [one.join() for one in running]
    check(True, f"one tracker in two threads: {len(faults)} calls refused, none crashed")


def overhead(sensor, frames):
    """Both in turns, on the same frame: the machine may be busy."""
    frame, tracker, alone = frames[-1], domecast.Tracker(sensor), domecast.Tracker(sensor)
    rust, python = [], []
    for _ in range(40):
        rust.append(1e6 * alone.benchmark(frame, rgb=True, repeats=25))
        times = []
        for _ in range(25):
            began = time.perf_counter()
            reading = tracker.update(frame, rgb=True)
            times.append(time.perf_counter() - began)
        python.append(1e6 * sorted(times)[12])
    assert reading.frame == 999
    more = sorted(a - b for a, b in zip(python, rust))
    print(f"     update: {sorted(python)[20]:.1f} us, in Rust alone {sorted(rust)[20]:.1f} us, in turns {more[20]:+.1f} us (medians)")
    times = []
    for _ in range(2000):
        began = time.perf_counter()
        tracker.skip()
        times.append(time.perf_counter() - began)
    print(f"     a call and its Reading without the work of a frame: {1e6 * sorted(times)[1000]:.1f} us")
    print(f"     import domecast: {1e3 * IMPORT_S:.1f} ms")


def main():
    warnings.simplefilter("error")
    for name in ("hypothesis", "mujoco", "gymnasium", "cv2"):
        check(importlib.util.find_spec(name) is None, f"{name} is not installed here")
    check(not NUMPY_CAME_WITH_IT, "import domecast leaves numpy where it is until an array is needed")
    design = domecast.Design.load(DESIGN)
    optics(design)
    edits(design)
    builds(design)
    check("<img" in design._repr_html_() and design.layout()._repr_png_().startswith(b"\x89PNG"), "a design and its layout as pictures")
    pushed, frames = simulated("push", "--frames", "6", frames=6)
    sensor, lines = tracks(pushed, frames)
    balls, pressed = simulated("ball", "--frames", "3", frames=3)
    rest, _ = simulated("lit", "--seed", "7", seed=7)
    shapes(balls, pressed, rest / "frame_0000.png")
    hardness(*simulated("ball", "--frames", "14", frames=14), rest / "frame_0000.png")
    calibrations(pushed)
    lights(WORK / "by-cli/constants/constants.json", pushed)
    prints()
    accuracies(Path(sys.argv[6]) if len(sys.argv) > 6 else None)
    threads(sensor, frames, lines)
    memory(sensor, frames, read_png(rest / "frame_0000.png"), pressed)
    overhead(sensor, frames)
    print(f"same as the command line: {len(FAULTS)} faults")
    return 1 if FAULTS else 0


if __name__ == "__main__":
    sys.exit(main())
