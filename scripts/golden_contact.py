#!/usr/bin/env python3
"""Displacements of a bonded hemisphere under a smooth pressure about its pole, by scikit-fem.

An independent reference for the swept elements of src/contact/fem: quadratic triangles over the meridian,
axisymmetric, displacement alone (no projection of the volume change), on two meshes so that the last digits are known.
Prints the golden values that the tests hold: polar angle, u_r and u_z in mm.

    python -m pip install scikit-fem
    python scripts/golden_contact.py
"""

import numpy as np
from skfem import Basis, ElementTriP2, ElementVector, FacetBasis, BilinearForm, LinearForm, MeshTri, condense, solve
from skfem.helpers import grad, trace

RADIUS, YOUNG, POISSON, PEAK, CAP = 10.0, 0.56, 0.49, 0.05, 0.8
MU = YOUNG / (2 * (1 + POISSON))
LAMBDA = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))


def sink(n):
    mesh = MeshTri.init_tensor(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1))
    x, y = mesh.p
    mesh = MeshTri(RADIUS * np.array([x * np.sqrt(1 - y**2 / 2), y * np.sqrt(1 - x**2 / 2)]), mesh.t)
    basis = Basis(mesh, ElementVector(ElementTriP2()), intorder=6)

    @BilinearForm
    def stiffness(u, v, w):
        r = w.x[0]
        du, dv = grad(u), grad(v)
        e = [[du[0, 0], 0.5 * (du[0, 1] + du[1, 0])], [0.5 * (du[0, 1] + du[1, 0]), du[1, 1]]]
        f = [[dv[0, 0], 0.5 * (dv[0, 1] + dv[1, 0])], [0.5 * (dv[0, 1] + dv[1, 0]), dv[1, 1]]]
        hoop_u, hoop_v = u[0] / r, v[0] / r
        inner = sum(e[i][j] * f[i][j] for i in range(2) for j in range(2)) + hoop_u * hoop_v
        return (2 * MU * inner + LAMBDA * (trace(du) + hoop_u) * (trace(dv) + hoop_v)) * r

    @LinearForm
    def load(v, w):
        r, z = w.x
        polar = np.arctan2(r, z)
        p = np.where(polar < CAP, PEAK * np.cos(np.pi / 2 * polar / CAP) ** 4, 0.0)
        return -p * (v[0] * np.sin(polar) + v[1] * np.cos(polar)) * r

    curved = mesh.facets_satisfying(lambda p: np.hypot(*p) > RADIUS * (1 - 1.5 / n**2 - 1e-9), boundaries_only=True)
    facets = FacetBasis(mesh, ElementVector(ElementTriP2()), facets=curved, intorder=8)
    base = basis.get_dofs(lambda p: p[1] < 1e-9).flatten()
    axis = basis.get_dofs(lambda p: p[0] < 1e-9).all("u^1")
    fixed = np.unique(np.concatenate([base, axis]))
    u = solve(*condense(stiffness.assemble(basis), load.assemble(facets), D=fixed))
    out = []
    for polar in (0.0, 0.3, 0.6, 0.9, 1.2):
        # a hair inside, where the straight edges still have an element
        at = RADIUS * (1 - 1e-3 / n) * np.array([[np.sin(polar)], [np.cos(polar)]])
        node = np.argmin(np.hypot(*(mesh.p - at)))
        near = mesh.p[:, node]
        dofs = basis.nodal_dofs[:, node]
        out.append((np.arctan2(near[0], near[1]), u[dofs[0]], u[dofs[1]]))
    return out


if __name__ == "__main__":
    for n in (64, 128):
        print(n, [tuple(round(float(v), 6) for v in line) for line in sink(n)])
