"""Camera tactile sensors with a soft dome: design, make, simulate, calibrate and read them.

>>> import domecast
>>> sensor = domecast.Sensor.load("constants.json")
>>> tracker = domecast.Tracker(sensor)
>>> reading = tracker.update(frame, rgb=True)      # rgb=False for OpenCV's frames, whose first colour is blue
>>> reading.status, reading.wrench, reading.wrench_sd

Lengths are mm, angles rad unless a name says deg, forces N, torques N mm, pixels px with the centre of the top-left one at
(0, 0). Faults are `DomecastError`, with the field. A `Tracker`, a `Shape`, a `Traction`, a `ContactHardness` and a `HardnessModel` serve one
thread each; the rest is free to share. `domecast.mujoco` and `domecast.gym` are for simulators, `domecast.ros` is a node of ROS 2.
"""

from ._commands import accuracy, calibrate_force, calibrate_light, calibrate_optics, calibrate_print, main
from ._design import Design, Optics
from ._error import DomecastError
from ._native import (
    Camera,
    ContactHardness,
    Forces,
    Hardness,
    HardnessModel,
    Layout,
    Reading,
    Sensor,
    Shape,
    ShapeMap,
    Tracker,
    Traction,
    __version__,
)
from ._scene import Scene

__all__ = [
    "Camera",
    "ContactHardness",
    "Design",
    "DomecastError",
    "Forces",
    "Hardness",
    "HardnessModel",
    "Layout",
    "Optics",
    "Reading",
    "Scene",
    "Sensor",
    "Shape",
    "ShapeMap",
    "Tracker",
    "Traction",
    "__version__",
    "accuracy",
    "calibrate_force",
    "calibrate_light",
    "calibrate_optics",
    "calibrate_print",
    "main",
]
