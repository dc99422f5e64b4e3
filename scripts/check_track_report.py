"""Judges `track --report` and the skin in `track --overlay`: the page's numbers against the JSON lines and the height maps.

    python3 scripts/check_track_report.py DOMECAST [--keep FOLDER]

A ball is pressed onto thumb24 and rolled aside; one frame is missing, one is dark, one is no picture. The page's readings are compared with
the lines, the skin's grid with the height maps at the pixels where `domecast project` sees its places. The page must be well-formed,
ask for nothing outside itself, stay small, and in a browser, where one is at hand, draw its skin without a fault.
"""
import argparse
import base64
import gzip
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
from html.parser import HTMLParser

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

ROOT = pathlib.Path(__file__).resolve().parent.parent
LIMIT_BYTES = 2_000_000
VOID = {"meta", "link", "img", "input", "br", "hr"}
MISSING, DARK, BROKEN = 5, 9, 11
FRAMES = 16
failed = 0


def check(what, holds, detail=""):
    global failed
    failed += not holds
    print(f"{'ok  ' if holds else 'FAIL'} {what:<52} {detail}", flush=True)


def run(*words, **how):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True, **how)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, words))}\n{done.stdout}{done.stderr}")
    return done.stdout


class Page(HTMLParser):
    """Elements that do not end where they must, names given twice, and what the page would fetch."""

    def __init__(self, text):
        super().__init__()
        self.open, self.faults, self.names, self.texts, self.inside = [], [], set(), {}, None
        self.feed(text)
        self.close()
        self.faults += [f"{tag} does not end" for tag in self.open]

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        for key in ("src", "href", "data", "action", "xlink:href"):
            value = attributes.get(key, "#")
            if not (value.startswith("#") or value.startswith("data:")):
                self.faults.append(f"{tag} asks for {value[:60]}")
        name = attributes.get("id")
        if name in self.names:
            self.faults.append(f"two elements are named {name}")
        self.names |= {name} - {None}
        self.inside = name if tag == "script" else None
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        self.inside = None
        if not self.open or self.open.pop() != tag:
            self.faults.append(f"{tag} ends where it does not stand")

    def handle_data(self, data):
        if self.inside:
            self.texts[self.inside] = self.texts.get(self.inside, "") + data


def make_frames(domecast, work):
    """The build, the frames with their faults, the frame at rest."""
    built, drawn, frames = work / "thumb24", work / "report-ball", work / "report-frames"
    if not built.exists():
        run(domecast, "build", ROOT / "designs/thumb24.json", "--out", built, "--quiet")
    if not (drawn / "truth.jsonl").exists():
        scene = json.loads((ROOT / "designs/scenes/ball.json").read_text())
        scene.update(name="report-ball", design=str(ROOT / "designs/thumb24.json"))
        scene["frames"]["count"] = FRAMES
        level = json.loads((built / "report/light.json").read_text())["level_per_mw_mm2"]
        scene["light"]["leds"]["level_per_mw_mm2"] = level
        scene["objects"][0]["path"] = [
            {"time_s": 0, "position_mm": [0, 0, 15.2]}, {"time_s": 0.5, "position_mm": [0, 0, 14.2]},
            {"time_s": 0.8, "position_mm": [1.5, 0, 14.0]}, {"time_s": 1, "position_mm": [1.5, 0, 15.4]},
        ]
        file = work / "report-ball.json"
        file.write_text(json.dumps(scene))
        run(domecast, "simulate", file, "--out", drawn, "--quiet")
    frames.mkdir(exist_ok=True)
    noise = np.random.default_rng(3)
    for number in [*range(FRAMES), "rest"]:
        whole = cv2.imread(str(drawn / f"frame_{0 if number == 'rest' else number:04}.png")).astype(float)
        noisy = (0.02 if number == DARK else 1) * whole + 1.5 * noise.standard_normal(whole.shape)
        to = work / "report-rest.png" if number == "rest" else frames / f"frame_{number:04}.png"
        cv2.imwrite(str(to), np.clip(np.rint(noisy), 0, 255).astype(np.uint8))
    (frames / f"frame_{MISSING:04}.png").unlink()
    (frames / f"frame_{BROKEN:04}.png").write_bytes(b"no picture")
    return built / "constants/constants.json", frames, work / "report-rest.png"


def rotation_vector(rotation):
    # OpenCV's takes angles below 1e-5 for none
    return Rotation.from_matrix(rotation).as_rotvec()


