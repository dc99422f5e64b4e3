"""What `_native` has: hand-written, checked against the module by scripts/check_python.py."""

from collections.abc import Iterator, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, final

from ._types import Bytes, Floats, Floats32, Names, Table

__version__: str

def main(arguments: Sequence[str]) -> int: ...
def call(arguments: Sequence[str | PathLike[str]]) -> tuple[str, list[str]]: ...
def write_text(path: Path, text: str, *, inputs: Sequence[Path], force: bool) -> Path | None: ...
def png(frame: Bytes, *, rgb: bool) -> bytes: ...
@final
class ResolvedDesign:
    @staticmethod
    def from_text(text: str, folder: Path, file: Path | None) -> ResolvedDesign: ...
    @staticmethod
    def read(path: Path) -> str: ...
    @property
    def name(self) -> str: ...
    @property
    def text(self) -> str: ...
    @property
    def warnings(self) -> list[tuple[str, str]]: ...
    @property
    def derived(self) -> list[tuple[str, str, str]]: ...
    @property
    def size(self) -> tuple[int, int]: ...
    @property
    def pole_mm(self) -> float: ...
    def build(self, out: Path, force: bool) -> str: ...
    def layout(self) -> Layout: ...
    def sensor(self) -> Sensor: ...

@final
class Layout:
    """The dots of a design. A notebook shows them as the camera will see them."""

    def __len__(self) -> int: ...
    @property
    def dots(self) -> Table:
        """A structured array: id, pass, image_px, surface_mm, normal, plate_mm, diameter_mm."""

    @property
    def pitch_px(self) -> float:
        """Distance of neighbours in the image, px."""

    @property
    def passes(self) -> int:
        """How many prints the pad takes."""

    @property
    def warnings(self) -> list[str]: ...
    def film_svg(self, index: int = 0) -> bytes:
        """The film of a print pass, from 0, in true millimetres."""

    def camera_view_png(self) -> bytes: ...
    def outside_view_png(self) -> bytes: ...
    def _repr_png_(self) -> bytes: ...

@final
class NativeOptics:
    def __new__(cls, design: ResolvedDesign) -> NativeOptics: ...
    def at_pose(self, pose: Floats) -> NativeOptics: ...
    def trace(self, uv: Floats) -> tuple[Floats, Names]: ...
    def project(self, xyz: Floats) -> tuple[Floats, Names]: ...

@final
class Sensor:
    """What a runtime must know of one sensor: the content of a `constants.json`."""

    @staticmethod
    def load(path: str | PathLike[str]) -> Sensor:
        """Reads a constants file."""

    @staticmethod
    def from_str(text: str) -> Sensor:
        """Reads the text of one."""

    def json(self) -> str:
        """The text of the file."""

    @property
    def design(self) -> str:
        """Name of the design."""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of a frame, px."""

@final
class Tracker:
    """Follows a sensor's marks from frame to frame. One thread at a time."""

    def __new__(
        cls,
        sensor: Sensor,
        *,
        channel: str = "luma",
        reference: int | None = None,
        search_every: int = 30,
        max_residual_px: float = 2.0,
        max_misplaced: float = 0.5,
        camera_turned_deg: float | None = None,
        temperature_c: float | None = None,
        check_colours: bool = True,
    ) -> Tracker:
        """The options are those of `domecast track`. `check_colours`: the first good frame whose colours fit the constants' light
        only in another order is refused."""

    def update(self, frame: Bytes, *, rgb: bool, time: float | None = None, number: int | None = None) -> Reading:
        """Takes the next frame in: uint8, (height, width, 3) or (height, width) of grey. `rgb`: red comes first; False: blue does,
        as in OpenCV's frames. `time`, s: when it was taken. `number`: its number, where one may be missing before it. A frame of
        contiguous rows with red first is not copied."""

    def set_gravity(self, acceleration_mps2: Sequence[float] | None) -> None:
        """Gravity less the sensor's own acceleration, sensor frame, m/s2 (upright: 0, 0, -9.81), of the frames from now on: the weight of
        what the springs carry is taken off the wrench. None, as at first, leaves it in. It needs `reference`."""

    def skip(self, *, time: float | None = None, number: int | None = None) -> Reading:
        """A frame that could not be had."""

    def restart(self) -> None:
        """Forgets everything but the constants."""

    def benchmark(self, frame: Bytes, *, rgb: bool, repeats: int) -> float:
        """Median time of the same frame in Rust alone, s."""

