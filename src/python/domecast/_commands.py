"""Commands that read and write files, as functions: what the command line does, and its `--json` result as a dictionary."""

from __future__ import annotations

import json
import os
import sys
import warnings
from typing import Any

from . import _native

StrPath = str | os.PathLike[str]


def main() -> int:
    """The command line; returns its exit code."""
    return _native.main(sys.argv)


def _place(path: StrPath | None) -> str | None:
    return None if path is None else os.fspath(path)


def _call(command: str, *places: StrPath, **options: Any) -> dict[str, Any]:
    words = [command]
    for name, value in options.items():
        option = "--" + name.replace("_", "-")
        if value is True:
            words.append(option)
        elif value is not None and value is not False:
            words.append(f"{option}={value}")
    # after the last option, so that no name of a file is taken for one
    text, notes = _native.call([*words, "--", *(os.fspath(place) for place in places)])
    for note in notes:
        warnings.warn(note, stacklevel=3)
    result: dict[str, Any] = json.loads(text) or {}
    return result


def calibrate_force(
    measured: StrPath,
    constants: StrPath,
    *,
    out: StrPath | None = None,
    motion_sd: tuple[float, ...] | None = None,
    temperature: float | None = None,
    force: bool = False,
) -> dict[str, Any]:
    """Fits the springs' stiffness to measured pairs of displacement and wrench: `domecast calibrate-force`."""
    sd = None if motion_sd is None else ",".join(repr(float(one)) for one in motion_sd)
    return _call("calibrate-force", measured, constants, out=_place(out), motion_sd=sd, temperature=temperature, force=force)


def calibrate_light(
    frames: StrPath,
    constants: StrPath,
    *,
    ball_radius_mm: float,
    rest: StrPath | None = None,
    out: StrPath | None = None,
    force: bool = False,
) -> dict[str, Any]:
    """Fits the lights to a folder of frames, one at rest and 5 to 20 presses of a ball: `domecast calibrate-light` (minutes)."""
    radius = repr(float(ball_radius_mm))
    return _call("calibrate-light", frames, constants, ball_radius_mm=radius, rest=_place(rest), out=_place(out), force=force)


def calibrate_optics(
    seen: StrPath,
    constants: StrPath,
    *,
    out: StrPath | None = None,
    rest_frames: int = 1,
    centroids: StrPath | None = None,
    force: bool = False,
) -> dict[str, Any]:
    """Fits pupil, sheet, indices, markers and dots to what the built sensor sees: `domecast calibrate-optics`."""
    return _call("calibrate-optics", seen, constants, out=_place(out), rest_frames=rest_frames, centroids=_place(centroids), force=force)


def calibrate_print(
    measured: StrPath,
    design: StrPath,
    *,
    out: StrPath | None = None,
    marks: str | None = None,
    force: bool = False,
) -> dict[str, Any]:
    """Fits the pad's map to a measured test print, and writes it into a new design file: `domecast calibrate-print`."""
    return _call("calibrate-print", measured, design, out=_place(out), marks=marks, force=force)


def accuracy(
    design: StrPath,
    *,
    out: StrPath | None = None,
    scene: StrPath | None = None,
    quick: bool = False,
    force: bool = False,
) -> dict[str, Any]:
    """Measures what accuracy costs in time: `domecast accuracy` (minutes; seconds with `quick`)."""
    return _call("accuracy", design, out=_place(out), scene=_place(scene), quick=quick, force=force)