def wanted_of(line, at):
    """What the page must say of a line: by name, None where there is no number."""
    wrench, wrench_sd, pose, pose_sd = (line[key] for key in ("wrench", "wrench_sd", "pose", "pose_sd"))
    of = dict.fromkeys(("force_n", "force_sd_n", "torque_nmm", "torque_sd_nmm", "translation_mm", "translation_sd_mm",
                        "rotation_rad", "rotation_sd_rad", "contact_depth_mm", "contact_depth_sd_mm", "contact_area_mm2"))
    if wrench:
        of.update(force_n=wrench[:3], torque_nmm=wrench[3:], force_sd_n=wrench_sd[:3], torque_sd_nmm=wrench_sd[3:])
    if pose:
        pose = np.array(pose)
        of.update(translation_mm=pose[:3, :3] @ at + pose[:3, 3] - at, rotation_rad=rotation_vector(pose[:3, :3]),
                  translation_sd_mm=pose_sd[:3], rotation_sd_rad=pose_sd[3:])
    shape = line.get("shape")
    if shape and shape["status"] != "no_pose":
        touch = line["contact"] or {"depth_mm": 0, "area_mm2": 0, "depth_sd_mm": None}
        of.update(contact_depth_mm=touch["depth_mm"], contact_area_mm2=touch["area_mm2"], contact_depth_sd_mm=touch["depth_sd_mm"])
    return of


def numbers(data, lines, at):
    """The page's readings are those of the lines."""
    check("frames and statuses are those of the lines",
          (data["frames"], data["status"], data["frames_in_all"], data["every"])
          == ([line["frame"] for line in lines], [line["status"] for line in lines], len(lines), 1))
    worst, compared, unlike = {}, 0, []
    for index, line in enumerate(lines):
        for key, wanted in wanted_of(line, at).items():
            found = data[key][index]
            if (found is None) != (wanted is None):
                unlike.append(f"{key} of frame {line['frame']}: {found}, {wanted}")
            elif found is not None:
                worst[key] = max(worst.get(key, 0), np.abs(np.subtract(found, wanted)).max())
                compared += 1
    check("numbers are there where the lines have some", not unlike, "; ".join(unlike[:3]))
    check("numbers are those of the lines", compared > 100 and max(worst.values()) <= 2.1e-6,
          f"{compared}, at most {max(worst.values()):.1e} off")
    gone = [data["force_n"][data["frames"].index(number)] for number in (DARK, BROKEN)]
    check("a dark frame and a broken one are gaps", gone == [None, None] and MISSING not in data["frames"])


def skin(domecast, data, packed, shape, lines, work):
    """The grid's heights are those of the height maps where the grid's places are seen."""
    grid = data["skin"]
    rings, around = np.array(grid["rings"]), grid["around"]
    count, frames = 1 + (len(rings) - 1) * around, len(grid["frames"])
    raw = gzip.decompress(base64.b64decode(packed))
    check("the skin's bytes are whole", len(raw) == 3 * frames * count and 0 < frames <= 60, f"{frames} frames of {count} places")
    heights = np.frombuffer(raw, "<i2", frames * count).reshape(frames, count)
    touched = np.frombuffer(raw, "u1", offset=2 * frames * count).reshape(frames, count)
    turn = 2 * np.pi * np.arange(around) / around
    place = lambda r, z: np.stack([np.outer(r, np.cos(turn)), np.outer(r, np.sin(turn)), np.outer(z, np.ones(around))], 2)
    join = lambda r, z: np.vstack([[[0, 0, z[0]]], place(r[1:], z[1:]).reshape(-1, 3)])
    places, normals = join(rings[:, 0], rings[:, 1]), join(rings[:, 2], rings[:, 3])
    by_frame = {line["frame"]: line for line in lines}
    off, seen = [], []
    for index, number in enumerate(grid["frames"]):
        known = heights[index] != grid["unseen"]
        seen.append(known.mean())
        found = heights[index][known] * grid["unit_mm"]
        pose, points = work / "report-pose.json", work / "report-points.csv"
        pose.write_text(json.dumps(by_frame[number]["pose"]))
        # Places that bulge past the dome are not the command's to project.
        inner = found <= 0
        at = (places[known] + normals[known] * found[:, None])[inner]
        points.write_text("".join(f"{x},{y},{z}\n" for x, y, z in at))
        text = run(domecast, "project", ROOT / "designs/thumb24.json", "--points", points, "--pose", pose)
        pixels = np.array([json.loads(row)["image_px"] or [np.nan, np.nan] for row in text.splitlines()])
        height = np.load(shape / f"frame_{number:04}.height.npy").astype(float)
        there = np.isfinite(pixels[:, 0]) & (pixels[:, 0] < height.shape[1] - 1) & (pixels[:, 1] < height.shape[0] - 1)
        (x, y), part = pixels[there].astype(int).T, np.modf(pixels[there])[0].T
        own = ((height[y, x] * (1 - part[0]) + height[y, x + 1] * part[0]) * (1 - part[1])
               + (height[y + 1, x] * (1 - part[0]) + height[y + 1, x + 1] * part[0]) * part[1])
        difference = np.abs(own - found[inner][there])
        off.append(np.nanpercentile(difference, 99.9))
        touch = by_frame[number]["contact"]
        if bool(touch) != bool(touched[index].any()):
            check(f"frame {number} is touched where the line says so", False)
        if touch and not abs(found.min() + touch["depth_mm"]) <= 0.02:
            check(f"frame {number} is as deep as its contact", False, f"{found.min():.3f}, {touch['depth_mm']:.3f} mm")
    check("heights are those of the maps", max(off) <= 0.002, f"99.9 of 100 within {max(off):.4f} mm")
    check("most of the dome is seen", min(seen) > 0.5, f"{min(seen):.2f}")


