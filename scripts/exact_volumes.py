#!/usr/bin/env python3
"""Volumes of parts as exact solids, by OpenCASCADE (package cadquery-ocp).

    scripts/exact_volumes.py constructions.json

The file is a list of parts, each `added` and `cut`: turned bodies and prisms in their places. They are made as solids
with true cylinders, cones and spheres, united and cut by OpenCASCADE's own booleans; nothing of domecast's meshes
goes into them. Prints a JSON list of volumes, mm^3. Exit code 3 if OpenCASCADE is not installed.
"""

import json
import math
import sys

try:
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
    from OCP.BRepBuilderAPI import (
        BRepBuilderAPI_GTransform,
        BRepBuilderAPI_MakeEdge,
        BRepBuilderAPI_MakeFace,
        BRepBuilderAPI_MakeWire,
        BRepBuilderAPI_Transform,
    )
    from OCP.BRepGProp import BRepGProp
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism, BRepPrimAPI_MakeRevol
    from OCP.GC import GC_MakeArcOfCircle
    from OCP.gp import gp_Ax1, gp_Dir, gp_GTrsf, gp_Mat, gp_Pnt, gp_Trsf, gp_Vec, gp_XYZ
    from OCP.GProp import GProp_GProps

    try:
        from OCP.collections import List_TopoDS_Shape as ShapeList
    except ImportError:  # OCP before 8
        from OCP.TopTools import TopTools_ListOfShape as ShapeList
except ImportError as error:
    print(f"OpenCASCADE is not installed: {error}", file=sys.stderr)
    sys.exit(3)


def wire(edges):
    maker = BRepBuilderAPI_MakeWire()
    for edge in edges:
        maker.Add(edge)
    return maker.Wire()


def line(a, b):
    return BRepBuilderAPI_MakeEdge(gp_Pnt(*a), gp_Pnt(*b)).Edge()


def arc(a, middle, b):
    return BRepBuilderAPI_MakeEdge(GC_MakeArcOfCircle(gp_Pnt(*a), gp_Pnt(*middle), gp_Pnt(*b)).Value()).Edge()


def turned(points, centers):
    """A profile (radius, z) turned about z."""
    edges = []

    def at(p):
        return (p[0], 0.0, p[1])

    if points[0][0] > 0:
        edges.append(line((0, 0, points[0][1]), at(points[0])))
    for low, high, center in zip(points, points[1:], centers):
        if center is None:
            edges.append(line(at(low), at(high)))
        else:
            angles = [math.atan2(p[1] - center, p[0]) for p in (low, high)]
            radius = math.hypot(low[0], low[1] - center)
            mean = sum(angles) / 2
            edges.append(arc(at(low), (radius * math.cos(mean), 0.0, center + radius * math.sin(mean)), at(high)))
    if points[-1][0] > 0:
        edges.append(line(at(points[-1]), (0, 0, points[-1][1])))
    edges.append(line((0, 0, points[-1][1]), (0, 0, points[0][1])))
    face = BRepBuilderAPI_MakeFace(wire(edges), True).Face()
    return BRepPrimAPI_MakeRevol(face, gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1))).Shape()


def prism(outline, radius, heights):
    """A convex polygon with rounded corners, extruded."""
    corners = []
    for i, here in enumerate(outline):
        before, after = outline[i - 1], outline[(i + 1) % len(outline)]
        if radius == 0:
            corners.append((here, None, here))
            continue
        into = [h - b for h, b in zip(here, before)]
        out = [a - h for a, h in zip(after, here)]
        u = [x / math.hypot(*into) for x in into]
        v = [x / math.hypot(*out) for x in out]
        turn = math.atan2(u[0] * v[1] - u[1] * v[0], u[0] * v[0] + u[1] * v[1])
        along = radius * math.tan(turn / 2)
        start = (here[0] - u[0] * along, here[1] - u[1] * along)
        end = (here[0] + v[0] * along, here[1] + v[1] * along)
        center = (start[0] - u[1] * radius, start[1] + u[0] * radius)
        way = (here[0] - center[0], here[1] - center[1])
        scale = radius / math.hypot(*way)
        corners.append((start, (center[0] + way[0] * scale, center[1] + way[1] * scale), end))
    z = heights[0]
    edges = []
    for i, (start, middle, end) in enumerate(corners):
        if middle is not None:
            edges.append(arc((*start, z), (*middle, z), (*end, z)))
        following = corners[(i + 1) % len(corners)][0]
        edges.append(line((*end, z), (*following, z)))
    face = BRepBuilderAPI_MakeFace(wire(edges), True).Face()
    return BRepPrimAPI_MakePrism(face, gp_Vec(0, 0, heights[1] - heights[0])).Shape()


def solid(piece):
    shape = piece["shape"]
    if "points" in shape:
        made = turned(shape["points"], shape["arc_centers"])
    else:
        made = prism(shape["outline"], shape["radius"], shape["heights"])
    m, o = piece["matrix"], piece["origin"]
    rigid = all(
        abs(sum(m[k][i] * m[k][j] for k in range(3)) - (i == j)) < 1e-12 for i in range(3) for j in range(3)
    )
    if rigid:
        move = gp_Trsf()
        move.SetValues(*[x for row, shift in zip(m, o) for x in (*row, shift)])
        return BRepBuilderAPI_Transform(made, move, True).Shape()
    matrix = gp_Mat(*[x for row in m for x in row])
    return BRepBuilderAPI_GTransform(made, gp_GTrsf(matrix, gp_XYZ(*o)), True).Shape()


def joined(maker, first, others):
    if not others:
        return first
    arguments, tools = ShapeList(), ShapeList()
    arguments.Append(first)
    for other in others:
        tools.Append(other)
    operation = maker()
    operation.SetArguments(arguments)
    operation.SetTools(tools)
    operation.Build()
    if not operation.IsDone():
        raise RuntimeError("OpenCASCADE's boolean failed")
    return operation.Shape()


def volume(part):
    added = [solid(piece) for piece in part["added"]]
    body = joined(BRepAlgoAPI_Fuse, added[0], added[1:])
    body = joined(BRepAlgoAPI_Cut, body, [solid(piece) for piece in part["cut"]])
    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(body, properties, 1e-10, False, False)
    return properties.Mass()


def main(path):
    with open(path) as file:
        print(json.dumps([volume(part) for part in json.load(file)]))


if __name__ == "__main__":
    main(sys.argv[1]) if len(sys.argv) == 2 else sys.exit(__doc__)
