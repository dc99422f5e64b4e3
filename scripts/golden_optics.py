#!/usr/bin/env python3
"""Golden values for lenses and refraction, in 50 digit arithmetic.

    scripts/golden_optics.py            # writes tests/cases/golden-optics/<name>.json for every case
    scripts/golden_optics.py --check    # compares with the files instead

A file in tests/cases/lenses is a case of its own. Needs mpmath only. Everything here is written from the formulas alone (OpenCV's
lens models, Snell's law, a sphere); nothing is shared with the crate. Inputs are
the exact doubles that the crate gets; outputs are printed with 34 digits, beside
the error that is allowed: the larger of the fixed bound and 8 ulp of the input
times the condition number, which is found by differencing in the same arithmetic.
"""

import json
import re
import sys
from pathlib import Path

from mpmath import mp, mpf, matrix, sqrt, sin, cos, tan, atan, atan2, pi, findroot, radians, fabs

mp.dps = 50
DIGITS = 34
ULP = mpf(2) ** -52
ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "tests" / "cases" / "golden-optics"


def exact(x):
    """The double nearest to x, exactly."""
    return mpf(float(x))


def show(x):
    return mp.nstr(x, DIGITS, strip_zeros=False)


class Lens:
    def __init__(self, spec):
        self.model = spec["model"]
        self.k = [exact(v) for v in spec["distortion"]]
        m = spec["matrix"]
        self.fx, self.fy, self.cx, self.cy = exact(m[0][0]), exact(m[1][1]), exact(m[0][2]), exact(m[1][2])
        self.half = exact(float(spec["field_of_view_deg"]) / 2) * pi / 180
        self.shift = [exact(v) for v in spec.get("pupil_shift_mm", [])]
        self.end, self.limit = self.domain()

    def radial(self, a):
        """Image radius over the focal length: of tan(theta), or of theta."""
        u = a * a
        if self.model == "kannala_brandt":
            k1, k2, k3, k4 = self.k
            return a * (1 + u * (k1 + u * (k2 + u * (k3 + u * k4))))
        k1, k2, _, _, k3, k4, k5, k6 = (self.k + [mpf(0)] * 8)[:8]
        return a * (1 + u * (k1 + u * (k2 + u * k3))) / (1 + u * (k4 + u * (k5 + u * k6)))

    def smallest_eigenvalue(self, r):
        """Of the Jacobian, over all azimuths: scanned, then refined."""
        h = mpf(10) ** -20
        rise = (self.radial(r + h) - self.radial(r - h)) / (2 * h)
        level = self.radial(r) / r
        q = sqrt(self.k[2] ** 2 + self.k[3] ** 2)
        worst = None
        for i in range(0, 65):
            c = cos(pi * i / 64)
            a, b, d = rise + 6 * q * c * r, level + 2 * q * c * r, 2 * q * sqrt(1 - c * c) * r
            value = (a + b) / 2 - sqrt(((a - b) / 2) ** 2 + d * d)
            worst = value if worst is None else min(worst, value)
        return worst

    def domain(self):
        if self.model == "pinhole":
            return self.half, "beyond_field_of_view"
        if self.model == "kannala_brandt":
            h = mpf(10) ** -20
            grows = lambda a: (self.radial(a + h) - self.radial(a - h)) / (2 * h)
            angle_of, last = (lambda a: a), self.half
        else:
            grows = self.smallest_eigenvalue
            angle_of, last = atan, tan(min(self.half, pi / 2 - mpf(10) ** -6))
        # March out, then bisect the first change of sign.
        steps = 400
        low = last / steps / 1000
        for i in range(1, steps + 1):
            high = last * i / steps
            if grows(high) <= 0:
                for _ in range(110):
                    middle = (low + high) / 2
                    low, high = (middle, high) if grows(middle) > 0 else (low, middle)
                return angle_of(low), "beyond_fold"
            low = high
        return self.half, "beyond_field_of_view"

    def pixel(self, ray):
        x, y, z = ray
        across = sqrt(x * x + y * y)
        if self.model == "kannala_brandt":
            theta = atan2(across, z)
            scale = self.radial(theta) / across if across > 0 else 1 / z
            a, b = x * scale, y * scale
        else:
            x, y = x / z, y / z
            u = x * x + y * y
            if self.model == "pinhole":
                a, b = x, y
            else:
                k1, k2, p1, p2, k3, k4, k5, k6 = (self.k + [mpf(0)] * 8)[:8]
                f = (1 + u * (k1 + u * (k2 + u * k3))) / (1 + u * (k4 + u * (k5 + u * k6)))
                a = x * f + 2 * p1 * x * y + p2 * (u + 2 * x * x)
                b = y * f + p1 * (u + 2 * y * y) + 2 * p2 * x * y
        return a * self.fx + self.cx, b * self.fy + self.cy

    def ray(self, pixel, near):
        """The ray of a pixel, by Newton's method from a ray that is nearly it."""
        if self.model == "kannala_brandt":
            a, b = (pixel[0] - self.cx) / self.fx, (pixel[1] - self.cy) / self.fy
            rho = sqrt(a * a + b * b)
            if rho == 0:
                return mpf(0), mpf(0), mpf(1)
            start = atan2(sqrt(near[0] ** 2 + near[1] ** 2), near[2])
            theta = findroot(lambda t: self.radial(t) - rho, start, tol=mpf(10) ** -90)
            return sin(theta) * a / rho, sin(theta) * b / rho, cos(theta)
        x = matrix([near[0] / near[2], near[1] / near[2]])
        h = mpf(10) ** -25
        for _ in range(60):
            at = lambda p, q: matrix(self.pixel((p, q, mpf(1))))
            error = at(x[0], x[1]) - matrix(pixel)
            jx = (at(x[0] + h, x[1]) - at(x[0] - h, x[1])) / (2 * h)
            jy = (at(x[0], x[1] + h) - at(x[0], x[1] - h)) / (2 * h)
            det = jx[0] * jy[1] - jx[1] * jy[0]
            step = matrix([jy[1] * error[0] - jy[0] * error[1], jx[0] * error[1] - jx[1] * error[0]]) / det
            x -= step
            if fabs(step[0]) + fabs(step[1]) < mpf(10) ** -44 * (1 + fabs(x[0]) + fabs(x[1])):
                break
        else:
            raise RuntimeError("no ray")
        w = sqrt(1 + x[0] ** 2 + x[1] ** 2)
        return x[0] / w, x[1] / w, 1 / w

    def pupil(self, theta):
        return sum(c * theta ** (2 * i + 2) for i, c in enumerate(self.shift))


