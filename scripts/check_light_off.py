"""Heights of `track --shape` for a sensor whose lights differ from its design, read with the design's constants.

    python3 scripts/check_light_off.py DOMECAST [--quick] [--keep FOLDER] [--design NAME]

Fluxes of the colours are off by up to 20 %, places by 0.1 mm and azimuths by up to 1.3 degrees, tilt, tape and membrane differ. The frame
at rest takes that out: errors of heights may be 1.5 times those with the true light in the constants (of the nut, the deepest press, 2.2). Frames (noise of 2 levels, JPEG
90, by numpy and OpenCV) are of `simulate`; the true constants are computed here. A sensor with red and blue swapped must be refused.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

import cv2
import numpy as np

import shape_frames as judge

check = judge.check


def off_design(design, change, folder):
    """A design whose lights differ; its file."""
    tree = json.loads((judge.ROOT / f"designs/{design}.json").read_text())
    leds = tree["leds"]
    for key, factor in change["flux"].items():
        leds["radiant_flux_mw"][key] *= factor
    leds["center_radius_mm"] += change["radius_mm"]
    leds["center_z_mm"] += change["z_mm"]
    leds["tilt_deg"] += change["tilt_deg"]
    for led, turn in zip(leds["list"], np.resize(change["azimuth_deg"], len(leds["list"]))):
        led["azimuth_deg"] = (led["azimuth_deg"] + float(turn)) % 360
    if leds.get("diffuser"):
        leds["diffuser"]["lambert_fraction"] += change["lambert"]
        leds["diffuser"]["lobe_width_deg"] *= change["width"]
    tree["elastomer"]["membrane_reflectance"] = {c: v * change["membrane"] for c, v in tree["elastomer"]["membrane_reflectance"].items()}
    tree["name"] = f"{design}-{change['name']}"
    file = folder / f"{tree['name']}.json"
    file.write_text(json.dumps(tree))
    return file


def true_constants(file, nominal, out):
    """The nominal constants with the light of a design whose lights are off, which parts would have no room for."""
    tree, constants = json.loads(file.read_text()), json.loads(nominal.read_text())
    leds, light = tree["leds"], constants["light"]
    tilt = np.radians(leds["tilt_deg"])
    front = leds["diffuser_thickness_mm"] if leds.get("diffuser") else 0.0
    for led, spec in zip(light["leds"], leds["list"], strict=True):
        azimuth = np.radians(spec["azimuth_deg"])
        outward, up = np.array([np.cos(azimuth), np.sin(azimuth), 0]), np.array([0, 0, 1.0])
        axis, side = up * np.cos(tilt) - outward * np.sin(tilt), up * np.sin(tilt) + outward * np.cos(tilt)
        center = outward * leds["center_radius_mm"] + up * leds["center_z_mm"]
        led["position_mm"], led["axis"], led["across"] = (center + front * axis).tolist(), axis.tolist(), np.cross(side, axis).tolist()
        led["flux"] = leds["radiant_flux_mw"][spec["color"][0]]
        if leds.get("diffuser"):
            tape = led["lobe"]["diffuser"]
            tape["lambert_fraction"] = leds["diffuser"]["lambert_fraction"]
            tape["lobe_width_rad"] = np.radians(leds["diffuser"]["lobe_width_deg"])
    membrane = list(tree["elastomer"]["membrane_reflectance"].values())
    light["mean_reflectance"] = [m * new / old for m, new, old in zip(light["mean_reflectance"], membrane, light["reflectance"])]
    light["reflectance"] = membrane
    out.write_text(json.dumps(constants))
    return out


CHANGES = [
    {"name": "off-a", "flux": {"r": 1.2, "g": 0.85, "b": 1.1}, "radius_mm": 0.1, "z_mm": -0.12, "tilt_deg": -2.0,
     "azimuth_deg": [1.2, -0.8, 0.5, -1.3, 0.9, 0.2], "lambert": -0.15, "width": 1.15, "membrane": 1.1},
    {"name": "off-b", "flux": {"r": 0.8, "g": 1.1, "b": 0.9}, "radius_mm": -0.1, "z_mm": 0.1, "tilt_deg": 2.0,
     "azimuth_deg": [-1.0, 1.0, 1.3, 0.3, -0.6, -1.2], "lambert": 0.15, "width": 0.85, "membrane": 0.9},
]


# Errors of heights over those with the true light: 1.5, but for the deepest press, whose step round the touch follows from the volume of
# a rim that the wrong light tilts.
MAX_PARTS = {"nut": 2.2}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("domecast", type=pathlib.Path)
    parser.add_argument("--quick", action="store_true", help="one sensor")
    parser.add_argument("--keep", type=pathlib.Path, help="folder that simulated frames are kept in")
    parser.add_argument("--design", default="thumb24")
    arguments = parser.parse_args()
    domecast, design = arguments.domecast, arguments.design
    with tempfile.TemporaryDirectory() as scratch:
        work = (arguments.keep or pathlib.Path(scratch)).resolve()
        work.mkdir(parents=True, exist_ok=True)
        nominal = work / design
        if not nominal.exists():
            judge.run(domecast, "build", judge.ROOT / f"designs/{design}.json", "--out", nominal, "--quiet")
        for change in CHANGES[: 1 if arguments.quick else None]:
            one(domecast, work, design, nominal / "constants/constants.json", change)
    sys.exit(1 if judge.failed else 0)


def one(domecast, work, design, constants, change):
    file = off_design(design, change, work)
    true = true_constants(file, constants, work / f"{file.stem}-true.json")
    level = 0.9 * json.loads((work / design / "report/light.json").read_text())["level_per_mw_mm2"]
    dome = judge.dome_of(true)
    scale = dome["radius"] / 10
    label = f"{design}, {change['name']}"
    rest = judge.drawn(judge.draw(domecast, work / f"{file.stem}-rest", file, level, None))
    still = work / f"{file.stem}-camera-rest.png"
    cv2.imwrite(str(still), judge.photograph(rest, 2))
    presses = {"ball": judge.ball(5 * scale, 18, 70, 0.45 * scale, dome), "small ball": judge.ball(2 * scale, 38, 250, 0.3 * scale, dome),
               "edge": judge.edge(0.3 * scale, dome), "nut": judge.nut(0.3 * scale, dome)}
    for name, objects in presses.items():
        truth = judge.draw(domecast, work / f"{file.stem}-{name.replace(' ', '-')}", file, level, objects)
        frame = truth / "camera_frame.png"
        cv2.imwrite(str(frame), judge.photograph(judge.drawn(truth), 1))
        rms = {}
        for kind, path in {"true": true, "design's": constants}.items():
            out = truth / f"shape-{kind[0]}"
            judge.track(domecast, frame, still, path, out)
            e = judge.errors(truth, out, dome)
            here = e["known"] & (e["polar"] <= 45)
            rms[kind] = np.sqrt(np.mean(e["off"][here] ** 2))
        check(f"{label}, {name}: height to 45 deg", rms["design's"] <= MAX_PARTS.get(name, 1.5) * rms["true"],
              "rms " + ", ".join(f"with the {kind} light {value:.4f}" for kind, value in rms.items()) + " mm")
    swapped = work / f"{file.stem}-swapped.png"
    cv2.imwrite(str(swapped), judge.photograph(rest[..., ::-1], 3))
    done = subprocess.run([str(w) for w in (domecast, "track", frame, "--constants", constants, "--shape", work / "refused",
                                            "--rest", swapped, "--force")], capture_output=True, text=True)
    check(f"{label}: red and blue swapped is refused", done.returncode == 1 and "swapped" in done.stderr, done.stderr.strip()[:120])


if __name__ == "__main__":
    main()
