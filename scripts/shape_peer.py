"""The usual way from colours to heights, as a peer of `track --shape`: a table from presses of a ball, then Poisson's equation.

    python3 scripts/shape_peer.py DOMECAST [--design NAME] [--keep FOLDER]

As gs_sdk and GelSight's own software do it: the change of B, G, R and the place in the image give the height's slopes, learned from
twelve presses of a ball of known radius and place; a discrete sine transform makes heights of them. Two tables are made. `ball` knows
what a maker knows, the ball's own surface where it touches and nothing around it; its error must be five times that of
`track --shape` on the same camera frames (noise of 2 levels, JPEG 90) in the geometric mean over the presses, twice at least. `all` is told the true height of the whole skin, which
nobody has, and shows what such tables could come to. Both have the nearest of all pixels rather than bins.
"""
import argparse
import json
import pathlib
import sys
import tempfile

import cv2
import numpy as np
from scipy.fft import dstn, idstn
from scipy.spatial import cKDTree

import check_shape
import shape_frames as judge

# Presses of the ball: radius, depth (mm), polar angle and azimuth (degrees).
BALLS = [(3, 0.3 + 0.05 * (k % 5), polar, 137.5 * k) for k, polar in enumerate([0, 8, 15, 20, 25, 30, 33, 37, 40, 44, 48, 52])]
# Smoothing of the change of colours, px; levels of 255 and pixels that count as equally far; how many of the nearest are averaged.
SMOOTHING_PX = 2.5
LEVELS, PIXELS = 0.5, 15.0
NEAREST = 32
# Width over which slopes are filled in at dots and markers, px.
FILL_PX = 4.0


def smooth(change, masked):
    """A change of colours without the pixels of dots and markers, smoothed."""
    share = cv2.GaussianBlur((~masked).astype(np.float32), (0, 0), SMOOTHING_PX)
    summed = cv2.GaussianBlur((change * ~masked[..., None]).astype(np.float32), (0, 0), SMOOTHING_PX)
    return summed / np.maximum(share, 1e-3)[..., None]


def heights(truth, dome):
    surface = np.load(truth / "frame_0000.surface.npy").astype(float)
    return np.linalg.norm(surface - [0, 0, dome["center_z"]], axis=2) - dome["radius"]


def inside(height):
    """Where the dome is seen, but for its outline."""
    return cv2.erode(np.isfinite(height).astype(np.uint8), np.ones((9, 9), np.uint8)) > 0


def covered(*pictures):
    """Pixels at dots and markers of any of these pictures: those that differ from the middle of their surroundings, and the next."""
    mask = 0
    for picture in pictures:
        codes = np.clip(np.rint(cv2.GaussianBlur(picture, (0, 0), 0.8)), 0, 255).astype(np.uint8)
        around = cv2.medianBlur(codes, 31).astype(float)
        share = codes.sum(axis=2) / np.maximum(around.sum(axis=2), 1)
        mask |= ((share < 0.85) | (share > 1.25)).astype(np.uint8)
    return cv2.dilate(mask, np.ones((3, 3), np.uint8)) > 0


class Table:
    """Colours and places to the slopes of the height over the image."""

    def __init__(self, rest, knows_all):
        self.knows_all = knows_all
        self.rest, self.keys, self.slopes = rest, [], []

    def learn(self, frame, truth, dome):
        height = heights(truth, dome)
        down, right = np.gradient(np.nan_to_num(height))
        if not self.knows_all:
            touched = np.load(truth / "frame_0000.pressure.npy") > 0
            down, right = down * touched, right * touched
        masked = covered(self.rest, frame)
        known = inside(height) & ~masked
        # every second pixel, touched or not: a table of touched ones alone sees touch everywhere
        v, u = np.nonzero(known & (np.random.default_rng(0).random(height.shape) < 0.5))
        self.keys.append(self.key(frame, masked, u, v))
        self.slopes.append(np.stack([right[v, u], down[v, u]], axis=1))

    def key(self, frame, masked, u, v):
        change = smooth(frame - self.rest, masked)[v, u] / LEVELS
        return np.column_stack([change, u / PIXELS, v / PIXELS])

    def finish(self):
        self.tree = cKDTree(np.concatenate(self.keys))
        self.slopes = np.concatenate(self.slopes)

    def read(self, frame, truth, dome):
        """Height over the image, mm."""
        seen = inside(heights(truth, dome))
        masked = covered(self.rest, frame)
        v, u = np.nonzero(seen & ~masked)
        _, near = self.tree.query(self.key(frame, masked, u, v), k=NEAREST, workers=2)
        right, down = np.zeros(seen.shape), np.zeros(seen.shape)
        right[v, u], down[v, u] = self.slopes[near].mean(axis=1).T
        known = np.zeros(seen.shape)
        known[v, u] = 1
        share = np.maximum(cv2.GaussianBlur(known, (0, 0), FILL_PX), 1e-6)
        for slopes in (right, down):
            around = cv2.GaussianBlur(slopes, (0, 0), FILL_PX) / share
            slopes[masked & seen] = around[masked & seen]
        return poisson(right, down)


