#!/usr/bin/env python3
"""Open the STEP, 3MF and GLB files of one or more builds in other people's readers.

    scripts/check_parts_formats.py output/thumb24 [output/other ...]

STEP: OpenCASCADE (package cadquery-ocp): one valid closed solid whose volume is that of the part's mesh to within what
the chord tolerance allows (exact faces) or to rounding (facets). 3MF: trimesh, and the consortium's own lib3mf: the
mesh of the STL, in millimetres, under the part's name. GLB: trimesh: every item of the closed and of the exploded
scene. Exit code 1 if anything is off.
"""

import json
import sys
from pathlib import Path

import lib3mf
import numpy as np
import trimesh
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.GProp import GProp_GProps
from OCP.IFSelect import IFSelect_RetDone
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_SOLID
from OCP.TopExp import TopExp_Explorer

# Bores and pockets are drawn round in STEP; in the mesh their chords stand outside the circle, for the fit. At 0.01 mm that is
# 1.5 mm^3 of the coupon with its fourteen bores, 1.3e-3 of it; of all other parts far less. An error of shape would be larger.
EXACT_RELATIVE = 2e-3
FACETED_RELATIVE = 1e-6


def check_step(path, stated_mm3):
    reader = STEPControl_Reader()
    if reader.ReadFile(str(path)) != IFSelect_RetDone:
        return "cannot be read"
    reader.TransferRoots()
    shape = reader.OneShape()
    explorer, volumes = TopExp_Explorer(shape, TopAbs_SOLID), []
    while explorer.More():
        properties = GProp_GProps()
        BRepGProp.VolumeProperties_s(explorer.Current(), properties)
        volumes.append(properties.Mass())
        explorer.Next()
    if len(volumes) != 1 or not BRepCheck_Analyzer(shape).IsValid():
        return f"{len(volumes)} solids, valid: {BRepCheck_Analyzer(shape).IsValid()}"
    faceted = "_faceted" in path.read_text()[:400]
    off = volumes[0] / stated_mm3 - 1
    if not abs(off) <= (FACETED_RELATIVE if faceted else EXACT_RELATIVE):
        return f"volume {volumes[0]:.6f}, the mesh has {stated_mm3:.6f}"
    return ("faceted" if faceted else "exact") + f", volume off by {off:.1e}", True


def check_3mf(path, name, stated_mm3):
    scene = trimesh.load(path)
    mesh = scene.to_mesh() if hasattr(scene, "to_mesh") else scene
    if abs(mesh.volume / stated_mm3 - 1) > 1e-5 or scene.units not in ("mm", "millimeter", "millimeters"):
        return f"trimesh: volume {mesh.volume}, unit {scene.units}"
    model = lib3mf.Wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(path))
    if reader.GetWarningCount():
        return f"lib3mf: {reader.GetWarning(0)}"
    objects = model.GetMeshObjects()
    if not objects.MoveNext():
        return "lib3mf: no mesh"
    found = objects.GetCurrentMeshObject()
    if found.GetName() != name or found.GetTriangleCount() != len(mesh.faces) or not found.IsManifoldAndOriented():
        return f"lib3mf: {found.GetName()}, {found.GetTriangleCount()} triangles"
    return "two readers agree", True


def check_glb(path):
    scene = trimesh.load(path)
    # metres, Y up: the sensor is some centimetres tall along y
    size = np.ptp(scene.bounds, axis=0)
    if not (0.001 < size[1] < 1.0) or not scene.geometry:
        return f"size {size} m, {len(scene.geometry)} items"
    return f"{len(scene.geometry)} items, {size[1] * 1000:.1f} mm tall", True


def main(folders):
    faults = 0
    for folder in map(Path, folders):
        parts = json.loads((folder / "manifest.json").read_text())["parts"]
        jobs = []
        for part in parts:
            base = folder / "parts" / part["name"]
            jobs.append((base.with_suffix(".step"), lambda p, v=part["volume_mm3"]: check_step(p, v)))
            jobs.append((base.with_suffix(".3mf"), lambda p, n=part["name"], v=part["volume_mm3"]: check_3mf(p, n, v)))
        jobs.append((folder / "parts" / "assembly.glb", check_glb))
        for path, job in jobs:
            outcome = job(path)
            good = isinstance(outcome, tuple)
            faults += not good
            print(f"{'ok  ' if good else 'BAD '} {path.name:28} {outcome[0] if good else outcome}")
    print("all formats open" if faults == 0 else f"{faults} faults")
    return 0 if faults == 0 else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]) if len(sys.argv) > 1 else print(__doc__) or 2)
