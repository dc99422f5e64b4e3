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
from scipy.sparse import bmat, coo_matrix
from scipy.sparse.linalg import splu
from skfem import Basis, ElementTriP1, ElementTriP2, ElementVector, FacetBasis, MeshTri

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
    plane = a * d - b * c
    return ((d / plane, -c / plane), (-b / plane, a / plane), 1 / t), plane * t


def flat(tensor):
    """Components rr, rz, zr, zz, and that around the axis."""
    return np.array([*tensor[0], *tensor[1], tensor[2]])


def gradients(basis):
    """Of each of the basis functions, in each element and at each of its points, as `flat` orders them."""
    r = basis.global_coordinates()[0]
    of = [(*u.grad[0], *u.grad[1], u.value[0] / r) for (u,) in basis.basis]
    return np.array(of).transpose(2, 3, 1, 0)


def values(basis):
    """Of each of the basis functions, in each element and at each of its points."""
    of = np.array([u.value for (u,) in basis.basis])
    return of.transpose(2, 3, 1, 0) if of.ndim == 4 else of.transpose(1, 2, 0)[:, :, None]


def matrix(rows, columns, elements):
    """A sparse matrix of those of the elements, each rows by columns."""
    at = np.broadcast_arrays(rows.element_dofs.T[:, :, None], columns.element_dofs.T[:, None, :])
    return coo_matrix((elements.ravel(), [part.ravel() for part in at]), shape=(rows.N, columns.N)).tocsr()


def vector(rows, elements):
    return np.bincount(rows.element_dofs.T.ravel(), elements.ravel(), rows.N)


def factor(system):
    """Factors of a matrix whose pattern is symmetric, as these are: half the work of what takes any pattern."""
    return splu(system, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.1, options={"SymmetricMode": True})


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
        self.prepare()

    def prepare(self):
        """What no step changes: the tensors of the basis functions, and weights of the points with their circumference."""
        self.of_u, self.of_p, self.on_facet = gradients(self.basis), values(self.pressure), values(self.facets)
        self.weight = self.basis.dx * self.basis.global_coordinates()[0]
        weighted = self.of_p.swapaxes(2, 3) * self.weight[..., None, None]
        self.volume = matrix(self.pressure, self.pressure, -(weighted @ self.of_p).sum(1) / self.kappa)

    def body(self, x):
        """Matrices and residuals of displacement and pressure in the silicone. The gradient of a basis function times the moduli times that
        of another is a product of matrices at each point: forms of scikit-fem would work all of this out anew for each of 144 pairs."""
        u, p = self.basis.interpolate(x[: self.nu]), self.pressure.interpolate(x[self.nu :]).value
        r, d = self.basis.global_coordinates()[0], u.grad
        f = ((1 + d[0][0], d[0][1]), (d[1][0], 1 + d[1][1]), 1 + u.value[0] / r)
        g, j = inverse_transpose(f)
        back = np.zeros((5, 5, *j.shape))
        for row, column, k, l in np.ndindex(2, 2, 2, 2):
            # G d^T G
            back[2 * row + column, 2 * l + k] = g[row][k] * g[l][column]
        back[4, 4] = g[2] * g[2]
        f, g = flat(f), flat(g)
        scale, first = self.mu * j ** (-2 / 3), (f * f).sum(0)
        fg = f[:, None] * g[None]
        moduli = (
            scale * np.eye(5)[:, :, None, None]
            - 2 / 3 * scale * (fg + fg.swapaxes(0, 1))
            + (2 / 9 * scale * first + p * j) * g[:, None] * g[None]
            + (scale * first / 3 - p * j) * back
        )
        stress = scale * f + (p * j - scale * first / 3) * g
        moduli, stress, g = (np.moveaxis(part * self.weight, (-2, -1), (0, 1)) for part in (moduli, stress, g * j))
        across = self.of_u.swapaxes(2, 3)
        stiffness = matrix(self.basis, self.basis, (across @ moduli @ self.of_u).sum(1))
        volumes = g[:, :, None] @ self.of_u
        coupling = matrix(self.pressure, self.basis, (self.of_p.swapaxes(2, 3) @ volumes).sum(1))
        force = vector(self.basis, (stress[:, :, None] @ self.of_u).sum((1, 2)))
        change = ((j - 1 - p / self.kappa) * self.weight)[..., None, None]
        return stiffness, coupling, force, vector(self.pressure, (change * self.of_p).sum((1, 2)))

    def contact(self, kind, size, tip, u):
        at = self.facets.interpolate(u)
        r, z = self.facets.global_coordinates()
        value, nr, nz, rr, rz, zz = gap(kind, size, tip, r + at[0], z + at[1])
        on = self.penalty * (value < 0) * r * self.facets.dx
        law = np.array([[nr * nr + value * rr, nr * nz + value * rz], [nr * nz + value * rz, nz * nz + value * zz]])
        law, push = (np.moveaxis(on * part, (-2, -1), (0, 1)) for part in (law, value * np.array([nr, nz])))
        stiffness = matrix(self.facets, self.facets, (self.on_facet.swapaxes(2, 3) @ law @ self.on_facet).sum(1))
        force = vector(self.facets, (push[:, :, None] @ self.on_facet).sum((1, 2)))
        up = 2 * np.pi * np.sum(-on * value * nz)
        return stiffness, force, up, float(-value.min())

    def newton(self, kind, size, tip, x):
        past = np.inf
        for _ in range(40):
            stiffness, coupling, force, change = self.body(x)
            pushing, pushed, up, inside = self.contact(kind, size, tip, x[: self.nu])
            residual = np.concatenate([force + pushed, change])
            size_of = np.abs(residual[self.free]).max()
            if not np.isfinite(size_of) or size_of > 1e3 * max(past, self.young):
                return None
            if size_of < 1e-9 * self.young * self.radius:
                return x, up, inside
            past = size_of
            system = bmat([[stiffness + pushing, coupling.T], [coupling, self.volume]], format="csc")
            system = system[self.free][:, self.free]
            move = np.zeros_like(x)
            move[self.free] = factor(system).solve(-residual[self.free])
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
