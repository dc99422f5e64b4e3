"""How well the outline of a touch can be known from slopes, by numpy alone: what bounds the contact mask of `track --shape`.

    python3 scripts/contact_outlines.py

Contacts on an elastic half-space whose surface is bent as thumb24's dome is are solved on a grid of a third of a pixel (Polonsky and
Keer, Wear 231, 1999; Love's displacements), far finer than the simulator's elements. A camera's cells of 2 x 2 pixels see the slopes' means
with noise; heights are what these add up to. Then the rule of `src/runtime/shape/contact.rs` is applied, and the level of the
pressure that would have been best. Printed: touched pixels that mask and truth share, over those that either has.
"""
import cv2
import numpy as np
from scipy.fft import dctn, idctn
from scipy.ndimage import map_coordinates

PIXEL_MM, CELL, FINE, SIDE, DOME_MM = 0.0735, 6, 512, 128, 10.0
STEP_MM = PIXEL_MM / 3
at = (np.arange(FINE) - FINE / 2 + 0.31) * STEP_MM
X, Y = np.meshgrid(at, at)
DOME = (X**2 + Y**2) / (2 * DOME_MM)


def kernel():
    """Displacement by a unit pressure over the plane-strain modulus on a square of the grid."""
    i = np.arange(-FINE, FINE) * STEP_MM
    x, y, a = *np.meshgrid(i, i), STEP_MM / 2
    part = lambda x, y: x * np.arcsinh(y / np.maximum(abs(x), 1e-300)) + y * np.arcsinh(x / np.maximum(abs(y), 1e-300))
    return (part(x + a, y + a) - part(x - a, y + a) - part(x + a, y - a) + part(x - a, y - a)) / np.pi


KERNEL = np.fft.rfft2(np.fft.ifftshift(kernel()))


def moved(pressure):
    wide = np.zeros((2 * FINE, 2 * FINE))
    wide[:FINE, :FINE] = pressure
    return np.fft.irfft2(np.fft.rfft2(wide) * KERNEL)[:FINE, :FINE]


def touch(gap):
    """Pressure and depth where a rigid object overlaps the surface by `-gap`."""
    p, way, before, keep = np.where(gap < 0, 0.3, 0.0), np.zeros_like(gap), 1.0, 0.0
    for turn in range(300):
        left = moved(p) + gap
        is_in = p > 0
        size = (left[is_in] ** 2).sum()
        way = np.where(is_in, left + keep * size / before * way, 0)
        before, by = size, moved(way)
        step = (left[is_in] * way[is_in]).sum() / (by[is_in] * way[is_in]).sum()
        p = np.maximum(np.where(is_in, p - step * way, p), 0)
        enters = (p == 0) & (left < 0)
        keep = 0.0 if enters.any() else 1.0
        p = np.where(enters, p - step * left, p)
        if turn > 20 and np.sqrt(size / is_in.sum()) < 2e-6 and not enters.any():
            break
    return p, moved(p)


def heights(depth, noise_rad, seed):
    """What cells see: mean slopes with noise, added up, held to the truth at the border."""
    n = FINE // CELL
    box = lambda a: a[: n * CELL, : n * CELL].reshape(n, CELL, n, CELL).mean((1, 3))
    random = np.random.default_rng(seed)
    down, across = (box(g) + noise_rad * random.standard_normal((n, n)) for g in np.gradient(depth, STEP_MM))
    step, div = CELL * STEP_MM, np.zeros((n, n))
    right, below = 0.5 * step * (across[:, 1:] + across[:, :-1]), 0.5 * step * (down[1:] + down[:-1])
    div[:, :-1] += right
    div[:, 1:] -= right
    div[:-1] += below
    div[1:] -= below
    wave = 2 - 2 * np.cos(np.pi * np.arange(n) / n)
    own = wave[:, None] + wave
    own[0, 0] = 1
    found = -dctn(div, norm="ortho") / own
    found[0, 0] = 0
    found, true = idctn(found, norm="ortho"), box(depth)
    border = np.ones((n, n), bool)
    border[2:-2, 2:-2] = False
    return found + (true - found)[border].mean()


