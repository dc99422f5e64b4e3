"""Judges what `track --shape` says of faults: stains, patches that are cut off, spots and scratches, weaker lights and lights that are out.

    python3 scripts/check_shape_faults.py DOMECAST [--quick] [--every N] [--keep FOLDER]

Frames are those of `shape_frames.py`. A fault is drawn into the frame alone, before noise and JPEG: the frame at rest lacks it.
"""
import argparse
import json
import math
import pathlib
import shutil
import subprocess
import sys
import tempfile

import cv2
import numpy as np

import shape_frames
from shape_frames import PRESSES, ROOT, ball, built_constants, check, direction, dome_of, draw, drawn, errors, photograph, run, shown, simulate, track, within

# A press of each design, and its name among the frames.
TOUCHES = {
    "thumb24": ("ball-on-the-pole", lambda d: ball(5, 0, 0, 0.5, d)),
    "endoscope-r5": ("held", lambda d: ball(2, 15, 60, 0.25, d)),
    "thumb24-wide": ("held", lambda d: ball(4, 20, 60, 0.4, d)),
    "digit-rigid": ("ball-at-10-deg", lambda d: ball(4, 10, 100, 0.4, d)),
    "picam-r20": ("ball-at-20-deg", lambda d: ball(6, 20, 300, 0.8, d)),
}
# What stains leave of blue, green and red; `None` is cut off. Radii in parts of the dome's.
STAINS = {"red": (0.6, 0.6, 1), "green": (0.6, 1, 0.6), "blue": (1, 0.6, 0.6), "yellow": (0.6, 1, 1), "cyan": (1, 1, 0.6), "faint red": (0.9, 0.9, 1),
          "faint grey": (0.92, 0.92, 0.92), "grey": (0.7, 0.7, 0.7), "dark": (0.15, 0.15, 0.15), "bright": (1.15, 1.15, 1.15), "cut off": None}
RADII = (0.05, 0.1, 0.3)
# Shares of pixels within three deviations, in a stain, to 20 px around it, and away: of all stains of a design, touched or not; of each.
ALL_WITHIN, EACH_WITHIN = 0.95, 0.4
# Weaker lights: the largest rms to 60 degrees, mm, and the least share of pixels within three deviations.
WEAKER = (0.02, 0.9)
# Stains on untouched skin, of 33, that state a touch: what is left over is not told apart from
# noise where dots cover two thirds of the skin or much of it is dark.
MAX_FALSE_TOUCHES = {"endoscope-r5": 9, "picam-r20": 5, "thumb24-wide": 9, "digit-rigid": 5}


def away_deg(truth, dome, polar_deg, azimuth_deg):
    """Angle of each pixel's skin from a place of the dome."""
    from_center = np.load(truth / "frame_0000.surface.npy").astype(float) - [0, 0, dome["center_z"]]
    way = direction(polar_deg, azimuth_deg)
    cosine = (from_center @ way) / np.linalg.norm(from_center, axis=2)
    return np.where(np.isfinite(cosine), np.degrees(np.arccos(np.clip(cosine, -1, 1))), 180)


def stained(picture, mask, color):
    """A camera's frame with a stain; a patch that is cut off is so after all else."""
    if color is None:
        frame = photograph(picture, 77)
        frame[mask] = 255
        return frame
    part = cv2.GaussianBlur(mask.astype(float), (0, 0), 1.0)[..., None]
    return photograph(picture * (1 - part + part * np.array(color)), 77)


