#!/usr/bin/env python3
"""Read the LED boards and circuits of builds again, with other programs' eyes.

    python3 scripts/check_led_board.py output/thumb24 [...]

Gerbers by gerbonara: the outline is `leds.board_mm` to 1 um; copper stays off it by the maker's limit; the copper falls into
two pieces, each with the pads of one net, apart by the limit; the mask opens over every pad and nothing more; paste lies on the
light's lands alone; ink lies on no pad. The KiCad file by gerbonara's reader: the same pads, nets, tracks and outline. SVG and
DXF (ezdxf): the same outline. The numbers of `report/electrical.json` are computed again from the design alone, with the E24
series as IEC 60063 prints it; the wiring table and the list of parts say the same. At the end copies that were spoiled on
purpose must be found out. Exit code 1 if anything is off.
"""
import csv
import json
import math
import pathlib
import re
import shutil
import sys
import tempfile

import ezdxf
import numpy as np
from gerbonara import GerberFile
from gerbonara.cad.kicad.pcb import Board
from scipy import ndimage

UM = 1e-3
# fineness of the picture in which pieces of copper are counted, mm
GRAIN = 0.01
E24 = [10, 11, 12, 13, 15, 16, 18, 20, 22, 24, 27, 30, 33, 36, 39, 43, 47, 51, 56, 62, 68, 75, 82, 91]
KEYS = {"red": "r", "green": "g", "blue": "b", "white": "w"}


class Faults(list):
    def check(self, what, holds, detail=""):
        if not holds:
            self.append(f"{what} {detail}")


def leds_of(build):
    """The lights' section with what rules gave."""
    design = json.loads((build / "design.json").read_text())
    derived = build / "derived.json"
    for one in json.loads(derived.read_text()) if derived.exists() else []:
        place, keys = design, one["field"].split(".")
        for key in keys[:-1]:
            place = place.setdefault(key, {})
        place[keys[-1]] = one["value"]
    return design["leds"]


def shapes(path):
    """Every drawn thing: its attributes, and its box or its line's ends and width, mm."""
    found = []
    for thing in GerberFile.open(path).objects:
        for shape in thing.to_primitives(unit="mm"):
            net = thing.attrs.get(".N", ("",))[0]
            if hasattr(shape, "w"):
                half = np.array([shape.w, shape.h]) / 2
                middle = np.array([shape.x, shape.y])
                found.append({"net": net, "pin": thing.attrs.get(".P"), "box": (middle - half, middle + half)})
            else:
                ends = np.array([[shape.x1, shape.y1], [shape.x2, shape.y2]])
                reach = shape.width / 2
                box = (ends.min(0) - reach, ends.max(0) + reach)
                found.append({"net": net, "pin": None, "box": box, "ends": ends, "width": shape.width})
    return found


def picture(things, size):
    """Which grains are covered."""
    x, y = (np.arange(0, side, GRAIN) + GRAIN / 2 for side in size)
    at = np.stack(np.meshgrid(x, y, indexing="ij"), -1)
    covered = np.zeros(at.shape[:2], bool)
    for thing in things:
        if "ends" in thing:
            a, b = thing["ends"]
            along = b - a
            share = np.clip((at - a) @ along / max(along @ along, 1e-12), 0, 1)
            covered |= np.linalg.norm(at - a - share[..., None] * along, axis=-1) <= thing["width"] / 2
        else:
            low, high = thing["box"]
            covered |= ((at >= low) & (at <= high)).all(-1)
    return covered


def inside(box, outer, margin=0.0):
    return bool((box[0] >= outer[0] + margin - 1e-9).all() and (box[1] <= outer[1] - margin + 1e-9).all())


def overlap(a, b):
    return bool((np.minimum(a[1], b[1]) > np.maximum(a[0], b[0]) + 1e-9).all())


