#!/usr/bin/env python3
"""Checks the networks of `track --hardness` from outside, by ONNX Runtime and the ONNX checker.

- Random networks of every kind of node (residual with a bidirectional GRU, the paper's ResNet-18, readings alone), built here by
  ONNX's own helpers: each window's outputs are ONNX Runtime's to 1e-5 of their size, frame by frame as they stream in.
- What our writer makes of a graph passes ONNX's checker and gives ONNX Runtime the same outputs.
- A file cut anywhere, a node, an attribute, a type or a size that is not known: refused with exit code 1 and by name.
- `track --hardness` on simulated frames with a random model: what its lines state is what ONNX Runtime makes of the lines' own wrench
  and pose and of the frames shrunk by OpenCV; `unsure` without a contact, beyond the forces of the training, in less light and
  through another lens; nothing is stated before the window is full.
- Trained models that are named as well are held to ONNX Runtime.

    scripts/check_hardness.py target/release/domecast BUILD [MODEL.onnx..] [--time]

The program `hardness` of scripts/examples stands beside domecast (`cargo build --release -p domecast-hardness --example hardness`).
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

import cv2
import numpy as np
import onnx
import onnxruntime
from onnx import TensorProto, helper, numpy_helper

SCENES = pathlib.Path(__file__).resolve().parent.parent / "designs/scenes"
WINDOW = 10
CLASSES = {"soft": 0.07, "hard": 0.9}
TOLERANCE = 1e-5


class Net:
    """Nodes and constants of a graph, with random weights that keep the size of what runs through."""

    def __init__(self, seed):
        self.random = np.random.default_rng(seed)
        self.nodes, self.constants, self.count = [], [], 0

    def constant(self, values):
        self.count += 1
        values = np.asarray(values)
        kind = np.int64 if values.dtype.kind == "i" else np.float32
        self.constants.append(numpy_helper.from_array(values.astype(kind), f"c{self.count}"))
        return f"c{self.count}"

    def weights(self, *sides, fan=None):
        fan = fan or int(np.prod(sides[1:])) or 1
        return self.constant(self.random.normal(0, np.sqrt(1.6 / fan), sides))

    def node(self, kind, inputs, out=None, **attributes):
        self.count += 1
        out = out or f"v{self.count}"
        self.nodes.append(helper.make_node(kind, inputs, [out], **attributes))
        return out

    def conv(self, value, inputs, outputs, kernel=3, stride=1):
        pad = kernel // 2
        return self.node("Conv", [value, self.weights(outputs, inputs, kernel, kernel), self.weights(outputs, fan=20)],
                         kernel_shape=[kernel] * 2, strides=[stride] * 2, pads=[pad] * 4)

    def block(self, value, inputs, outputs, stride):
        inner = self.node("Relu", [self.conv(value, inputs, outputs, 3, stride)])
        inner = self.conv(inner, outputs, outputs)
        if stride != 1 or inputs != outputs:
            value = self.conv(value, inputs, outputs, 1, stride)
        return self.node("Relu", [self.node("Add", [inner, value])])

    def linear(self, value, inputs, outputs, out=None):
        return self.node("Gemm", [value, self.weights(outputs, inputs), self.weights(outputs, fan=20)], out, transB=1)


def network(seed, size, readings, channels, paper=False, hidden=32, features=64, classes=2):
    """A graph of the shape that is trained; `size` is height and width, or None without a picture."""
    net = Net(seed)
    parts, width, inputs = [], 0, []
    if size:
        inputs.append(helper.make_tensor_value_info("picture", TensorProto.FLOAT, [WINDOW, 3, *size]))
        value = net.node("Relu", [net.conv("picture", 3, channels[0], 7 if paper else 3, 2)])
        if paper:
            value = net.node("MaxPool", [value], kernel_shape=[3, 3], strides=[2, 2], pads=[1] * 4)
        before = channels[0]
        for at, count in enumerate(channels):
            strides = ([1 if at == 0 else 2, 1] if paper else [2])
            for stride in strides:
                value = net.block(value, before, count, stride)
                before = count
        value = net.node("Flatten", [net.node("GlobalAveragePool", [value])])
        parts.append(net.node("Relu", [net.linear(value, before, features)]))
        width += features
    if readings:
        inputs.append(helper.make_tensor_value_info("readings", TensorProto.FLOAT, [WINDOW, readings]))
        parts.append(net.node("Relu", [net.linear("readings", readings, 16)]))
        width += 16
    value = net.node("Concat", parts, axis=1) if len(parts) > 1 else parts[0]
    value = net.node("Unsqueeze", [value, net.constant(np.array([1]))])
    value = net.node("GRU", [value, net.weights(2, 3 * hidden, width, fan=width), net.weights(2, 3 * hidden, hidden, fan=hidden),
                             net.weights(2, 6 * hidden, fan=20)], hidden_size=hidden, direction="bidirectional", linear_before_reset=1)
    cut = lambda value, first: net.node("Slice", [value, *(net.constant(np.array([v])) for v in (first, WINDOW, 0))])
    value = net.node("ReduceMean", [cut(value, WINDOW - 5)], axes=[0], keepdims=0)
    value = net.node("Reshape", [value, net.constant(np.array([1, 2 * hidden]))])
    net.node("Softmax", [net.linear(value, 2 * hidden, classes)], "probability", axis=1)
    net.linear(value, 2 * hidden, 2, "log10_e")
    far = [net.node("ReduceSumSquare", [net.linear(value, 2 * hidden, 2 * hidden)], axes=[1])]
    if readings:
        far.append(net.node("ReduceSumSquare", [net.linear(cut("readings", -1), readings, readings)], axes=[1]))
    net.node("Concat", far, "novelty", axis=1)
    outputs = [helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, n])
               for name, n in (("probability", classes), ("log10_e", 2), ("novelty", len(far)))]
    graph = helper.make_graph(net.nodes, "random", inputs, outputs, net.constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    onnx.checker.check_model(model, full_check=True)
    return model


def judged(model_bytes, frames):
    """ONNX Runtime's outputs of each full window."""
    session = onnxruntime.InferenceSession(model_bytes, providers=["CPUExecutionProvider"])
    sides = {value.name: value.shape for value in session.get_inputs()}
    rows = []
    for end in range(WINDOW, len(next(iter(frames.values()))) + 1):
        inputs = {name: frames[name][end - WINDOW:end] for name in sides}
        rows.append(dict(zip([o.name for o in session.get_outputs()], session.run(None, inputs))))
    return rows


