"""Designs that can be edited, and the optics that follow from them."""

from __future__ import annotations

import base64
import html
import json
import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from . import _native
from ._error import DomecastError

if TYPE_CHECKING:
    from ._types import Floats, Names


def plain(value: Any, field: str = "") -> Any:
    """The value as JSON can hold it: numpy's numbers and arrays become Python's."""
    if isinstance(value, dict):
        found: dict[str, Any] = {}
        for key, one in cast("dict[object, Any]", value).items():
            if not isinstance(key, str):
                raise DomecastError(f"`{field}` has the key {key!r}, which is no text", field=field, value=repr(key),
                                    allowed="names of fields")
            found[key] = plain(one, f"{field}.{key}" if field else key)
        return found
    if isinstance(value, (list, tuple)):
        ones = list(cast("list[Any]", value))
        return [plain(one, f"{field}[{index}]") for index, one in enumerate(ones)]
    if isinstance(value, float) and not math.isfinite(value):
        raise DomecastError(f"`{field}` is {value}: not a finite number; allowed: a finite number", field=field,
                            value=str(value), allowed="a finite number")
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, os.PathLike):
        return os.fspath(cast("os.PathLike[str]", value))
    if hasattr(value, "tolist"):
        return plain(value.tolist(), field)
    raise DomecastError(f"`{field}` is of the type {type(value).__name__}, which no file can hold; allowed: what JSON has",
                        field=field, value=type(value).__name__, allowed="numbers, text, true, false, null, lists and dictionaries")


class Design:
    """A design: its file as dictionaries and lists, to look into and to edit, resolved when it is used.

    >>> design = Design.load("designs/thumb24.json")
    >>> design["leds"]["tilt_deg"] = 80
    >>> design.build("output/tilted")
    """

    def __init__(self, tree: dict[str, Any], *, folder: str | os.PathLike[str] = ".") -> None:
        """Takes the content of a design file; relative paths in it start at `folder`."""
        self._begin(plain(tree), None, Path(folder), None)

    def _begin(self, tree: dict[str, Any], text: str | None, folder: Path, file: Path | None) -> None:
        self.tree = tree
        self._folder = folder
        self._file = file
        # the file's own text stands as long as nothing of it is changed
        self._as_read = (json.dumps(tree), text) if text is not None else None
        self._resolved: tuple[str, _native.ResolvedDesign] | None = None

    @classmethod
    def _of_text(cls, text: str, folder: Path, file: Path | None) -> Design:
        design = cls.__new__(cls)
        resolved = _native.ResolvedDesign.from_text(text, folder, file)
        # what the design takes from elsewhere, a camera's calibration say, stands in its resolved text
        design._begin(json.loads(text.removeprefix("\ufeff")), text, folder, file)
        design._resolved = (text, resolved)
        return design

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Design:
        """Reads and resolves a design file."""
        file = Path(path)
        return cls._of_text(_native.ResolvedDesign.read(file), file.parent, file)

    @classmethod
    def from_str(cls, text: str, *, folder: str | os.PathLike[str] = ".") -> Design:
        """Resolves a design from its text; relative paths in it start at `folder`."""
        return cls._of_text(text, Path(folder), None)

    def __getitem__(self, field: str) -> Any:
        return self.tree[field]

    def __setitem__(self, field: str, value: Any) -> None:
        self.tree[field] = value

    def __delitem__(self, field: str) -> None:
        del self.tree[field]

    def __contains__(self, field: object) -> bool:
        return field in self.tree

    def copy(self) -> Design:
        """The same design, to be edited apart."""
        return Design._of_text(self.text, self._folder, self._file)

    @property
    def text(self) -> str:
        """The design file: as it was read, or with the edits."""
        tree = plain(self.tree)
        if self._as_read is not None and json.dumps(tree) == self._as_read[0]:
            return self._as_read[1]
        return json.dumps(tree, indent=2, ensure_ascii=False) + "\n"

    def resolve(self) -> _native.ResolvedDesign:
        """Checks the design as it stands; every use of it does. A fault names the field."""
        text = self.text
        if self._resolved is None or self._resolved[0] != text:
            self._resolved = (text, _native.ResolvedDesign.from_text(text, self._folder, self._file))
        return self._resolved[1]

    @property
    def name(self) -> str:
        """Name of the design."""
        return self.resolve().name

    @property
    def warnings(self) -> list[tuple[str, str]]:
        """What the maker should know: field and message."""
        return self.resolve().warnings

    @property
    def derived(self) -> dict[str, tuple[Any, str]]:
        """The fields that the file leaves to rules: value and rule."""
        return {field: (json.loads(value), rule) for field, value, rule in self.resolve().derived}

    def save(self, path: str | os.PathLike[str], *, force: bool = False) -> None:
        """Writes the design file, whole or not at all; `force` keeps what stands there as NAME.bak-N."""
        self.resolve()
        inputs = [self._file] if self._file is not None and not force else []
        _native.write_text(Path(path), self.text, inputs=inputs, force=force)

    def build(self, out: str | os.PathLike[str], *, force: bool = False) -> dict[str, Any]:
        """Makes everything that the design needs, as `domecast build` does; returns dots, headlines and the manifest."""
        made: dict[str, Any] = json.loads(self.resolve().build(Path(out), force))
        return made

    def layout(self) -> _native.Layout:
        """The dots: where they are seen, on the dome, and on the printing plate."""
        return self.resolve().layout()

    def sensor(self) -> _native.Sensor:
        """The constants of the sensor as designed."""
        return self.resolve().sensor()

    def optics(self) -> Optics:
        """Pixels to points on the dome and back."""
        return Optics(self)

    def __repr__(self) -> str:
        return f"<domecast.Design {self.tree.get('name')!r}>"

    def _repr_html_(self) -> str:
        try:
            layout = self.layout()
        except DomecastError as error:
            return f"<p><b>{html.escape(str(self.tree.get('name')))}</b>: {html.escape(str(error))}</p>"
        width, height = self.resolve().size
        rows = [("dots", len(layout)), ("distance in the image", f"{layout.pitch_px:.2f} px"), ("camera", f"{width} x {height} px")]
        rows += [("warning", f"{field}: {message}") for field, message in self.warnings]
        cells = "".join(f"<tr><th>{html.escape(str(a))}</th><td>{html.escape(str(b))}</td></tr>" for a, b in rows)
        image = base64.b64encode(layout.camera_view_png()).decode()
        return (f"<b>{html.escape(self.name)}</b><table>{cells}</table>"
                f'<img alt="the dots as the camera sees them" src="data:image/png;base64,{image}">')


class Optics:
    """Lens, layers and dome of a design: pixels to points on the dome and back."""

    def __init__(self, design: Design) -> None:
        self._native = _native.NativeOptics(design.resolve())

    def at_pose(self, pose: Floats) -> Optics:
        """The same with the platform at a pose: a 4 x 4 matrix `rest_from_platform`, mm."""
        moved = Optics.__new__(Optics)
        moved._native = self._native.at_pose(pose)
        return moved

    def trace(self, uv: Floats) -> tuple[Floats, Names]:
        """What raw pixels (N, 2) see: points on the dome (N, 3), sensor frame, mm, NaN where there is none; and `ok` or the
        name of the reason for each. The centre of the top-left pixel is (0, 0)."""
        return self._native.trace(uv)

    def project(self, xyz: Floats) -> tuple[Floats, Names]:
        """The raw pixels (N, 2) that show points of the dome (N, 3), sensor frame, mm; and `ok` or the reason for each."""
        return self._native.project(xyz)
