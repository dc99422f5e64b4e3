"""A ROS 2 node that reads a sensor: `python -m domecast.ros --ros-args -p constants:=constants.json -p device:=/dev/video0`.

It uses the rclpy and the messages of the ROS 2 that is sourced; the wheel brings none. Frames come from `device`, a camera or
player of `domecast live`, or, where that is empty, from the topic `image` (`sensor_msgs/Image`, rgb8, bgr8 or mono8) of another
node. Under `~/` it publishes

| topic | type | what |
|---|---|---|
| `image` | `sensor_msgs/Image` | the frame that was read, where it comes from `device` |
| `wrench` | `geometry_msgs/WrenchStamped` | N and N m in `domecast_wrench` |
| `pose` | `geometry_msgs/PoseStamped` | the platform in `domecast_rest`, m |
| `dots` | `sensor_msgs/PointCloud2` | `x y z` at rest in `domecast_sensor`, displacement `dx dy dz` (m; NaN where it is not measured), `id`, `state` |
| `status` | `diagnostic_msgs/DiagnosticArray` | the frame's status |

Fields, frames and numbers of states are those of recordings (`domecast live --record`). Parameters: `constants`, `device`, `rate`,
`exposure_ms` (0: as it stands), `gain` (-1: as it stands), `rest_frames` (0: the constants' rest).
"""

from __future__ import annotations

import importlib
import json
import threading
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from . import _native
from ._error import DomecastError
from ._types import Bytes, Floats, Table

REST, SENSOR, WRENCH, CAMERA = "domecast_rest", "domecast_sensor", "domecast_wrench", "domecast_camera"
STATES = (
    "ok", "missing", "lost", "merged", "identity_unsure", "dirty", "smeared", "glare", "partly_hidden", "hidden",
)
M_PER_MM = 1e-3
# sensor_msgs/PointField's numbers of types
UINT8, UINT32, FLOAT32 = 2, 6, 7
# name, offset in bytes, type
FIELDS = (
    ("x", 0, FLOAT32), ("y", 4, FLOAT32), ("z", 8, FLOAT32),
    ("dx", 12, FLOAT32), ("dy", 16, FLOAT32), ("dz", 20, FLOAT32),
    ("id", 24, UINT32), ("state", 28, UINT8),
)
FORMATS = {UINT8: "u1", UINT32: "<u4", FLOAT32: "<f4"}
POINT = np.dtype({
    "names": [name for name, _, _ in FIELDS],
    "formats": [FORMATS[kind] for _, _, kind in FIELDS],
    "offsets": [offset for _, offset, _ in FIELDS],
    "itemsize": 32,
})


def quaternion(matrix: Floats) -> tuple[float, float, float, float]:
    """x, y, z, w of a rotation, w from 0 (J. Guidance and Control 1, 1978, p. 223: the largest part first)."""
    trace = float(np.trace(matrix))
    parts = [float(matrix[0, 0]), float(matrix[1, 1]), float(matrix[2, 2]), trace]
    largest = int(np.argmax(parts))
    q = np.empty(4)
    if largest == 3:
        q[3] = 1.0 + trace
        q[:3] = matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]
    else:
        i, j, k = largest, (largest + 1) % 3, (largest + 2) % 3
        q[i] = 1.0 - trace + 2.0 * matrix[i, i]
        q[j], q[k] = matrix[j, i] + matrix[i, j], matrix[k, i] + matrix[i, k]
        q[3] = matrix[k, j] - matrix[j, k]
    q /= np.linalg.norm(q) if q[3] >= 0 else -np.linalg.norm(q)
    return float(q[0]), float(q[1]), float(q[2]), float(q[3])


def points(dots: Table, rest_mm: Floats) -> Table:
    """A point for each dot: where it is at rest, its displacement, number and state."""
    table = np.zeros(len(dots), POINT)
    moved = np.asarray(dots["displacement_mm"])
    for axis, (at, by) in enumerate((("x", "dx"), ("y", "dy"), ("z", "dz"))):
        table[at] = rest_mm[:, axis] * M_PER_MM
        table[by] = moved[:, axis] * M_PER_MM
    table["id"] = dots["id"]
    table["state"] = [STATES.index(str(state)) for state in dots["state"]]
    return table


def frame_of(message: Any) -> tuple[Bytes, bool]:
    """The frame of a `sensor_msgs/Image`, and whether red comes first."""
    encoding, width, height = str(message.encoding), int(message.width), int(message.height)
    channels = {"rgb8": 3, "bgr8": 3, "mono8": 1}.get(encoding)
    if channels is None:
        raise ValueError(f"an image of {encoding!r}: rgb8, bgr8 and mono8 are read")
    step = int(message.step)
    data = np.frombuffer(message.data, np.uint8)
    if step < width * channels or data.size < step * height:
        raise ValueError(f"an image of {width} x {height} with rows of {step} bytes, {data.size} in all: it is cut off")
    rows = data[: step * height].reshape(height, step)[:, : width * channels]
    return rows.reshape((height, width, channels) if channels == 3 else (height, width)), encoding != "bgr8"