def board_faults(build, leds):
    faults, parts = Faults(), build / "parts"
    limits, size = leds["electrical"]["board"], np.array(leds["board_mm"], float)
    layer = {name: shapes(parts / f"led_board-{name}.gbr") for name in ("F_Cu", "F_Mask", "F_Paste", "F_Silkscreen", "Edge_Cuts")}
    edges = [thing["ends"] for thing in layer["Edge_Cuts"]]
    corners = np.concatenate(edges)
    faults.check("outline", np.abs(np.ptp(corners, axis=0) - size).max() <= UM, f"{np.ptp(corners, axis=0)} for {size}")
    closed = all(np.allclose(a[1], b[0], atol=1e-9) for a, b in zip(edges, edges[1:] + edges[:1]))
    faults.check("outline is closed", closed and len(edges) == 4)
    outline = (corners.min(0), corners.max(0))

    copper = layer["F_Cu"]
    for thing in copper:
        faults.check("copper off the edge", inside(thing["box"], outline, limits["min_edge_mm"]), str(thing))
    pads = [thing for thing in copper if thing["pin"]]
    faults.check("pads", sorted(pad["pin"] for pad in pads) == [("D1", "1"), ("D1", "2"), ("W1", "1"), ("W2", "1")])
    pieces, count = ndimage.label(picture(copper, size))
    faults.check("pieces of copper", count == 2, str(count))
    piece_of = {}
    for pad in pads:
        i, j = ((sum(pad["box"]) / 2) / GRAIN).astype(int)
        piece_of.setdefault(pad["net"], set()).add(int(pieces[i, j]))
    faults.check("nets", piece_of.keys() == {"ANODE", "CATHODE"} and all(len(p) == 1 for p in piece_of.values()), str(piece_of))
    faults.check("nets are apart", len(set.union(*piece_of.values())) == 2, str(piece_of))
    if count == 2:
        gap = ndimage.distance_transform_edt(pieces != 1)[pieces == 2].min() * GRAIN
        faults.check("gap between nets", gap >= limits["min_gap_mm"] - GRAIN, f"{gap}")

    openings = [thing["box"] for thing in layer["F_Mask"]]
    faults.check("mask openings", len(openings) == len(pads))
    for pad in pads:
        around = [box for box in openings if inside(pad["box"], box, limits["mask_margin_mm"])]
        faults.check("mask opens over the pad", len(around) == 1, str(pad))
    for box in openings:
        faults.check("mask stays on the board", inside(box, outline))
    lands = [pad["box"] for pad in pads if pad["pin"][0] == "D1"]
    paste = [thing["box"] for thing in layer["F_Paste"]]
    faults.check("paste on the lands", len(paste) == 2 and all(any(inside(p, land) for land in lands) for p in paste))
    for ink in layer["F_Silkscreen"]:
        faults.check("ink on the board, off the pads", inside(ink["box"], outline) and not any(overlap(ink["box"], o) for o in openings))
        faults.check("ink is wide enough", ink["width"] >= limits["silk_line_mm"] - 1e-9)
    # the plus, two lines that cross, stands on the anode's side: at the right, as its pads
    crossing = np.mean([np.mean(thing["ends"], 0) for thing in layer["F_Silkscreen"][1:]], 0)
    anode = np.mean([np.mean(pad["box"], 0) for pad in pads if pad["net"] == "ANODE"], 0)
    faults.check("plus at the anode", np.sign(crossing[0] - size[0] / 2) == np.sign(anode[0] - size[0] / 2))
    # the light stands where the design has it
    light = np.mean(lands, (0, 1)) - size / 2
    faults.check("light on its place", np.abs(light - [0, -leds["board_offset_mm"]]).max() <= UM, str(light))
    faults += kicad_faults(parts / "led_board.kicad_pcb", copper, size)
    faults += drawing_faults(parts, size)
    return faults


def kicad_faults(path, copper, size):
    """The same board in KiCad's file: its y runs down."""
    faults, board = Faults(), Board.open(path)
    names = dict(board.nets)
    edge = [item for item in board.rectangles if item.layer == "Edge.Cuts"]
    faults.check("KiCad: one outline", len(edge) == 1)
    start, end = ([point.x, -point.y] for point in (edge[0].start, edge[0].end))
    low, high = np.minimum(start, end), np.maximum(start, end)
    faults.check("KiCad: outline", np.abs(high - low - size).max() <= UM, f"{high - low}")
    pads = {}
    for part in board.footprints:
        for pad in part.pads:
            middle = np.array([part.at.x + pad.at.x, -part.at.y - pad.at.y]) - low
            half = np.array([pad.size.x, pad.size.y]) / 2
            pads[(part.reference, str(pad.number))] = (pad.net.name, np.array([middle - half, middle + half]))
    drawn = {thing["pin"]: (thing["net"], np.array(thing["box"])) for thing in copper if thing["pin"]}
    faults.check("KiCad: pads", pads.keys() == drawn.keys(), f"{pads.keys()}")
    for pin in pads.keys() & drawn.keys():
        same = pads[pin][0] == drawn[pin][0] and np.abs(pads[pin][1] - drawn[pin][1]).max() <= UM
        faults.check("KiCad: pad", same, f"{pin}: {pads[pin]} and {drawn[pin]}")
    tracks = {(names[s.net], *np.round([s.start.x - low[0], -s.start.y - low[1], s.end.x - low[0], -s.end.y - low[1], s.width], 4))
              for s in board.track_segments}
    lines = {(t["net"], *np.round([*t["ends"][0], *t["ends"][1], t["width"]], 4)) for t in copper if "ends" in t
             and np.ptp(t["ends"], axis=0).max() > 1e-9}
    faults.check("KiCad: tracks", tracks == lines, f"{tracks} and {lines}")
    return faults


