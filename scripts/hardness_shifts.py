"""Shifts of a data set's test videos, and what a trained model says of them, by ONNX Runtime, OpenCV and numpy alone.

Each must be right or `unsure`: less light, another lens, JPEG, two dots that were never printed, no contact; and sets of their own,
drawn on domes of other radii, and at the camera's full size, where JPEG is what a camera makes of it.
"""
import dataclasses
import json
import pathlib

import cv2
import numpy as np
import onnxruntime

from check_dataset import read_set

ROOT = pathlib.Path(__file__).resolve().parent.parent
# What thumb24 needs besides to stand with another radius, mm.
DOMES = {
    8: {"mould": {"pins": {"at_mm": [[11.7, 11.7], [-11.7, 11.7], [-11.7, -11.7], [11.7, -11.7]]}}},
    12: {"mould": {"pins": {"at_mm": [[14.4, 14.4], [-14.4, 14.4], [-14.4, -14.4], [14.4, -14.4]]}},
         "platforms": {"outer_mm": [28.4, 28.4]}, "sheet": {"size_mm": [26, 26]}, "envelope": {"size_mm": [28.4, 28.4, 28]},
         "white_markers": {"positions_mm": [[9, 9], [-9, 9], [-9, -9], [9, -9]]},
         "loads": {"claims": [{"name": "press", "force_n": [0, 0, -14], "point_mm": [0, 0, 12]}]}},
}
# Parts of the camera's height (`src/dataset/readings.rs`).
NEAR_PART = 0.12


@dataclasses.dataclass
class Video:
    """A video of a set: levels, readings, dots (motion, px; 1 where found), label."""
    frames: np.ndarray
    rest: np.ndarray
    readings: np.ndarray
    dots: np.ndarray
    label: dict


def videos_of(folder, split):
    """The set's index and each video of a split."""
    index, videos = read_set(folder)
    for _, video in sorted(videos.items()):
        if video["json"]["split"] == split:
            pictures = [video[name].astype(np.float64) for name in ("frames.npy", "rest.npy")]
            yield index, Video(*pictures, video["readings.npy"], video["dots.npy"], video["json"])


def merged(base, change):
    """JSON objects, member by member."""
    if not isinstance(change, dict):
        return change
    return base | {name: merged(base.get(name, {}), value) for name, value in change.items()}


def design_with_dome(radius_mm, out):
    """Writes thumb24 with another radius of the dome; the file."""
    design = json.loads((ROOT / "designs/thumb24.json").read_text())
    design = merged(design, {"name": f"thumb24-r{radius_mm}", "dome": {"radius_mm": radius_mm}} | DOMES[radius_mm])
    file = out / f"{design['name']}.json"
    file.write_text(json.dumps(design, indent=1))
    return file


# --- shifts of a video

def of_pictures(change):
    """The same change of every picture."""
    def shift(_, video):
        return dataclasses.replace(video, frames=np.array([change(frame) for frame in video.frames]), rest=change(video.rest))
    return shift


def zoomed(by):
    def zoom(picture):
        height, width = picture.shape[:2]
        middle = np.array([(width - 1) / 2, (height - 1) / 2])
        turn = np.float64([[by, 0, middle[0] * (1 - by)], [0, by, middle[1] * (1 - by)]])
        return cv2.warpAffine(picture, turn, (width, height), flags=cv2.INTER_LINEAR)
    return zoom


def jpeg(picture):
    done, data = cv2.imencode(".jpg", np.clip(picture, 0, 255).astype(np.uint8)[:, :, ::-1], [cv2.IMWRITE_JPEG_QUALITY, 70])
    assert done
    return cv2.imdecode(data, cv2.IMREAD_COLOR)[:, :, ::-1].astype(np.float64)


def dots_features(index, dots):
    """What the readings hold of the dots of each frame: mean motion, its part away from the contact's middle, its divergence there."""
    at, near = np.array(index["dots"]["image_px"]), NEAR_PART * index["camera"]["full_height"]
    rows = []
    for frame in dots.astype(np.float64):
        found = frame[:, 2] > 0
        moved, rest = frame[found, :2], at[found]
        squares = (moved**2).sum(axis=1)
        if not squares.sum() > 0:
            rows.append(np.zeros(3))
            continue
        away = rest + moved - (squares[:, None] * (rest + moved)).sum(axis=0) / squares.sum()
        length = np.linalg.norm(away, axis=1)
        out = (away * moved).sum(axis=1)
        weight = np.exp(-0.5 * (length / near) ** 2)
        rows.append(np.array([np.sqrt(squares).mean(), (out / np.maximum(length, 1e-12)).mean(),
                              2 * (weight * out).sum() / (weight * length**2).sum()]))
    return np.array(rows)


def without_dots(index, video):
    """Two dots that were never printed, of those that move most: neither in the pictures nor in the readings."""
    gone = np.argsort(np.linalg.norm(video.dots[-1, :, :2], axis=1))[-2:]
    dots = video.dots.copy()
    dots[:, gone] = 0
    columns, readings = index["readings"]["columns"], video.readings.copy()
    motion = [columns.index(name) for name in ("dots_mean_px", "dots_radial_px", "dots_divergence")]
    readings[:, motion] += dots_features(index, dots) - dots_features(index, video.dots)
    readings[:, columns.index("dots_found")] = dots[:, :, 2].mean(axis=1)
    scale = video.rest.shape[1] / index["camera"]["full_width"]

    def painted(picture, moved):
        mask = np.zeros(picture.shape[:2], np.uint8)
        for place in (np.array(index["dots"]["image_px"])[gone] + moved + 0.5) * scale - 0.5:
            cv2.circle(mask, tuple(int(round(part)) for part in place), 1, 255, -1)
        return cv2.inpaint(picture.astype(np.uint8), mask, 2, cv2.INPAINT_TELEA).astype(np.float64)
    frames = [painted(frame, moved) for frame, moved in zip(video.frames, video.dots[:, gone, :2])]
    return Video(np.array(frames), painted(video.rest, 0), readings, dots, video.label)


