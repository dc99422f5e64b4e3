"""Random wrong inputs to every call: exceptions with words, never a panic, never a crash.

    wrong_inputs.py CONSTANTS REPOSITORY COUNT
"""

import json
import sys
import tempfile
import warnings
from collections import Counter
from pathlib import Path

import domecast
import numpy as np
from hypothesis import HealthCheck, Phase, given, settings, strategies as some
from hypothesis.extra import numpy as arrays

CONSTANTS, REPOSITORY, COUNT = Path(sys.argv[1]).read_text(), Path(sys.argv[2]), int(sys.argv[3])
# what a caller's mistake may raise; a panic is a BaseException that is none of them
ALLOWED = (ValueError, TypeError, OverflowError, AttributeError, KeyError, IndexError)
SENSOR = domecast.Sensor.from_str(CONSTANTS)
DESIGN = domecast.Design.load(REPOSITORY / "designs/thumb24.json")
OPTICS = DESIGN.optics()
SCENE = json.loads((REPOSITORY / "designs/scenes/push.json").read_text())
TREES = {"design": json.loads(DESIGN.text), "constants": json.loads(CONSTANTS), "scene": SCENE}
TRACKER = domecast.Tracker(SENSOR)
READING = TRACKER.update(np.zeros((480, 640, 3), np.uint8), rgb=True)
SHAPE = domecast.Shape(SENSOR, TRACKER)
TRACTION = domecast.Traction(SENSOR)
FOLDER = tempfile.TemporaryDirectory()
SEEN: Counter = Counter()

numbers = some.one_of(some.floats(), some.integers(), some.sampled_from([0, -1, 2**31, 2**63, 2**64, 1e308, float("nan"), float("inf")]))
scalars = some.one_of(numbers, some.none(), some.booleans(), some.text(max_size=8), some.binary(max_size=8))
anything = some.recursive(scalars, lambda inner: some.one_of(some.lists(inner, max_size=4), some.dictionaries(some.text(max_size=6), inner, max_size=4)), max_leaves=8)
shapes = some.one_of(some.sampled_from([(480, 640, 3), (480, 640), (0, 0, 3), (1, 1, 3), (480, 640, 4), (3,), ()]), arrays.array_shapes(max_dims=4, max_side=6))
ndarrays = some.builds(lambda shape, dtype, turn: np.zeros(shape, dtype)[tuple([slice(None, None, turn)] * len(shape))], shapes,
                       some.sampled_from(["u1", "i1", "f4", "f8", "c16", "O", "U4", "?", "u2", ">f8", "M8[s]"]), some.sampled_from([1, -1, 2]))
points = some.one_of(ndarrays, anything, arrays.arrays("f8", some.tuples(some.integers(0, 5), some.integers(0, 4)), elements=some.floats()))
frames = some.one_of(ndarrays, anything)
words = some.one_of(scalars, some.sampled_from(["luma", "green", "wrench", "dots"]))


@some.composite
def broken(draw, kind):
    """A file in which one place has another value, or none."""
    tree = json.loads(json.dumps(TREES[kind]))
    at = tree
    while True:
        keys = list(at) if isinstance(at, dict) else list(range(len(at)))
        key = draw(some.sampled_from(keys))
        inner = at[key]
        if not (isinstance(inner, (dict, list)) and inner) or draw(some.booleans()):
            break
        at = inner
    if draw(some.booleans()):
        at[key] = draw(anything)
    else:
        del at[key]
    return tree


def text_of(tree):
    return json.dumps(tree, default=str)


def edit(tree):
    design = DESIGN.copy()
    design.tree = tree
    design.resolve()


def scene_of(tree):
    if isinstance(tree.get("frames"), dict):
        tree["frames"]["count"] = 1
    domecast.Scene(tree, design=DESIGN, folder=REPOSITORY / "designs/scenes")


def track_other(text):
    """Constants that are still some must make a tracker, or say why not; and what they make must work."""
    sensor = domecast.Sensor.from_str(text)
    tracker = domecast.Tracker(sensor)
    width, height = sensor.size
    if width * height <= 2_000_000:
        tracker.update(np.full((height, width, 3), 128, np.uint8), rgb=True).json()
    domecast.Traction(sensor)
    domecast.Shape(sensor, tracker)


