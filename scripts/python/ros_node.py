"""The wheel's ROS 2 node beside a stub of rclpy and of the messages, whose fields are those of ROS 2 and no others.

    ros_node.py CONSTANTS FRAMES_FOLDER

What is published must be what a tracker reads of the same frames; poses and point clouds are read back by OpenCV and by hand.
"""

import struct
import sys
import tempfile
import types
from pathlib import Path

import cv2
import domecast
import numpy as np

CONSTANTS, FOLDER = Path(sys.argv[1]), Path(sys.argv[2])
FAULTS = []


def check(is_so, what):
    print(f"{'ok  ' if is_so else 'FAIL'} {what}")
    if not is_so:
        FAULTS.append(what)


def message(name, /, **fields):
    """A class of a message: only its own fields can be set, each of its own type."""
    def begin(self):
        for field, make in fields.items():
            object.__setattr__(self, field, make())

    def put(self, field, value):
        if field not in fields:
            raise AttributeError(f"{name} has no field {field}")
        kind = type(fields[field]())
        if kind in (int, float, str, bytes, bool) and type(value) is not kind and not (kind is bytes and isinstance(value, (bytes, bytearray))):
            raise AssertionError(f"{name}.{field} must be {kind.__name__}, not {type(value).__name__}")
        object.__setattr__(self, field, value)
    return type(name, (), {"__init__": begin, "__setattr__": put})


Time = message("Time", sec=int, nanosec=int)
Header = message("Header", stamp=Time, frame_id=str)
Vector3 = message("Vector3", x=float, y=float, z=float)
Quaternion = message("Quaternion", x=float, y=float, z=float, w=float)
Wrench = message("Wrench", force=Vector3, torque=Vector3)
Pose = message("Pose", position=Vector3, orientation=Quaternion)
MODULES = {
    "std_msgs.msg": {"Header": Header},
    "geometry_msgs.msg": {
        "WrenchStamped": message("WrenchStamped", header=Header, wrench=Wrench),
        "PoseStamped": message("PoseStamped", header=Header, pose=Pose),
    },
    "sensor_msgs.msg": {
        "Image": message("Image", header=Header, height=int, width=int, encoding=str, is_bigendian=int, step=int, data=bytes),
        "PointField": message("PointField", name=str, offset=int, datatype=int, count=int),
        "PointCloud2": message("PointCloud2", header=Header, height=int, width=int, fields=list, is_bigendian=bool, point_step=int,
                               row_step=int, data=bytes, is_dense=bool),
    },
    "diagnostic_msgs.msg": {
        "KeyValue": message("KeyValue", key=str, value=str),
        "DiagnosticStatus": message("DiagnosticStatus", level=bytes, name=str, message=str, hardware_id=str, values=list),
        "DiagnosticArray": message("DiagnosticArray", header=Header, status=list),
    },
}


class Logger:
    def __init__(self):
        self.lines = []

    def error(self, text, throttle_duration_sec=None):
        self.lines.append(text)


class Node:
    def __init__(self, given):
        self.given, self.values, self.published, self.subscribed, self.logger = given, {}, {}, {}, Logger()

    def declare_parameter(self, name, default):
        value = self.given.get(name, default)
        assert type(value) is type(default), f"the parameter {name} is of {type(default)}"
        self.values[name] = value

    def get_parameter(self, name):
        return types.SimpleNamespace(value=self.values[name])

    def create_publisher(self, kind, topic, depth):
        self.published[topic] = []

        def publish(one):
            assert type(one) is kind, (topic, one)
            self.published[topic].append(one)
        return types.SimpleNamespace(publish=publish)

    def create_subscription(self, kind, topic, call, depth):
        self.subscribed[topic] = call

    def get_clock(self):
        now = Time()
        now.sec = 7
        return types.SimpleNamespace(now=lambda: types.SimpleNamespace(to_msg=lambda: now))

    def get_logger(self):
        return self.logger

    def destroy_node(self):
        self.values["destroyed"] = True


NODES = []


def stub(given):
    """rclpy as the node uses it."""
    state = {"ok": False}
    rclpy = types.ModuleType("rclpy")
    rclpy.init = lambda args=None: state.update(ok=True)
    rclpy.create_node = lambda name: NODES.append(Node(given)) or NODES[-1]
    rclpy.ok = lambda: state["ok"]
    rclpy.spin_once = lambda node, timeout_sec: __import__("time").sleep(0.01)
    rclpy.shutdown = lambda: state.update(ok=False)
    sys.modules["rclpy"] = rclpy
    for name, kinds in MODULES.items():
        package = name.split(".")[0]
        sys.modules[package] = types.ModuleType(package)
        sys.modules[name] = types.ModuleType(name)
        for kind, one in kinds.items():
            setattr(sys.modules[name], kind, one)