def angle(ray):
    return atan2(sqrt(ray[0] ** 2 + ray[1] ** 2), ray[2])


class Sensor:
    def __init__(self, case):
        self.lens = Lens(case["lens"])
        self.radius = exact(case["dome_radius_mm"])
        self.layers = [(exact(l["index"]), exact(l.get("thickness_mm") or 0)) for l in case["layers"]]
        self.sheet, self.fill = self.layers[:-1], self.layers[-1][0]
        self.bottom = -sum(d for _, d in self.sheet)
        rows = case["sensor_from_camera"]
        self.rot = matrix([[exact(v) for v in row[:3]] for row in rows[:3]])
        self.pos = matrix([exact(row[3]) for row in rows[:3]])
        # The matrix is written in doubles; its nearest rotation is meant.
        for _ in range(8):
            self.rot = (self.rot + (self.rot ** -1).T) / 2

    def start(self, ray):
        axis = self.rot[:, 2]
        return self.pos + axis * self.lens.pupil(angle(ray))

    def top(self, ray):
        """Where a camera ray leaves the sheet's top, and its direction there."""
        d, o = self.rot * matrix(ray), self.start(ray)
        if d[2] <= 0:
            return None
        gap = self.bottom - o[2]
        p = matrix([d[0], d[1]])
        across = gap / d[2]
        for n, thick in self.sheet:
            across += thick / sqrt(n * n - d[0] ** 2 - d[1] ** 2) if thick else 0
        base = matrix([o[0], o[1]]) + p * across
        up = sqrt(self.fill ** 2 - d[0] ** 2 - d[1] ** 2) / self.fill
        return base, p / self.fill, up

    def surface(self, ray):
        met = self.top(ray)
        if met is None:
            return "misses_dome"
        base, side, up = met
        c = self.radius ** 2 - base[0] ** 2 - base[1] ** 2
        if c < 0:
            return "misses_dome"
        b = base[0] * side[0] + base[1] * side[1]
        s = -b + sqrt(b * b + c)
        return base[0] + side[0] * s, base[1] + side[1] * s, up * s

    def direction(self, point, pupil):
        """Sensor-frame direction in air of the ray from the pupil to a point."""
        x, y, z = point
        parts = [(mpf(1), min(self.bottom, z) - pupil[2])] + [(n, d) for n, d in self.sheet] + [(self.fill, max(z, 0))]
        parts = [(n, d) for n, d in parts if d > 0]
        h = matrix([x - pupil[0], y - pupil[1]])
        reach = sqrt(h[0] ** 2 + h[1] ** 2)
        if reach == 0:
            return matrix([0, 0, 1])
        n0 = min(n for n, _ in parts)
        total = lambda t: sum(d * n0 * t / sqrt(n * n + (n * n - n0 * n0) * t * t) for n, d in parts)
        high = mpf(1)
        while total(high) < reach:
            high *= 4
        low = mpf(0)
        for _ in range(60):
            middle = (low + high) / 2
            low, high = (middle, high) if total(middle) < reach else (low, middle)
        t = findroot(lambda t: total(t) - reach, (low + high) / 2, tol=mpf(10) ** -80)
        sine = n0 * t / sqrt(1 + t * t)
        if sine >= 1:
            return "total_internal_reflection"
        return matrix([h[0] / reach * sine, h[1] / reach * sine, sqrt(1 - sine * sine)])

    def chief(self, point):
        if self.lens.shift:
            axis = self.rot[:, 2]

            def miss(s):
                d = self.direction(point, self.pos + axis * s)
                return self.lens.pupil(angle(self.rot.T * d)) - s
            s = findroot(miss, (mpf(0), mpf("0.01")), solver="secant", tol=mpf(10) ** -80)
            pupil = self.pos + axis * s
        else:
            pupil = self.pos
        d = self.direction(point, pupil)
        return d if isinstance(d, str) else tuple(self.rot.T * d)

    def project(self, point):
        ray = self.chief(point)
        if isinstance(ray, str):
            return ray, None
        if angle(ray) > self.lens.end:
            return self.lens.limit, None
        return self.lens.pixel(ray), ray