def without_contact(_, video):
    """The frames before the contact, the last of them again and again."""
    shown = np.minimum(np.arange(len(video.frames)), video.label["first_contact_frame"] - 1)
    return dataclasses.replace(video, frames=video.frames[shown], readings=video.readings[shown], dots=video.dots[shown])


def touched_at_rest(_, video):
    """A frame of the press given as the one at rest."""
    return dataclasses.replace(video, rest=video.frames[len(video.frames) // 2])


def at_size(width, height):
    """Every picture as the mean over areas of it, as `track` shows it to a model."""
    return lambda picture: cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA)


AS_IT_IS, NO_CONTACT = "as it is", "no contact"
SHIFTS = {AS_IT_IS: lambda _, video: video, "30 % less light": of_pictures(lambda p: np.round(0.7 * p)),
          "half the light": of_pictures(lambda p: np.round(0.5 * p)), "lens 10 % longer": of_pictures(zoomed(1.1)),
          "lens 10 % shorter": of_pictures(zoomed(1 / 1.1)), "JPEG 70 of the small pictures": of_pictures(jpeg),
          "two dots missing": without_dots, "touched at rest": touched_at_rest, NO_CONTACT: without_contact}


# --- what the model says

def profile(rest):
    """Mean level, and the levels of 3 x 4 blocks in parts of it."""
    height, width, _ = rest.shape
    rows, columns = np.arange(height) * 3 // height, np.arange(width) * 4 // width
    mean = rest.mean()
    blocks = [rest[rows == row][:, columns == column].mean() for row in range(3) for column in range(4)]
    return np.array([mean, *(np.array(blocks) / mean)])


def allows(reading, value):
    low, high = reading["range"]
    margin = 0.25 * (high - low)
    low, high = (max(low - margin, 0.5 * low) if low > 0 else low - margin,
                 min(high + margin, 0.5 * high) if high < 0 else high + margin)
    return low <= value <= high


def judge(model, index, video):
    """The class, or None where the model is unsure."""
    session, metadata = model
    ranges = np.array(metadata["rest_ranges"])
    if len(ranges):
        part = np.array([0.05] + [0.5] * (len(ranges) - 1))
        margin = np.maximum(part * (ranges[:, 1] - ranges[:, 0]), 0.02 * np.abs(ranges[:, 1]))
        seen = profile(video.rest)
        if ((seen < ranges[:, 0] - margin) | (seen > ranges[:, 1] + margin)).any():
            return None
    columns = index["readings"]["columns"]
    readings = video.readings[:, [columns.index(reading["name"]) for reading in metadata["readings"]]]
    if not all(allows(reading, value) for reading, value in zip(metadata["readings"], readings[-1])):
        return None
    inputs = {"picture": ((video.frames - video.rest) / 255).transpose(0, 3, 1, 2).astype(np.float32)}
    sizes = {port.name: port.shape for port in session.get_inputs()}
    inputs["readings"] = readings[:, : sizes.get("readings", [0, 0])[1]].astype(np.float32)
    names = [port.name for port in session.get_outputs()]
    outputs = dict(zip(names, session.run(None, {name: inputs[name] for name in sizes})))
    if (outputs["novelty"][0] > np.array(metadata["novelty_limits"])).any():
        return None
    # a model of classes alone states none that is less probable
    if metadata["interval_quantile"] == 0 and outputs["probability"][0].max() < 0.9:
        return None
    return int(outputs["probability"][0].argmax())


def contradicted(metadata, label, by_contact):
    """Whether contact mechanics, where it has the hand's travel, says another class: then `track --travel` states none."""
    if by_contact["status"] not in ("ok", "saturated"):
        return False
    off = [abs(np.log10(each["youngs_modulus_mpa"]) - by_contact["log10_youngs_modulus_mpa"]) for each in metadata["classes"]]
    return off[label] > min(off)


def opened(model):
    session = onnxruntime.InferenceSession(str(model), providers=["CPUExecutionProvider"])
    return session, json.loads(session.get_modelmeta().custom_metadata_map["domecast_hardness"])


KINDS = ("right", "wrong", "unsure")


def kind_of(found, video):
    return "unsure" if found is None else "right" if found == video.label["label"] else "wrong"


def unsure_of(folder, file):
    """Of how many of the test's videos a model is unsure."""
    model = opened(file)
    return sum(judge(model, index, video) is None for index, video in videos_of(folder, "test"))


def said(folder, file, shifts, by_contact):
    """Of the test's videos in each of `shifts`: right, wrong, unsure; and the same where contact mechanics (`by_contact`, the lines of
    `domecast hardness` by key) has a say."""
    model = opened(file)
    rows = {name: {kind: 0 for kind in (*KINDS, *(f"{kind}_beside" for kind in KINDS))} for name in shifts}
    for index, video in videos_of(folder, "test"):
        for name, shift in shifts.items():
            found = judge(model, index, shift(index, video))
            rows[name][kind_of(found, video)] += 1
            if found is not None and contradicted(model[1], found, by_contact[video.label["key"]]):
                found = None
            rows[name][f"{kind_of(found, video)}_beside"] += 1
    return rows