@final
class Reading:
    """What a frame says of the sensor. What is not known is None, or NaN in a table; `status` says why."""

    @property
    def frame(self) -> int:
        """Its number."""

    @property
    def time(self) -> float | None: ...
    @property
    def status(self) -> str:
        """`ok`, or the gravest of the problems."""

    @property
    def problems(self) -> list[str]: ...
    @property
    def wrench(self) -> Floats | None:
        """Fx, Fy, Fz, Mx, My, Mz that the world puts on the sensor, N and N mm, rest frame, about the springs' point."""

    @property
    def wrench_sd(self) -> Floats | None:
        """Its standard deviations: noise, tolerances and calibrations."""

    @property
    def wrench_sd_random(self) -> Floats | None:
        """The share of them that changes from frame to frame."""

    @property
    def pose(self) -> Floats | None:
        """`rest_from_platform`, 4 x 4, mm."""

    @property
    def displacement(self) -> Floats | None:
        """The same as tx, ty, tz (mm), rx, ry, rz (rad) about the springs' point."""

    @property
    def pose_sd(self) -> Floats | None: ...
    @property
    def pose_rms_px(self) -> float | None: ...
    @property
    def dots(self) -> Table:
        """A structured array: id, state, image_px, centroid_px, sd_px, undeformed_px, motion_px, displacement_mm,
        displacement_sd_random_mm, ray."""

    @property
    def markers(self) -> Table:
        """A structured array: id, state, image_px, centroid_px, sd_px, residual_px."""

    @property
    def false_dots(self) -> Floats | None:
        """Places of dark blobs that are no dots, px (N, 2); None where the frame was not searched as a whole."""

    def json(self, fields: Sequence[str] | None = None, *, shape: ShapeMap | None = None) -> str:
        """The line that `domecast track` writes of this frame, with the members of `--shape` where a map is given."""

    def overlay_png(
        self,
        frame: Bytes,
        *,
        rgb: bool,
        magnify: float = 1.0,
        shape: ShapeMap | None = None,
        forces: Forces | None = None,
    ) -> bytes:
        """The reading drawn over its frame."""

    def _repr_png_(self) -> bytes: ...

@final
class Shape:
    """Reads the skin's shape from the colours of frames, against one of the untouched sensor. One thread at a time."""

    def __new__(
        cls, sensor: Sensor, tracker: Tracker, *, cell_px: int = 2, max_passes: int = 2
    ) -> Shape: ...
    def set_rest(self, frame: Bytes, *, rgb: bool) -> None:
        """Takes a frame of the untouched sensor. One whose colours fit only in another order is refused."""

    def update(self, frame: Bytes, reading: Reading, *, rgb: bool) -> ShapeMap:
        """Reads a frame's shape, with what the tracker says of the same frame."""

@final
class ShapeMap:
    """The skin as a frame shows it, a value for each raw pixel; NaN where nothing is known."""

    @property
    def status(self) -> str:
        """`ok`, `not_converged`, `no_pose`, `light_out`: a light is out that was on at rest, and nothing is known, or `raised`: the skin lies
        farther above its shape at rest than anywhere below it, as where the frame at rest was touched, and no touch is stated."""

    @property
    def height_mm(self) -> Floats32:
        """Distance from the shape at rest, mm, (height, width); negative where it is pressed in."""

    @property
    def height_sd_mm(self) -> Floats32: ...
    @property
    def touched(self) -> Table:
        """Whether the skin is touched, bool."""

    @property
    def normal(self) -> Floats32:
        """Outward unit normals, sensor frame, (height, width, 3)."""

    @property
    def members(self) -> str:
        """What `domecast track --shape` adds to a line, as a JSON object: `contact` and `shape`."""

    def surface(self) -> tuple[Floats32, Floats32, Table]:
        """The skin as triangles: points (N, 3), mm, their normals, and corners (M, 3)."""

    def _repr_png_(self) -> bytes: ...

@final
class Traction:
    """Finds the forces on the skin, place by place. One thread at a time."""

    def __new__(cls, sensor: Sensor, *, correlation_mm: float | None = None) -> Traction:
        """`correlation_mm`: over how far pressures are taken to be alike; 1 where heights are given, as the command line does."""

    def set_rest(self, reading: Reading) -> None:
        """Takes the reading of a frame of the untouched sensor: its dots lie where that shows them. Without it, and without the tracker's
        `reference`, forces that move dots by no more than they are printed to (a tenth of a millimetre) are not seen."""

    def update(self, reading: Reading, *, shape: ShapeMap | None = None) -> Forces: ...
    def pressure(self, shape: ShapeMap) -> tuple[Floats32, Floats32]:
        """The last frame's pressures on the grid of its height map, N/mm2, and their deviations."""

