"""Names of the arrays, for annotations alone."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

Bytes: TypeAlias = npt.NDArray[np.uint8]
Floats: TypeAlias = npt.NDArray[np.float64]
Floats32: TypeAlias = npt.NDArray[np.float32]
Names: TypeAlias = npt.NDArray[np.str_]
Table: TypeAlias = npt.NDArray[Any]
