"""Judges `track --shape` by numpy alone: heights, normals and contact against what `simulate --depth` says it drew.

    python3 scripts/check_shape.py DOMECAST [--quick] [--keep FOLDER]

Frames are those of `shape_frames.py`. Faults of light and picture are judged by `check_shape_faults.py`.
"""
import argparse
import json
import pathlib
import shutil
import sys
import tempfile

import cv2
import numpy as np
import trimesh

import shape_frames
from shape_frames import PRESSES, ROOT, SHARES, ball, built_constants, check, dome_of, draw, drawn, errors, photograph, run, shown, simulate, track, within

# Height to 45 degrees (rms, 99 of 100) and to 60 (rms), mm; normals to 45, degrees rms. The last two designs' lights leave part
# of the dome dark (crescents of the lip, a ring without light), so that not every design can hold what thumb24 does.
BOUNDS = {
    "thumb24": (0.010, 0.030, 0.020, 1.5),
    "digit-rigid": (0.025, 0.070, 0.025, 2.2),
    "picam-r20": (0.040, 0.070, 0.050, 1.5),
}

# Of `SHARES`, the pixels within 1, 2, 3 deviations, all that are known to 60 degrees, touched or not: by how much they may be
# off: of one frame, from below alone; of a design's frames; of all. Wide as they are: on thumb24 deviations are a quarter too
# large, for its flank, where the light is known worse, says what is left over for all of the dome.
ONE, DESIGN, ALL = 0.25, 0.19, 0.12
# Of one frame, errors over deviations, rms. Its errors go together over the dome: where all of them are a little more than one
# deviation, few are within one, and nothing is wrong; so a frame is not judged by that share.
ONE_RMS = 1.5
deviations = {}

# Touched pixels of a ball that both find, over those that either finds: as much as the simulator's elements of half a millimetre draw of an
# outline. Halved (0.25 mm), the same balls are at 0.88 to 0.94; on exact skins the rule itself reaches 0.96 to 0.99 (`contact_outlines.py`).
BALL_OVERLAP = 0.82


def check_deviations():
    """Whether deviations are neither too small nor too large, frames alike."""
    for design, shares in deviations.items():
        if len(shares) == 1:
            continue
        mean = np.mean(shares, axis=0)
        check(f"{design}: sd from both sides", all(np.abs(mean - SHARES) <= DESIGN), shown(mean))
    if not deviations:
        return
    mean = np.mean([share for shares in deviations.values() for share in shares], axis=0)
    check("all: sd from both sides", all(np.abs(mean - SHARES) <= ALL), shown(mean))


def touched(truth, objects, contact, dome):
    """The pixels that a touch covers. Of a ball the circle that Hertz' formula gives for the force: the simulator's elements of half a
    millimetre are no outline. Of all else those whose pressure is more than a fiftieth of the largest, which is as coarse as the elements."""
    shape = objects[0]["shape"]
    if shape["kind"] != "sphere":
        pressure = np.load(truth / "frame_0000.pressure.npy")
        return pressure > 0.02 * np.nanmax(pressure)
    rubber, force = dome["elastomer"], np.linalg.norm(contact["force_n"])
    radius = 1 / (1 / shape["radius_mm"] + 1 / dome["radius"])
    stiffness = rubber["young_modulus_mpa"] / (1 - rubber["poisson_ratio"] ** 2)
    edge = (0.75 * force * radius / stiffness) ** (1 / 3)
    away = np.load(truth / "frame_0000.surface.npy") - np.array(contact["point_mm"])
    axis = np.array(contact["normal"])
    return np.linalg.norm(np.cross(away, axis), axis=2) < edge