def length(v):
    return sqrt(sum(x * x for x in v))


def allowed(f, at, floor):
    """The larger of the floor and 8 ulp of each input times the slope."""
    total = mpf(0)
    for j, value in enumerate(at):
        if value == 0:
            continue
        h = fabs(value) * mpf(10) ** -15
        moved = [list(at), list(at)]
        moved[0][j] -= h
        moved[1][j] += h
        low, high = f(moved[0]), f(moved[1])
        total += length([b - a for a, b in zip(low, high)]) / (2 * h) * fabs(value) * ULP * 8
    return max(floor, total)


def checks(case):
    sensor = Sensor(case)
    lens = sensor.lens
    traces, projects = [], []
    rays = [(lens.end * mpf(f), radians(mpf(a))) for f, a in case.get("rays", [])]
    for theta, phi in rays:
        near = (sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta))
        pixel = [exact(v) for v in lens.pixel(near)]
        add_trace(sensor, pixel, near, traces, projects)
    for du, dv in case.get("beside_axis_px", []):
        pixel = [exact(lens.cx + mpf(du)), exact(lens.cy + mpf(dv))]
        near = ((pixel[0] - lens.cx) / lens.fx, (pixel[1] - lens.cy) / lens.fy, mpf(1))
        add_trace(sensor, pixel, near, traces, projects)
    for fraction in case.get("beyond", []):
        # Radially past the image of the domain: larger than any image radius.
        pixel = [exact(lens.cx + lens.fx * mpf(fraction)), exact(lens.cy)]
        traces.append({"pixel": [float(v) for v in pixel], "status": lens.limit})
    for point in case.get("points_mm", []):
        add_project(sensor, [exact(v) for v in point], projects)
    return {"max_field_angle_rad": show(lens.end), "limit": lens.limit, "trace": traces, "project": projects}


def add_trace(sensor, pixel, near, traces, projects):
    lens = sensor.lens
    ray = lens.ray(pixel, near)
    entry = {"pixel": [float(v) for v in pixel], "ray": [show(v) for v in ray]}
    entry["allowed_rad"] = float(allowed(lambda p: lens.ray(p, ray), pixel, mpf("1e-10")))
    hit = sensor.surface(ray)
    if isinstance(hit, str):
        entry["status"] = hit
    else:
        entry["status"] = "ok"
        entry["surface_mm"] = [show(v) for v in hit]
        floor = mpf("1e-10") * sensor.radius
        entry["allowed_mm"] = float(allowed(lambda p: surface_or_fail(sensor, lens.ray(p, ray)), pixel, floor))
        entry["field_angle_rad"] = show(angle(ray))
        add_project(sensor, [exact(v) for v in hit], projects)
    traces.append(entry)


