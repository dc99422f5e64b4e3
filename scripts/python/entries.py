"""What wrong_inputs.py calls: every public entry of the wheel, with a good value and wrong ones for each parameter."""

import json
import sys
import types
from pathlib import Path
from typing import Any, Callable, NamedTuple
from unittest.mock import MagicMock

import domecast
import domecast.live
import numpy as np
from domecast import _native
from hypothesis import strategies as some
from hypothesis.extra import numpy as arrays

LEFT_OUT = "(left out)"


class Edits(list):
    """Faults of a file: paths in its tree, and what stands there in place of what was."""

    def __init__(self, tree, edits=()):
        super().__init__(edits)
        self.tree = tree

    def of(self, edits):
        return Edits(self.tree, edits)

    def tried(self, call):
        """Calls with the broken tree, and mends it."""
        undo = []
        try:
            for path, value in self:
                at = self.tree
                try:
                    for key in path[:-1]:
                        at = at[key]
                    at[path[-1]]
                except (KeyError, IndexError, TypeError):
                    # an earlier fault has taken it away
                    continue
                # a key that comes back must not come last
                undo.append((at, at.copy()))
                if value is LEFT_OUT:
                    del at[path[-1]]
                else:
                    at[path[-1]] = value
            return call(self.tree)
        finally:
            for at, before in reversed(undo):
                at.clear()
                at.update(before) if isinstance(at, dict) else at.extend(before)


class Spoilt:
    """A frame that is made when it is asked for: the good one, turned, cut, noisy, of other values, of another layout."""

    WAYS = ("dark", "bright", "noise", "shifted", "turned", "swapped", "torn", "half", "grey", "view", "columns", "faint", "as it is")

    def __init__(self, frame, way, seed):
        self.frame, self.way, self.seed = frame, way, seed

    def __repr__(self):
        return f"Spoilt({self.way!r}, {self.seed})"

    def made(self):
        frame, random = self.frame, np.random.default_rng(self.seed)
        match self.way:
            case "dark": return np.zeros_like(frame)
            case "bright": return np.full_like(frame, 255)
            case "noise": return random.integers(0, 256, frame.shape, dtype=np.uint8)
            case "shifted": return np.roll(frame, random.integers(-40, 40, 2), (0, 1))
            case "turned": return frame[::-1, ::-1]
            case "swapped": return frame[:, :, ::-1]
            case "torn": return np.concatenate([frame[:self.seed % len(frame)], np.roll(frame, 9, 1)[self.seed % len(frame):]])
            case "half": return frame[:, ::2].repeat(2, 1)
            case "grey": return frame[:, :, 1]
            case "view": return np.asfortranarray(frame)
            case "columns": return frame[:, :self.seed % frame.shape[1]]
            case "faint": return frame // 16
        return frame


class Entry(NamedTuple):
    """A call, a good value and wrong ones for each parameter, and how many of the calls it gets."""

    call: Callable[..., Any]
    columns: list
    weight: float = 1.0


numbers = some.one_of(some.floats(), some.integers(), some.sampled_from([0, -1, 2**31, 2**32, 2**63, 2**64, 1e308, float("nan"), float("inf")]))
scalars = some.one_of(numbers, some.none(), some.booleans(), some.text(max_size=8), some.binary(max_size=8))
anything = some.recursive(scalars, lambda inner: some.one_of(some.lists(inner, max_size=4), some.dictionaries(some.text(max_size=6), inner, max_size=4)), max_leaves=8)
sizes = some.one_of(some.sampled_from([(480, 640, 3), (480, 640), (0, 0, 3), (1, 1, 3), (480, 640, 4), (3,), ()]), arrays.array_shapes(max_dims=4, max_side=6))
ndarrays = some.builds(lambda shape, dtype, turn: np.zeros(shape, dtype)[tuple([slice(None, None, turn)] * len(shape))], sizes,
                       some.sampled_from(["u1", "i1", "f4", "f8", "c16", "O", "U4", "?", "u2", ">f8", "M8[s]"]), some.sampled_from([1, -1, 2]))