def drawing_faults(parts, size):
    faults = Faults()
    outline = [e for e in ezdxf.readfile(parts / "led_board.dxf").modelspace() if e.dxf.layer == "outline"]
    corners = np.array([point[:2] for entity in outline for point in entity.get_points()])
    faults.check("DXF: outline", np.abs(np.ptp(corners, axis=0) - size).max() <= UM, str(corners))
    svg = (parts / "led_board.svg").read_text()
    path = re.search(r'<g id="outline".*?\sd="([^"]*)"', svg, re.S).group(1)
    corners = np.array(re.findall(r"(-?[\d.]+),(-?[\d.]+)", path), float)
    faults.check("SVG: outline", np.abs(np.ptp(corners, axis=0) - size).max() <= UM, str(corners))
    faults.check("PDF", (parts / "led_board.pdf").read_bytes().startswith(b"%PDF-"))
    return faults


def electrical_faults(build, leds):
    """Ohm's law and the heat, from the design alone."""
    faults, e, flux = Faults(), leds["electrical"], leds["radiant_flux_mw"]
    stated = json.loads((build / "report/electrical.json").read_text())
    supply, lights = e["supply_voltage_v"], []
    for led in leds["list"]:
        key = KEYS[led["color"]]
        asked = sum(flux.values()) if key == "w" else flux[key]
        volt, per_ma = e["forward_voltage_v"][key], e["radiant_efficacy_mw_per_ma"][key]
        light = {"color": led["color"], "asked_flux_mw": asked, "resistor_ohm": None, "current_ma": 0.0}
        if asked > 0:
            exact = (supply - volt) * 1000 / (asked / per_ma)
            light["ideal_resistor_ohm"] = exact
            series = [round(digits * 10.0 ** (power - 1), 6) for power in range(9) for digits in E24]
            light["resistor_ohm"] = min(series, key=lambda ohm: abs(math.log(ohm / exact)))
            light["current_ma"] = (supply - volt) * 1000 / light["resistor_ohm"]
            light["resistor_power_mw"] = (supply - volt) * light["current_ma"]
            faults.check("rating", stated["lights"][len(lights)]["resistor_rating_w"] >= 2e-3 * light["resistor_power_mw"] - 1e-12)
        light["flux_mw"] = per_ma * light["current_ma"]
        light["light_power_mw"] = volt * light["current_ma"]
        faults.check("current below its limit", light["current_ma"] <= e["max_current_ma"][key], str(light))
        lights.append(light)
    inner = sum(light["light_power_mw"] for light in lights)
    platform = e["ambient_c"] + inner / 1000 * e["platform_to_air_k_per_w"]
    for light in lights:
        heat = (light["light_power_mw"] - light["flux_mw"]) / 1000
        light["board_c"] = platform + heat * e["board_to_platform_k_per_w"]
        light["junction_c"] = light["board_c"] + heat * e["junction_to_board_k_per_w"]
        faults.check("junction below its limit", light["junction_c"] <= e["max_junction_c"], str(light))
    total = sum(light["current_ma"] for light in lights)
    sums = {"total_current_ma": total, "total_power_mw": total * supply, "power_in_sensor_mw": inner, "platform_c": platform}
    faults.check("lights", len(stated["lights"]) == len(lights))
    for own, other in [(sums, stated), *zip(lights, stated["lights"])]:
        for name, value in own.items():
            same = math.isclose(value, other[name], rel_tol=1e-9) if isinstance(value, float) else value == other[name]
            faults.check("electrical.json", same, f"{name}: {value} and {other[name]}")
    return faults + table_faults(build, leds, lights)


