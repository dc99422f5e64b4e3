"""A domecast sensor in a MuJoCo model: `pip install domecast[mujoco]`.

>>> sensor = domecast.mujoco.TouchSensor(model, "fingertip", domecast.Design.load("designs/thumb24.json"))
>>> mujoco.mj_forward(model, data)
>>> touch = sensor.read(data)
>>> touch.wrench, touch.dots_px, touch.frame
"""

from __future__ import annotations

import importlib
import os
import warnings
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ._design import Design
from ._error import DomecastError
from ._types import Floats
from .live import MAX_OBJECTS, LiveSensor, Touch, capsule, ellipsoid, mesh_folder, write_stl

MM = 1000.0

# MuJoCo comes without types
_mj: Any = importlib.import_module("mujoco")


def _id(model: Any, kind: Any, given: str | int) -> int:
    if isinstance(given, str):
        found = int(_mj.mj_name2id(model, kind, given))
        if found < 0:
            raise DomecastError(f"the model has no {kind.name.removeprefix('mjOBJ_').lower()} named {given!r}", value=repr(given))
        return found
    number, count = int(given), int({_mj.mjtObj.mjOBJ_SITE: model.nsite, _mj.mjtObj.mjOBJ_GEOM: model.ngeom}[kind])
    if not 0 <= number < count:
        what = kind.name.removeprefix("mjOBJ_").lower()
        raise DomecastError(f"the model has no {what} of number {number}; allowed: 0 to {count - 1}", value=str(number), allowed=f"0 to {count - 1}")
    return number


def _matrix(rotation: Any, position: Any) -> Floats:
    pose = np.eye(4)
    pose[:3, :3] = np.asarray(rotation).reshape(3, 3)
    pose[:3, 3] = np.asarray(position)
    return pose


def _is_below(model: Any, body: int, ancestor: int) -> bool:
    while body > 0:
        if body == ancestor:
            return True
        body = int(model.body_parentid[body])
    return ancestor == 0 and body == 0


class TouchSensor:
    """The sensor at a site of a model: its frame is that of the sensor at rest (origin on the sheet's top face, below the dome's
    pole; z towards the pole), in metres as all of MuJoCo.

    `geoms` may touch it, by name or number: spheres, capsules, cylinders, boxes, ellipsoids and closed meshes, at most 16; left out,
    all geoms that collide, but for planes and height fields, which are not felt (a warning names them), and belong to other bodies than the site's own. They are rigid here: the dome yields. MuJoCo's own
    contact forces are not read, and none are given back: let the geoms near the dome not collide with the sensor's own, or make these as soft
    as it is. Keywords are those of `domecast.live.LiveSensor`.
    """

    def __init__(
        self,
        model: Any,
        site: str | int,
        design: Design,
        *,
        geoms: Iterable[str | int] | None = None,
        images: bool = True,
        scene: Mapping[str, Any] | None = None,
        folder: str | os.PathLike[str] = ".",
        rate_hz: float | None = None,
        everything: bool = False,
    ) -> None:
        self.model = model
        self.site = _id(model, _mj.mjtObj.mjOBJ_SITE, site)
        self.geoms = self._others() if geoms is None else [_id(model, _mj.mjtObj.mjOBJ_GEOM, one) for one in geoms]
        if not 1 <= len(self.geoms) <= MAX_OBJECTS:
            raise DomecastError(f"{len(self.geoms)} geoms may touch the sensor; allowed: 1 to {MAX_OBJECTS}: name them in `geoms`",
                                field="geoms", value=str(len(self.geoms)), allowed=f"1 to {MAX_OBJECTS}")
        with mesh_folder() as place:
            shapes = [self._shape(geom, Path(place)) for geom in self.geoms]
            rate = 1.0 / float(model.opt.timestep) if rate_hz is None else rate_hz
            self.live = LiveSensor(design, shapes, images=images, scene=scene, folder=folder, rate_hz=rate, everything=everything)

    def _others(self) -> list[int]:
        model, own = self.model, int(self.model.site_bodyid[self.site])
        # a site of the world is no body's: everything else may touch it
        mine = [own > 0 and _is_below(model, int(body), own) for body in model.geom_bodyid]
        not_felt = {_mj.mjtGeom.mjGEOM_PLANE, _mj.mjtGeom.mjGEOM_HFIELD}
        others = [geom for geom in range(model.ngeom)
                  if (model.geom_contype[geom] or model.geom_conaffinity[geom]) and not mine[geom]]
        left_out = [geom for geom in others if _mj.mjtGeom(int(model.geom_type[geom])) in not_felt]
        if left_out:
            names = ", ".join(repr(_mj.mj_id2name(model, _mj.mjtObj.mjOBJ_GEOM, geom) or geom) for geom in left_out)
            warnings.warn(f"planes and height fields are not felt: {names}; put a box where the sensor may touch them, or name in `geoms` what may touch it",
                          stacklevel=3)
        return [geom for geom in others if geom not in left_out]

    def _shape(self, geom: int, place: Path) -> dict[str, Any]:
        model, kinds = self.model, _mj.mjtGeom
        kind, size = kinds(int(model.geom_type[geom])), MM * np.asarray(model.geom_size[geom])
        if kind == kinds.mjGEOM_SPHERE:
            return {"kind": "sphere", "radius_mm": float(size[0])}
        if kind == kinds.mjGEOM_CYLINDER:
            return {"kind": "cylinder", "radius_mm": float(size[0]), "length_mm": 2 * float(size[1])}
        if kind == kinds.mjGEOM_BOX:
            return {"kind": "box", "size_mm": (2 * size).tolist()}
        if kind == kinds.mjGEOM_CAPSULE:
            vertices, faces = capsule(float(size[0]), float(size[1]))
        elif kind == kinds.mjGEOM_ELLIPSOID:
            vertices, faces = ellipsoid(size)
        elif kind == kinds.mjGEOM_MESH:
            mesh = int(model.geom_dataid[geom])
            first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
            face, faces_count = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
            vertices = MM * np.asarray(model.mesh_vert[first:first + count], dtype=np.float64)
            faces = np.asarray(model.mesh_face[face:face + faces_count])
        else:
            name = _mj.mj_id2name(model, _mj.mjtObj.mjOBJ_GEOM, geom) or geom
            raise DomecastError(f"the geom {name!r} is of the kind {kind.name}; allowed: sphere, capsule, cylinder, box, ellipsoid, mesh",
                                field="geoms", value=str(name), allowed="sphere, capsule, cylinder, box, ellipsoid, mesh")
        path = place / f"geom_{geom}.stl"
        write_stl(path, vertices, faces)
        return {"kind": "mesh", "file": str(path)}

    def poses(self, data: Any) -> list[Floats]:
        """Where the geoms are in the sensor's frame, mm."""
        site = _matrix(data.site_xmat[self.site], data.site_xpos[self.site])
        to_site = np.linalg.inv(site)
        found: list[Floats] = []
        for geom in self.geoms:
            pose = to_site @ _matrix(data.geom_xmat[geom], data.geom_xpos[geom])
            pose[:3, 3] *= MM
            pose[3] = [0, 0, 0, 1]
            found.append(pose)
        return found

    def read(self, data: Any) -> Touch:
        """What the sensor feels as the model stands (after `mj_forward` or `mj_step`). Friction remembers the reads before."""
        return self.live.step(list(self.poses(data)))

    def restart(self) -> None:
        """Forgets what touched the dome: after the model was reset."""
        self.live.restart()