points = some.one_of(ndarrays, anything, arrays.arrays("f8", some.tuples(some.integers(0, 5), some.integers(0, 4)), elements=some.floats()))
matrices = some.one_of(points, arrays.arrays("f8", (4, 4), elements=some.floats()), some.sampled_from([np.zeros((4, 4)), 2 * np.eye(4), np.eye(4)[::-1]]))
words = some.one_of(scalars, some.sampled_from(["luma", "green", "wrench", "dots", ""]))
# relative to a folder of its own: nothing is written elsewhere
names = some.one_of(numbers, some.none(), some.text(max_size=8).filter(lambda text: "/" not in text and ".." not in text))

# what a reader could sink into, or stumble over
texts = some.one_of(some.text(), some.sampled_from(["[" * 100_000, '{"a":' * 100_000, "\ufeff{}", "\0", "1e999", '{"a": 1, "a": 2}', "\ud800"]))


def edits(tree):
    """A place of a tree and what stands there instead."""
    @some.composite
    def one(draw):
        path, at = [], tree
        while isinstance(at, (dict, list)) and at and not (path and draw(some.integers(0, 3)) == 0):
            path.append(draw(some.sampled_from(list(at) if isinstance(at, dict) else range(len(at)))))
            at = at[path[-1]]
        return tuple(path), draw(some.one_of(some.just(LEFT_OUT), anything))
    return (Edits(tree), one().map(lambda edit: Edits(tree, [edit])))


def text_of(tree):
    return json.dumps(tree, default=str)


def first(frames):
    """The first frame of a scene alone: what else there is takes long."""
    for one in frames:
        return one


def plainly(call):
    """Spoilt frames are made when they are used."""
    return lambda *given, **options: call(*(one.made() if isinstance(one, Spoilt) else one for one in given), **options)


def small(tree):
    return isinstance(tree, dict) and all(isinstance(tree.get(side), int) and tree[side] <= 2000 for side in ("width", "height"))