def table_faults(build, leds, lights):
    faults = Faults()
    rows = list(csv.DictReader((build / "parts/led_wiring.csv").open(newline="")))
    faults.check("wiring: rows", len(rows) == len(lights) + 1 and rows[-1]["light"] == "all")
    for index, (row, light, led) in enumerate(zip(rows, lights, leds["list"])):
        ohm = None if row["resistor_ohm"] == "none" else float(row["resistor_ohm"])
        same = (row["light"], row["color"], float(row["azimuth_deg"])) == (str(index), led["color"], led["azimuth_deg"])
        faults.check("wiring: row", same and ohm == light["resistor_ohm"], str(row))
        faults.check("wiring: current", abs(float(row["current_ma"]) - light["current_ma"]) < 1e-3, str(row))
        faults.check("wiring: wires", (row["anode_wire"], row["cathode_wire"]) == (led["color"], "black"), str(row))
    bom = {row["item"]: row for row in csv.DictReader((build / "parts/bom.csv").open(newline=""))}
    counts = {}
    for light in lights:
        if light["resistor_ohm"]:
            counts[light["resistor_ohm"]] = counts.get(light["resistor_ohm"], 0) + 1
    listed = {float(item.split()[1]): int(row["quantity"]) for item, row in bom.items() if item.startswith("resistor ")}
    faults.check("bom: resistors", listed == counts, f"{listed} and {counts}")
    metres = sum(float(row["quantity"]) for item, row in bom.items() if item.startswith("wire "))
    needed = 2 * len(lights) * leds["electrical"]["wire_length_mm"] / 1000
    faults.check("bom: wires", abs(metres - needed) <= 0.02 * len(bom), f"{metres} for {needed}")
    return faults


def faults_of(build):
    leds = leds_of(build)
    if not leds["list"] or leds["electrical"]["drive"] != "resistor":
        there = [p.name for p in (build / "parts").glob("led_*")]
        return [f"files of lights that are not there: {there}"] if there else []
    faults = electrical_faults(build, leds)
    if (build / "parts/led_board.kicad_pcb").exists():
        return faults + board_faults(build, leds)
    warned = [w["message"] for w in json.loads((build / "manifest.json").read_text())["warnings"]]
    if not any(message.startswith("No board is drawn") for message in warned):
        faults.append("neither a board nor a reason")
    return faults


# file, a text of it, and what spoils it
SPOILED = [
    ("parts/led_board-Edge_Cuts.gbr", r"X0Y0D02", "X2000Y0D02"),
    ("parts/led_board-F_Cu.gbr", r"TO.N,ANODE", "TO.N,CATHODE"),
    ("parts/led_board-F_Cu.gbr", r"%ADD10C,[\d.]+\*%", "%ADD10C,1.3*%"),
    ("parts/led_board-F_Mask.gbr", r"X\d+Y\d+D03\*\nM02", "M02"),
    ("parts/led_board.kicad_pcb", r'\(pad "2" smd rect \(at [\d.-]+', '(pad "2" smd rect (at 0.9'),
    ("report/electrical.json", r'"resistor_ohm": \d', '"resistor_ohm": 9'),
    ("parts/led_wiring.csv", r",black,", ",white,"),
]


def unseen_of(build):
    """The spoiled copies that nothing was found in."""
    unseen = []
    for name, pattern, spoiled in SPOILED:
        with tempfile.TemporaryDirectory() as folder:
            copy = pathlib.Path(folder) / "copy"
            shutil.copytree(build, copy, ignore=shutil.ignore_patterns("*.stl", "*.step", "*.3mf", "*.glb", "*.tif"))
            text = (copy / name).read_text()
            changed = re.sub(pattern, spoiled, text, count=1)
            (copy / name).write_text(changed)
            try:
                found = changed != text and faults_of(copy)
            except Exception as error:
                found = [str(error)]
            if not found:
                unseen.append(f"{name}: {pattern}")
    return unseen


def main(*builds):
    failed, tried = 0, False
    for build in map(pathlib.Path, builds):
        faults = faults_of(build)
        failed += len(faults)
        print(f"{'FAIL' if faults else 'ok  '} {build.name}", *faults, sep="\n     ")
        if not tried and not faults and (build / "parts/led_board.kicad_pcb").exists():
            tried, unseen = True, unseen_of(build)
            failed += len(unseen)
            print(f"{'FAIL' if unseen else 'ok  '} {len(SPOILED)} spoiled copies are found out", *unseen, sep="\n     ")
    print("all lights hold" if failed == 0 else f"{failed} faults")
    return 1 if failed else 0


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
