"""A sensor that is touched step by step, by whatever moves bodies: the base of `domecast.mujoco` and `domecast.gym`."""

from __future__ import annotations

import json
import os
import struct
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from . import _native
from ._arrays import Frame
from ._design import Design
from ._error import DomecastError
from ._scene import Scene
from ._types import Floats

MAX_OBJECTS = 16
PLANNED_FRAMES = 64


def _array(field: str, given: Any, shape: tuple[int, ...], kinds: str = "iuf") -> Any:
    """The numbers of an argument, of numpy's `kinds` of type; -1 in `shape` is any length."""
    found: Any = np.asarray(given)
    is_shaped = found.ndim == len(shape) and all(side in (-1, own) for side, own in zip(shape, found.shape))
    if not is_shaped or found.dtype.kind not in kinds or not np.isfinite(found).all():
        sides = " x ".join("N" if side < 0 else str(side) for side in shape)
        allowed = f"{sides} {'finite' if 'f' in kinds else 'whole'} numbers"
        raise DomecastError(f"`{field}` does not hold {allowed}", field=field, value=repr(given)[:100], allowed=allowed)
    return found


def _pressing(index: int, count: int, shape: Mapping[str, Any], end_s: float) -> dict[str, Any]:
    """An object of a scene file that is pressed onto the pole for its share of the time, by half a newton."""
    edges = [index / count, (index + 0.05) / count, (index + 0.9) / count, (index + 0.95) / count]
    force = [{"time_s": end_s * edge, "force_n": force} for edge, force in zip(edges, (0.0, 0.5, 0.5, 0.0))]
    return {
        "name": f"object {index}",
        "shape": dict(shape),
        "path": [{"time_s": 0.0, "position_mm": [0.0, 0.0, 200.0]}],
        "press": {"direction": [0, 0, -1], "force": force},
    }


class Touch:
    """What a step gives: the frame, where frames are drawn, and the exact truth."""

    def __init__(self, frame: Frame | None, truth: dict[str, Any]) -> None:
        self.frame = frame
        self.truth = truth

    @property
    def status(self) -> str:
        """`ok`, or the name of the limit that holds the platform."""
        return str(self.truth["status"])

    @property
    def wrench(self) -> Floats:
        """Fx, Fy, Fz (N), Mx, My, Mz (N mm) on the sensor, its rest frame, about the springs' point; a push on the pole has Fz < 0."""
        return np.array(self.truth["wrench"], dtype=np.float64)

    @property
    def pose(self) -> Floats:
        """`rest_from_platform`, 4 x 4, mm."""
        return np.array(self.truth["pose"], dtype=np.float64)

    @property
    def dots_px(self) -> Floats:
        """Centre of each dot in the raw image, px; NaN where it is not seen."""
        none = [np.nan, np.nan]
        return np.array([dot["image_px"] or none for dot in self.truth["black_dots"]], dtype=np.float64).reshape(-1, 2)

    @property
    def dots_mm(self) -> Floats:
        """Centre of each dot on the deformed dome, mm, the frame of the sensor at rest."""
        return np.array([dot["surface_mm"] for dot in self.truth["black_dots"]], dtype=np.float64).reshape(-1, 3)

    def _repr_png_(self) -> bytes | None:
        return None if self.frame is None else self.frame._repr_png_()