def stains(domecast, work, design, constants, every, radii):
    """Stains of several colours and sizes on untouched skin, in the middle of a touch and beside it: their pixels, and those around, say so."""
    dome, (name, press) = dome_of(constants), TOUCHES[design]
    rest, touch = simulate(domecast, work / f"{design}-rest", design, None), simulate(domecast, work / f"{design}-{name}", design, press(dome))
    folder = work / f"{design}-stained"
    folder.mkdir(exist_ok=True)
    still, frame, shape = folder / "camera_rest.png", folder / "camera_frame.png", folder / "shape"
    cv2.imwrite(str(still), photograph(drawn(rest), 2))
    point = np.array(json.loads((touch / "truth.jsonl").read_text().splitlines()[0])["contact"]["point_mm"]) - [0, 0, dome["center_z"]]
    polar, azimuth = np.degrees([np.arccos(point[2] / np.linalg.norm(point)), np.arctan2(point[1], point[0])])
    within, false_touches, count = {"in it": [], "around it": [], "away": []}, 0, 0
    for truth, place in ((rest, (25, 80)), (touch, (polar, azimuth)), (touch, (30, azimuth + 150))):
        picture, away = drawn(truth), away_deg(truth, dome, *place)
        for color, parts in list(STAINS.items())[::every]:
            for radius in radii:
                mask = away <= np.degrees(radius)
                cv2.imwrite(str(frame), stained(picture, mask, parts))
                line = track(domecast, frame, still, constants, shape)
                e = errors(truth, shape, dome)
                here, near = e["known"] & (e["polar"] <= 60), cv2.dilate(mask.astype(np.uint8), np.ones((41, 41))) > 0
                for where, pixels in (("in it", here & mask), ("around it", here & near & ~mask), ("away", here & ~near)):
                    if pixels.sum() > 20:
                        within[where].append((np.mean(np.abs(e["off"][pixels]) <= 3 * e["sd"][pixels]), f"{color}, {radius}"))
                if truth is rest:
                    count, false_touches = count + 1, false_touches + bool(line.get("contact"))
    for where, shares in within.items():
        mean, (worst, which) = np.mean([share for share, _ in shares]), min(shares)
        check(f"{design}: {len(shares)} stains, {where}", mean >= ALL_WITHIN and worst >= EACH_WITHIN, f"{mean:.3f} within 3 sd, of the worst ({which}) {worst:.2f}")
    limit = math.ceil(MAX_FALSE_TOUCHES.get(design, 1) * count / (len(STAINS) * len(RADII)))
    check(f"{design}: stains state no touch", false_touches <= limit, f"{false_touches} of {count}")


def under_lights(domecast, work, design, name, objects, each):
    """A scene whose lights give these parts of what they gave at rest."""
    level = json.loads((work / design / "report/light.json").read_text())["level_per_mw_mm2"]
    power = 0.5 if design != "picam-r20" else 1.0
    return draw(domecast, work / f"{design}-{name}", ROOT / f"designs/{design}.json", level, objects, power, each)


def lights_out(domecast, work, design, constants):
    """Each light out in turn, touched or not: named, and nothing said of the skin. Without the light of the markers there may be no pose."""
    dome, (_, press) = dome_of(constants), TOUCHES[design]
    still = photograph(drawn(simulate(domecast, work / f"{design}-rest", design, None)), 2)
    lights = len(json.loads(constants.read_text())["light"]["leds"])
    for light in range(lights):
        each, said = [float(k != light) for k in range(lights)], []
        for touched, objects in (("rest", None), ("held", press(dome))):
            dark = under_lights(domecast, work, design, f"dark{light}-{touched}", objects, each)
            cv2.imwrite(str(dark / "camera_frame.png"), photograph(drawn(dark), 7))
            cv2.imwrite(str(dark / "camera_rest.png"), still)
            line = track(domecast, dark / "camera_frame.png", dark / "camera_rest.png", constants, dark / "shape")
            height = np.load(dark / "shape/frame_0000.height.npy")
            said.append((line["shape"]["status"], line["shape"].get("lights_out"), line.get("contact"), np.isfinite(height).any()))
        named = ("light_out", [light], None, False), ("no_pose", None, None, False)
        check(f"{design}: light {light} out", all(one in named for one in said), " | ".join(f"{status} {which or ''}" for status, which, *_ in said))