def surface_or_fail(sensor, ray):
    hit = sensor.surface(ray)
    # At the rim a neighbour may leave the dome; the distance is then no slope.
    return (mpf(0),) * 3 if isinstance(hit, str) else hit


def add_project(sensor, point, projects):
    pixel, ray = sensor.project(point)
    entry = {"point_mm": [float(v) for v in point]}
    if isinstance(pixel, str):
        entry["status"] = pixel
    else:
        entry["status"] = "ok"
        entry["image_px"] = [show(v) for v in pixel]
        move = lambda p: sensor.lens.pixel(sensor.chief(p))
        entry["allowed_px"] = float(allowed(move, point, mpf("1e-9")))
    projects.append(entry)


def pose(rx=0.0, ry=0.0, rz=0.0, at=(0.0, 0.0, -10.0)):
    a, b, c = (radians(mpf(v)) for v in (rx, ry, rz))
    x = matrix([[1, 0, 0], [0, cos(a), -sin(a)], [0, sin(a), cos(a)]])
    y = matrix([[cos(b), 0, sin(b)], [0, 1, 0], [-sin(b), 0, cos(b)]])
    z = matrix([[cos(c), -sin(c), 0], [sin(c), cos(c), 0], [0, 0, 1]])
    r = z * y * x
    return [[float(r[i, j]) for j in range(3)] + [float(at[i])] for i in range(3)] + [[0.0, 0.0, 0.0, 1.0]]


def stack(*layers):
    return [{"index": n, "thickness_mm": d} for n, d in layers]


THUMB = stack((1.491, 1.0), (1.41, None))
FAN = [("0", "0"), ("0.05", "17"), ("0.2", "100"), ("0.4", "190"), ("0.55", "280"), ("0.7", "333")]
EDGE = [("0.9", "45"), ("0.99", "135"), ("0.999", "225"), ("0.999999", "315")]
RIM = [[10.0, 0.0, 0.0], [0.0, -10.0, 0.0], [6.0, 8.0, 0.0]]


def near_rim(radius, *heights):
    return [[float(sqrt(radius ** 2 - mpf(h) ** 2)), 0.0, float(h)] for h in heights]