def browser(page, frames):
    """Draws the page: the state of the skin's view says which frame it shows."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if not chromium:
        print("!!! SKIPPED: the page was not opened in a browser: on Debian, install chromium")
        return
    with tempfile.TemporaryDirectory() as profile:
        done = subprocess.run([chromium, "--headless=new", "--no-sandbox", "--enable-unsafe-swiftshader", f"--user-data-dir={profile}",
                               "--virtual-time-budget=20000", "--enable-logging=stderr", "--dump-dom", page.as_uri()],
                              capture_output=True, text=True, timeout=300)
    state = re.search(r'id="skin-view"[^>]*data-state="([^"]*)"', done.stdout)
    said = [line for line in done.stderr.splitlines() if "CONSOLE" in line and "GL Driver Message" not in line]
    check("a browser draws the skin", bool(state) and state[1] in {f"drawn {number}" for number in frames}, state[1] if state else "")
    check("and says nothing on its console", not said, "; ".join(said)[:200])


def overlays(folder, frames, shape, lines):
    """The touch stands out from the frame: its colours differ from the picture where, and only where, the skin is pressed in."""
    deepest = max((line for line in lines if line.get("contact")), key=lambda line: line["contact"]["depth_mm"])
    number = deepest["frame"]
    drawn = cv2.imread(str(folder / f"overlay_{number:04}.png"))[::2, ::2].astype(int)
    frame = cv2.imread(str(frames / f"frame_{number:04}.png")).astype(int)
    height = np.load(shape / f"frame_{number:04}.height.npy")
    changed = np.abs(drawn - frame).max(axis=2) > 3
    deep = height < -0.1
    flat = np.isfinite(height) & (height > 0.02)
    check("the overlay colours what is pressed in", changed[deep].mean() > 0.95, f"{changed[deep].mean():.3f} of {deep.sum()} px")
    check("and leaves the rest but for marks", changed[flat].mean() < 0.2, f"{changed[flat].mean():.3f} of {flat.sum()} px")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("domecast", type=pathlib.Path)
    parser.add_argument("--keep", type=pathlib.Path, help="folder that frames and pages are kept in")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        work = (arguments.keep or pathlib.Path(scratch)).resolve()
        work.mkdir(parents=True, exist_ok=True)
        constants, frames, rest = make_frames(arguments.domecast, work)
        shape, overlay, page, out = (work / f"report-{name}" for name in ("shape", "overlay", "page.html", "lines.jsonl"))
        run(arguments.domecast, "track", frames, "--constants", constants, "--shape", shape, "--rest", rest, "--overlay", overlay,
            "--report", page, "--out", out, "--force", "--quiet")
        text, lines = page.read_text(), [json.loads(line) for line in out.read_text().splitlines()]
        read = Page(text)
        check("the page is well-formed and asks for nothing", not read.faults, "; ".join(read.faults[:3]))
        reaches_out = re.findall(r"@import|url\(|fetch\(|XMLHttpRequest|WebSocket|import\(", text)
        check("nor do its style and scripts", not reaches_out, ", ".join(reaches_out))
        check("it is small", len(text.encode()) <= LIMIT_BYTES, f"{len(text.encode()) / 1e3:.0f} kB")
        data = json.loads(read.texts["track"])
        at = np.array(json.loads(constants.read_text())["springs"]["at_mm"])
        numbers(data, lines, at)
        skin(arguments.domecast, data, read.texts["skins"], shape, lines, work)
        overlays(overlay, frames, shape, lines)
        browser(page, data["skin"]["frames"])
        again = work / "report-again.html"
        run(arguments.domecast, "track", frames, "--constants", constants, "--shape", shape, "--rest", rest, "--report", again,
            "--out", out, "--force", "--quiet")
        check("the same frames give the same page", again.read_bytes() == page.read_bytes())
        run(arguments.domecast, "track", frames, "--constants", constants, "--report", again, "--out", out, "--force", "--quiet")
        plain = Page(again.read_text())
        check("a page without shape has no skin", not plain.faults and "skin" not in json.loads(plain.texts["track"]))
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
