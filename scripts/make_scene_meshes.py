#!/usr/bin/env python3
"""Writes the meshes of the shipped scenes (designs/scenes/meshes/*.stl): nut, bolt and USB plug, in mm.

Each is a stack of closed rings with the same number of corners, joined by strips of triangles, so it is closed by
construction; the script checks that every edge has two triangles and that the volume is positive. Needs numpy.
"""
import pathlib
import struct

import numpy as np

OUT = pathlib.Path(__file__).resolve().parent.parent / "designs" / "scenes" / "meshes"


def strips(rings, closed):
    """Quads between neighbouring rings, split into triangles; `closed` joins the last ring to the first."""
    triangles = []
    pairs = list(zip(rings, rings[1:])) + ([(rings[-1], rings[0])] if closed else [])
    for low, high in pairs:
        n = len(low)
        for k in range(n):
            a, b, c, d = low[k], low[(k + 1) % n], high[(k + 1) % n], high[k]
            triangles += [(a, b, c), (a, c, d)]
    return triangles


def fan(ring, turn):
    """A flat cap of a convex ring."""
    middle = ring.mean(axis=0)
    out = []
    for k in range(len(ring)):
        a, b = ring[k], ring[(k + 1) % len(ring)]
        out.append((middle, a, b) if turn else (middle, b, a))
    return out


def circle(radius, z, count):
    turn = 2 * np.pi * np.arange(count) / count
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), np.full(count, z)], axis=1)


def hexagon(across_flats, z, count):
    """Points on a hexagon in the directions of `circle`, corners among them."""
    turn = 2 * np.pi * np.arange(count) / count
    radius = 0.5 * across_flats / np.cos((turn % (np.pi / 3)) - np.pi / 6)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), np.full(count, z)], axis=1)


def rectangle(width, depth, z):
    x, y = 0.5 * width, 0.5 * depth
    return np.array([[x, y, z], [-x, y, z], [-x, -y, z], [x, -y, z]])


def nut():
    """M4: 7 mm across flats, 3.2 mm high; axis z, centred."""
    n, h = 48, 1.6
    rings = [hexagon(7.0, -h, n), hexagon(7.0, h, n), circle(2.0, h, n), circle(2.0, -h, n)]
    return strips(rings, closed=True)


def bolt():
    """M6 with rings for a thread of 1 mm pitch, 12 mm long, axis z; a hexagonal head of 10 mm at the top."""
    n, pitch = 36, 1.0
    rings = [circle(2.3, -8.0, n)]
    for k in range(12):
        z = -8.0 + pitch * k
        rings += [circle(3.0, z + 0.5 * pitch, n), circle(2.39, z + pitch, n)]
    rings += [hexagon(10.0, 4.0, n), hexagon(10.0, 8.0, n)]
    return fan(rings[0], turn=False) + strips(rings, closed=False) + fan(rings[-1], turn=True)


def usb_plug():
    """The end of a type A plug: a shell of 12 x 4.5 mm, 0.4 mm thick, with its tongue; the open end looks to -z."""
    deep, long = 4.0, 8.0
    rings = [
        rectangle(10.6, 1.9, -0.5), rectangle(10.6, 1.9, -deep),
        rectangle(11.2, 3.7, -deep), rectangle(11.2, 3.7, 0.0),
        rectangle(12.0, 4.5, 0.0), rectangle(12.0, 4.5, -long),
    ]
    # The tongue stands off the middle towards +y, as in the real plug.
    for ring in rings[:2]:
        ring[:, 1] += 0.7
    rings = [ring * [1, 1, -1] for ring in rings]
    return fan(rings[0], turn=False) + strips(rings, closed=False) + fan(rings[-1], turn=True)


def check(name, triangles):
    tri = np.asarray(triangles, dtype=np.float32).astype(np.float64)
    volume = np.einsum("ij,ij->i", tri[:, 0], np.cross(tri[:, 1], tri[:, 2])).sum() / 6
    edges = {}
    for a, b, c in tri:
        for p, q in ((a, b), (b, c), (c, a)):
            edges[(tuple(p), tuple(q))] = edges.get((tuple(p), tuple(q)), 0) + 1
    assert all(edges.get((q, p)) == 1 and n == 1 for (p, q), n in edges.items()), f"{name} is not closed"
    return volume


def write(name, triangles):
    if check(name, triangles) < 0:
        triangles = [(a, c, b) for a, b, c in triangles]
    volume = check(name, triangles)
    data = bytearray(80) + struct.pack("<I", len(triangles))
    for a, b, c in triangles:
        a, b, c = (np.asarray(p, dtype=np.float32) for p in (a, b, c))
        normal = np.cross(b - a, c - a)
        normal = normal / max(float(np.linalg.norm(normal)), 1e-30)
        data += struct.pack("<12fH", *normal, *a, *b, *c, 0)
    (OUT / f"{name}.stl").write_bytes(bytes(data))
    print(f"{name}: {len(triangles)} triangles, {volume:.1f} mm3")


if __name__ == "__main__":
    OUT.mkdir(parents=True, exist_ok=True)
    write("nut", nut())
    write("bolt", bolt())
    write("usb_plug", usb_plug())