class TouchPublisher:
    """Tracks frames and publishes what they say, by the node that is given."""

    def __init__(self, node: Any, sensor: _native.Sensor, *, rest_frames: int = 0) -> None:
        """`node`: an `rclpy.node.Node`. `rest_frames`: the first so many good frames are without load."""
        self.node = node
        # the order of colours is no guess here: the device or the encoding says it
        self.tracker = _native.Tracker(sensor, reference=rest_frames or None, check_colours=False)
        tree = json.loads(sensor.json())
        self._design = str(tree["design"])
        self._rest_mm = np.array([dot["surface_mm"] for dot in tree["black_dots"]], dtype=np.float64).reshape(-1, 3)
        messages = {
            name: importlib.import_module(f"{name}.msg")
            for name in ("sensor_msgs", "geometry_msgs", "diagnostic_msgs", "std_msgs")
        }
        self._sensor_msgs: Any = messages["sensor_msgs"]
        self._geometry_msgs: Any = messages["geometry_msgs"]
        self._diagnostic_msgs: Any = messages["diagnostic_msgs"]
        self._std_msgs: Any = messages["std_msgs"]
        kinds = {
            "image": self._sensor_msgs.Image,
            "wrench": self._geometry_msgs.WrenchStamped,
            "pose": self._geometry_msgs.PoseStamped,
            "dots": self._sensor_msgs.PointCloud2,
            "status": self._diagnostic_msgs.DiagnosticArray,
        }
        # what is old is of no use to a controller: the depth is one message
        self._publishers: dict[str, Any] = {
            name: node.create_publisher(kind, f"~/{name}", 1) for name, kind in kinds.items()
        }

    def _header(self, stamp: Any, frame_id: str) -> Any:
        header = self._std_msgs.Header()
        header.stamp = stamp
        header.frame_id = frame_id
        return header

    def publish(
        self, frame: Bytes, stamp: Any, *, rgb: bool, image: bool, time_s: float | None = None, number: int | None = None
    ) -> _native.Reading:
        """Tracks a frame and publishes it; `stamp`: a `builtin_interfaces/Time`; `image`: the frame too."""
        reading = self.tracker.update(frame, rgb=rgb, time=time_s, number=number)
        if image:
            self._publishers["image"].publish(self.image(frame, stamp, rgb=rgb))
        if reading.wrench is not None:
            self._publishers["wrench"].publish(self.wrench(reading.wrench, stamp))
        if reading.pose is not None:
            self._publishers["pose"].publish(self.pose(reading.pose, stamp))
        self._publishers["dots"].publish(self.dots(reading, stamp))
        self._publishers["status"].publish(self.status(reading, stamp))
        return reading

    def image(self, frame: Bytes, stamp: Any, *, rgb: bool) -> Any:
        """A frame as `sensor_msgs/Image`."""
        message = self._sensor_msgs.Image()
        message.header = self._header(stamp, CAMERA)
        message.height, message.width = frame.shape[:2]
        message.encoding = "mono8" if frame.ndim == 2 else "rgb8" if rgb else "bgr8"
        message.is_bigendian = 0
        message.step = frame.shape[1] * (1 if frame.ndim == 2 else 3)
        message.data = frame.tobytes()
        return message

    def wrench(self, wrench: Floats, stamp: Any) -> Any:
        """N and N m."""
        message = self._geometry_msgs.WrenchStamped()
        message.header = self._header(stamp, WRENCH)
        values = [float(v) for v in wrench]
        force, torque = message.wrench.force, message.wrench.torque
        force.x, force.y, force.z = values[:3]
        torque.x, torque.y, torque.z = (v * M_PER_MM for v in values[3:])
        return message

    def pose(self, pose: Floats, stamp: Any) -> Any:
        """The platform in the frame that it rests in, m."""
        message = self._geometry_msgs.PoseStamped()
        message.header = self._header(stamp, REST)
        at, turn = message.pose.position, message.pose.orientation
        at.x, at.y, at.z = (float(v) * M_PER_MM for v in pose[:3, 3])
        turn.x, turn.y, turn.z, turn.w = quaternion(pose[:3, :3])
        return message

    def dots(self, reading: _native.Reading, stamp: Any) -> Any:
        """Each dot at rest and its displacement, m."""
        table = points(reading.dots, self._rest_mm)
        message = self._sensor_msgs.PointCloud2()
        message.header = self._header(stamp, SENSOR)
        message.height, message.width = 1, len(table)
        fields: list[Any] = []
        for name, offset, kind in FIELDS:
            field = self._sensor_msgs.PointField()
            field.name, field.offset, field.datatype, field.count = name, offset, kind, 1
            fields.append(field)
        message.fields = fields
        message.is_bigendian, message.is_dense = False, False
        message.point_step, message.row_step = POINT.itemsize, POINT.itemsize * len(table)
        message.data = table.tobytes()
        return message

    def status(self, reading: _native.Reading, stamp: Any) -> Any:
        """OK; a warning where there are numbers all the same; an error where there is no pose."""
        status = self._diagnostic_msgs.DiagnosticStatus()
        level = 0 if not reading.problems else 1 if reading.pose is not None else 2
        # the message's type is `byte`
        status.level = bytes([level])
        status.name, status.message, status.hardware_id = "domecast", reading.status, self._design
        dots = reading.dots
        told = {
            "frame": str(reading.frame),
            "problems": ",".join(reading.problems),
            "dots_ok": str(int(np.count_nonzero(dots["state"] == "ok"))),
            "dots": str(len(dots)),
        }
        values: list[Any] = []
        for key, value in told.items():
            pair = self._diagnostic_msgs.KeyValue()
            pair.key, pair.value = key, value
            values.append(pair)
        status.values = values
        message = self._diagnostic_msgs.DiagnosticArray()
        message.header = self._header(stamp, SENSOR)
        message.status = [status]
        return message