def masks(depth_cells):
    """The rule's mask and its level, and a mask for any level, on pixels."""
    cell_mm, n = CELL * STEP_MM, len(depth_cells)
    place = (np.arange(n) * CELL + (CELL - 1) / 2 - FINE / 2 + 0.31) * STEP_MM
    x, y = np.meshgrid(place, place)
    pressed = depth_cells > 0.2 * depth_cells.max()
    center = np.array([x[pressed].mean(), y[pressed].mean()])
    reach = max(1.8 * np.hypot(x - center[0], y - center[1])[pressed].max(), 16 * cell_mm)
    step = 2 * reach / SIDE
    chart = (np.arange(SIDE) - SIDE / 2) * step
    of_cell = lambda v: (v / STEP_MM + FINE / 2 - 0.31 - (CELL - 1) / 2) / CELL
    rows, columns = np.meshgrid(of_cell(chart + center[1]), of_cell(chart + center[0]), indexing="ij")
    depth = map_coordinates(depth_cells, [rows, columns], order=1, mode="nearest")
    edge = np.minimum(np.arange(SIDE), SIDE - 1 - np.arange(SIDE)) / (0.15 * SIDE)
    fade = np.where(edge < 1, 0.5 - 0.5 * np.cos(np.pi * np.minimum(edge, 1)), 1)
    wave = np.hypot(*np.meshgrid(*[np.fft.fftfreq(SIDE) * 2 * np.pi] * 2))
    response = wave / step * np.exp(-0.5 * (1.2 * wave) ** 2)
    pressure = np.real(np.fft.ifft2(np.fft.fft2(depth * fade * fade[:, None]) * response))
    largest = pressure.max()
    radius = np.sqrt((pressure > 0.15 * largest).sum() * step**2 / np.pi)
    smooth = np.hypot(1.2 * step, 0.5 * cell_mm)
    level = np.clip(0.411 * np.sqrt(2 * smooth / max(radius, smooth)), 0.08, 0.3)
    pixels = at[1::3]
    rows, columns = np.meshgrid((pixels - center[1]) / step + SIDE / 2, (pixels - center[0]) / step + SIDE / 2, indexing="ij")
    on_pixels = map_coordinates(pressure, [rows, columns], order=1) / largest
    return level, lambda level: on_pixels > level


def objects():
    turned = np.radians(20)
    across = np.cos(turned) * Y - np.sin(turned) * X
    hexagon = np.max([np.abs(np.cos(a) * X + np.sin(a) * Y) for a in np.radians([10, 70, 130])], axis=0) - 2.6
    letter = np.zeros((FINE, FINE), np.uint8)
    cv2.putText(letter, "R", (FINE // 2 - 85, FINE // 2 + 85), cv2.FONT_HERSHEY_SIMPLEX, 8, 255, 28)
    beside = cv2.distanceTransform(255 - letter, cv2.DIST_L2, 5) * STEP_MM
    ball = lambda radius: (X**2 + Y**2) / (2 * radius)
    yield "ball, 5 mm", ball(5) + DOME - 0.5
    yield "ball, 3 mm", ball(3) + DOME - 0.35
    yield "ball, 2 mm", ball(2) + DOME - 0.25
    yield "edge of a block", np.abs(across) + DOME - 0.3
    yield "nut", np.maximum(np.maximum(hexagon, 0), np.maximum(1.5 - np.hypot(X, Y), 0)) + DOME - 0.35
    yield "letter R, strokes of 0.7 mm", np.minimum(2 * beside, 3) + DOME - 0.45


def main():
    for name, gap in objects():
        pressure, depth = touch(gap)
        true = pressure[1::3, 1::3] > 0
        shared = lambda mask: (mask & true).sum() / (mask | true).sum()
        shown = []
        for noise_deg in (0.0, 0.4, 1.0):
            own, best = [], []
            for seed in range(3 if noise_deg else 1):
                level, mask = masks(heights(depth, np.radians(noise_deg), seed))
                own.append(shared(mask(level)))
                best.append(max(shared(mask(other)) for other in np.linspace(0.02, 0.5, 49)))
            shown.append(f"{np.mean(own):.3f} (best level {np.mean(best):.3f})")
            # The rule knows the edge of a ball's touch.
            assert not name.startswith("ball") or np.mean(own) > 0.95, (name, noise_deg, own)
        print(f"{name:<28} {true.sum():>5} px; slopes off by 0, 0.4, 1 degree: {'; '.join(shown)}", flush=True)


if __name__ == "__main__":
    main()
