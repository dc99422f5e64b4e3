"""The springs' law of `constants.json` (`springs.law`), written a second time: from an energy, by differences.

Each spring stores the energy of its compression, its twist and its magnets' pull, and as Haringx' column (Philips Research
Reports 3, 1948) that of the shift and tilt of its upper end. The wrench is the slope of the sum along small motions about
`at_mm`. `check_constants.py` sets it beside the stiffness that the constants give.
"""
import cv2
import numpy as np
from scipy.integrate import quad
from scipy.interpolate import make_interp_spline
from scipy.optimize import brentq
from scipy.special import j1

MU_0 = 1.25663706212  # T^2 / MU_0 is N/mm^2


class SpringLaw:
    def __init__(self, springs):
        law = springs["law"]
        self.at, self.ends = np.array(springs["at_mm"]), np.array(law["upper_ends_mm"])
        self.weight, self.mass_at = np.array(law["weight_n"]), np.array(law["center_of_mass_mm"])
        d, n = law["wire_diameter_mm"], law["active_coils"]
        D, self.free = law["outer_diameter_mm"] - d, law["free_length_mm"]
        G, E = law["shear_modulus_mpa"], law["elastic_modulus_mpa"]
        self.k, self.twist = G * d ** 4 / (8 * D ** 3 * n), E * d ** 4 / (64 * D * n)
        bending = E * np.pi * d ** 4 / 64
        self.bend = bending / (n * np.pi * D / 2 * (1 + E / (2 * G)))
        self.shear = bending / (n * np.pi * (D / 2) ** 3)
        self.magnets = self.pull_energy(law.get("magnets"))
        share = -self.weight[2] / len(self.ends)
        self.rest = brentq(lambda c: self.k * c - self.magnets(self.free - c, 1) - share, -0.5 * self.free, 0.9 * self.free)

    def pull_energy(self, magnets):
        """Integral of the attraction over the gap (D. Vokoun et al., J. Magn. Magn. Mater. 321 (2009) 3758)."""
        if magnets is None:
            return lambda gap, order=0: 0.0 * gap
        R, t = magnets["diameter_mm"] / 2, magnets["thickness_mm"]
        scale = (1 if magnets["attract"] else -1) * np.pi * magnets["remanence_t"] ** 2 * R * R / MU_0

        def attraction(gap):
            part = lambda a: quad(lambda q: j1(q) ** 2 * np.exp(-q * a) / q, 0, np.inf, limit=400, epsabs=1e-12)[0]
            return scale * sum(w * part((gap + s * t) / R) for w, s in ((1, 0), (-2, 1), (1, 2)))

        gaps = np.linspace(0.3 * self.free, 1.2 * self.free, 80)
        pull = make_interp_spline(gaps, [attraction(g) for g in gaps], k=7)
        energy = pull.antiderivative()
        return lambda gap, order=0: energy(gap, order)

    def column(self, c):
        """dH/dy, dH/dpsi = dM/dy and dM/dpsi of the upper end."""
        L, P = self.free - c, self.k * c
        s = 1 + P / (L * self.shear)
        root = np.sqrt(complex(P * L / self.bend * s))
        c0, c1 = np.cos(root).real, np.sinc(root / np.pi).real
        c2 = (0.5 * np.sinc(root / (2 * np.pi)) ** 2).real
        c3 = ((1 - np.sinc(root / np.pi)) / root ** 2).real if abs(root) > 1e-2 else 1 / 6 - (root ** 2).real / 120
        B = L * self.bend
        alpha, beta, gamma = 1 / self.shear - s * s * c3 * L ** 3 / B, s * c2 * L * L / B, c1 * L / B
        det = alpha * gamma + beta * beta
        return gamma / det, -beta / det, (c0 * alpha + s * c1 * L * beta) / det

    def energy(self, turn, shift):
        """Of a rotation and the shift of the point at `at_mm`."""
        r = cv2.Rodrigues(turn)[0][:, 0]
        lean = np.array([r[1], -r[0]])
        total = 0.0
        for arm in self.ends - self.at:
            moved = turn @ arm + shift - arm
            c, side = self.rest - moved[2], moved[:2]
            shear, coupling, tilt = self.column(c)
            total += 0.5 * self.k * c * c + self.magnets(self.free - c) + 0.5 * self.twist * r[2] ** 2
            total += 0.5 * shear * side @ side + coupling * side @ lean + 0.5 * tilt * lean @ lean
        return total - self.weight @ (turn @ (self.mass_at - self.at) + shift)

    def wrench(self, d, step=1e-3):
        """N and N*mm about `at_mm` for (tx, ty, tz, rx, ry, rz)."""
        turn, shift = cv2.Rodrigues(np.array(d[3:], float))[0], np.array(d[:3], float)

        def slope(axis):
            e = np.zeros(6)
            e[axis] = step
            # A small turn about `at_mm` takes the platform's shifted point along.
            side = [self.energy((R := cv2.Rodrigues(s * e[3:])[0]) @ turn, R @ shift + s * e[:3]) for s in (1, -1, 2, -2)]
            return (8 * (side[0] - side[1]) - (side[2] - side[3])) / (12 * step)

        load = np.array([slope(axis) for axis in range(6)])
        return load - self.at_rest() if np.any(d) else load

    def at_rest(self):
        if not hasattr(self, "rest_load"):
            self.rest_load = self.wrench(np.zeros(6))
        return self.rest_load

    def stiffness(self, compression=0.0, step=1e-3):
        """The tangent at a compression; the column of tz is the secant there."""
        down = np.array([0, 0, -compression, 0, 0, 0], float)
        K = np.stack([(self.wrench(down + step * e) - self.wrench(down - step * e)) / (2 * step) for e in np.eye(6)], axis=1)
        if compression:
            K[:, 2] = self.wrench(down) / -compression
        return K