def judge(domecast, work, design, name, objects, dome, constants):
    label = f"{design}, {name}"
    folder = work / f"{design}-{name.replace(' ', '-')}"
    truth = simulate(domecast, folder, design, objects)
    rest = simulate(domecast, work / f"{design}-rest", design, None)
    frame, still = folder / "camera_frame.png", folder / "camera_rest.png"
    cv2.imwrite(str(frame), photograph(drawn(truth), 1))
    cv2.imwrite(str(still), photograph(drawn(rest), 2))
    shape = folder / "shape"
    line = track(domecast, frame, still, constants, shape)
    e = errors(truth, shape, dome)
    numbers = {}
    for limit in (45, 60):
        here = e["known"] & (e["polar"] <= limit)
        seen = np.isfinite(e["true"]) & (e["polar"] <= limit)
        off = np.abs(e["off"][here])
        numbers[limit] = dict(rms=np.sqrt(np.mean(off**2)), p99=np.percentile(off, 99), worst=off.max(),
                              normal=np.sqrt(np.mean(e["turned"][here] ** 2)), known=here.sum() / max(1, seen.sum()))
    n45, n60 = numbers[45], numbers[60]
    rms45, p99, rms60, turned = BOUNDS[design]
    check(f"{label}: height to 45 deg", n45["rms"] <= rms45 and n45["p99"] <= p99,
          f"rms {n45['rms']:.4f} p99 {n45['p99']:.4f} max {n45['worst']:.4f} mm, depth {-np.nanmin(e['true']):.3f}, known {n45['known']:.3f}")
    check(f"{label}: height to 60 deg", n60["rms"] <= rms60, f"rms {n60['rms']:.4f} p99 {n60['p99']:.4f} mm, known {n60['known']:.3f}")
    check(f"{label}: normals to 45 deg", n45["normal"] <= turned, f"rms {n45['normal']:.2f} deg; to 60: {n60['normal']:.2f}")
    ratio = (np.abs(e["off"]) / e["sd"])[e["known"] & (e["polar"] <= 60)]
    shares = within(ratio)
    rms = np.sqrt(np.mean(ratio**2))
    check(f"{label}: sd is not too small", rms <= ONE_RMS and all((shares >= np.array(SHARES) - ONE)[1:]), f"{shown(shares)}; rms {rms:.2f}")
    deviations.setdefault(design, []).append(shares)
    contact = json.loads((truth / "truth.jsonl").read_text().splitlines()[0])["contact"]
    there, found = touched(truth, objects, contact, dome), np.load(shape / "frame_0000.contact.npy") > 0
    overlap = (there & found).sum() / max(1, (there | found).sum())
    away = np.linalg.norm(np.subtract(line["contact"]["point_mm"], contact["point_mm"]))
    detail = f"{away:.3f} mm; IoU {overlap:.2f}, {line['contact']['area_mm2']:.2f} of {contact['area_mm2']:.2f} mm2"
    is_ball = objects[0]["shape"]["kind"] == "sphere"
    check(f"{label}: place of the touch", not is_ball or (away <= 0.1 and overlap >= BALL_OVERLAP), detail)
    outline = np.array(line["contact"]["outline_px"], np.float32)
    check(f"{label}: outline", cv2.contourArea(outline) > 0 and line["shape"]["status"] == "ok",
          f"{len(outline)} corners, {cv2.contourArea(outline):.0f} of {found.sum()} px")
    wrong = written_alike(shape, dome)
    check(f"{label}: picture and triangles", not wrong, ", ".join(wrong))
    return e


def written_alike(shape, dome):
    """What is wrong with the picture and the triangles beside the heights, by OpenCV and trimesh."""
    height = np.load(shape / "frame_0000.height.npy")
    levels = cv2.imread(str(shape / "frame_0000.height.png"), cv2.IMREAD_UNCHANGED)
    known, wrong = np.isfinite(height), []
    if levels.dtype != np.uint16 or levels.shape != height.shape or ((levels > 0) != known).any():
        return ["the picture is of another kind or size, or knows other pixels"]
    if np.abs((levels[known] - 32768.0) * 0.001 - height[known]).max() > 0.00051:
        wrong.append("the picture's heights")
    skin = trimesh.load(shape / "frame_0000.ply", process=False)
    data = skin.metadata["_ply_raw"]["vertex"]["data"]
    away = np.linalg.norm(skin.vertices - [0, 0, dome["center_z"]], axis=1) - dome["radius"]
    if np.abs(away - data["height_mm"]).max() > 1e-4 or not (data["height_sd_mm"] > 0).all():
        wrong.append("heights of the triangles' corners")
    if (skin.area_faces <= 0).any() or ((skin.triangles_center - [0, 0, dome["center_z"]]) * skin.face_normals).sum(axis=1).min() <= 0:
        wrong.append("triangles that face inwards or have no area")
    if len(skin.split(only_watertight=False)) != 1 or len(skin.faces) < known.sum() / 4:
        wrong.append("triangles that do not hang together")
    normals = np.column_stack([data[name] for name in ("nx", "ny", "nz")])
    if (normals * skin.vertex_normals).sum(axis=1).mean() < 0.99:
        wrong.append("normals that are not the surface's")
    return wrong


# Presses of a sequence of frames on two designs whose light is scarce in places, where errors that go on from frame to frame grow.
SCARCE = {
    "endoscope-r5": lambda d: ball(2, 15, 60, 0.25, d),
    "thumb24-wide": lambda d: ball(4, 20, 60, 0.4, d),
}