def entries(constants_path, repository, model_path, folder):
    """The calls by name; and what tells that the objects they share are as they were."""
    designs, scenes = repository / "designs", repository / "designs/scenes"
    design = domecast.Design.load(designs / "thumb24.json")
    little = domecast.Design.load(designs / "endoscope-r5.json")
    optics, sensor, layout = design.optics(), domecast.Sensor.load(constants_path), little.layout()
    lit, pushed = domecast.Scene.load(scenes / "lit.json"), domecast.Scene.load(scenes / "push.json", frames=2)
    rest = np.array(first(lit.frames())[0])
    tracker, shape, traction = domecast.Tracker(sensor), None, domecast.Traction(sensor)
    referred = domecast.Tracker(sensor, reference=1)
    reading = tracker.update(rest, rgb=True)
    shape = domecast.Shape(sensor, tracker)
    shape.set_rest(rest, rgb=True)
    skin = shape.update(rest, reading, rgb=True)
    forces = traction.update(reading, shape=skin)
    touch, model = domecast.ContactHardness(sensor, reading), domecast.HardnessModel.load(model_path)
    model.set_rest(rest, reading, rgb=True)
    trees = {"design": json.loads(design.text), "constants": json.loads(little.sensor().json()),
             "scene": json.loads((scenes / "push.json").read_text())}
    trees["scene"]["frames"]["count"] = 1
    frames = (rest, some.one_of(ndarrays, anything, some.builds(lambda way, seed: Spoilt(rest, way, seed), some.sampled_from(Spoilt.WAYS), some.integers(0, 2**32))))
    truth, fields = (True, words), (None, some.one_of(anything, some.lists(some.sampled_from(["wrench", "pose", "black_dots", "frame", "none"]))))
    maps, touches = (skin, some.one_of(some.none(), anything, some.just(reading))), (forces, some.one_of(some.none(), anything))
    readings = (reading, some.one_of(anything, some.just(forces)))

    def edited(field, value):
        one = little.copy()
        one[field] = value
        one.resolve()

    def of_tree(tree):
        return domecast.Design(tree, folder=designs)

    def track_other(tree):
        """Constants that are still some must make a tracker, or say why not; and what they make must work."""
        other = domecast.Sensor.from_str(text_of(tree))
        follows = domecast.Tracker(other)
        width, height = other.size
        if width * height <= 2_000_000:
            follows.update(np.full((height, width, 3), 128, np.uint8), rgb=True).json()
        return other, follows

    def read_other(tree):
        other, follows = track_other(tree)
        if small(tree["camera"]):
            domecast.Traction(other)
            domecast.Shape(other, follows)

    def scene(tree, **options):
        return domecast.Scene(tree, design=design, folder=scenes, **options)

    def listened(device, rate, exposure, gain, balance):
        for _ in zip(range(3), domecast.Camera(device, sensor, rate=rate, exposure_ms=exposure, gain=gain, white_balance_k=balance)):
            pass

    played = folder / "played"
    played.mkdir()
    for number in range(2):
        (played / f"frame_{number}.png").write_bytes(_native.png(rest, rgb=True))
    (played / "frame_2.png").write_bytes(_native.png(rest, rgb=True)[:5000])
    devices = some.one_of(scalars, some.text(max_size=6).map("player:".__add__), some.sampled_from(["/dev/null", "player:", "-", "/dev/video99"]), some.builds(
        "player:{}?{}={}".format, some.just("played"), some.sampled_from(["rate", "drop", "repeat", "tear", "delay", "frames", "seed", "unplug", "x", ""]),
        some.one_of(some.floats().map(str), some.integers().map(str), some.text(max_size=4))))
    files = (str(constants_path), some.one_of(scalars, some.sampled_from([".", "played", "played/frame_0.png", "played/frame_2.png", "table.csv", "broken.json", "deep.json", str(designs / "thumb24.json")])))
    (folder / "broken.json").write_text('{"format": "domecast-constants", "version": 1,')
    (folder / "deep.json").write_text("[" * 100_000)
    (folder / "table.csv").write_text("tx,ty,tz,rx,ry,rz,Fx,Fy,Fz,Mx,My,Mz\n" + "1,2,3,nan,5,6,7,8,9,1,2\n" * 3)
    live = domecast.live.LiveSensor(little, [{"kind": "sphere", "radius_mm": 2.0}], images=False)
    away = np.eye(4)
    away[2, 3] = 50.0
    ball = (away, some.one_of(some.none(), matrices))

    calls = {
        "Optics": Entry(lambda a: domecast.Optics(a), [(little, anything)]),
        "Optics.trace": Entry(optics.trace, [(np.zeros((2, 2)), points)], 3),
        "Optics.project": Entry(optics.project, [(np.zeros((2, 3)), points)], 3),
        "Optics.at_pose": Entry(optics.at_pose, [(np.eye(4), matrices)], 3),
        "Tracker": Entry(lambda a, b, c, d, e, f, g, h, i: domecast.Tracker(
            a, channel=b, reference=c, search_every=d, max_residual_px=e, max_misplaced=f, camera_turned_deg=g, temperature_c=h, check_colours=i),
            [(sensor, anything), ("luma", words), (None, anything), (30, words), (2.0, numbers), (0.5, numbers), (None, words), (None, words), truth], 0.3),
        "Tracker.update": Entry(plainly(lambda a, b, c, d: tracker.update(a, rgb=b, time=c, number=d)), [frames, truth, (0.1, words), (3, words)], 0.5),
        "Tracker.set_gravity": Entry(lambda a: referred.set_gravity(a), [((0.0, 0.0, -9.81), some.one_of(words, some.lists(numbers, max_size=4)))], 1),
        "Tracker.skip": Entry(lambda a, b: tracker.skip(time=a, number=b), [(1.0, words), (1, words)], 4),
        "Tracker.benchmark": Entry(plainly(lambda a, b, c: tracker.benchmark(a, rgb=b, repeats=c)), [frames, truth, (1, some.one_of(words, some.integers(-3, 2)))], 0.3),
        "Shape": Entry(lambda a, b, c, d: domecast.Shape(a, b, cell_px=c, max_passes=d), [(sensor, anything), (tracker, anything), (2, numbers), (2, numbers)], 0.15),
        "Shape.set_rest": Entry(plainly(lambda a, b: shape.set_rest(a, rgb=b)), [frames, truth], 0.1),
        "Shape.update": Entry(plainly(lambda a, b, c: shape.update(a, b, rgb=c)), [frames, readings, truth], 0.1),
        "Traction": Entry(lambda a, b: domecast.Traction(a, correlation_mm=b), [(sensor, anything), (None, some.one_of(numbers, anything))], 0.02),
        "Traction.set_rest": Entry(lambda a: traction.set_rest(a), [readings], 0.2),
        "Traction.update": Entry(lambda a, b: traction.update(a, shape=b), [readings, maps], 0.2),
        "Traction.pressure": Entry(lambda a: traction.pressure(a), [maps], 0.5),
        "ContactHardness": Entry(lambda a, b, c: domecast.ContactHardness(a, b, travel_sd_mm=c), [(sensor, anything), readings, (0.02, numbers)], 0.5),
        "ContactHardness.update": Entry(lambda a, b, c: touch.update(a, b, travel_mm=c), [touches, maps, (0.1, numbers)], 1),
        "HardnessModel.load": Entry(domecast.HardnessModel.load, [(str(model_path), files[1])], 0.3),
        "HardnessModel.set_rest": Entry(plainly(lambda a, b, c: model.set_rest(a, b, rgb=c)), [frames, readings, truth], 0.2),
        "HardnessModel.update": Entry(plainly(lambda a, b, c, d, e: model.update(a, b, rgb=c, shape=d, contact=e)),
                                      [frames, readings, truth, maps, (None, anything)], 0.2),
        "Forces.json": Entry(lambda a, b: forces.json(a, shape=b), [fields, maps], 1),
        "Reading.json": Entry(lambda a, b: reading.json(a, shape=b), [fields, maps], 2),
        "Reading.overlay_png": Entry(plainly(lambda a, b, c, d, e: reading.overlay_png(a, rgb=b, magnify=c, shape=d, forces=e)), [frames, truth, (1.0, words), maps, touches], 0.2),
        "Sensor.from_str": Entry(lambda a: a.tried(lambda tree: domecast.Sensor.from_str(text_of(tree))), [edits(trees["constants"])], 1),
        "Sensor.from_str of a text": Entry(domecast.Sensor.from_str, [("{}", some.one_of(texts, anything))], 3),
        "Sensor.load": Entry(domecast.Sensor.load, [files], 2),
        "Tracker of other constants": Entry(lambda a: a.tried(track_other), [edits(trees["constants"])], 0.6),
        "Shape, Traction of others": Entry(lambda a: a.tried(read_other), [edits(trees["constants"])], 0.02),
        "Camera": Entry(listened, [("player:played?rate=1000", devices), (1000.0, words), (None, words), (None, words), (None, words)], 0.3),
        "Design": Entry(lambda a, b: domecast.Design(a, folder=b), [({}, anything), (".", scalars)], 3),
        "Design.load": Entry(domecast.Design.load, [(str(designs / "endoscope-r5.json"), some.one_of(scalars, files[1]))], 1),
        "Design.from_str": Entry(lambda a, b: domecast.Design.from_str(a, folder=b), [("{}", some.one_of(texts, anything)), (".", scalars)], 3),
        "Design of a broken tree": Entry(lambda a: a.tried(lambda tree: of_tree(tree).resolve()), [edits(trees["design"])], 0.15),
        "Design edits": Entry(edited, [("name", some.one_of(scalars, some.sampled_from(list(trees["design"])))), ("x", anything)], 0.5),
        "Design.layout of a broken tree": Entry(lambda a: a.tried(lambda tree: of_tree(tree).sensor()), [edits(trees["design"])], 0.04),
        "Design.save": Entry(lambda a, b: little.save(a, force=b), [("saved.json", names), truth], 0.3),
        "Design.build": Entry(lambda a, b: little.build(a, force=b), [(3, some.one_of(numbers, some.binary(), some.sampled_from(["played", "table.csv"]))), (False, some.just(False))], 1),
        "Layout.film_svg": Entry(layout.film_svg, [(0, anything)], 1),
        "Scene": Entry(lambda a: a.tried(scene), [edits(trees["scene"])], 0.3),
        "Scene of options": Entry(lambda a, b, c, d: domecast.Scene(a, design=b, folder=scenes, frames=c, seed=d), [(trees["scene"], anything), (little, anything), (1, numbers), (1, numbers)], 0.2),
        "Scene.load": Entry(lambda a, b, c: domecast.Scene.load(a, frames=b, seed=c), [(str(scenes / "push.json"), files[1]), (1, numbers), (1, numbers)], 0.1),
        "Scene.plan": Entry(lambda a: pushed.plan(everything=a), [truth], 0.1),
        "Scene.frames": Entry(lambda a: first(pushed.frames(everything=a)), [(False, words)], 0.02),
        "Scene.frames of a broken tree": Entry(lambda a: a.tried(lambda tree: first(scene(tree, frames=1).frames())), [edits(trees["scene"])], 0.02),
        "LiveSensor": Entry(lambda a, b, c, d: domecast.live.LiveSensor(a, b, images=False, scene=c, rate_hz=d),
                            [(little, anything), ([{"kind": "sphere", "radius_mm": 2.0}], some.one_of(anything, some.builds(lambda a, b: [{"kind": a, "radius_mm": b}], words, numbers))),
                             (None, anything), (60.0, numbers)], 0.3),
        "LiveSensor.step": Entry(lambda a: live.step([a]), [ball], 0.3),
        "Touch": Entry(lambda a, b: domecast.live.Touch(a, b), [(None, anything), ({}, anything)], 1),
        "calibrate_force": Entry(lambda a, b, c, d, e: domecast.calibrate_force(a, b, out="force.json", motion_sd=c, temperature=d, force=e), [("table.csv", files[1]), files, (None, anything), (None, words), truth], 0.7),
        "calibrate_light": Entry(lambda a, b, c, d: domecast.calibrate_light(a, b, ball_radius_mm=c, rest=d, out="light.json"), [("played", files[1]), files, (4.0, scalars), (None, names)], 0.3),
        "calibrate_optics": Entry(lambda a, b, c, d: domecast.calibrate_optics(a, b, out="optics.json", rest_frames=c, centroids=d), [("played", files[1]), files, (1, words), (None, names)], 0.4),
        "calibrate_print": Entry(lambda a, b, c: domecast.calibrate_print(a, b, out="print.json", marks=c), [("table.csv", files[1]), (str(designs / "thumb24.json"), files[1]), (None, words)], 0.4),
        "accuracy": Entry(lambda a, b, c: domecast.accuracy(a, out=b, scene=c), [("broken.json", some.one_of(scalars, some.sampled_from(["played", "table.csv"]))), ("a", names), (None, files[1])], 1),
        "png": Entry(plainly(lambda a, b: _native.png(a, rgb=b)), [frames, truth], 0.1),
        "call": Entry(_native.call, [(["list", "cameras"], some.one_of(anything, some.lists(some.one_of(some.text(max_size=6), some.sampled_from(
            ["list", "explain", "check", "compare", "trace", "project", "new", "track", "simulate", "illuminate", "--json", "--out=x", "--help", "cameras", "leds", "table.csv", "played", "--"])), max_size=4)))], 1),
    }
    calls.update(of_ros(sensor, frames, reading))
    calls.update(of_shapes())
    expected = reading.json(), text_of(trees)

    def same():
        tracker.restart()
        after = tracker.update(rest, rgb=True).json(), text_of(trees)
        assert after == expected, "what wrong inputs were given to answers otherwise now"
    return calls, same


