#!/usr/bin/env python3
"""A ball pressed on the pole of a cap, a hemisphere and a hemisphere on a cylinder, by scikit-fem.

An independent reference for the linear level on domes of other shapes: axisymmetric linear elasticity on quadratic
triangles (displacement alone), bonded by the base; the ball is held off by a stiff penalty at the integration points of
the undeformed surface, without friction, its gap taken where the surface has moved to. At small strain and large turns a
force on the turned surface is, on the body at rest, that force turned back (second Piola-Kirchhoff stress): the pressure is
put along the normals at rest, and the ball's force is that of the same pressures along the ball's own normals. Each case is solved on two meshes;
what they differ by is written beside the numbers. The same domes under large strain (neo-Hookean, as
golden_neo_hookean.py) are what the level's estimate of its own error is held against.

    python -m pip install scikit-fem
    python scripts/golden_domes.py            # writes tests/cases/golden_domes.json
    python scripts/golden_domes.py --check    # solves on the coarse mesh and compares
"""

import json
import sys
from pathlib import Path

import golden_neo_hookean as large
import numpy as np
from skfem import Basis, BilinearForm, ElementTriP2, ElementVector, FacetBasis, MeshTri
from skfem.helpers import grad, trace

TABLE = Path(__file__).resolve().parent.parent / "tests" / "cases" / "golden_domes.json"
MESHES = (28, 42)
# places of the surface at which the displacement is told: parts of the meridian's length from the pole to the rim
PLACES = (0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.55, 0.7, 0.85)
# radius of the sphere and height of its centre, ball's radius, mm; Young's modulus, MPa; Poisson's ratio; depths, mm
CASES = (
    (10.0, 0.0, 5.0, 0.56, 0.49, (0.2, 0.6)),
    (11.5, -5.75, 4.0, 0.56, 0.49, (0.2, 0.6)),
    (14.0, -9.9, 3.0, 0.56, 0.49, (0.2, 0.5)),
    (6.0, -1.0, 3.0, 0.2, 0.45, (0.1, 0.4)),
    (8.0, 4.0, 4.0, 0.56, 0.49, (0.2, 0.6)),
    (5.0, 3.5, 10.0, 0.3, 0.48, (0.1, 0.3)),
)
# The same under large strain: object, its radius, sphere's radius, height of its centre, mm; depths, mm
LARGE_MESHES = (14, 20)
LARGE_CASES = (
    ("ball", 4.0, 11.5, -5.75, (0.2, 0.6, 1.2)),
    ("ball", 3.0, 14.0, -9.9, (0.2, 0.5, 0.9)),
    ("plate", 0.0, 11.5, -5.75, (0.2, 0.5)),
    ("ball", 4.0, 8.0, 4.0, (0.2, 0.6, 1.2)),
)
LARGE_MATERIAL = (0.56, 0.49)
# Pressure by depth over Young's modulus by the radius: the ball lies some 1e-4 of a contact's depth in the dome.
PENALTY = 4e4


def meridian(radius, center, part):
    """Places (r, z) of the surface by the part of its length from the pole."""
    end = np.arccos(-center / radius) if center < 0 else np.pi / 2 + center / radius
    s = np.asarray(part) * end
    on_wall = s > np.pi / 2
    r = np.where(on_wall, radius, radius * np.sin(s))
    z = np.where(on_wall, center - radius * (s - np.pi / 2), center + radius * np.cos(s))
    return np.array([r, z])


def section(radius, center, n):
    """Triangles over the section, finer towards the pole, and the numbers of the surface's nodes from pole to rim."""
    steps = np.linspace(0, 1, n + 1)
    near_zero = steps * (0.25 + 0.75 * steps)
    mesh = MeshTri.init_tensor(near_zero, 1 - near_zero[::-1])
    x, y = mesh.p
    disc = np.array([x * np.sqrt(1 - y**2 / 2), y * np.sqrt(1 - x**2 / 2)])
    size, angle = np.hypot(*disc), np.arctan2(disc[0], disc[1])
    return MeshTri(size * meridian(radius, center, angle / (np.pi / 2)), mesh.t), np.isclose(size, 1.0)