def sequence(domecast, work, design, constants, press, count):
    """Frames in a row beside a frame at rest with noise of its own: untouched ones, one picture again and again, a touch that stays, its release."""
    dome, jpeg = dome_of(constants), False
    rest, truth = simulate(domecast, work / f"{design}-rest", design, None), simulate(domecast, work / f"{design}-held", design, press(dome))
    frames, still, shape = work / f"{design}-sequence", work / f"{design}-sequence-rest.png", work / f"{design}-sequence-shape"
    shutil.rmtree(frames, ignore_errors=True)
    frames.mkdir()
    parts = {"untouched": [(rest, 100 + k) for k in range(count)], "again": [(rest, 100)] * count,
             "held": [(truth, 200)] * 4, "released": [(rest, 100)] * 3}
    for number, (picture, seed) in enumerate(frame for part in parts.values() for frame in part):
        cv2.imwrite(str(frames / f"frame_{number:04}.png"), photograph(drawn(picture), seed, jpeg))
    cv2.imwrite(str(still), photograph(drawn(rest), 99, jpeg))
    lines = [json.loads(line) for line in run(domecast, "track", frames, "--constants", constants, "--shape", shape,
                                              "--rest", still, "--force").splitlines()]
    rms, shares, number, stated = {}, [], 0, {}
    for part, pictures in parts.items():
        stated[part] = sum(bool(line.get("contact")) for line in lines[number:number + len(pictures)])
        for picture, _ in pictures:
            e = errors(picture, shape, dome, number)
            here = e["known"] & (e["polar"] <= 60)
            rms.setdefault(part, []).append(np.sqrt(np.mean(e["off"][here] ** 2)))
            if part == "untouched":
                shares.append(within((np.abs(e["off"]) / e["sd"])[here]))
            number += 1
    # A frame at rest that was touched must not pass for one: the skin lies above it then, and beside a clean one nowhere.
    line = track(domecast, frames / "frame_0000.png", frames / f"frame_{2 * count:04}.png", constants, shape)
    plain = all(one["shape"]["status"] == "ok" for one in lines)
    check(f"{design}: a touched frame at rest", line["shape"]["status"] == "raised" and not line["contact"] and plain, line["shape"]["status"])
    # some 10 MB of maps a frame
    shutil.rmtree(shape)
    check(f"{design}: untouched", len(lines) == number and not (stated["untouched"] or stated["released"]),
          f"{stated['untouched']} touches in {count} frames, {stated['released']} in 3 after a release")
    mean = np.mean(shares[count // 2:], axis=0)
    check(f"{design}: sd of untouched frames in a row", all(mean >= np.array(SHARES) - ONE), f"{shown(mean)}, from frame {count // 2} on")
    for part, before in (("again", rms["untouched"][0]), ("held", rms["held"][0]), ("released", rms["untouched"][0])):
        check(f"{design}: a frame {part}", stated["held"] == 4 and rms[part][-1] <= 1.2 * before, f"rms {before:.4f} to {rms[part][-1]:.4f} mm")


def pillar(domecast, work):
    """thumb24's dome on a cylinder of 2 mm: heights of a press beside the pole."""
    design = json.loads((ROOT / "designs/thumb24.json").read_text()) | {"name": "pillar"}
    design["dome"]["cylinder_height_mm"] = 2.0
    design["envelope"]["size_mm"] = [24.0, 24.0, 28.0]
    file, built = work / "pillar.json", work / "pillar"
    file.write_text(json.dumps(design))
    if not built.exists():
        run(domecast, "build", file, "--out", built, "--quiet")
    constants = built / "constants/constants.json"
    dome, level = dome_of(constants), json.loads((built / "report/light.json").read_text())["level_per_mw_mm2"]
    rest = draw(domecast, work / "pillar-rest", file, level, None)
    truth = draw(domecast, work / "pillar-ball", file, level, ball(4, 15, 60, 0.4, dome))
    for name, seed, picture in (("frame", 1, truth), ("rest", 2, rest)):
        cv2.imwrite(str(truth / f"camera_{name}.png"), photograph(drawn(picture), seed))
    track(domecast, truth / "camera_frame.png", truth / "camera_rest.png", constants, truth / "shape")
    e = errors(truth, truth / "shape", dome)
    off = np.abs(e["off"][e["known"] & (e["polar"] <= 45)])
    rms = np.sqrt(np.mean(off**2))
    check("on a cylinder: height to 45 deg", rms <= 0.010 and np.percentile(off, 99) <= 0.030,
          f"rms {rms:.4f} p99 {np.percentile(off, 99):.4f} mm, depth {-np.nanmin(e['true']):.3f}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("domecast", type=pathlib.Path)
    parser.add_argument("--quick", action="store_true", help="one press of each design")
    parser.add_argument("--keep", type=pathlib.Path, help="folder that simulated frames are kept in")
    parser.add_argument("--only", help="a design")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        work = (arguments.keep or pathlib.Path(scratch)).resolve()
        work.mkdir(parents=True, exist_ok=True)
        for design, presses in PRESSES.items():
            if arguments.only not in (None, design):
                continue
            constants = built_constants(arguments.domecast, work, design)
            dome = dome_of(constants)
            for name, objects in list(presses.items())[: 1 if arguments.quick else None]:
                judge(arguments.domecast, work, design, name, objects(dome), dome, constants)
            sequence(arguments.domecast, work, design, constants, next(iter(presses.values())), 4 if arguments.quick else 16)
            if design == "thumb24":
                pillar(arguments.domecast, work)
        for design, press in list(SCARCE.items())[: 1 if arguments.quick else None]:
            if arguments.only in (None, design):
                sequence(arguments.domecast, work, design, built_constants(arguments.domecast, work, design), press, 12)
    # Errors of a frame go together: three frames say little of their mean.
    if not arguments.quick:
        check_deviations()
    sys.exit(1 if shape_frames.failed else 0)


if __name__ == "__main__":
    main()
