#!/usr/bin/env python3
"""Objects pressed on the pole of a neo-Hookean hemisphere that is bonded by its base, by scikit-fem.

An independent reference for contact at large strain: axisymmetric Taylor-Hood triangles (quadratic displacement, linear
continuous pressure), total Lagrangian, W = mu/2 (J^(-2/3) tr C - 3) + p (J - 1) - p^2 / (2 kappa), Newton's method with
the exact tangent, the object held off by a stiff penalty at the integration points of the surface, no friction. Each
case is solved on two meshes; what they differ by is written beside the numbers.

    python -m pip install scikit-fem
    python scripts/golden_neo_hookean.py            # writes tests/cases/golden_neo_hookean.json
    python scripts/golden_neo_hookean.py --check    # solves on the coarse mesh and compares
"""

import json
import sys
from pathlib import Path

import numpy as np
from scipy.sparse import bmat
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementTriP1, ElementTriP2, ElementVector, FacetBasis, LinearForm, MeshTri

TABLE = Path(__file__).resolve().parent.parent / "tests" / "cases" / "golden_neo_hookean.json"
MESHES = (16, 24)
# Polar angles of the undeformed surface at which the displacement is told, degrees.
POLAR_DEG = (0, 4, 8, 12, 16, 20, 25, 30, 40, 50, 60, 75)
# object, its radius, mm; dome radius, mm; Young's modulus, MPa; Poisson's ratio; depths, mm
CASES = (
    ("ball", 5.0, 10.0, 0.56, 0.49, (0.43, 0.78, 1.12, 1.6, 2.1, 2.4)),
    ("plate", 0.0, 10.0, 0.56, 0.49, (0.3, 0.8, 1.5, 2.2)),
    ("punch", 3.0, 10.0, 0.56, 0.49, (0.6, 1.2, 1.8, 2.4)),
    ("ball", 15.0, 5.0, 0.2, 0.48, (0.1, 0.3, 0.6, 0.9, 1.2)),
    ("ball", 2.0, 10.0, 0.56, 0.49, (0.3, 0.8, 1.4, 2.0)),
    ("ball", 5.0, 10.0, 0.56, 0.499, (0.5, 1.0, 1.5, 2.0)),
    ("ball", 5.0, 10.0, 0.56, 0.45, (0.5, 1.0, 1.5, 2.0)),
)


def gap(kind, size, tip, r, z):
    """Signed distance of an object whose lowest point is at height tip, its gradient and second derivatives (rr, rz, zz)."""
    one, zero = np.ones_like(r), np.zeros_like(r)
    if kind == "ball":
        dz = z - (tip + size)
        length = np.maximum(np.hypot(r, dz), 1e-12)
        nr, nz = r / length, dz / length
        return length - size, nr, nz, (1 - nr * nr) / length, -nr * nz / length, (1 - nz * nz) / length
    if kind == "plate":
        return tip - z, zero, -one, zero, zero, zero
    side, below = r - size, tip - z
    corner = (side > 0) & (below > 0)
    length = np.where(corner, np.hypot(side, below), 1.0)
    value = np.where(corner, length, np.maximum(side, below))
    nr = np.where(corner, side / length, np.where(side > below, 1.0, 0.0))
    nz = np.where(corner, -below / length, np.where(side > below, 0.0, -1.0))
    return value, nr, nz, zero, zero, zero


def inverse_transpose(f):
    (a, b), (c, d), t = f[0], f[1], f[2]
    flat = a * d - b * c
    return ((d / flat, -c / flat), (-b / flat, a / flat), 1 / t), flat * t


def contract(a, b):
    return a[0][0] * b[0][0] + a[0][1] * b[0][1] + a[1][0] * b[1][0] + a[1][1] * b[1][1] + a[2] * b[2]


def combine(*terms):
    flat = [[sum(s * t[i][j] for s, t in terms) for j in range(2)] for i in range(2)]
    return (flat[0], flat[1], sum(s * t[2] for s, t in terms))


def turned(g, d):
    """G d^T G for a gradient d."""
    m = [[sum(g[i][k] * d[l][k] * g[l][j] for k in range(2) for l in range(2)) for j in range(2)] for i in range(2)]
    return (m[0], m[1], g[2] * d[2] * g[2])


def gradient(u, r):
    d = u.grad
    return ((d[0][0], d[0][1]), (d[1][0], d[1][1]), u[0] / r)


