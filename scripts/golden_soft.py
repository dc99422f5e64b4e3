#!/usr/bin/env python3
"""An elastic ball pressed on the pole of domes, by scikit-fem: the dome bonded by its base, the ball a half-space.

Axisymmetric linear elasticity on quadratic triangles of the dome (displacement alone); of the ball Hertz' half-space in closed form (K. L. Johnson,
Contact Mechanics, 1985, eq. 3.42). The pressure is a sum of half ellipsoids of several radii up to the contact's, whose weights close the
gap of the two spheres within it: so every contact radius has one force and one depth. No friction.

    python scripts/golden_soft.py            # writes tests/cases/golden_soft.json
    python scripts/golden_soft.py --check    # solves on the coarse mesh and compares
"""
import json
import sys
from pathlib import Path

import numpy as np
from golden_domes import free_of, section, stiffness
from scipy.sparse.linalg import splu
from skfem import Basis, ElementTriP2, ElementVector, FacetBasis, LinearForm

TABLE = Path(__file__).resolve().parent.parent / "tests" / "cases" / "golden_soft.json"
MESHES = (36, 60)
# radius of the sphere, height of its centre, ball's radius, mm
CASES = ((10.0, 0.0, 8.0), (11.5, -5.75, 6.0), (8.0, 4.0, 6.0))
YOUNG, POISSON = 0.56, 0.49
# Young's moduli of the ball, MPa; its Poisson's ratio
BALLS = (0.07, 0.3, 3.0)
BALL_POISSON = 0.47
# contact radii, as parts of the dome's radius or height, whichever is less
TOUCHES = (0.15, 0.25)
# radii of the half ellipsoids over the contact's
PARTS = np.array([0.5, 0.7, 0.87, 1.0])


def half_space(r, a):
    """Sink under the pressure sqrt(1 - r^2/a^2) times the plane-strain modulus."""
    ratio = np.minimum(a / np.maximum(r, 1e-12), 1.0)
    outside = ((2 * a**2 - r**2) * np.arcsin(ratio) + r**2 * ratio * np.sqrt(1 - ratio**2)) / (2 * a)
    return np.where(r <= a, np.pi / (4 * a) * (2 * a**2 - r**2), outside)


def presses(case, n):
    """By ball and touch: force and depth."""
    radius, center, ball = case
    mesh, on_face = section(radius, center, n)
    element = ElementVector(ElementTriP2())
    basis = Basis(mesh, element, intorder=6)
    facets = mesh.boundary_facets()
    skin = FacetBasis(mesh, element, facets=facets[on_face[mesh.facets[:, facets]].all(axis=0)], intorder=12)
    free = free_of(basis)
    factors = splu(stiffness(YOUNG, POISSON).assemble(basis)[free][:, free].tocsc())
    found = []
    for touch in TOUCHES:
        a = touch * min(radius, radius + center)
        columns, nodes = [], np.flatnonzero(on_face & (mesh.p[0] < 0.999 * a) & (mesh.p[1] > center))
        r, z = mesh.p[:, nodes]
        for part in PARTS:

            @LinearForm
            def load(v, w, part=part):
                r, z = w.x
                inside = np.sqrt(np.maximum(1 - (r / (part * a)) ** 2, 0)) * (z > center)
                return -inside * (v[0] * r + v[1] * (z - center)) / radius * r * 2 * np.pi

            u = np.zeros(basis.N)
            u[free] = factors.solve(load.assemble(skin)[free])
            columns.append(-u[basis.nodal_dofs[1, nodes]])
        dome = np.array(columns).T
        own = np.array([half_space(r, part * a) for part in PARTS]).T
        profile = radius - np.sqrt(radius**2 - r**2) + ball - np.sqrt(ball**2 - r**2)
        for young in BALLS:
            both = dome + own * (1 - BALL_POISSON**2) / young
            system = np.hstack([both, -np.ones((len(nodes), 1))])
            weights, *_ = np.linalg.lstsq(system, -profile, rcond=1e-10)
            left = system @ weights + profile
            force = 2 / 3 * np.pi * (weights[:-1] * (PARTS * a) ** 2).sum()
            found.append({"young_mpa": young, "radius_mm": a, "force_n": force, "depth_mm": weights[-1], "left_mm": np.abs(left).max()})
    return found


def main():
    known = json.loads(TABLE.read_text())["cases"] if "--check" in sys.argv else None
    cases = []
    for at, case in enumerate(CASES):
        coarse = presses(case, MESHES[0])
        fine = known[at]["presses"] if known else presses(case, MESHES[1])
        worst = 0.0
        for one, other in zip(coarse, fine, strict=True):
            # of the same depth, by Hertz' power
            force = one["force_n"] * (other["depth_mm"] / one["depth_mm"]) ** 1.5
            worst = max(worst, abs(force / other["force_n"] - 1))
            print(f"{case} {one['young_mpa']} MPa, a = {one['radius_mm']:.2f}: {other['force_n']:.4f} N at {other['depth_mm']:.4f} mm, the coarse mesh {100 * (force / other['force_n'] - 1):+.2f} %, gap {other['left_mm']:.1e}", flush=True)
        if known and worst > 0.01:
            sys.exit(f"{case}: off by {worst}")
        rounded = [{key: round(float(value), 6) for key, value in one.items()} for one in fine]
        cases.append({"dome_radius_mm": case[0], "center_z_mm": case[1], "ball_radius_mm": case[2], "coarse_off": round(float(worst), 5), "presses": rounded})
    if not known:
        why = "scripts/golden_soft.py: an elastic ball, a half-space, on an elastic dome by scikit-fem; no friction"
        TABLE.write_text(json.dumps({"why": why, "young_mpa": YOUNG, "poisson": POISSON, "ball_poisson": BALL_POISSON, "cases": cases}, indent=1) + "\n")


if __name__ == "__main__":
    main()