def poisson(right, down):
    """The height whose slopes these are, in the sense of least squares; 0 at the image's edge."""
    divergence = np.zeros_like(right)
    divergence[:, 1:] += 0.5 * (right[:, 1:] - right[:, :-1])
    divergence[:, :-1] += 0.5 * (right[:, 1:] - right[:, :-1])
    divergence[1:] += 0.5 * (down[1:] - down[:-1])
    divergence[:-1] += 0.5 * (down[1:] - down[:-1])
    rows, columns = divergence.shape
    across = 2 * np.cos(np.pi * np.arange(1, rows + 1) / (rows + 1)) - 2
    along = 2 * np.cos(np.pi * np.arange(1, columns + 1) / (columns + 1)) - 2
    return idstn(dstn(divergence, type=1) / (across[:, None] + along[None, :]), type=1)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("domecast", type=pathlib.Path)
    parser.add_argument("--design", default="thumb24")
    parser.add_argument("--keep", type=pathlib.Path, help="folder that simulated frames are kept in")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        work = (arguments.keep or pathlib.Path(scratch)).resolve()
        work.mkdir(parents=True, exist_ok=True)
        design, domecast = arguments.design, arguments.domecast
        built = work / design
        if not built.exists():
            judge.run(domecast, "build", judge.ROOT / f"designs/{design}.json", "--out", built, "--quiet")
        constants = built / "constants/constants.json"
        dome = judge.dome_of(constants)
        still = judge.simulate(domecast, work / f"{design}-rest", design, None)
        rest = np.mean([judge.photograph(judge.drawn(still), seed).astype(float) for seed in range(20, 28)], axis=0)
        tables = {"ball": Table(rest, False), "all": Table(rest, True)}
        for index, (radius, depth, polar, azimuth) in enumerate(BALLS):
            scale = dome["radius"] / 10
            press = judge.ball(radius * scale, polar, azimuth, depth * scale, dome)
            truth = judge.simulate(domecast, work / f"{design}-table-{index}", design, press)
            for table in tables.values():
                table.learn(judge.photograph(judge.drawn(truth), 100 + index).astype(float), truth, dome)
        for table in tables.values():
            table.finish()
        ratios = {}
        for name, objects in judge.PRESSES[design].items():
            check_shape.judge(domecast, work, design, name, objects(dome), dome, constants)
            truth = work / f"{design}-{name.replace(' ', '-')}"
            ours = judge.errors(truth, truth / "shape", dome)
            for kind, table in tables.items():
                off = table.read(judge.photograph(judge.drawn(truth), 1).astype(float), truth, dome) - heights(truth, dome)
                for limit in (45, 60):
                    here = ours["known"] & (ours["polar"] <= limit)
                    peer, own = [np.sqrt(np.mean(e[here] ** 2)) for e in (off, ours["off"])]
                    holds = table.knows_all or peer >= 2 * own
                    ratios.setdefault((kind, limit), []).append(peer / own)
                    judge.check(f"{design}, {name}: table '{kind}' to {limit} deg", holds, f"rms {peer:.4f} mm, {peer / own:.1f} times ours")
        for (kind, limit), values in ratios.items():
            mean = float(np.exp(np.mean(np.log(values))))
            judge.check(f"{design}: table '{kind}' to {limit} deg", kind == "all" or mean >= 5, f"{mean:.1f} times our error, geometric mean")
    sys.exit(1 if judge.failed else 0)


if __name__ == "__main__":
    main()