def deformation(w):
    d = gradient(w["u"], w.x[0])
    return ((1 + d[0][0], d[0][1]), (d[1][0], 1 + d[1][1]), 1 + d[2])


class Dome:
    def __init__(self, n, radius, young, poisson):
        self.radius, self.mu = radius, young / (2 * (1 + poisson))
        self.kappa, self.young = young / (3 * (1 - 2 * poisson)), young
        # Finer towards the pole: x of the square becomes r there, y becomes z.
        s = np.linspace(0, 1, n + 1)
        x, y = 0.45 * s + 0.55 * s**2.0, 1 - (0.4 * (1 - s) + 0.6 * (1 - s) ** 2)
        mesh = MeshTri.init_tensor(x, y)
        x, y = mesh.p
        self.mesh = MeshTri(radius * np.array([x * np.sqrt(1 - y**2 / 2), y * np.sqrt(1 - x**2 / 2)]), mesh.t)
        self.basis = Basis(self.mesh, ElementVector(ElementTriP2()), intorder=5)
        self.pressure = self.basis.with_element(ElementTriP1())
        curved = lambda p: np.hypot(*p) > radius * (1 - 2.0 / n**2)
        self.facets = FacetBasis(
            self.mesh,
            self.basis.elem,
            facets=self.mesh.facets_satisfying(curved, boundaries_only=True),
            intorder=8,
        )
        base = self.basis.get_dofs(lambda p: p[1] < 1e-9).flatten()
        axis = self.basis.get_dofs(lambda p: p[0] < 1e-9).all("u^1")
        self.nu, self.np = self.basis.N, self.pressure.N
        self.free = np.setdiff1d(np.arange(self.nu + self.np), np.concatenate([base, axis]))
        self.penalty = 8000 * young / radius
        self.make_forms()

    def make_forms(self):
        mu, kappa = self.mu, self.kappa

        @BilinearForm
        def stiffness(u, v, w):
            r = w.x[0]
            f, d = deformation(w), gradient(u, r)
            g, j = inverse_transpose(f)
            first, a, b = contract(f, f), contract(g, d), contract(f, d)
            scale, p, back = mu * j ** (-2 / 3), w["p"], turned(g, d)
            total = combine(
                (scale, d),
                (-2 / 3 * scale * a, f),
                (scale * (2 / 9 * first * a - 2 / 3 * b) + p * j * a, g),
                (scale * first / 3 - p * j, back),
            )
            return contract(total, gradient(v, r)) * r

        @BilinearForm
        def coupling(u, q, w):
            r = w.x[0]
            g, j = inverse_transpose(deformation(w))
            return j * contract(g, gradient(u, r)) * q * r

        @BilinearForm
        def volume(p, q, w):
            return -p * q / kappa * w.x[0]

        @LinearForm
        def force(v, w):
            f = deformation(w)
            g, j = inverse_transpose(f)
            stress = combine((mu * j ** (-2 / 3), f), (w["p"] * j - mu * j ** (-2 / 3) * contract(f, f) / 3, g))
            return contract(stress, gradient(v, w.x[0])) * w.x[0]

        @LinearForm
        def change(q, w):
            _, j = inverse_transpose(deformation(w))
            return (j - 1 - w["p"] / kappa) * q * w.x[0]

        self.forms = stiffness, coupling, volume, force, change

    def contact(self, kind, size, tip, u):
        at = self.facets.interpolate(u)
        r, z = self.facets.global_coordinates()
        value, nr, nz, rr, rz, zz = gap(kind, size, tip, r + at[0], z + at[1])
        on = self.penalty * (value < 0)

        @BilinearForm
        def stiffness(u, v, w):
            along = nr * u[0] + nz * u[1]
            bend = (rr * u[0] + rz * u[1]) * v[0] + (rz * u[0] + zz * u[1]) * v[1]
            return on * (along * (nr * v[0] + nz * v[1]) + value * bend) * w.x[0]

        @LinearForm
        def force(v, w):
            return on * value * (nr * v[0] + nz * v[1]) * w.x[0]

        up = 2 * np.pi * np.sum(-on * value * nz * r * self.facets.dx)
        return stiffness.assemble(self.facets), force.assemble(self.facets), up, float(-value.min())

    def newton(self, kind, size, tip, x):
        stiffness, coupling, volume, force, change = self.forms
        past = np.inf
        for step in range(40):
            u, p = x[: self.nu], x[self.nu :]
            at = {"u": self.basis.interpolate(u), "p": self.pressure.interpolate(p)}
            bodily, pushed, up, inside = self.contact(kind, size, tip, u)
            residual = np.concatenate(
                [force.assemble(self.basis, **at) + pushed, change.assemble(self.pressure, **at)]
            )
            size_of = np.abs(residual[self.free]).max()
            if not np.isfinite(size_of) or size_of > 1e3 * max(past, self.young):
                return None
            if size_of < 1e-9 * self.young * self.radius:
                return x, up, inside
            past = size_of
            k = stiffness.assemble(self.basis, **at) + bodily
            b = coupling.assemble(self.basis, self.pressure, **at)
            c = volume.assemble(self.pressure, **at)
            system = bmat([[k, b.T], [b, c]], format="csc")[self.free][:, self.free]
            move = np.zeros_like(x)
            move[self.free] = splu(system.tocsc()).solve(-residual[self.free])
            longest = np.abs(move[: self.nu]).max()
            x = x + move * min(1.0, 0.05 * self.radius / longest)
        return None

    def surface(self, u):
        """Displacement by polar angle of the undeformed surface, of the nodes and edge middles there."""
        dofs = np.unique(self.basis.get_dofs(self.facets.find).all("u^1"))
        across = np.unique(self.basis.get_dofs(self.facets.find).all("u^2"))
        r, z = self.basis.doflocs[:, dofs]
        polar = np.degrees(np.arctan2(r, z))
        order = np.argsort(polar)
        return [np.interp(POLAR_DEG, polar[order], u[part][order]) for part in (dofs, across)]


