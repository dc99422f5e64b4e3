#!/usr/bin/env python3
"""Searches lights for designs and judges what `domecast illuminate --optimize` proposes.

    check_optimize.py DOMECAST DESIGN... [--evaluations N] [--random N] [--seed N]

For each design file, and for some random sensors of check_random_designs whose domes have radii of 5 to 20 mm:

    the search ends with its result; the same bytes come with one thread and with two (of the first design)
    what it proposes builds as it is; what it says of a search without a proposal holds no numbers of one
    the error of normals of a plain `illuminate` run, from `vector_irradiance_mw_mm2` in numpy, is smaller than the given
    design's, and both are what `optimize.json` states
    nothing on the front is dominated by another point of it
    options that make no search, and lights without a colour, are refused by name
"""

import argparse
import importlib.machinery
import importlib.util
import json
import os
import random
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

# the error recomputed from the file's numbers, relative
SMALL = 1e-6
RADII_MM = (5, 20)


def run(domecast, *words, threads=None):
    environment = dict(os.environ)
    if threads:
        environment["RAYON_NUM_THREADS"] = str(threads)
    done = subprocess.run([domecast, *map(str, words), "--json"], capture_output=True, text=True, env=environment)
    return done.returncode, json.loads(done.stdout)


def error_p95(folder, polar_deg):
    """95th percentile by area of the normal's error to a polar angle, degrees a grey level, from L alone."""
    report = json.loads((folder / "illuminate.json").read_text())
    places = report["places"]
    light = np.array(places["vector_irradiance_mw_mm2"])
    grey = np.array(places["grey_levels_per_mw_mm2"])
    normals = np.array(places["normal"])
    seen = np.array([pixel is not None for pixel in places["image_px"]]) & (np.array(places["polar_deg"]) <= polar_deg)
    matrices = grey[:, :, None] * (np.array(report["crosstalk"]) @ light)
    across = np.eye(3) - normals[:, :, None] * normals[:, None, :]
    values = np.full(len(light), np.inf)
    singular = np.linalg.svd(matrices, compute_uv=False)
    regular = singular[:, 2] > 1e-9 * singular[:, 0]
    inverse = np.linalg.inv(matrices[regular])
    values[regular] = np.degrees(np.linalg.norm(across[regular] @ inverse, axis=(1, 2)) / np.sqrt(2))
    ordered = np.sort(values[seen])
    at = 0.95 * (len(ordered) - 1)
    low, high = ordered[int(at)], ordered[min(int(at) + 1, len(ordered) - 1)]
    return low + (at - int(at)) * (high - low) if high < np.inf else None


def is_near(found, wanted):
    return found is wanted if found is None or wanted is None else abs(found / wanted - 1) < SMALL


def judge(domecast, design, work, options, threads=None):
    """What is wrong with a search, and its ratio."""
    faults = []
    out = work / "search"
    code, said = run(domecast, "illuminate", design, "--optimize", "--out", out, "--force", *options, threads=threads)
    if code != 0:
        return [f"refused: {said['error'].get('message', '')[:300]}"], None
    report = json.loads((out / "optimize.json").read_text())
    polar_deg = report["polar_angle_deg"]
    before = error_p95(out, polar_deg)
    if not is_near(report["start"]["illuminate_normal_error_p95_deg_per_level"], before):
        faults.append(f"the start's error is {before} from the light, stated otherwise")
    if report["evaluations"] > report["evaluations_allowed"]:
        faults.append("more lights looked at than allowed")
    points = [[point[key] for key in ("normal_error_p95_deg_per_level", "sum_coefficient_of_variation", "lights", "height_mm")]
              for point in report["front"]]
    for one in points:
        if any(other != one and all(a <= b for a, b in zip(other, one)) for other in points):
            faults.append(f"{one} of the front is dominated")
    proposal = said["optimize"]["proposal"]
    if proposal is None:
        if report["best"] or report["changes"] or report["ratio"]:
            faults.append("numbers of a proposal that there is not")
        return faults, None
    code, built = run(domecast, "build", proposal, "--out", work / "built", "--force")
    if code != 0:
        return [*faults, f"the proposal does not build: {built['error'].get('message', '')[:300]}"], report["ratio"]
    run(domecast, "illuminate", proposal, "--out", work / "after", "--force")
    after = error_p95(work / "after", polar_deg)
    if not is_near(report["best"]["illuminate_normal_error_p95_deg_per_level"], after):
        faults.append(f"the proposal's error is {after} from the light, stated otherwise")
    if after is None or (before is not None and after >= before):
        faults.append(f"the proposal is worse: {after}, {before} as given")
    return faults, report["ratio"]