def stiffness(young, nu):
    """Axisymmetric linear elasticity, of the whole body."""
    mu, lam = young / (2 * (1 + nu)), young * nu / ((1 + nu) * (1 - 2 * nu))

    @BilinearForm
    def form(u, v, w):
        r, du, dv = w.x[0], grad(u), grad(v)
        shear = (du[0, 1] + du[1, 0]) * (dv[0, 1] + dv[1, 0]) / 2
        hoop = u[0] * v[0] / r**2
        inner = du[0, 0] * dv[0, 0] + du[1, 1] * dv[1, 1] + shear + hoop
        return (2 * mu * inner + lam * (trace(du) + u[0] / r) * (trace(dv) + v[0] / r)) * r * 2 * np.pi

    return form


def free_of(basis):
    """The unknowns of a body that is bonded at z = 0 and has its axis at r = 0."""
    fixed = np.unique(np.concatenate([
        basis.get_dofs(lambda p: p[1] < 1e-9).flatten(), basis.get_dofs(lambda p: p[0] < 1e-9).all("u^1"),
    ]))
    return np.setdiff1d(np.arange(basis.N), fixed)


def pressed(case, n):
    radius, center, ball, young, nu, depths = case
    mesh, on_face = section(radius, center, n)
    element = ElementVector(ElementTriP2())
    basis = Basis(mesh, element, intorder=6)
    facets = mesh.boundary_facets()
    face = facets[on_face[mesh.facets[:, facets]].all(axis=0)]
    skin = FacetBasis(mesh, element, facets=face, intorder=8)
    free = free_of(basis)
    matrix = stiffness(young, nu).assemble(basis)
    k = PENALTY * young / radius

    # what no step changes, at each point of the surface
    r, z = skin.global_coordinates()
    weight, on_skin = k * r * 2 * np.pi * skin.dx, large.values(skin)
    inward = -np.array([r, np.maximum(z - center, 0.0) if center > 0 else z - center])
    inward /= np.hypot(*inward)

    def gap(u, tip):
        moved = skin.interpolate(u)
        away = np.array([r + moved[0], z + moved[1] - tip - ball])
        length = np.hypot(*away)
        return length - ball, away / length

    def of_points(values):
        return np.moveaxis(values, (-2, -1), (0, 1))

    def pushed(u, tip, by_ball=False):
        """The pressures' forces along the normals at rest, or along the ball's own."""
        g, normal = gap(u, tip)
        force = of_points(np.minimum(g, 0) * weight * (normal if by_ball else inward))
        return large.vector(skin, (force[:, :, None] @ on_skin).sum((1, 2)))

    def stiff(u, tip):
        g, normal = gap(u, tip)
        law = of_points(np.where(g < 0, weight * inward[:, None] * normal[None], 0.0))
        return large.matrix(skin, skin, (on_skin.swapaxes(2, 3) @ law @ on_skin).sum(1))

    def residual(u, tip):
        return matrix @ u + pushed(u, tip)

    pole = center + radius
    u, answers, last = np.zeros(basis.N), [], 0.0
    for depth in depths:
        for part in np.linspace(last, depth, max(3, int(np.ceil((depth - last) / 0.05))))[1:]:
            tip = pole - part
            left = residual(u, tip)
            size = np.abs(left[free]).max()
            for _ in range(60):
                if size < 1e-11:
                    break
                tangent = matrix + stiff(u, tip)
                step = large.factor(tangent[free][:, free].tocsc()).solve(-left[free])
                for share in (1.0, 0.5, 0.25, 0.1, 0.03):
                    trial = u.copy()
                    trial[free] += share * step
                    left = residual(trial, tip)
                    if np.abs(left[free]).max() < size:
                        break
                u, size = trial, np.abs(left[free]).max()
            assert size < 1e-9, f"{case}: {size} N left at {part} mm"
        last = depth
        force = pushed(u, tip, by_ball=True)
        force = force[basis.nodal_dofs[1]].sum() + force[basis.facet_dofs[1]].sum()
        answers.append(answer_of(depth, force, mesh, basis, u, np.flatnonzero(on_face), radius, center))
    return answers


