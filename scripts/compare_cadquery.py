#!/usr/bin/env python3
"""Time CadQuery on an upper platform and two mould halves like thumb24's, beside our whole set of parts.

    scripts/compare_cadquery.py target/release/domecast designs/thumb24.json

CadQuery (its own process, imports included) makes the three parts with the design's main features and writes STL at the
same chord tolerance; domecast makes the whole build: every part, STL, 3MF, STEP, pictures, artwork, checks. Wall time
and processor time of both are printed; nothing is asserted, because times depend on the machine.
"""

import os
import resource
import subprocess
import sys
import tempfile
import time

CADQUERY = '''
import json, math, sys
import cadquery as cq
d = json.load(open(sys.argv[1])); out = sys.argv[2]; tol = d["mesh"]["chord_tolerance_mm"]
ring = d["springs"]["places"]["ring"]; m = d["magnets"]; p = d["magnet_pockets"]; leds = d["leds"]
axes = [(ring["radius_mm"] * math.cos(math.radians(ring["first_azimuth_deg"]) + 2 * math.pi * i / ring["count"]),
         ring["radius_mm"] * math.sin(math.radians(ring["first_azimuth_deg"]) + 2 * math.pi * i / ring["count"]))
        for i in range(ring["count"])]
x, y = d["platforms"]["outer_mm"]; low = d["platforms"]["upper"]["underside_z_mm"]; s = d["sheet"]
seat = -d["optics"]["layers"][0]["thickness_mm"]
upper = cq.Workplane().box(x, y, -low, centered=(True, True, False)).translate((0, 0, low))
upper = upper.cut(cq.Workplane().box(s["size_mm"][0] + 0.3, s["size_mm"][1] + 0.3, 3, centered=(True, True, False)).translate((0, 0, seat)))
upper = upper.cut(cq.Workplane("XZ").polyline([(0, low - 1), (4.2, low - 1), (10.5, seat), (10.5, 1), (0, 1)]).close().revolve(360, (0, 0), (0, 1)))
for at in axes:
    upper = upper.cut(cq.Workplane().workplane(offset=low).center(*at).circle((m["diameter_mm"] + p["diameter_clearance_mm"]) / 2).extrude(m["thickness_mm"] + p["depth_clearance_mm"]))
    upper = upper.cut(cq.Workplane().workplane(offset=low).center(*at).circle(p["push_out_diameter_mm"] / 2).extrude(-low))
for led in leds["list"]:
    pit = cq.Workplane().box(2.3, 4.6, 5).translate((1.0, 0, 1.4)).rotate((0, 0, 0), (0, 1, 0), 90 - leds["tilt_deg"])
    upper = upper.cut(pit.translate((leds["center_radius_mm"], 0, leds["center_z_mm"])).rotate((0, 0, 0), (0, 0, 1), led["azimuth_deg"]))
    hole = cq.Workplane().workplane(offset=low - 1).center(10.6, 0).circle(0.4).extrude(2.0)
    upper = upper.cut(hole.rotate((0, 0, 0), (0, 0, 1), led["azimuth_deg"]))
r = d["dome"]["radius_mm"] + 0.03; mould = d["mould"]; h = 2 * (r + mould["wall_mm"])
cavity = cq.Workplane().box(h, h, r + mould["floor_mm"], centered=(True, True, False)).translate((0, 0, -r - mould["floor_mm"]))
cavity = cavity.cut(cq.Workplane().sphere(r))
base = cq.Workplane().box(h, h, mould["base_thickness_mm"], centered=(True, True, False))
pins = mould["pins"]
for at in pins["at_mm"]:
    cavity = cavity.cut(cq.Workplane().workplane(offset=-3.5).center(*at).circle(pins["diameter_mm"] / 2 + pins["clearance_mm"]).extrude(4))
    base = base.union(cq.Workplane().workplane(offset=-pins["height_mm"]).center(*at).circle(pins["diameter_mm"] / 2).extrude(4).faces("<Z").chamfer(pins["chamfer_mm"]))
base = base.cut(cq.Workplane().center(mould["fill"]["radius_mm"], 0).circle(1.5).extrude(5))
for k in range(mould["vents"]["count"]):
    base = base.cut(cq.Workplane().center(9.4 * math.cos(0.785 + k * math.pi / 2), 9.4 * math.sin(0.785 + k * math.pi / 2)).circle(0.5).extrude(5))
for name, part in (("upper", upper), ("cavity", cavity), ("base", base)):
    cq.exporters.export(part, f"{out}/{name}.stl", tolerance=tol, angularTolerance=0.1)
'''


def timed(name, command):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    start = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    wall = time.perf_counter() - start
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(f"{name:40} {wall:7.2f} s wall {cpu:7.2f} s processor")
    return wall, cpu


def main(domecast, design):
    with tempfile.TemporaryDirectory() as out:
        timed("(Python and CadQuery, import only)", [sys.executable, "-c", "import cadquery"])
        peer = timed("CadQuery, three parts, STL", [sys.executable, "-c", CADQUERY, design, out])
        ours = timed("domecast, whole build", [domecast, "build", design, "--out", os.path.join(out, "ours"), "--quiet"])
        print(f"domecast takes {ours[0] / peer[0]:.2f} of CadQuery's wall time, {ours[1] / peer[1]:.2f} of its processor time")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
