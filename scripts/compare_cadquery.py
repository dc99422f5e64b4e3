#!/usr/bin/env python3
"""Time CadQuery on an upper platform and two mould halves like thumb24's, beside our whole set of parts.

    scripts/compare_cadquery.py $(scripts/compare_cadquery.py --program) designs/thumb24.json [runs]

`--program` builds `benches/parts.rs` and prints where it is.

CadQuery makes the three parts with the design's main features, each in a process of its own (imports included), and
writes STL at the same chord tolerance. domecast makes every part with STL, 3MF, STEP, pictures, assembly and all
checks, in one process. The two take turns; medians of wall and processor time are printed. Nothing is asserted,
because times depend on the machine; the ratio is what counts.
"""

import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time

CADQUERY = '''
import json, math, sys
import cadquery as cq
d = json.load(open(sys.argv[1])); out = sys.argv[2]; want = sys.argv[3]; tol = d.get("mesh", {}).get("chord_tolerance_mm", 0.01)
ring = d["springs"]["places"]["ring"]; m = d["magnets"]; p = d["magnet_pockets"]; leds = d["leds"]
axes = [(ring["radius_mm"] * math.cos(math.radians(ring["first_azimuth_deg"]) + 2 * math.pi * i / ring["count"]),
         ring["radius_mm"] * math.sin(math.radians(ring["first_azimuth_deg"]) + 2 * math.pi * i / ring["count"]))
        for i in range(ring["count"])]
x, y = d["platforms"]["outer_mm"]; low = d["platforms"]["upper"]["underside_z_mm"]; s = d["sheet"]
seat = -d["optics"]["layers"][0]["thickness_mm"]
if want == "upper":
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
    part = upper
r = d["dome"]["radius_mm"] + 0.03; mould = d["mould"]; h = 2 * (r + mould["wall_mm"]); pins = mould["pins"]
if want == "cavity":
    part = cq.Workplane().box(h, h, r + mould["floor_mm"], centered=(True, True, False)).translate((0, 0, -r - mould["floor_mm"]))
    part = part.cut(cq.Workplane().sphere(r))
    for at in pins["at_mm"]:
        part = part.cut(cq.Workplane().workplane(offset=-3.5).center(*at).circle(pins["diameter_mm"] / 2 + pins["clearance_mm"]).extrude(4))
if want == "base":
    part = cq.Workplane().box(h, h, mould["base_thickness_mm"], centered=(True, True, False))
    for at in pins["at_mm"]:
        part = part.union(cq.Workplane().workplane(offset=-pins["height_mm"]).center(*at).circle(pins["diameter_mm"] / 2).extrude(4).faces("<Z").chamfer(pins["chamfer_mm"]))
    part = part.cut(cq.Workplane().center(mould["fill"]["radius_mm"], 0).circle(1.5).extrude(5))
    for k in range(mould["vents"]["count"]):
        part = part.cut(cq.Workplane().center(9.4 * math.cos(0.785 + k * math.pi / 2), 9.4 * math.sin(0.785 + k * math.pi / 2)).circle(0.5).extrude(5))
cq.exporters.export(part, f"{out}/{want}.stl", tolerance=tol, angularTolerance=0.1)
'''


def timed(command):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    start = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    wall = time.perf_counter() - start
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main(ours, design, runs=3):
    peer_times, our_times = [], []
    with tempfile.TemporaryDirectory() as out:
        for _ in range(int(runs)):
            three = [timed([sys.executable, "-c", CADQUERY, design, out, part]) for part in ("upper", "cavity", "base")]
            peer_times.append([sum(x) for x in zip(*three)])
            our_times.append(timed([ours, design, os.path.join(out, "ours")]))
    middle = [[statistics.median(x) for x in zip(*times)] for times in (peer_times, our_times)]
    for name, (wall, cpu) in zip(("CadQuery, three parts, STL", "domecast, all parts, files, checks"), middle):
        print(f"{name:40} {wall:7.2f} s wall {cpu:7.2f} s processor")
    (peer_wall, peer_cpu), (our_wall, our_cpu) = middle
    print(f"domecast takes {our_wall / peer_wall:.3f} of CadQuery's wall time, {our_cpu / peer_cpu:.3f} of its processor time")


def program():
    """Builds the bench and returns its path."""
    built = subprocess.run(["cargo", "bench", "--bench", "parts", "--no-run", "--message-format", "json"],
                           check=True, capture_output=True, text=True)
    made = [json.loads(line) for line in built.stdout.splitlines() if line.startswith("{")]
    return [m["executable"] for m in made if m.get("executable")][-1]


if __name__ == "__main__":
    if sys.argv[1:] == ["--program"]:
        print(program())
        sys.exit()
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    main(*sys.argv[1:])