def random_frames(model, seed, count=WINDOW + 3):
    random = np.random.default_rng(seed)
    return {value.name: random.normal(0, 0.5, [count] + [d.dim_value for d in value.type.tensor_type.shape.dim][1:]).astype(np.float32)
            for value in model.graph.input}


def ours(program, path, frames, folder):
    count = len(next(iter(frames.values())))
    rows = [frames["picture"].transpose(0, 2, 3, 1).reshape(count, -1)] if "picture" in frames else []
    rows += [frames["readings"]] if "readings" in frames else []
    numbers = folder / "numbers.bin"
    np.concatenate(rows, axis=1).astype("<f4").tofile(numbers)
    done = subprocess.run([program, "run", path, numbers], capture_output=True, text=True, check=True)
    return [json.loads(line) for line in done.stdout.splitlines()]


def difference(a, b):
    """The largest difference, in parts of the larger of one and the value."""
    worst = 0.0
    for one, two in zip(a, b, strict=True):
        for name, values in one.items():
            values, other = np.ravel(values).astype(float), np.ravel(two[name]).astype(float)
            worst = max(worst, float(np.max(np.abs(values - other) / np.maximum(1, np.abs(values)))))
    return worst


def compare(program, name, model, folder):
    path = folder / "model.onnx"
    path.write_bytes(model.SerializeToString())
    frames = random_frames(model, 7)
    wanted = judged(path.read_bytes(), frames)
    found = ours(program, path, frames, folder)
    worst = difference(wanted, found)
    again = folder / "again.onnx"
    subprocess.run([program, "rewrite", path, again], check=True)
    onnx.checker.check_model(onnx.load(again), full_check=True)
    same = difference(wanted, judged(again.read_bytes(), frames))
    print(f"{name}: {len(wanted)} windows, differs from ONNX Runtime by {worst:.1e} at most, rewritten by {same:.1e}")
    if not (worst <= TOLERANCE and same == 0):
        sys.exit(f"FAULT: {name} differs")