def judge(node, frames, rgb, title, has_image, rate):
    """Every message against a tracker of our own."""
    tracker = domecast.Tracker(domecast.Sensor.load(CONSTANTS), check_colours=False)
    readings = [tracker.update(frame, rgb=rgb, time=k / rate) for k, frame in enumerate(frames)]
    with_pose = [one for one in readings if one.pose is not None]
    out = node.published
    check(len(out["~/dots"]) == len(out["~/status"]) == len(frames), f"{title}: {len(frames)} messages of dots and status")
    check(len(out["~/wrench"]) == len(out["~/pose"]) == len(with_pose) > 0, f"{title}: a wrench and a pose for each frame that has one")
    same = True
    for reading, wrench, pose in zip(with_pose, out["~/wrench"], out["~/pose"]):
        force, torque = wrench.wrench.force, wrench.wrench.torque
        same &= [force.x, force.y, force.z, torque.x * 1e3, torque.y * 1e3, torque.z * 1e3] == [*reading.wrench[:3], *(reading.wrench[3:] * 1e-3 * 1e3)]
        at, q = pose.pose.position, pose.pose.orientation
        angle = 2 * np.arctan2(np.linalg.norm([q.x, q.y, q.z]), q.w)
        turn = np.array([q.x, q.y, q.z]) * (angle / max(np.sin(angle / 2), 1e-300) if angle else 0)
        same &= np.allclose(cv2.Rodrigues(turn)[0], reading.pose[:3, :3], atol=1e-12)
        same &= np.allclose([at.x, at.y, at.z], reading.pose[:3, 3] * 1e-3, atol=0, rtol=1e-15)
    check(bool(same), f"{title}: wrenches and poses")
    clouds = True
    for reading, cloud in zip(readings, out["~/dots"]):
        at = {field.name: (field.offset, {2: "B", 6: "<I", 7: "<f"}[field.datatype]) for field in cloud.fields}
        read = [{name: struct.unpack_from(code, cloud.data, k * cloud.point_step + offset)[0] for name, (offset, code) in at.items()}
                for k in range(cloud.width)]
        dots = reading.dots
        clouds &= len(cloud.data) == cloud.row_step * cloud.height and len(read) == len(dots)
        clouds &= [one["id"] for one in read] == dots["id"].tolist()
        moved = np.array([[one["dx"], one["dy"], one["dz"]] for one in read]) * 1e3
        clouds &= np.allclose(moved, dots["displacement_mm"], atol=1e-6, equal_nan=True)
        clouds &= all((one["state"] == 0) == (state == "ok") for one, state in zip(read, dots["state"]))
    check(bool(clouds), f"{title}: dots of the point clouds")
    status = [(one.status[0].message, one.status[0].level) for one in out["~/status"]]
    expected = [(one.status, bytes([0 if not one.problems else 1 if one.pose is not None else 2])) for one in readings]
    check(status == expected, f"{title}: status {status if status != expected else ''}")
    images = out["~/image"]
    check(len(images) == (len(frames) if has_image else 0), f"{title}: images")
    if has_image:
        first = np.frombuffer(images[0].data, np.uint8).reshape(frames[0].shape)
        check(np.array_equal(first, frames[0]) and images[0].encoding == "rgb8", f"{title}: pixels of the image")


def main():
    files = sorted(FOLDER.glob("*.png"))[:6]
    bgr = [cv2.imread(str(path)) for path in files]
    with tempfile.TemporaryDirectory() as place:
        for path in files:
            (Path(place) / path.name).write_bytes(path.read_bytes())
        # a player by the node's own main
        device = f"player:{place}?rate=20"
        stub({"constants": str(CONSTANTS), "device": device})
        import domecast.ros
        code = domecast.ros.main([])
        node = NODES[-1]
        check(code == 0 and node.values["destroyed"] and not node.logger.lines, f"the node ends with its device: {code}, {node.logger.lines}")
        judge(node, [frame[:, :, ::-1].copy() for frame in bgr], True, "device", True, 20)
        # the camera by itself
        sensor = domecast.Sensor.load(CONSTANTS)
        camera = list(domecast.Camera(device, sensor))
        check([number for _, _, number in camera] == list(range(len(files))), "Camera: numbers")
        check(all(np.array_equal(frame, own[:, :, ::-1]) for (frame, _, _), own in zip(camera, bgr)), "Camera: pixels")
        for wrong in (lambda: domecast.Camera("player:nowhere", sensor), lambda: domecast.Camera("/dev/null", sensor),
                      lambda: domecast.Camera(device, sensor, rate=0), lambda: domecast.Camera("-", sensor)):
            try:
                wrong()
                check(False, "Camera: a wrong device or rate is refused")
            except domecast.DomecastError as error:
                check(bool(error.field), f"Camera: {error}")
    # frames of a topic
    stub({"constants": str(CONSTANTS)})
    node = Node({"constants": str(CONSTANTS)})
    touch = domecast.ros.TouchNode(node)
    Image = sys.modules["sensor_msgs.msg"].Image

    def image(frame, encoding, pad=0):
        one = Image()
        one.height, one.width = frame.shape[:2]
        rows = np.pad(frame.reshape(frame.shape[0], -1), ((0, 0), (0, pad)))
        one.encoding, one.step, one.data = encoding, rows.shape[1], rows.tobytes()
        return one

    for k, frame in enumerate(bgr):
        one = image(frame, "bgr8", pad=5)
        one.header.stamp.nanosec = round(k * 1e9 / 30)
        node.subscribed["image"](one)
    judge(node, bgr, False, "topic", False, 30)
    node.subscribed["image"](image(bgr[0], "yuv422"))
    cut = image(bgr[0], "bgr8")
    cut.data = cut.data[:1000]
    node.subscribed["image"](cut)
    node.subscribed["image"](image(bgr[0][:100], "bgr8"))
    check(len(node.logger.lines) >= 2 and "yuv422" in node.logger.lines[0] and "cut off" in node.logger.lines[1], "wrong images are named, the node stays")
    touch.stop()
    # a node without constants says so
    stub({})
    code = domecast.ros.main([])
    check(code == 1 and "constants" in NODES[-1].logger.lines[0], "a missing parameter is named")
    sys.exit(1 if FAULTS else 0)


if __name__ == "__main__":
    main()