def same_bytes(domecast, design, work, options):
    """Against the search that `judge` has just made with two threads."""
    outs = [work / "search", work / "one-thread"]
    run(domecast, "illuminate", design, "--optimize", "--out", outs[1], "--force", *options, threads=1)
    names = [sorted(path.name for path in out.iterdir()) for out in outs]
    if names[0] != names[1]:
        return ["one thread and two write other files"]
    return [f"{name} differs between one thread and two" for name in names[0]
            if (outs[0] / name).read_bytes() != (outs[1] / name).read_bytes()]


def refusals(domecast, design, work):
    """Each way to ask for nothing is named."""
    tree = json.loads(design.read_text())
    blind = work / "no-blue.json"
    two = [{"color": "red", "azimuth_deg": 0}, {"color": "green", "azimuth_deg": 120}]
    blind.write_text(json.dumps({**tree, "leds": {**tree.get("leds", {}), "list": two}}))
    wanted = [
        (design, ["--evaluations", 0], "--evaluations"),
        (design, ["--polar-angle-deg", 0], "--polar-angle-deg"),
        (design, ["--polar-angle-deg", 91], "--polar-angle-deg"),
        (design, ["--polar-angle-deg", 0.1], "--polar-angle-deg"),
        (blind, [], "leds.list"),
    ]
    for file, options, field in wanted:
        code, said = run(domecast, "illuminate", file, "--optimize", "--out", work / "refused", "--force", *options)
        if code != 1 or said.get("error", {}).get("field") != field:
            yield f"{file.name} {options}: exit code {code}, {json.dumps(said)[:200]}"


def random_sensors(count, seed, work):
    """Designs of check_random_designs with domes of the radii that count."""
    path = Path(__file__).parent / "check_random_designs"
    loader = importlib.machinery.SourceFileLoader("check_random_designs", str(path))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(loader.name, loader))
    loader.exec_module(module)
    pick, index, found = random.Random(seed), 0, 0
    while found < count:
        design = module.some_design(pick, index)
        index += 1
        if not RADII_MM[0] <= design["dome"]["radius_mm"] <= RADII_MM[1]:
            continue
        file = work / f"{design['name']}.json"
        file.write_text(json.dumps(design))
        found += 1
        yield file


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    arguments.add_argument("domecast")
    arguments.add_argument("designs", nargs="+", type=Path)
    arguments.add_argument("--evaluations", type=int, default=60)
    arguments.add_argument("--random", type=int, default=0)
    arguments.add_argument("--seed", type=int, default=1)
    given = arguments.parse_args()
    wrong = 0
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        first = list(refusals(given.domecast, given.designs[0], work))
        wrong += bool(first)
        print(f"options: {'ok' if not first else 'FAILED'}")
        print("".join(f"  {fault}\n" for fault in first), end="")
        skipped = 0
        for design in [*given.designs, *random_sensors(given.random, given.seed, work)]:
            if design not in given.designs and run(given.domecast, "build", design, "--out", work / "plain", "--force")[0] != 0:
                # a search begins at what builds; check_random_designs judges what does not
                skipped += 1
                continue
            options, is_first = ["--evaluations", given.evaluations], design == given.designs[0]
            faults, ratio = judge(given.domecast, design, work, options, threads=2 if is_first else None)
            faults += same_bytes(given.domecast, design, work, options) if is_first and (work / "search").exists() else []
            wrong += bool(faults)
            shown = "no better lights" if ratio is None else f"error of normals times {ratio:.3f}"
            print(f"{design.stem}: {'ok' if not faults else 'FAILED'}; {shown}", flush=True)
            print("".join(f"  {fault}\n" for fault in faults), end="")
        if skipped:
            print(f"{skipped} random sensors do not build as they are drawn")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