def of_ros(sensor, frames, reading):
    """The ROS 2 side, its node and messages taken for anything: python/ros_node.py has a strict stub."""
    for name in ("sensor_msgs", "geometry_msgs", "diagnostic_msgs", "std_msgs"):
        sys.modules[name] = sys.modules[f"{name}.msg"] = MagicMock()
    import domecast.ros as ros
    publisher = ros.TouchPublisher(MagicMock(), sensor)

    def image(encoding, width, height, step, data):
        return ros.frame_of(types.SimpleNamespace(encoding=encoding, width=width, height=height, step=step, data=data))

    def node(*values):
        given = dict(zip(("constants", "device", "rate", "exposure_ms", "gain", "rest_frames"), values))
        ros.TouchNode(types.SimpleNamespace(**{
            "declare_parameter": lambda name, value: None, "get_parameter": lambda name: types.SimpleNamespace(value=given[name]),
            "create_publisher": MagicMock(), "create_subscription": MagicMock()}))

    made = plainly(publisher.publish)
    sys.modules["rclpy"] = MagicMock()
    return {
        "frame_of": Entry(image, [("rgb8", some.sampled_from(["mono8", "bgr8", "x", ""])), (2, scalars), (2, scalars), (6, scalars), (bytes(12), some.one_of(scalars, some.binary(max_size=20)))], 2),
        "points": Entry(ros.points, [(reading.dots, anything), (np.zeros((len(reading.dots), 3)), points)], 0.5),
        "quaternion": Entry(ros.quaternion, [(np.eye(4), matrices)], 1),
        "TouchPublisher": Entry(lambda a, b: ros.TouchPublisher(MagicMock(), a, rest_frames=b), [(sensor, anything), (0, words)], 0.02),
        "TouchPublisher.publish": Entry(lambda a, b, c, d: made(a, 0, rgb=b, image=True, time_s=c, number=d), [frames, (True, words), (0.0, words), (None, words)], 0.02),
        "TouchPublisher.image": Entry(plainly(lambda a, b: publisher.image(a, 0, rgb=b)), [frames, (True, words)], 0.05),
        "TouchPublisher.wrench": Entry(lambda a: publisher.wrench(a, 0), [(np.zeros(6), anything)], 0.2),
        "TouchPublisher.pose": Entry(lambda a: publisher.pose(a, 0), [(np.eye(4), matrices)], 0.2),
        "TouchPublisher.dots": Entry(lambda a: publisher.dots(a, 0), [(reading, anything)], 0.05),
        "TouchPublisher.status": Entry(lambda a: publisher.status(a, 0), [(reading, anything)], 0.05),
        "main": Entry(ros.main, [(None, anything)], 0.02),
        "TouchNode": Entry(node, [("", some.one_of(scalars, some.just("broken.json"))), ("", scalars), (30.0, scalars), (0.0, scalars), (-1, scalars), (0, scalars)], 0.2),
    }


def of_shapes():
    """What makes meshes for simulators of bodies."""
    live = domecast.live
    return {
        "capsule": Entry(live.capsule, [(1.0, scalars), (1.0, scalars)], 0.2),
        "ellipsoid": Entry(live.ellipsoid, [(np.ones(3), points)], 0.2),
        "turned_profile": Entry(live.turned_profile, [(np.array([0.0, 1, 0]), points), (np.arange(3.0), points)], 0.5),
        "write_stl": Entry(lambda a, b: live.write_stl(Path("mesh.stl"), a, b), [(np.eye(3), points), (np.array([[0, 1, 2]]), points)], 0.5),
    }