@final
class Forces:
    """The forces on the skin in a frame."""

    @property
    def status(self) -> str: ...
    @property
    def rms_px(self) -> float: ...
    @property
    def compliance_factor(self) -> float: ...
    @property
    def dots(self) -> Table:
        """A structured array: id, surface_mm, depth_sd_mm, traction_n_mm2, noise_sd_n_mm2, sd_n_mm2."""

    @property
    def contact(self) -> tuple[Floats, Floats, Floats, Floats] | None:
        """Point of the touch (mm), its outward normal, the force (N) and its deviations."""

    def json(self, fields: Sequence[str] | None = None, *, shape: ShapeMap | None = None) -> str:
        """The line that `domecast track --traction` writes of this frame."""

@final
class Hardness:
    """What a frame says of how hard the touched object is: the member of the line that `domecast track` writes. What is not said is None."""

    @property
    def status(self) -> str:
        """Of a `ContactHardness`: `ok`, `saturated` (too hard for this dome), `impossible` (the travel is not what it is taken for) or `not_measured`;
        of a `HardnessModel`: `ok` or `unsure`."""

    @property
    def reason(self) -> str | None:
        """Why a model is unsure."""

    @property
    def class_name(self) -> str | None:
        """The most probable class of a model."""

    @property
    def probability(self) -> float | None: ...
    @property
    def log10_youngs_modulus_mpa(self) -> float | None: ...
    @property
    def interval_90(self) -> tuple[float, float] | None:
        """Within these 90 of 100 moduli lie, log10 of MPa."""

    @property
    def frames(self) -> int | None:
        """Frames of the touch so far, of a `ContactHardness`."""

    def json(self) -> str:
        """The member."""

@final
class ContactHardness:
    """Young's modulus of what is touched, by contact mechanics, from how far the hand has moved: each touch for itself. One thread at a time."""

    def __new__(cls, sensor: Sensor, rest: Reading, *, travel_sd_mm: float = 0.02) -> ContactHardness:
        """`rest`: the reading of a frame of the untouched sensor. `travel_sd_mm`: the noise of the hand's travel."""

    def update(self, forces: Forces, shape: ShapeMap, *, travel_mm: float) -> Hardness | None:
        """Takes a frame in: its forces, its shape, and how far the hand has brought sensor and object together, mm from anywhere, growing.
        None where nothing touches or the frame is not `ok`."""

@final
class HardnessModel:
    """Class or Young's modulus of what is touched, by a network over a window of frames. One thread at a time."""

    @staticmethod
    def load(path: str | PathLike[str]) -> HardnessModel:
        """Reads a model, an ONNX file of `domecast-learn`."""

    def set_rest(self, frame: Bytes, reading: Reading, *, rgb: bool) -> None:
        """Takes a frame of the untouched sensor, and its reading."""

    def update(
        self,
        frame: Bytes,
        reading: Reading,
        *,
        rgb: bool,
        shape: ShapeMap | None = None,
        contact: Hardness | None = None,
    ) -> Hardness | None:
        """Takes the next frame in. None until the window is full, which begins anew at a frame that is not `ok`. With `shape` the model is unsure
        once a frame shows that the one at rest was touched; with `contact`, what a `ContactHardness` says of the same frame, it says nothing
        that this contradicts."""

    def restart(self) -> None:
        """Forgets the frames, not the rest."""

@final
class Camera:
    """A camera of Linux with exposure, gain and white balance locked, or `player:FOLDER?rate=60`: frames as they come, the newest first where
    the caller falls behind."""

    def __new__(
        cls,
        device: str,
        sensor: Sensor,
        *,
        rate: float = 30.0,
        exposure_ms: float | None = None,
        gain: int | None = None,
        white_balance_k: int | None = None,
    ) -> Camera:
        """The options are those of `domecast live`. A device that goes is opened again; damaged frames are left out."""

    def __iter__(self) -> Camera: ...
    def __next__(self) -> tuple[Bytes, float, int]:
        """A frame (uint8, red first; (height, width) of grey), when it was taken (s since the device was opened), and its number: one that is
        missing before it never came."""

@final
class NativeScene:
    @staticmethod
    def load(path: Path, frames: int | None, seed: int | None) -> NativeScene: ...
    @staticmethod
    def from_text(
        text: str, folder: Path, design: ResolvedDesign | None, frames: int | None, seed: int | None
    ) -> NativeScene: ...
    @property
    def name(self) -> str: ...
    @property
    def frame_count(self) -> int: ...
    @property
    def size(self) -> tuple[int, int]: ...
    def plan(self, everything: bool) -> str: ...
    def sensor(self) -> Sensor: ...
    def frames(self, everything: bool) -> NativeFrames: ...

@final
class NativeFrames:
    def __iter__(self) -> Iterator[tuple[Any | None, str]]: ...
    def __next__(self) -> tuple[Any | None, str]: ...

@final
class NativeLive:
    def __new__(cls, scene: NativeScene, everything: bool) -> NativeLive: ...
    def step(self, poses: Floats) -> tuple[Any | None, str]: ...
    def restart(self) -> None: ...