CALLS = {
    "Optics.trace": (lambda a: OPTICS.trace(a), points),
    "Optics.project": (lambda a: OPTICS.project(a), points),
    "Optics.at_pose": (lambda a: OPTICS.at_pose(a), points),
    "Tracker.update": (lambda a: TRACKER.update(a[0], rgb=a[1], time=a[2], number=a[3]), some.tuples(frames, words, words, words)),
    "Tracker.skip": (lambda a: TRACKER.skip(time=a[0], number=a[1]), some.tuples(words, words)),
    "Tracker": (lambda a: domecast.Tracker(SENSOR, channel=a[0], reference=a[1], search_every=a[2], max_residual_px=a[3], camera_turned_deg=a[4]),
                some.tuples(words, anything, some.one_of(some.just(30), words), some.one_of(some.just(2.0), numbers), words)),
    "Shape": (lambda a: domecast.Shape(SENSOR, TRACKER, cell_px=a[0], max_passes=a[1]), some.tuples(numbers, numbers)),
    "Shape.set_rest": (lambda a: SHAPE.set_rest(a[0], rgb=a[1]), some.tuples(frames, words)),
    "Shape.update": (lambda a: SHAPE.update(a[0], a[1], rgb=True), some.tuples(frames, some.one_of(some.just(READING), anything))),
    "Traction.update": (lambda a: TRACTION.update(a[0], shape=a[1]), some.tuples(some.one_of(some.just(READING), anything), words)),
    "Reading.json": (lambda a: READING.json(a), anything),
    "Reading.overlay_png": (lambda a: READING.overlay_png(a[0], rgb=True, magnify=a[1]), some.tuples(frames, words)),
    "Sensor.from_str": (lambda a: domecast.Sensor.from_str(a), some.one_of(some.text(), broken("constants").map(text_of))),
    "Tracker of other constants": (track_other, broken("constants").map(text_of)),
    "Camera": (lambda a: domecast.Camera(a[0], SENSOR, rate=a[1], exposure_ms=a[2], gain=a[3]), some.tuples(some.one_of(scalars, some.text(max_size=6).map("player:".__add__)), words, words, words)),
    "Sensor.load": (lambda a: domecast.Sensor.load(a), scalars),
    "Design.from_str": (lambda a: domecast.Design.from_str(a), some.one_of(some.text(), anything)),
    "Design edits": (edit, some.one_of(broken("design"), some.dictionaries(some.text(max_size=6), anything, max_size=3))),
    "Scene": (scene_of, broken("scene")),
    "calibrate_force": (lambda a: domecast.calibrate_force(a[0], a[1], out=Path(FOLDER.name) / "out.json", motion_sd=a[2]), some.tuples(scalars, scalars, anything)),
    "accuracy": (lambda a: domecast.accuracy(a[0], out=a[1]), some.tuples(scalars, scalars)),
}
# these take milliseconds, not microseconds
SLOW = {"Design edits": 0.1, "Scene": 0.03, "Tracker": 0.1, "Shape": 0.02, "Reading.overlay_png": 0.05, "Tracker of other constants": 0.1}


def attempt(name, call, value):
    try:
        call(value)
        SEEN["accepted"] += 1
    except domecast.DomecastError as error:
        SEEN["DomecastError"] += 1
        assert str(error) and "panicked" not in str(error), (name, error)
    except ALLOWED as error:
        SEEN[type(error).__name__] += 1
        assert str(error), (name, value)
    except RuntimeError as error:
        # "a fault in domecast itself" is one
        raise AssertionError(f"{name}: {value!r}: {error}") from error
    except BaseException as error:
        if type(error).__name__ == "PanicException":
            raise AssertionError(f"{name} panicked: {value!r}: {error}") from error
        raise


def main():
    # an input that is taken with a part of it lost is a fault too
    warnings.simplefilter("error")
    share = COUNT / sum(SLOW.get(name, 1) for name in CALLS)
    for name, (call, inputs) in CALLS.items():
        count = max(20, round(share * SLOW.get(name, 1)))

        @settings(max_examples=count, deadline=None, database=None, derandomize=True, suppress_health_check=list(HealthCheck), phases=[Phase.generate, Phase.shrink])
        @given(inputs)
        def judged(value):
            attempt(name, call, value)
        judged()
    total = sum(SEEN.values())
    FOLDER.cleanup()
    print(f"wrong inputs: {total} calls, none panicked: {dict(SEEN)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
