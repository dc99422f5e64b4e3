"""Scenes: frames and their exact truth."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _native
from ._design import Design, plain

if TYPE_CHECKING:
    from ._arrays import Frame


class Scene:
    """What happens to a sensor: a scene file, or its content for a design that is there already."""

    def __init__(
        self,
        tree: dict[str, Any],
        *,
        design: Design | None = None,
        folder: str | os.PathLike[str] = ".",
        frames: int | None = None,
        seed: int | None = None,
    ) -> None:
        """Takes the content of a scene file. Relative paths in it start at `folder`; with a `design` its own field `design` may
        be left out. `frames` and `seed` replace those of the file."""
        given = dict(plain(tree))
        if design is not None:
            given.setdefault("design", "")
        resolved = None if design is None else design.resolve()
        self._native = _native.NativeScene.from_text(json.dumps(given), Path(folder), resolved, frames, seed)

    @classmethod
    def load(cls, path: str | os.PathLike[str], *, frames: int | None = None, seed: int | None = None) -> Scene:
        """Reads a scene file; `frames` and `seed` replace its own, as `domecast simulate --frames --seed`."""
        scene = cls.__new__(cls)
        scene._native = _native.NativeScene.load(Path(path), frames, seed)
        return scene

    @property
    def name(self) -> str:
        """Name of the scene."""
        return self._native.name

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of a frame, px."""
        return self._native.size

    def __len__(self) -> int:
        return self._native.frame_count

    def __repr__(self) -> str:
        return f"<domecast.Scene {self.name!r}: {len(self)} frames>"

    def plan(self, *, everything: bool = False) -> dict[str, Any]:
        """Which effects take part, how large each can be, what it costs, and why: as `plan.json`."""
        plan: dict[str, Any] = json.loads(self._native.plan(everything))
        return plan

    def sensor(self) -> _native.Sensor:
        """The constants of the scene's sensor as designed."""
        return self._native.sensor()

    def frames(self, *, everything: bool = False) -> Iterator[tuple[Frame | None, dict[str, Any]]]:
        """Each frame (uint8, height x width x 3, red first; height x width where the scene is grey; none where it draws none) with
        its truth, a line of `truth.jsonl` as a dictionary. Frames are drawn as they are asked for, one ahead."""
        from ._arrays import Frame

        for image, line in self._native.frames(everything):
            yield None if image is None else image.view(Frame), json.loads(line)