def answer_of(depth, force, mesh, basis, u, nodes, radius, center):
    near = [nodes[np.argmin(np.hypot(*(mesh.p[:, nodes].T - at).T))] for at in meridian(radius, center, PLACES).T]
    return {
        "depth_mm": depth,
        "force_n": float(force),
        "at_mm": mesh.p[:, near].T.tolist(),
        "displacement_mm": np.array([u[basis.nodal_dofs[0, near]], u[basis.nodal_dofs[1, near]]]).T.tolist(),
    }


class LargeStrain(large.Dome):
    """golden_neo_hookean.py's dome on another section."""

    def __init__(self, n, radius, center):
        young, poisson = LARGE_MATERIAL
        self.radius, self.mu = radius, young / (2 * (1 + poisson))
        self.kappa, self.young = young / (3 * (1 - 2 * poisson)), young
        self.mesh, on_face = section(radius, center, n)
        self.nodes = np.flatnonzero(on_face)
        self.basis = Basis(self.mesh, ElementVector(ElementTriP2()), intorder=5)
        self.pressure = self.basis.with_element(large.ElementTriP1())
        facets = self.mesh.boundary_facets()
        face = facets[on_face[self.mesh.facets[:, facets]].all(axis=0)]
        self.facets = FacetBasis(self.mesh, self.basis.elem, facets=face, intorder=8)
        base = self.basis.get_dofs(lambda p: p[1] < 1e-9).flatten()
        axis = self.basis.get_dofs(lambda p: p[0] < 1e-9).all("u^1")
        self.nu, self.np = self.basis.N, self.pressure.N
        self.free = np.setdiff1d(np.arange(self.nu + self.np), np.concatenate([base, axis]))
        self.penalty = 8000 * young / radius
        self.prepare()


def pressed_far(case, n):
    kind, size, radius, center, depths = case
    dome = LargeStrain(n, radius, center)
    x, done, answers, pole = np.zeros(dome.nu + dome.np), 0.0, [], radius + center
    for depth in depths:
        step = 0.02 * pole
        while done < depth - 1e-12:
            step = min(step, depth - done)
            solved = dome.newton(kind, size, pole - done - step, x)
            if solved is None:
                step /= 2
                assert step > 1e-4 * pole, f"{case} does not converge beyond {done} mm"
                continue
            x, force, _ = solved
            done += step
            step *= 1.4
        answers.append(answer_of(depth, -force, dome.mesh, dome.basis, x[: dome.nu], dome.nodes, radius, center))
    return answers


def rounded(value):
    if isinstance(value, list):
        return [rounded(one) for one in value]
    return {key: rounded(one) for key, one in value.items()} if isinstance(value, dict) else round(value, 7)


def solved(cases, names, known, solve, meshes):
    """The table's lines of some cases; with `known` lines the coarse mesh is compared with them."""
    lines = []
    for index, case in enumerate(cases):
        coarse = solve(case, meshes[0])
        fine = known[index]["answers"] if known else solve(case, meshes[1])
        off = max(abs(a["force_n"] / b["force_n"] - 1) for a, b in zip(coarse, fine))
        print(case, [round(a["force_n"], 5) for a in fine], f"the coarse mesh's forces are off by {off:.1e}", flush=True)
        if known and off > known[index]["meshes_differ_by"] * 1.05 + 1e-5:
            sys.exit(f"{case}: the force is off by {off}")
        lines.append({**dict(zip(names, case)), "meshes_differ_by": float(f"{off:.2g}"), "answers": rounded(fine)})
    return lines


def main():
    table = json.loads(TABLE.read_text()) if "--check" in sys.argv else {}
    names = ("radius_mm", "center_z_mm", "ball_radius_mm", "young_mpa", "poisson")
    far = ("object", "object_radius_mm", "radius_mm", "center_z_mm")
    made = {
        "why": "scripts/golden_domes.py: axisymmetric elasticity by scikit-fem, without friction; cases: small strain, large: neo-Hookean",
        "cases": solved(CASES, names, table.get("cases"), pressed, MESHES),
        "large": solved(LARGE_CASES, far, table.get("large"), pressed_far, LARGE_MESHES),
    }
    if not table:
        TABLE.write_text(json.dumps(made, indent=1) + "\n")


if __name__ == "__main__":
    main()