def weaker_lights(domecast, work, design, constants):
    """One light at four fifths, all at nine tenths and at 98.5 %, untouched and then held: what the lights give is taken out."""
    dome, (_, press) = dome_of(constants), TOUCHES[design]
    lights = len(json.loads(constants.read_text())["light"]["leds"])
    max_rms_mm, min_share = WEAKER
    for what, each in (("light-0-at-80", [0.8] + [1.0] * (lights - 1)), ("all-at-90", [0.9] * lights), ("all-at-0985", [0.985] * lights)):
        folder = work / f"{design}-{what}"
        folder.mkdir(exist_ok=True)
        cv2.imwrite(str(folder / "rest.png"), photograph(drawn(simulate(domecast, work / f"{design}-rest", design, None)), 2))
        dims = []
        for touched, objects in (("rest", None), ("held", press(dome))):
            dims.append(under_lights(domecast, work, design, f"{what}-{touched}", objects, each))
            cv2.imwrite(str(folder / f"{touched}-dim.png"), photograph(drawn(dims[-1]), 7))
        lines = run(domecast, "track", folder / "rest-dim.png", folder / "held-dim.png", "--constants", constants, "--shape", folder / "shape", "--rest", folder / "rest.png", "--force")
        for number, (truth, line) in enumerate(zip(dims, lines.splitlines())):
            e = errors(truth, folder / "shape", dome, number)
            here = e["known"] & (e["polar"] <= 60)
            rms, share = np.sqrt(np.mean(e["off"][here] ** 2)), np.mean(np.abs(e["off"][here]) <= 3 * e["sd"][here])
            said = " ".join(f"{gain:.2f}" for gain in json.loads(line)["shape"]["light_gain"])
            check(f"{design}: {what}, {'held' if number else 'untouched'}", rms <= max_rms_mm and share >= min_share, f"rms {rms:.4f} mm to 60 deg, {share:.2f} within 3 sd, gains {said}")


def in_a_touch(domecast, truth, rest, constants, dome):
    """A patch that is cut off and a dirty dot on a touch leave what is beside them within its bounds."""
    clean, touched = cv2.imread(str(truth / "camera_frame.png")), np.load(truth / "shape/frame_0000.contact.npy") > 0
    rows, columns = np.nonzero(touched)
    middle, end = (int(columns.mean()), int(rows.mean())), (int(columns.max()), int(rows.mean()))
    for what, at, radius, level in (("cut off in the middle", middle, 9, 255), ("cut off at the rim", end, 9, 255), ("dirty", end, 6, 25)):
        frame, patch = clean.copy(), np.zeros(touched.shape, np.uint8)
        cv2.circle(patch, at, radius, 1, -1)
        frame[patch > 0] = level
        cv2.imwrite(str(truth / "faulty.png"), frame)
        track(domecast, truth / "faulty.png", rest, constants, truth / "faulty")
        e = errors(truth, truth / "faulty", dome)
        here = e["known"] & (e["polar"] <= 45) & (cv2.dilate(patch, np.ones((13, 13))) == 0)
        rms, own = np.sqrt(np.mean(e["off"][here] ** 2)), e["sd"][patch > 0]
        within_it = np.mean((np.abs(e["off"]) <= 3 * e["sd"])[(patch > 0) & e["known"]])
        check(f"a touch, {what}", rms <= 0.010 and within_it >= 0.95 and np.nanmedian(own) > 1.2 * np.nanmedian(e["sd"][here]),
              f"rms {rms:.4f} mm beside it; {within_it:.2f} within 3 sd, {np.nanmedian(own):.3f} there, {np.nanmedian(e['sd'][here]):.3f} beside it")


