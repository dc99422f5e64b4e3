#!/usr/bin/env python3
"""What the bonded base of a dome holds back under a small touch of its pole, by scikit-fem.

Axisymmetric linear elasticity on quadratic triangles (displacement alone). A pressure as Hertz', `p0 sqrt(1 - r^2/a^2)`, presses straight down. On a
half-space its mean depth, weighted by the pressure, is 0.6 F / (a E*); the dome's is less by `held F / (E* R)`. On a high cylinder it is more: the
column yields.

    python scripts/golden_held.py            # writes tests/cases/golden_held.json
    python scripts/golden_held.py --check    # solves on the coarse mesh and compares
"""
import json
import sys
from pathlib import Path

import numpy as np
from golden_domes import free_of, section, stiffness
from scipy.sparse.linalg import splu
from skfem import Basis, ElementTriP2, ElementVector, FacetBasis, LinearForm

TABLE = Path(__file__).resolve().parent.parent / "tests" / "cases" / "golden_held.json"
MESHES = (36, 60)
# height of the sphere's centre above the base, in radii; Poisson's ratio
CENTERS = (-0.9, -0.8, -0.7, -0.6, -0.5, -0.4, -0.3, -0.2, -0.1, 0.0, 0.25, 0.5, 1.0, 2.0)
POISSON = 0.49
# the touch's radius, as a part of the dome's height or of its radius, whichever is less
TOUCH = 0.25


def held(center, n, poisson=POISSON):
    touch = TOUCH * (1 + min(center, 0))
    mesh, on_face = section(1.0, center, n)
    element = ElementVector(ElementTriP2())
    basis = Basis(mesh, element, intorder=6)

    @LinearForm
    def load(v, w):
        return -v[1] * np.sqrt(np.maximum(1 - (w.x[0] / touch) ** 2, 0)) * (w.x[1] > center) * w.x[0] * 2 * np.pi

    facets = mesh.boundary_facets()
    face = facets[on_face[mesh.facets[:, facets]].all(axis=0)]
    force = load.assemble(FacetBasis(mesh, element, facets=face, intorder=12))
    free, u = free_of(basis), np.zeros(basis.N)
    u[free] = splu(stiffness(1.0, poisson).assemble(basis)[free][:, free].tocsc()).solve(force[free])
    total = -(force[basis.nodal_dofs[1]].sum() + force[basis.facet_dofs[1]].sum())
    mean = force @ u / total
    modulus = 1 / (1 - poisson**2)
    return (0.6 * total / (touch * modulus) - mean) * modulus / total


def main():
    known = json.loads(TABLE.read_text())["held"] if "--check" in sys.argv else None
    lines = []
    for at, center in enumerate(CENTERS):
        coarse = held(center, MESHES[0])
        fine = known[at]["held"] if known else held(center, MESHES[1])
        print(f"centre at {center:+.2f} R: {fine:+.4f} F/(E* R), the coarse mesh is off by {coarse - fine:+.4f}", flush=True)
        if known and abs(coarse - fine) > 0.01 + 0.01 * abs(fine):
            sys.exit(f"{center}: off by {coarse - fine}")
        lines.append({"center_z": center, "held": round(float(fine), 4)})
    if not known:
        why = "scripts/golden_held.py: axisymmetric linear elasticity by scikit-fem; of a dome of radius 1, in F/(E* R)"
        TABLE.write_text(json.dumps({"why": why, "poisson": POISSON, "held": lines}, indent=1) + "\n")


if __name__ == "__main__":
    main()