def cases():
    files = sorted((ROOT / "tests" / "cases" / "lenses").glob("*.json"))
    lenses = {path.stem: json.loads(path.read_text()) for path in files}
    thumb, t265, tum = lenses["thumb24"], lenses["t265"], lenses["tum-vi"]
    plain = {"model": "kannala_brandt", "matrix": [[229.18, 0, 319.5], [0, 229.18, 239.5], [0, 0, 1]],
             "distortion": [0, 0, 0, 0], "field_of_view_deg": 178, "width": 640, "height": 480}
    pinhole = dict(plain, model="pinhole", distortion=[], field_of_view_deg=160)

    def case(name, why, lens, layers=THUMB, at=None, radius=10.0, **inputs):
        keys = ("model", "width", "height", "matrix", "distortion", "field_of_view_deg", "pupil_shift_mm")
        lens = {k: lens[k] for k in keys if k in lens}
        return dict(name=name, why=why, lens=lens, layers=layers, sensor_from_camera=at or pose(),
                    dome_radius_mm=radius, **inputs)

    for lens in lenses.values():
        yield case("published " + lens["name"], lens["source"], lens, rays=FAN + EDGE, radius=30.0,
                   beside_axis_px=[("1e-12", "0"), ("0", "-1e-12"), ("1e-9", "1e-9")])
    yield case("pinhole", "the paper's literal model: every index 1", pinhole, stack((1.0, 1.0), (1.0, None)),
               rays=FAN, points_mm=RIM + [[0.0, 0.0, 10.0], [7.5, 7.5, 0.0], [1.0, -2.0, 3.0]])
    yield case("thumb24 points", "white markers beside the dome, points inside it, the rim",
               thumb, points_mm=RIM + near_rim(10, "1e-12", "1e-6", "1e-3") + [
                   [7.5, 7.5, 0.0], [-7.5, 7.5, 0.0], [0.0, 0.0, 0.0], [1.0, 2.0, 3.0], [40.0, 0.0, 0.0]])
    yield case("fold inside the image", "k1 alone folds at 42.4 degrees", dict(thumb, distortion=[-0.4, 0, 0, 0, 0]),
               rays=FAN + EDGE, beyond=["0.62", "1", "10"])
    yield case("fisheye fold", "Kannala-Brandt folds too: 1 - 0.3 theta^2",
               dict(plain, distortion=[-0.1, 0, 0, 0], field_of_view_deg=240), rays=FAN, beyond=["1.3", "5"])
    yield case("overfit", "a huge k3 against a huge k2, folding at 31 degrees",
               dict(thumb, distortion=[0.5, -40, 0.0005, -0.0003, 90]), rays=FAN + EDGE)
    yield case("strong tangential", "decentring of 1 percent",
               dict(thumb, distortion=[-0.2, 0.05, 0.01, -0.012, -0.004]), rays=FAN + EDGE)
    yield case("grazing", "rays within 0.001 degree of the sheet, a micron of air", plain,
               at=pose(at=(0, 0, -1.001)), rays=[("0.9", "10"), ("0.99", "20"), ("0.9999", "30"), ("0.999999", "40")],
               points_mm=[[0.9, 0.0, 0.0], [0.0, 1.2, 0.0], [3.0, 4.0, 75 ** 0.5]])
    yield case("micron of air", "the air hardly counts", thumb, at=pose(at=(0, 0, -1.001)), rays=FAN + EDGE)
    yield case("pupil touches the sheet", "no air at all; past the critical angle nothing gets out", thumb,
               at=pose(at=(0, 0, -1)), rays=FAN,
               points_mm=[[0.5, 0.0, 0.0], [0.0, -0.8, 0.0], [5.0, 0.0, 0.0], [0.2, 0.1, 4.0]])
    yield case("zero and equal layers", "layers of no thickness, of one index, of air inside, in any order", t265,
               stack((1.491, 0.0), (1.7, 0.3), (1.7, 0.2), (1.0, 0.1), (1.33, 0.0), (1.41, 0.4), (1.41, None)),
               rays=FAN, points_mm=RIM)
    yield case("falling indices", "the sheet densest, then thinner", t265,
               stack((2.4, 0.5), (1.9, 0.5), (1.5, 0.5), (1.2, None)), rays=FAN)
    yield case("tilted and off axis", "camera out of true by degrees and millimetres", thumb,
               at=pose(8, -5, 30, (0.7, -0.4, -9.3)), rays=FAN, points_mm=RIM)
    yield case("tangent at the rim", "a pupil beside the dome: rays graze the dome near its rim", plain,
               at=pose(0, 0, 0, (9.5, -4.0, -5.0)),
               points_mm=RIM + near_rim(10, "1e-9", "1e-6", "1e-3") + [[9.9, -1.4106735979665885, 0.0]])
    yield case("moving pupil", "0.2 mm at 45 degrees", dict(t265, pupil_shift_mm=[0.32, 0.01]), rays=FAN,
               points_mm=RIM + [[7.5, 7.5, 0.0], [1.0, 2.0, 3.0]])
    yield case("moving pupil, tilted", "backwards, with a tilted camera", dict(thumb, pupil_shift_mm=[-0.5, 0.1]),
               at=pose(5, 3, 0, (0.2, 0.1, -9.0)), rays=FAN, points_mm=[[3.0, 4.0, 75 ** 0.5]])
    yield case("past 90 degrees", "a 195 degree lens tilted until it looks along the sheet", tum,
               at=pose(40, 0, 0, (0, 3, -4)), rays=FAN)
    yield case("1 mm dome", "tiny", thumb, stack((1.491, 0.1), (1.41, None)), pose(at=(0, 0, -1.0)), 1.0,
               rays=FAN, points_mm=[[1.0, 0.0, 0.0]])
    yield case("1 m dome", "large", thumb, stack((1.491, 100.0), (1.41, None)), pose(at=(0, 0, -1000.0)), 1000.0,
               rays=FAN, points_mm=[[1000.0, 0.0, 0.0]])


def main():
    check = sys.argv[1:] == ["--check"]
    if sys.argv[1:] and not check:
        sys.exit("usage: scripts/golden_optics.py [--check]")
    wrong = []
    for case in cases():
        print(case["name"], file=sys.stderr)
        inputs = {k: v for k, v in case.items() if k not in ("rays", "beside_axis_px", "beyond", "points_mm")}
        text = json.dumps(dict(inputs, **checks(case)), indent=1) + "\n"
        path = FOLDER / (re.sub("[^a-z0-9]+", "-", case["name"]) + ".json")
        if not check:
            path.write_text(text)
        elif not path.exists() or path.read_text() != text:
            wrong.append(path.name)
    if wrong:
        sys.exit("not as computed: " + ", ".join(wrong))


if __name__ == "__main__":
    main()