def faults(domecast, work, dome, constants):
    """A saturated patch, a spot and a scratch leave the rest within its bounds; what cannot be read is refused by name."""
    truth = simulate(domecast, work / "thumb24-ball-on-the-pole", "thumb24", PRESSES["thumb24"]["ball on the pole"](dome))
    rest = truth / "camera_rest.png"
    cv2.imwrite(str(truth / "camera_frame.png"), photograph(drawn(truth), 1))
    cv2.imwrite(str(rest), photograph(drawn(simulate(domecast, work / "thumb24-rest", "thumb24", None)), 2))
    track(domecast, truth / "camera_frame.png", rest, constants, truth / "shape")
    frame = cv2.imread(str(truth / "camera_frame.png"))
    frame[195:215, 398:416] = 255
    cv2.circle(frame, (239, 287), 5, (30, 30, 30), -1)
    cv2.line(frame, (262, 140), (300, 152), (200, 200, 200), 1)
    cv2.imwrite(str(truth / "faulty.png"), frame)
    track(domecast, truth / "faulty.png", rest, constants, truth / "faulty")
    e = errors(truth, truth / "faulty", dome)
    here = e["known"] & (e["polar"] <= 45)
    rms = np.sqrt(np.mean(e["off"][here] ** 2))
    check("a patch cut off, a spot, a scratch", rms <= 0.010, f"rms {rms:.4f} mm to 45 deg")
    for what, patch in {"patch": np.s_[195:215, 398:416], "spot": np.s_[282:292, 234:244]}.items():
        sds = np.nanmean(np.abs(e["off"][patch]) / e["sd"][patch])
        check(f"its {what} says so", sds < 1.5 and np.nanmean(e["sd"][patch]) > np.nanmedian(e["sd"]), f"{sds:.2f} sd off")

    in_a_touch(domecast, truth, rest, constants, dome)

    # Too much light: the skin has no height there, and `track` names that; it does not of the frames as they are.
    for what, gain in (("as it is", 1.0), ("twice the light", 2.0)):
        pictures = {name: truth / f"{name}-bright.png" for name in ("camera_frame", "camera_rest")}
        for name, file in pictures.items():
            cv2.imwrite(str(file), np.clip(gain * cv2.imread(str(truth / f"{name}.png")).astype(float), 0, 255).astype(np.uint8))
        done = subprocess.run([str(w) for w in (domecast, "track", pictures["camera_frame"], "--constants", constants, "--rest", pictures["camera_rest"],
                                                "--shape", truth / "bright", "--out", truth / "bright.jsonl", "--force")], capture_output=True, text=True)
        warned = [line for line in done.stderr.splitlines() if "has no height" in line]
        check(f"light: {what}", done.returncode == 0 and len(warned) == (gain > 1), " ".join(warned)[:110])

    # A light that has become weaker since the frame at rest feigns a slope all over the dome: the deviations must say so.
    still = cv2.imread(str(truth / "camera_frame.png"))
    for c, color in enumerate(("blue", "green", "red")):
        weaker = still.astype(float)
        weaker[..., c] *= 0.98
        cv2.imwrite(str(truth / "weaker.png"), np.rint(weaker).astype(np.uint8))
        track(domecast, truth / "weaker.png", rest, constants, truth / "weaker")
        e = errors(truth, truth / "weaker", dome)
        here = e["known"] & (e["polar"] <= 60)
        rms, share = np.sqrt(np.mean(e["off"][here] ** 2)), np.mean(np.abs(e["off"][here]) <= 3 * e["sd"][here])
        check(f"{color} 2 % weaker than at rest", share >= 0.97 and rms <= 0.04, f"rms {rms:.4f} mm to 60 deg, {share:.2f} within 3 sd")

    def refused(what, word, *words):
        done = subprocess.run([str(w) for w in (domecast, "track", truth / "camera_frame.png", "--shape",
                                                truth / "refused", *words)], capture_output=True, text=True)
        check(f"refused: {what}", done.returncode == 1 and word in done.stderr, done.stderr.strip()[-110:])

    still = cv2.imread(str(rest))
    # Without its own light blue sees what crosstalk leaves of green.
    dead = np.dstack([np.rint(0.08 * still[..., 1]).astype(np.uint8), still[..., 1:]])
    for name, picture in {"swapped": still[..., ::-1], "dead": dead}.items():
        cv2.imwrite(str(truth / f"{name}.png"), picture)
    refused("red and blue swapped at rest", "swapped", "--constants", constants, "--rest", truth / "swapped.png")
    refused("blue lights out at rest", "blue", "--constants", constants, "--rest", truth / "dead.png")
    old = json.loads(constants.read_text())
    del old["light"]
    (truth / "old.json").write_text(json.dumps(old))
    refused("constants without light", "light is not in", "--constants", truth / "old.json", "--rest", truth / "swapped.png")