class LiveSensor:
    """A sensor and rigid objects near it, put where each step says; friction remembers the way.

    `shapes`: for each object its `shape` as a scene file has it (`{"kind": "sphere", "radius_mm": 4}`), in its own frame. The
    scene's other sections (`light`, `electronics`, `contact`, `tolerance`, ..) come from `scene`; without `images` only the truth
    is computed, which takes milliseconds.
    """

    def __init__(
        self,
        design: Design,
        shapes: Sequence[Mapping[str, Any]],
        *,
        images: bool = True,
        scene: Mapping[str, Any] | None = None,
        folder: str | os.PathLike[str] = ".",
        rate_hz: float = 60.0,
        everything: bool = False,
    ) -> None:
        if not 1 <= len(shapes) <= MAX_OBJECTS:
            raise ValueError(f"{len(shapes)} objects: 1 to {MAX_OBJECTS} are possible")
        if not 1e-3 <= rate_hz <= 1e6:
            raise DomecastError(f"`rate_hz` is {rate_hz}; allowed: 0.001 to 1000000", field="rate_hz", value=repr(rate_hz),
                                allowed="0.001 to 1000000")
        # the plan must take every object for one that presses; where each stands is each step's own
        count = len(shapes)
        tree: dict[str, Any] = {
            "version": 1,
            "name": "live",
            "tolerance": {"px": 0.05, "grey": 16},
            "contact": {"level": "linear", "element_mm": 0.1 * float(design["dome"]["radius_mm"])},
            **dict(scene or {}),
            "frames": {"count": PLANNED_FRAMES, "rate_hz": rate_hz, "images": images},
            "objects": [_pressing(index, count, shape, PLANNED_FRAMES / rate_hz) for index, shape in enumerate(shapes)],
        }
        self.scene = Scene(tree, design=design, folder=folder)
        self._live = _native.NativeLive(self.scene._native, everything)
        self._count = len(shapes)

    def step(self, poses: Sequence[Floats | None]) -> Touch:
        """Puts each object at its pose, 4 x 4 `rest_from_object` in the frame of the sensor at rest, mm; None: away."""
        rows = np.full((self._count, 16), np.nan)
        if len(poses) != self._count:
            raise ValueError(f"{len(poses)} poses for {self._count} objects")
        for index, (row, pose) in enumerate(zip(rows, poses)):
            # one that is away has no pose: a number that is none must not pass for it
            if pose is not None:
                row[:] = _array(f"poses[{index}]", pose, (4, 4)).ravel()
        image, line = self._live.step(rows)
        return Touch(None if image is None else image.view(Frame), json.loads(line))

    def restart(self) -> None:
        """Forgets what touched the dome."""
        self._live.restart()

    def sensor(self) -> _native.Sensor:
        """The constants of the sensor, for a `Tracker` of the frames."""
        return self.scene.sensor()


def write_stl(path: Path, vertices: Floats, faces: Any) -> None:
    """A closed mesh as binary STL, in the unit of its vertices."""
    corners = _array("vertices", vertices, (-1, 3)).astype(np.float32)[_array("faces", faces, (-1, 3), "iu")]
    records = np.zeros(len(corners), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("spare", "<u2")])
    records["corners"] = corners
    path.write_bytes(b"\0" * 80 + struct.pack("<I", len(corners)) + records.tobytes())


def turned_profile(radii: Floats, heights: Floats, sides: int = 128) -> tuple[Floats, Any]:
    """Vertices and triangles of a profile turned about z; its first and last radius are 0."""
    radii, heights = _array("radii", radii, (-1,)), _array("heights", heights, (-1,))
    if len(radii) != len(heights) or len(radii) < 3:
        raise DomecastError(f"{len(radii)} radii and {len(heights)} heights; allowed: as many of both, three at least", field="radii",
                            value=str(len(radii)), allowed="as many radii as heights, three at least")
    angles = np.arange(sides) * (2 * np.pi / sides)
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    inner = [np.column_stack([radius * ring, np.full(sides, height)]) for radius, height in zip(radii[1:-1], heights[1:-1])]
    vertices = np.concatenate([[[0.0, 0.0, heights[0]]], *inner, [[0.0, 0.0, heights[-1]]]])
    faces: list[tuple[int, int, int]] = []
    for side in range(sides):
        after = (side + 1) % sides
        faces.append((0, 1 + after, 1 + side))
        for level in range(len(inner) - 1):
            low, high = 1 + level * sides, 1 + (level + 1) * sides
            faces += [(low + side, low + after, high + after), (low + side, high + after, high + side)]
        top = 1 + (len(inner) - 1) * sides
        faces.append((top + side, top + after, len(vertices) - 1))
    return vertices, faces


def capsule(radius: float, half_length: float, rings: int = 32) -> tuple[Floats, Any]:
    """A capsule along z: a cylinder of this half length with a half ball at each end."""
    radius, half_length = _array("radius and half length", [radius, half_length], (2,)).tolist()
    angles = np.linspace(0, np.pi / 2, rings + 1)
    radii = radius * np.sin(np.concatenate([angles, np.pi / 2 + angles]))
    heights = np.concatenate([-half_length - radius * np.cos(angles), half_length + radius * np.sin(angles)])
    radii[[0, -1]] = 0.0
    return turned_profile(radii, heights)


def ellipsoid(radii: Floats, rings: int = 64) -> tuple[Floats, Any]:
    """An ellipsoid along the axes."""
    angles = np.linspace(0, np.pi, rings + 1)
    vertices, faces = turned_profile(np.sin(angles) * (angles % np.pi > 0), -np.cos(angles))
    return vertices * _array("radii", radii, (3,)), faces


def mesh_folder() -> tempfile.TemporaryDirectory[str]:
    """Where meshes lie until they are read."""
    return tempfile.TemporaryDirectory(prefix="domecast-")
