#!/usr/bin/env python3
"""Computes again, from the vector irradiance of each place, what `domecast illuminate` says of the light of builds.

    check_illuminate.py DOMECAST BUILD...

`illuminate` runs on each build's design with one thread and with two, which must write the same bytes. From
`vector_irradiance_mw_mm2`, crosstalk and grey levels of `illuminate.json`, in numpy alone:

    condition number    singular values of C L, by LAPACK
    normal's error      rms, over draws of noise, of what noise of one level does to the solved normal, and the formula
    evenness            percentiles by area, coefficient of variation
    crescents           share of the area where a colour is below a twentieth of its median

The places must have equal areas, and no number may be NaN or infinite. The summary of the build's `report/light.json`, at a
coarser grid, must be near. A channel sees no less in total than directly.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

SMALL = 1e-7
# the light in total is read from a table with an error of a thousandth of the brightest place
TABLE = 0.01
# the build's summary has a quarter of the places; between the 94th and the 96th percentile of picam-r20, which has deep shadows, lie 38 %
COARSE = 0.25


def refuse(text):
    raise ValueError(f"{text} is no JSON number")


def numbers(values):
    """Nulls as infinity: a place without a number counts as worse than any."""
    return np.array([np.inf if value is None else value for value in values], float)


def percentiles(values):
    ordered = np.sort(values)
    found = []
    for part in (0.05, 0.5, 0.95):
        at = part * (len(ordered) - 1)
        low, high = ordered[int(at)], ordered[min(int(at) + 1, len(ordered) - 1)]
        share = at - int(at)
        value = low if share == 0 or low == high else low + share * (high - low)
        found.append(value if np.isfinite(value) else None)
    return found


def near(found, wanted, tolerance=SMALL):
    if found is None or wanted is None:
        return found is wanted
    return abs(found - wanted) <= tolerance * max(abs(wanted), 1e-12)


def compare(faults, name, found, wanted, tolerance=SMALL):
    if not near(found, wanted, tolerance):
        faults.append(f"{name}: {found}, computed again {wanted}")


def evenness(faults, name, report, values):
    for c, color in enumerate(("red", "green", "blue")):
        p5, p50, p95 = percentiles(values[:, c])
        for key, value in zip(("p5", "p50", "p95"), (p5, p50, p95)):
            compare(faults, f"{name} {color} {key}", report["irradiance_mw_mm2"][c][key], value)
        compare(faults, f"{name} {color} p95/p5", report["p95_over_p5"][c], p95 / p5 if p5 > 0 else None)
    total = values.sum(axis=1)
    compare(faults, f"{name} variation", report["sum_coefficient_of_variation"], total.std() / total.mean())


def noise(faults, matrices, normals, said):
    """The error of the normal by its formula at every place, and by drawn noise at some."""
    inverse = np.linalg.inv(matrices)
    across = np.eye(3) - normals[:, :, None] * normals[:, None, :]
    formula = np.degrees(np.linalg.norm(across @ inverse, axis=(1, 2)) / np.sqrt(2))
    worst = np.max(np.abs(formula / said - 1))
    if worst > 1e-6:
        faults.append(f"the normal's error is off by {worst:.2g} of itself from its formula")
    draws = np.random.default_rng(26).normal(size=(20000, 3))
    for i in np.linspace(0, len(said) - 1, 12).astype(int):
        size = 1e-3  # small against the levels: what the formula is the limit of
        solved = (matrices[i] @ normals[i] + size * draws) @ inverse[i].T
        solved /= np.linalg.norm(solved, axis=1)[:, None]
        turned = np.degrees(np.sqrt(np.mean(np.sum((solved - normals[i]) ** 2, axis=1)) / 2)) / size
        if said[i] < 20 and abs(turned / said[i] - 1) > 0.03:
            faults.append(f"place {i}: drawn noise turns the normal by {turned:.3g} degrees a level, stated {said[i]:.3g}")


def recompute(faults, report):
    places = report["places"]
    light = np.array(places["vector_irradiance_mw_mm2"])
    normals, polar = np.array(places["normal"]), np.array(places["polar_deg"])
    crosstalk = np.array(report["crosstalk"])
    grey = np.array(places["grey_levels_per_mw_mm2"])
    if len(light) != places["rings"] * places["per_ring"]:
        faults.append("the number of places is not that of rings times places")
    seen = crosstalk @ light
    direct = np.maximum(np.einsum("pcx,px->pc", light, normals), 0)
    total = np.array(places["total_irradiance_mw_mm2"])
    less = (direct @ crosstalk.T - total).max() / total.max()
    if less > TABLE:
        faults.append(f"the total is less than the direct light by {less:.2g} of the brightest")
    values = np.linalg.svd(seen, compute_uv=False)
    is_regular = values[:, 2] > 1e-9 * values[:, 0]
    condition = np.where(is_regular, values[:, 0] / np.where(is_regular, values[:, 2], 1), np.inf)
    said = numbers(places["condition_number"])
    if (np.isfinite(said) != is_regular).any() or np.max(np.abs(condition[is_regular] / said[is_regular] - 1), initial=0) > 1e-6:
        faults.append("condition numbers are not those of numpy")
    is_seen = np.array([pixel is not None for pixel in places["image_px"]])
    error = numbers(places["normal_error_deg_per_level"])
    valid = is_seen & is_regular
    if (np.isfinite(error) != valid).any():
        faults.append("the normal's error is stated where there is none, or the other way round")
    noise(faults, grey[valid][:, :, None] * seen[valid], normals[valid], error[valid])
    for within in report["within"]:
        to = within["polar_angle_deg"]
        inside = polar <= to
        compare(faults, f"places to {to}", within["places"], int(inside.sum()))
        compare(faults, f"places seen to {to}", within["places_seen"], int((inside & is_seen).sum()))
        evenness(faults, f"direct to {to}", within["direct"], direct[inside])
        evenness(faults, f"total to {to}", within["total"], total[inside])
        for name, found, of in (("condition_number", condition, inside),
                                ("normal_error_deg_per_level", error, inside & is_seen)):
            for key, value in zip(("p5", "p50", "p95"), percentiles(found[of])):
                compare(faults, f"{name} {key} to {to}", within[name][key], value, 1e-6)
        lacks = (direct < 0.05 * np.median(direct[inside], axis=0)) | (direct <= 0)
        compare(faults, f"crescents to {to}", within["crescent_share"], float(lacks[inside].any(axis=1).mean()))
        levels = [places["level"][i] for i in np.flatnonzero(inside & is_seen)]
        cut = float((np.array(levels) > 255).any(axis=1).mean()) if levels else 0.0
        compare(faults, f"saturated to {to}", within["saturated_share"], cut)
        if to == 75:
            if (lacks & inside[:, None]).tolist() != places["is_lacking"]:
                faults.append("the colours that places lack are others")
            listed = sum(crescent["share_of_dome"] for crescent in report["crescents"])
            compare(faults, "crescents listed", listed, float((lacks & inside[:, None]).sum() / len(polar)))


def equal_areas(faults, report):
    """Rings of one height each: the cosines of the polar angles on the sphere are evenly spaced."""
    places = report["places"]
    cosine = np.cos(np.radians(np.array(places["polar_deg"])[:: places["per_ring"]]))
    upper = cosine[cosine > 0.05]
    if np.ptp(np.diff(upper)) > 1e-9:
        faults.append("the rings have unlike areas")


def check(domecast, build):
    faults = []
    with tempfile.TemporaryDirectory() as folder:
        outs = [Path(folder, str(threads)) for threads in (1, 2)]
        for threads, out in zip((1, 2), outs):
            subprocess.run([domecast, "illuminate", str(build / "design.json"), "--out", str(out), "--quiet"], check=True,
                           env={**os.environ, "RAYON_NUM_THREADS": str(threads)})
        names = sorted(path.name for path in outs[0].iterdir())
        if names != sorted(path.name for path in outs[1].iterdir()):
            faults.append("one thread and two write other files")
        faults += [f"{name} differs between one thread and two" for name in names
                   if (outs[0] / name).read_bytes() != (outs[1] / name).read_bytes()]
        report = json.loads((outs[0] / "illuminate.json").read_text(), parse_constant=refuse)
    recompute(faults, report)
    equal_areas(faults, report)
    summary = json.loads((build / "report/light.json").read_text())["separation"]
    to60, to75 = report["within"][1:3]
    compare(faults, "condition number in the build", summary["condition_number_p95_to_60_deg"],
            to60["condition_number"]["p95"], COARSE)
    compare(faults, "normal's error in the build", summary["normal_error_deg_per_level_p95_to_60_deg"],
            to60["normal_error_deg_per_level"]["p95"], COARSE)
    if abs(summary["crescent_share_to_75_deg"] - to75["crescent_share"]) > 0.02:
        faults.append(f"crescents in the build: {summary['crescent_share_to_75_deg']}, {to75['crescent_share']} here")
    return faults, to60


def main(arguments):
    if len(arguments) < 2:
        print(__doc__)
        return 2
    domecast, *builds = arguments
    wrong = 0
    for build in map(Path, builds):
        faults, to60 = check(domecast, build)
        wrong += bool(faults)
        shown = lambda value: "none" if value is None else f"{value:.3g}"
        print(f"{build.name}: light {'ok' if not faults else 'FAILED'}; to 60 degrees p95 of the condition number "
              f"{shown(to60['condition_number']['p95'])}, of the normal's error "
              f"{shown(to60['normal_error_deg_per_level']['p95'])} degrees a level")
        print("".join(f"  {fault}\n" for fault in faults[:20]), end="")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