def opposite_lights(domecast, work):
    """Between lights of one colour that stand opposite each other colours say nothing of slopes: `build` warns, heights say so."""
    name = "thumb24-opposite"
    design, file = json.loads((ROOT / "designs/thumb24.json").read_text()), work / f"{name}.json"
    design["name"] = name
    for k, light in enumerate(design["leds"]["list"]):
        light["color"] = ("red", "green", "blue")[k % 3]
    file.write_text(json.dumps(design))
    shutil.rmtree(work / name, ignore_errors=True)
    done = subprocess.run([domecast, "build", file, "--out", work / name], capture_output=True, text=True)
    warned = [line for line in (done.stdout + done.stderr).splitlines() if "leds.list" in line]
    check("opposite lights: build warns of the pole", done.returncode == 0 and len(warned) == 1, " ".join(warned)[:60])
    constants = work / name / "constants/constants.json"
    dome, level = dome_of(constants), json.loads((work / name / "report/light.json").read_text())["level_per_mw_mm2"]
    rest = work / f"{name}-rest.png"
    cv2.imwrite(str(rest), photograph(drawn(draw(domecast, work / f"{name}-rest", file, level, None)), 2))
    for radius, polar, azimuth, depth in ((5, 0, 0, 0.6), (3, 20, 40, 0.5)):
        truth = draw(domecast, work / f"{name}-{polar}", file, level, ball(radius, polar, azimuth, depth, dome))
        frame = truth / "camera_frame.png"
        cv2.imwrite(str(frame), photograph(drawn(truth), 7))
        track(domecast, frame, rest, constants, truth / "shape")
        e = errors(truth, truth / "shape", dome)
        sds = np.abs(e["off"] / e["sd"])[e["known"] & (e["polar"] <= 60)]
        touch = np.abs(e["off"] / e["sd"])[e["known"] & (away_deg(truth, dome, polar, azimuth) <= 8)]
        check(f"opposite lights: touched at {polar} deg", within(sds)[2] >= 0.97 and within(touch)[2] >= 0.95,
              f"{np.nanmax(np.abs(e['off'][e['polar'] <= 60])):.3f} mm off at most; {shown(within(sds))}, in the touch {shown(within(touch))}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("domecast", type=pathlib.Path)
    parser.add_argument("--quick", action="store_true", help="thumb24 and few stains alone")
    parser.add_argument("--keep", type=pathlib.Path, help="folder that simulated frames are kept in")
    parser.add_argument("--every", type=int, default=1, help="of the stains' colours, every so many-th")
    parser.add_argument("--only", help="a design")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        work = (arguments.keep or pathlib.Path(scratch)).resolve()
        work.mkdir(parents=True, exist_ok=True)
        for design in list(TOUCHES)[: 1 if arguments.quick else None]:
            if arguments.only not in (None, design):
                continue
            constants = built_constants(arguments.domecast, work, design)
            if design == "thumb24":
                faults(arguments.domecast, work, dome_of(constants), constants)
                opposite_lights(arguments.domecast, work)
            lights_out(arguments.domecast, work, design, constants)
            weaker_lights(arguments.domecast, work, design, constants)
            stains(arguments.domecast, work, design, constants, 3 if arguments.quick else arguments.every, RADII[1 if arguments.quick else 0:])
    sys.exit(1 if shape_frames.failed else 0)


if __name__ == "__main__":
    main()