def refused(program, name, data, folder, word=""):
    path = folder / "bad.onnx"
    path.write_bytes(data)
    done = subprocess.run([program, "check", path], capture_output=True, text=True, timeout=20)
    if done.returncode != 1 or "panicked" in done.stderr or word not in done.stderr:
        sys.exit(f"FAULT: {name} ends with {done.returncode}: {done.stderr.strip()[:300]}")


def check_refusals(program, folder):
    good = network(3, (16, 16), 4, [8, 8])
    data = good.SerializeToString()
    cuts = sorted({0, 1, 2, 5, len(data) // 2, len(data) - 1, *np.random.default_rng(1).integers(1, len(data), 12).tolist()})
    for cut in cuts:
        refused(program, f"cut to {cut} bytes", data[:cut], folder)

    def changed(change):
        model = onnx.ModelProto()
        model.CopyFrom(good)
        change(model)
        return model.SerializeToString()

    def set_first(kind, change):
        return changed(lambda m: change(next(n for n in m.graph.node if n.op_type == kind)))

    cases = [
        ("a kind that is not known", set_first("Relu", lambda n: setattr(n, "op_type", "LeakyRelu")), "LeakyRelu"),
        ("another domain", set_first("Relu", lambda n: setattr(n, "domain", "com.microsoft")), "com.microsoft"),
        ("a group", set_first("Conv", lambda n: n.attribute.append(helper.make_attribute("group", 3))), "group"),
        ("an attribute", set_first("Relu", lambda n: n.attribute.append(helper.make_attribute("alpha", 0.1))), "alpha"),
        ("activations", set_first("GRU", lambda n: n.attribute.append(helper.make_attribute("clip", 1.0))), "clip"),
        ("another operator set", changed(lambda m: setattr(m.opset_import[0], "version", 21)), "21"),
        ("doubles", changed(lambda m: setattr(m.graph.initializer[0], "data_type", TensorProto.DOUBLE)), "type 11"),
        ("a wrong size", changed(lambda m: m.graph.initializer[0].dims.__setitem__(0, 9)), "numbers for the sides"),
        ("a huge size", changed(lambda m: m.graph.initializer[0].dims.__setitem__(0, 1 << 62)), "sides"),
        ("a huge picture", changed(lambda m: m.graph.input[0].type.tensor_type.shape.dim[2].__setattr__("dim_value", 1 << 26)), ""),
        ("a window of one", changed(lambda m: m.graph.input[0].type.tensor_type.shape.dim[0].__setattr__("dim_value", 1)), "window"),
        ("an infinite weight", changed(lambda m: setattr(m.graph.initializer[0], "raw_data",
                                                         b"\0\0\x80\x7f" + m.graph.initializer[0].raw_data[4:])), "finite"),
        ("external data", changed(lambda m: m.graph.initializer[0].external_data.add(key="location", value="/etc/passwd")), "external"),
        ("a loop", changed(lambda m: m.graph.node[0].input.__setitem__(0, m.graph.node[3].output[0])), "no node before it"),
        ("no metadata", data, "domecast_hardness"),
    ]
    for name, bytes_, word in cases:
        refused(program, name, bytes_, folder, word)
    print(f"{len(cuts)} cut and {len(cases)} foreign files refused by name")


RIGID = ["fx_n", "fy_n", "fz_n", "mx_nmm", "my_nmm", "mz_nmm", "tx_mm", "ty_mm", "tz_mm", "rx_rad", "ry_rad", "rz_rad"]
SIZE = (48, 64)


def shrunk(path):
    levels = cv2.imread(str(path)).astype(np.float32)
    return cv2.resize(levels, SIZE[::-1], interpolation=cv2.INTER_AREA)[:, :, ::-1].astype(float)


def rigid(line, at_mm):
    """Wrench and displacement of a frame, as track's line has them."""
    pose = np.array(line["pose"])
    turn = cv2.Rodrigues(pose[:3, :3])[0].ravel()
    return np.concatenate([line["wrench"], pose[:3, :3] @ at_mm + pose[:3, 3] - at_mm, turn])


def rest_ranges(picture):
    rows, columns = np.arange(SIZE[0]) * 3 // SIZE[0], np.arange(SIZE[1]) * 4 // SIZE[1]
    blocks = [picture[rows == r][:, columns == c].mean() / picture.mean() for r in range(3) for c in range(4)]
    return [[0.98 * v, 1.02 * v] for v in [picture.mean(), *blocks]]


def with_metadata(model, ranges, interval_quantile=1.6):
    wide = {"fz_n": [-1.6, -0.4]}
    text = {"version": 1, "classes": [{"name": n, "youngs_modulus_mpa": e} for n, e in CLASSES.items()],
            "readings": [{"name": n, "range": wide.get(n, [-1e3, 1e3])} for n in RIGID + ["dots_mean_px"]], "rest_ranges": ranges,
            "log10_e_range": [-1e3, 1e3], "interval_quantile": interval_quantile, "novelty_limits": [1e9, 1e9],
            "novelty_names": ["features", "readings"]}
    helper.set_model_props(model, {"domecast_hardness": json.dumps(text)})
    return model.SerializeToString()


def tracked(domecast, build, frames, rest, model, *more):
    done = subprocess.run([domecast, "track", *frames, "--constants", build / "constants/constants.json", "--hardness", model,
                           "--rest", rest, "--quiet", *more], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"FAULT: track ends with {done.returncode}: {done.stderr[:500]}")
    return [json.loads(line) for line in done.stdout.splitlines()]


def check_track(domecast, build, folder):
    scene = json.loads((SCENES / "block-soft.json").read_text())
    scene["design"] = str((SCENES / scene["design"]).resolve())
    scene["frames"] = {"count": WINDOW + 8, "rate_hz": 10}
    scene["electronics"]["noise"] = {"full_scale_electrons": 8000, "read_electrons": 4, "bits": 10}
    scene["tolerance"]["grey"] = 1  # without noise a still frame is the one before
    # no contact, a window of it, then more than the model knows
    keys = [(0.0, 0.0), (0.4, 0.0), (0.5, 0.8), (1.5, 1.5), (1.7, 3.0)]
    scene["objects"][0]["press"]["force"] = [{"time_s": t, "force_n": f} for t, f in keys]
    (folder / "scene.json").write_text(json.dumps(scene))
    subprocess.run([domecast, "simulate", folder / "scene.json", "--out", folder / "press", "--quiet"], check=True)
    frames = sorted((folder / "press").glob("frame_*.png"))
    rest, model = frames[0], folder / "random.onnx"
    data = with_metadata(network(8, SIZE, len(RIGID), [8, 16]), rest_ranges(shrunk(rest)))
    model.write_bytes(data)
    lines = tracked(domecast, build, frames, rest, model)
    at_mm = np.array(json.loads((build / "constants/constants.json").read_text())["springs"]["at_mm"])
    table = np.array([rigid(line, at_mm) for line in lines])
    table = (table - table[0]).astype(np.float32)
    picture = np.array([(shrunk(path) - shrunk(rest)) / 255 for path in frames]).transpose(0, 3, 1, 2).astype(np.float32)
    wanted = judged(data, {"picture": picture, "readings": table})
    if any(line["hardness"] is not None for line in lines[:WINDOW - 1]):
        sys.exit("FAULT: hardness is stated before the window is full")
    worst, states = 0.0, []
    for number, outputs in enumerate(wanted, WINDOW - 1):
        found, force = lines[number]["hardness"], table[number][2]
        states.append(found["status"])
        inside = -2.0 < force < -0.2
        if not inside and (found["status"], found["reason"]) != ("unsure", "out_of_range_fz_n"):
            sys.exit(f"FAULT: {force} N are stated: {found}")
        if inside and -1.6 < force < -0.4:
            (mean, ln_sd), probability = outputs["log10_e"][0], outputs["probability"][0]
            half = 1.6 * np.exp(ln_sd)
            numbers = [found["probability"], found["log10_youngs_modulus_mpa"], *found["interval_90"]]
            worst = max(worst, float(np.max(np.abs(np.array(numbers) - [probability.max(), mean, mean - half, mean + half]))))
            if found["class"] != ("soft", "hard")[probability.argmax()]:
                sys.exit(f"FAULT: frame {number} is {found}, ONNX Runtime has {probability}")
    if worst > 1e-4 or states.count("ok") < 5 or "unsure" not in states:
        sys.exit(f"FAULT: track differs from ONNX Runtime by {worst}, states {states}")
    print(f"track: {states.count('ok')} windows stated, {states.count('unsure')} unsure; off by {worst:.1e} from ONNX Runtime and OpenCV")
    check_unsure(domecast, build, frames, folder, data)
    check_beside_travel(domecast, build, frames, folder, data, lines)
    check_touched_at_rest(domecast, build, frames, folder, data)


def sure_of(data, label):
    """The model with a bias in front of its probabilities: sure of a class, whatever it sees."""
    model = onnx.load_from_string(data)
    model.metadata_props.clear()
    softmax = next(node for node in model.graph.node if "probability" in node.output)
    last = next(node for node in model.graph.node if softmax.input[0] in node.output)
    bias = next(constant for constant in model.graph.initializer if constant.name == last.input[2])
    bias.CopyFrom(numpy_helper.from_array(np.where(np.arange(len(CLASSES)) == label, 50.0, -50.0).astype(np.float32), bias.name))
    return model


def check_beside_travel(domecast, build, frames, folder, data, lines):
    """The same frames, and a hand that came as near as a soft object lets it, or as a hard one: the model's class is stated beside one of them only."""
    rest, shown, travel = frames[0], frames[: WINDOW + 4], folder / "travel.txt"
    # by Hertz' punch of some 3 mm on a dome of 0.56 MPa, on the springs that the lines have
    force = np.array([np.linalg.norm(np.array(line["wrench"][:3]) - lines[0]["wrench"][:3]) for line in lines])
    sunk = np.array([lines[0]["pose"][2][3] - line["pose"][2][3] for line in lines])
    for name in CLASSES:
        sure = sure_of(data, list(CLASSES).index(name))
        path = folder / f"sure-{name}.onnx"
        path.write_bytes(with_metadata(sure, rest_ranges(shrunk(rest)), 0.0))
        for other, young in CLASSES.items():
            travel.write_text("".join(f"{mm}\n" for mm in sunk + force * 0.77 * (1 / 0.56 + 1 / young) / 6.0))
            last = tracked(domecast, build, shown, rest, path, "--traction", "--shape", folder / "skin", "--travel", travel, "--force")[-1]
            found, contact = last["hardness"], last["contact_hardness"]
            wanted = ("ok", name) if name == other else ("unsure", "contradicts_contact_mechanics")
            if (found["status"], found["class"] or found["reason"]) != wanted:
                sys.exit(f"FAULT: the model is sure that it is {name}, the travel that of a {other} object: {found}, {contact}")
    print("travel: a class that contact mechanics has otherwise is not stated")


def check_touched_at_rest(domecast, build, frames, folder, data):
    """A frame of the press given as the one at rest, untouched frames before it: with --shape nothing is stated."""
    rest, path = frames[WINDOW], folder / "touched.onnx"
    model = sure_of(data, 0)
    path.write_bytes(with_metadata(model, rest_ranges(shrunk(rest))))
    said = []
    for more in ([], ["--shape", folder / "skin", "--force"]):
        found = [line["hardness"] for line in tracked(domecast, build, frames, rest, path, *more)]
        said.append([one.get("reason", one["status"]) for one in found if one])
    if "ok" not in said[0] or "ok" in said[1] or "raised" not in said[1]:
        sys.exit(f"FAULT: touched at rest: {said}")
    print(f"touched at rest: {said[0].count('ok')} windows are stated without --shape, none with it")


def check_unsure(domecast, build, frames, folder, data):
    """The same frames, and other light or another lens at rest: never `ok`."""
    shown = frames[: WINDOW + 3]
    height, width = cv2.imread(str(frames[0])).shape[:2]
    zoom = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), 0, 1.1)
    cases = {"less light": ("out_of_range_light", lambda p: np.round(0.7 * p).astype(np.uint8)),
             "another lens": ("unlike_training_rest", lambda p: cv2.warpAffine(p, zoom, (width, height)))}
    for name, (reason, change) in cases.items():
        # the model's limits are those of the frame as it was; the tracker sees the frames as they are
        rest = folder / "rest.png"
        cv2.imwrite(str(rest), change(cv2.imread(str(frames[0]))))
        ranges = rest_ranges(shrunk(frames[0]))
        if name == "another lens":
            ranges[0] = [0.0, 255.0]
        model = onnx.load_from_string(data)
        model.metadata_props.clear()
        path = folder / "other.onnx"
        path.write_bytes(with_metadata(model, ranges))
        if name == "another lens":
            # no tracker of these constants finds its marks through another lens: the rest must be refused, or the state unsure
            done = subprocess.run([domecast, "track", *shown, "--constants", build / "constants/constants.json", "--hardness", path,
                                   "--rest", rest, "--quiet"], capture_output=True, text=True)
            last = json.loads(done.stdout.splitlines()[-1])["hardness"] if done.returncode == 0 else None
            fits = (done.returncode == 1 and "has no wrench" in done.stderr) or (last and last["reason"] == reason)
        else:
            last = tracked(domecast, build, shown, rest, path)[-1]["hardness"]
            fits = last["status"] == "unsure" and last["reason"] == reason
        if not fits:
            sys.exit(f"FAULT: {name}: {last}")
    print(f"unsure: {', '.join(cases)}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("domecast", type=pathlib.Path)
    parser.add_argument("build", type=pathlib.Path, help="a build of thumb24")
    parser.add_argument("models", nargs="*", type=pathlib.Path)
    parser.add_argument("--time", action="store_true", help="print what a window costs")
    arguments = parser.parse_args()
    program = arguments.domecast.resolve().parent / "examples" / "hardness"
    small = [16, 32, 64, 128]
    nets = {
        "small, 48 x 64, 9 readings": network(1, (48, 64), 9, small),
        "small, 64 x 64": network(2, (64, 64), 0, small),
        "odd sizes, 3 classes": network(4, (37, 51), 5, [8, 12, 20], hidden=17, features=9, classes=3),
        "readings alone": network(5, None, 9, []),
        "the paper's ResNet-18, 64 x 64": network(6, (64, 64), 0, [64, 128, 256, 512], paper=True, hidden=128, features=128),
    }
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for name, model in nets.items():
            compare(program, name, model, folder)
            if arguments.time:
                print("   ", subprocess.run([program, "time", folder / "model.onnx", "5" if "paper" in name else "200"],
                                            capture_output=True, text=True, check=True).stdout.strip())
        for path in arguments.models:
            compare(program, path.name, onnx.load(path), folder)
            subprocess.run([program, "check", path], check=True, stdout=subprocess.DEVNULL)
        check_refusals(program, folder)
        check_track(arguments.domecast.resolve(), arguments.build, folder)


if __name__ == "__main__":
    main()
