"""Fields of the structured arrays, and the frame that shows itself. Imported when it is needed: numpy takes its time."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import _native

_NAME = "U16"

# in the order in which the Rust side writes them
LAYOUT_DOT = np.dtype([
    ("id", "u4"), ("pass", "u4"), ("image_px", "f8", 2), ("surface_mm", "f8", 3), ("normal", "f8", 3),
    ("plate_mm", "f8", 2), ("diameter_mm", "f8"),
])
DOT = np.dtype([
    ("id", "u4"), ("state", _NAME), ("image_px", "f8", 2), ("centroid_px", "f8", 2), ("sd_px", "f8"),
    ("undeformed_px", "f8", 2), ("motion_px", "f8", 2), ("displacement_mm", "f8", 3),
    ("displacement_sd_random_mm", "f8"), ("ray", "f8", 3),
])
MARKER = np.dtype([
    ("id", "u4"), ("state", _NAME), ("image_px", "f8", 2), ("centroid_px", "f8", 2), ("sd_px", "f8"),
    ("residual_px", "f8", 2),
])
TRACTION = np.dtype([("id", "u4"), ("surface_mm", "f8", 3), ("depth_sd_mm", "f8"), ("traction_n_mm2", "f8", 3), ("noise_sd_n_mm2", "f8"), ("sd_n_mm2", "f8")])


class Frame(np.ndarray[Any, np.dtype[np.uint8]]):
    """A simulated frame: an array of uint8 with red first, which a notebook shows as a picture."""

    def _repr_png_(self) -> bytes | None:
        is_frame = self.dtype == np.uint8 and (self.ndim == 2 or (self.ndim == 3 and self.shape[2] == 3))
        return _native.png(self, rgb=True) if is_frame and self.size else None