def solve(n, kind, size, radius, young, poisson, depths):
    dome = Dome(n, radius, young, poisson)
    x, done, rows = np.zeros(dome.nu + dome.np), 0.0, []
    for depth in depths:
        step = 0.03 * radius
        while done < depth - 1e-12:
            step = min(step, depth - done)
            solved = dome.newton(kind, size, radius - done - step, x)
            if solved is None:
                step /= 2
                if step < 1e-4 * radius:
                    raise SystemExit(f"{kind} {size} does not converge beyond {done} mm")
                continue
            x, up, inside = solved
            done += step
            step *= 1.4
        aside, high = dome.surface(x[: dome.nu])
        rows.append((depth, up, inside, aside, high))
        print(f"{n}: {kind} {size} on {radius}, nu {poisson}, {depth} mm: {up:.5f} N, {inside:.1e} mm inside", flush=True)
    return rows


def main():
    known = json.loads(TABLE.read_text()) if "--check" in sys.argv else None
    cases = []
    for number, (kind, size, radius, young, poisson, depths) in enumerate(CASES):
        meshes = MESHES[:1] if known else MESHES
        rows = [solve(n, kind, size, radius, young, poisson, depths) for n in meshes]
        if known:
            for row, then in zip(rows[0], known["cases"][number]["frames"]):
                # The table holds the fine mesh, and what the coarse one differed by.
                off = abs(row[1] / then["force_n"] - 1) - then["force_between_meshes"]
                assert abs(off) < 5e-4, (kind, size, row[0], off)
            continue
        frames = [
            {
                "depth_mm": fine[0],
                "force_n": round(fine[1], 6),
                "force_between_meshes": round(abs(coarse[1] / fine[1] - 1), 6),
                "displacement_between_meshes_mm": round(
                    float(max(np.abs(coarse[3] - fine[3]).max(), np.abs(coarse[4] - fine[4]).max())), 6
                ),
                "inside_mm": round(fine[2], 6),
                "outwards_mm": [round(float(v), 6) for v in fine[3]],
                "up_mm": [round(float(v), 6) for v in fine[4]],
            }
            for coarse, fine in zip(*rows)
        ]
        cases.append(
            {
                "object": kind,
                "object_radius_mm": size,
                "dome_radius_mm": radius,
                "young_mpa": young,
                "poisson": poisson,
                "frames": frames,
            }
        )
        # After every case, so that a run that was cut short leaves what it has.
        table = {"source": "scripts/golden_neo_hookean.py", "polar_deg": POLAR_DEG, "cases": cases}
        TABLE.write_text(json.dumps(table, indent=1) + "\n")


if __name__ == "__main__":
    main()