class TouchNode:
    """The node: parameters, and frames from a device or a topic. It holds an `rclpy.node.Node` as `node`."""

    def __init__(self, node: Any) -> None:
        self.node = node
        defaults: dict[str, Any] = {
            "constants": "", "device": "", "rate": 30.0, "exposure_ms": 0.0, "gain": -1, "rest_frames": 0,
        }
        for name, value in defaults.items():
            node.declare_parameter(name, value)
        given = {name: node.get_parameter(name).value for name in defaults}
        if not given["constants"]:
            raise DomecastError("constants: the parameter is missing; the constants.json of the sensor is needed")
        sensor = _native.Sensor.load(str(given["constants"]))
        self.publisher = TouchPublisher(node, sensor, rest_frames=int(given["rest_frames"]))
        self._is_stopped = threading.Event()
        self._thread: threading.Thread | None = None
        self.failed: BaseException | None = None
        if given["device"]:
            camera = _native.Camera(
                str(given["device"]),
                sensor,
                rate=float(given["rate"]),
                exposure_ms=float(given["exposure_ms"]) or None,
                gain=None if int(given["gain"]) < 0 else int(given["gain"]),
            )
            self._thread = threading.Thread(target=self._read, args=(camera,), daemon=True)
            self._thread.start()
        else:
            image: Any = importlib.import_module("sensor_msgs.msg").Image
            # frames of a camera: the newest counts
            node.create_subscription(image, "image", self._take, 1)

    def _read(self, camera: _native.Camera) -> None:
        try:
            for frame, time_s, number in camera:
                if self._is_stopped.is_set():
                    return
                stamp = self.node.get_clock().now().to_msg()
                self.publisher.publish(frame, stamp, rgb=True, image=True, time_s=time_s, number=number)
        except Exception as error:
            self.failed = error
            self.node.get_logger().error(str(error))

    def _take(self, message: Any) -> None:
        try:
            frame, rgb = frame_of(message)
            stamp = message.header.stamp
            time_s = float(stamp.sec) + 1e-9 * float(stamp.nanosec)
            self.publisher.publish(frame, stamp, rgb=rgb, image=False, time_s=time_s)
        except (ValueError, TypeError) as error:
            # another frame may be good; the node stays
            self.node.get_logger().error(str(error), throttle_duration_sec=5.0)

    @property
    def is_over(self) -> bool:
        """Whether the device has ended."""
        return self._thread is not None and not self._thread.is_alive()

    def stop(self) -> None:
        """Ends the reading of the device."""
        self._is_stopped.set()
        if self._thread is not None:
            self._thread.join(timeout=2.0)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the node until Ctrl-C, or the end of its device."""
    rclpy: Any = importlib.import_module("rclpy")
    rclpy.init(args=None if arguments is None else list(arguments))
    node: Any = rclpy.create_node("domecast")
    touch: TouchNode | None = None
    try:
        touch = TouchNode(node)
        is_ok: Callable[[], bool] = rclpy.ok
        while is_ok() and not touch.is_over:
            rclpy.spin_once(node, timeout_sec=0.2)
    except KeyboardInterrupt:
        pass
    except (DomecastError, OSError) as error:
        node.get_logger().error(str(error))
        return 1
    finally:
        if touch is not None:
            touch.stop()
        node.destroy_node()
        if rclpy.ok():
            rclpy.shutdown()
    return 1 if touch is not None and touch.failed is not None else 0


if __name__ == "__main__":
    raise SystemExit(main())
