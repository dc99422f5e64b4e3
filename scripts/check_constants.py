"""Reads the constants of a build with the programs that they are for, and checks what they say.

    python3 scripts/check_constants.py output/thumb24 [...]

OpenCV: FileStorage, projectPoints against `image_px` where no layer refracts, solvePnP with the plain
runtime's constants over the loads of `report/force.json`, through a refraction written here a second
time; the bounds of the resolution by differences of it; the springs' law by differences of an energy. PyYAML, and the rules of the programs that own the forms: camera_info
and camchain. yourdfpy: URDF. mujoco: MJCF, stepped under a known load.
"""
import json
import pathlib
import sys
import xml.etree.ElementTree as ET

import cv2
import numpy as np
import yaml

from spring_law import SpringLaw

failed = 0


def check(what, holds, detail=""):
    global failed
    failed += not holds
    print(f"{'ok  ' if holds else 'FAIL'} {what:<46} {detail}")


def numbers(store, name):
    return store.getNode(name).mat()


def lens_project(camera, rays):
    """Pixels of rays (n, 3) by OpenCV."""
    K, D = np.array(camera["matrix"]), np.array(camera["distortion"], float)
    zero = np.zeros(3)
    if camera["model"] == "kannala_brandt":
        return cv2.fisheye.projectPoints(rays[:, None], zero, zero, K, D)[0][:, 0]
    return cv2.projectPoints(rays, zero, zero, K, D if len(D) else None)[0][:, 0]


def refracted_rays(constants, pose, points):
    """Directions in the camera's air of points on the sheet's top, by bisection on Snell's invariant."""
    rest_from_camera = np.linalg.inv(np.array(constants["camera"]["camera_from_sensor"]))
    sensor_from_camera = np.linalg.inv(pose) @ rest_from_camera
    pupil, R = sensor_from_camera[:3, 3], sensor_from_camera[:3, :3]
    flat = [(l["index"], l["thickness_mm"]) for l in constants["optics"]["layers"][1:] if l["thickness_mm"]]
    gap = -sum(d for _, d in flat) - pupil[2]
    side = np.asarray(points, float)[:, :2] - pupil[:2]
    reach = np.linalg.norm(side, axis=1)
    low, high = np.zeros(len(side)), np.ones(len(side))
    for _ in range(60):
        s = 0.5 * (low + high)
        far = gap * s / np.sqrt(1 - s * s) + sum(d * s / np.sqrt(n * n - s * s) for n, d in flat)
        low, high = np.where(far < reach, s, low), np.where(far < reach, high, s)
    s = 0.5 * (low + high)
    direction = np.c_[s[:, None] * side / np.maximum(reach, 1e-300)[:, None], np.sqrt(1 - s * s)]
    return direction @ R


def unproject(camera, pixel, ray):
    """The ray of a pixel near a known ray: Newton with differences."""
    for _ in range(20):
        plane = ray[:2] / ray[2]
        at = lambda p: lens_project(camera, np.array([[p[0], p[1], 1.0]]))[0]
        h, left = 1e-6, pixel - at(plane)
        if np.abs(left).max() < 1e-11:
            break
        J = np.stack([(at(plane + h * e) - at(plane - h * e)) / (2 * h) for e in np.eye(2)], axis=1)
        plane = plane + np.linalg.solve(J, left)
        ray = np.r_[plane, 1.0]
    return ray / np.linalg.norm(ray)


def undistorted_centroids(constants, pose):
    """Centroids of the discs' images in the undistorted frame."""
    found, Ku = [], np.array(constants["camera"]["undistorted_matrix"])
    phi = np.linspace(0, 2 * np.pi, 180, endpoint=False)
    for marker in constants["white_markers"]:
        center, r = np.array(marker["position_mm"]), marker["diameter_mm"] / 2
        ring = center + r * np.stack([np.cos(phi), np.sin(phi), 0 * phi], axis=1)
        x = lens_project(constants["camera"], refracted_rays(constants, pose, ring))
        y = np.roll(x, -1, axis=0)
        cross = x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]
        centroid = ((x + y) * cross[:, None]).sum(0) / (3 * cross.sum())
        start = refracted_rays(constants, pose, [center])[0]
        ray = unproject(constants["camera"], centroid, start)
        found.append((Ku @ (ray / ray[2]))[:2])
    return np.array(found)


def solve(points, pixels, Ku):
    _, r, t = cv2.solvePnP(points, pixels, Ku, None, flags=cv2.SOLVEPNP_ITERATIVE)
    r, t = cv2.solvePnPRefineLM(points, pixels, Ku, None, r, t,
                                (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 200, 1e-14))
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = cv2.Rodrigues(r)[0], t[:, 0]
    return pose


def displacement(pose, rest, at):
    moved = np.linalg.inv(rest) @ pose
    return np.r_[moved[:3, :3] @ at + moved[:3, 3] - at, cv2.Rodrigues(moved[:3, :3])[0][:, 0]]


def posed(d, at):
    """rest_from_platform of a displacement about `at`."""
    pose = np.eye(4)
    pose[:3, :3] = cv2.Rodrigues(np.asarray(d[3:], float))[0]
    pose[:3, 3] = at + d[:3] - pose[:3, :3] @ at
    return pose


def all_round(d):
    """A displacement at the four quarter turns about the axis, and mirrored."""
    for one in (d, d * [1, -1, 1, -1, 1, -1]):
        for quarter in range(4):
            c, s = [(1, 0), (0, 1), (-1, 0), (0, -1)][quarter]
            turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]], float)
            yield np.r_[turn @ one[:3], turn @ one[3:]]


def check_plain_runtime(constants, report):
    """Mean wrench bias over the claimed loads, relative to the rest frame, against the linear law."""
    springs = constants["springs"]
    plain = springs.get("plain_runtime")
    if plain is None:
        check("plain runtime", False, "no plain_runtime in the constants")
        return
    at, Ku = np.array(springs["at_mm"]), np.array(constants["camera"]["undistorted_matrix"])
    K = np.array(springs["stiffness"])
    true = np.array([m["position_mm"] for m in constants["white_markers"]])
    seen_at = np.array([m["apparent_position_mm"] for m in constants["white_markers"]])
    at_rest = undistorted_centroids(constants, np.eye(4))
    own_rest, naive_rest = solve(seen_at, at_rest, Ku), solve(true, at_rest, Ku)
    away = np.abs(own_rest - np.array(plain["rest_pose"])).max()
    check("solvePnP at rest gives rest_pose", away < 2e-4, f"{away:.1e}")
    left, naive = [], []
    # The claims at a third, two thirds and in whole, and half and half with each other, all round.
    claims = [np.array(claim["displacement"]) for claim in report["claims"]]
    base = [d * part for d in claims for part in (1 / 3, 2 / 3, 1.0)]
    base += [0.5 * (d + other) for i, one in enumerate(claims) for d in list(all_round(one))[:4] for other in claims[:i]]
    loads = {tuple(np.round(d, 9)): d for one in base for d in all_round(one)}
    for d in loads.values():
        pixels = undistorted_centroids(constants, posed(d, at))
        own = displacement(solve(seen_at, pixels, Ku), np.array(plain["rest_pose"]), at)
        other = displacement(solve(true, pixels, Ku), naive_rest, at)
        left.append(np.array(plain["stiffness"]) @ own - K @ d)
        naive.append(K @ other - K @ d)
    left, naive = np.abs(left).mean(0), np.abs(naive).mean(0)
    refracts = any(l["index"] != 1.0 for l in constants["optics"]["layers"])
    for axis, name in enumerate(("Fx", "Fy", "Fz", "Mx", "My", "Mz")):
        factor = 10 if refracts and name in ("Fz", "Mx", "My") else 1
        # What cv2's own solver leaves, and a row that refraction does not bias. A bias of a fiftieth of what a single
        # frame's noise does to the axis (thumb24-fisheye's Mx, My) does not matter, whatever the naive one is: noise
        # of 0.1 px, as the paper's centroids have, whatever the markers' contrast would allow.
        trifle = report["resolution_at_rest"]["wrench_sd"][axis] * 0.1 / report["centroid_noise_px"] / 50
        check(f"plain runtime against naive, {name}",
              factor * left[axis] <= naive[axis] * 1.01 + 2e-4 or left[axis] <= min(trifle, naive[axis]),
              f"{left[axis]:.5f}, naive {naive[axis]:.5f}, one frame's noise {50 * trifle:.5f}")


def distorted_centroids(constants, pose):
    """Centroids of the discs' images in the raw frame."""
    found = []
    phi = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    for marker in constants["white_markers"]:
        ring = np.array(marker["position_mm"]) + marker["diameter_mm"] / 2 * np.stack(
            [np.cos(phi), np.sin(phi), 0 * phi], axis=1)
        x = lens_project(constants["camera"], refracted_rays(constants, pose, ring))
        x, y = x - x.mean(0), np.roll(x - x.mean(0), -1, axis=0)
        cross = x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]
        found.append(((x + y) * cross[:, None]).sum(0) / (3 * cross.sum())
                     + lens_project(constants["camera"], refracted_rays(constants, pose, ring)).mean(0))
    return np.array(found)


def check_resolution(constants, report):
    """The bound of the report from a Jacobian by differences; without layers, from cv2.solvePnP under noise."""
    # each marker's own, from its contrast in the lit frame
    springs, noise = constants["springs"], np.repeat(report["centroid_noise_px_by_marker"], 2)
    at, K = np.array(springs["at_mm"]), np.array(springs["stiffness"])
    step = np.array([1e-3] * 3 + [1e-4] * 3)
    J = np.stack([(distorted_centroids(constants, posed(h, at)) - distorted_centroids(constants, posed(-h, at))).ravel()
                  for h in np.diag(step)], axis=1) / (2 * step)
    covariance = np.linalg.inv(J.T @ (J / noise[:, None] ** 2))
    sd = np.sqrt(np.diag(covariance)) * np.r_[1, 1, 1, [180 / np.pi] * 3]
    wrench = np.sqrt(np.diag(K @ covariance @ K.T))
    said = report["resolution_at_rest"]
    check("bound of the pose", np.allclose(sd, said["pose_sd"], rtol=2e-2), str(np.round(sd, 5)))
    check("bound of the wrench", np.allclose(wrench, said["wrench_sd"], rtol=2e-2), str(np.round(wrench, 4)))
    if any(l["index"] != 1.0 for l in constants["optics"]["layers"]) or constants["camera"]["distortion"]:
        return
    rng, camera = np.random.default_rng(1), np.array(constants["camera"]["matrix"])
    points = np.array([m["position_mm"] for m in constants["white_markers"]])
    exact, found = distorted_centroids(constants, np.eye(4)), []
    for _ in range(1500):
        found.append(displacement(solve(points, exact + rng.normal(0, 1, exact.shape) * noise.reshape(-1, 2), camera),
                                  np.array(constants["camera"]["camera_from_sensor"]), at))
    spread = np.std(found, axis=0) * np.r_[1, 1, 1, [180 / np.pi] * 3]
    # solvePnP weighs the markers alike, so that of unlike ones it makes a little less than the bound
    alike = np.linalg.inv(J.T @ J) @ J.T
    own = np.sqrt(np.diag(alike * noise ** 2 @ alike.T)) * np.r_[1, 1, 1, [180 / np.pi] * 3]
    check("cv2.solvePnP under noise meets its bound", np.allclose(spread, own, rtol=0.1), str(np.round(spread, 5)))
    check("weighing the markers is not worse", bool((own >= 0.999 * np.array(said["pose_sd"])).all()), str(np.round(own, 5)))


def check_spring_law(constants):
    springs = constants["springs"]
    law = SpringLaw(springs)
    table = springs["stiffness_at"]
    worst = 0.0
    for compression, K in [(0.0, springs["stiffness"])] + [(e["compression_mm"], e["stiffness"]) for e in table[1::2]]:
        own, K = law.stiffness(compression), np.array(K)
        worst = max(worst, np.abs(own - K).max() / np.abs(K).max(), *(np.abs(own - K).max(1) / np.abs(K).max(1)))
    check("springs.law means stiffness and stiffness_at", worst < 1e-4, f"{worst:.1e}")


def check_layer_free(constants):
    if any(l["index"] != 1.0 for l in constants["optics"]["layers"]):
        return
    T = np.array(constants["camera"]["camera_from_sensor"])
    dots = constants["white_markers"] + constants["black_dots"]
    points = np.array([d.get("surface_mm") or d["position_mm"] for d in dots])
    pixels = lens_project(constants["camera"], points @ T[:3, :3].T + T[:3, 3])
    worst = np.abs(pixels - np.array([d["image_px"] for d in dots])).max()
    check("cv2 projects every mark to its image_px", worst < 1e-6, f"{worst:.1e} px")


def check_opencv(folder, constants):
    store = cv2.FileStorage(str(folder / "opencv.yaml"), cv2.FileStorage_READ)
    same = np.array_equal(numbers(store, "camera_matrix"), np.array(constants["camera"]["matrix"]))
    same &= np.array_equal(numbers(store, "undistorted_matrix"), constants["camera"]["undistorted_matrix"])
    same &= np.array_equal(numbers(store, "springs_stiffness"), constants["springs"]["stiffness"])
    same &= np.array_equal(numbers(store, "apparent_white_markers_mm"),
                           [m["apparent_position_mm"] for m in constants["white_markers"]])
    same &= int(store.getNode("image_width").real()) == constants["camera"]["width"]
    check("cv2.FileStorage reads opencv.yaml", bool(same))


def check_ros(folder, constants):
    """What camera_calibration_parsers' parse_yml.cpp reads, key by key: K 3x3, R 3x3, P 3x4, D of rows x cols numbers
    (five for plumb_bob, eight for rational_polynomial, four for equidistant, as sensor_msgs says)."""
    info = yaml.safe_load((folder / "camera_info.yaml").read_text())
    camera, good = constants["camera"], True
    for name, rows, cols in (("camera_matrix", 3, 3), ("rectification_matrix", 3, 3), ("projection_matrix", 3, 4)):
        node = info[name]
        good &= (node["rows"], node["cols"], len(node["data"])) == (rows, cols, rows * cols)
        good &= all(isinstance(v, float) for v in node["data"])
    count = {"plumb_bob": 5, "rational_polynomial": 8, "equidistant": 4}[info["distortion_model"]]
    node = info["distortion_coefficients"]
    good &= node["rows"] * node["cols"] == len(node["data"]) == count
    good &= all(isinstance(info[n], int) for n in ("image_width", "image_height")) and isinstance(info["camera_name"], str)
    good &= set(info) == {"image_width", "image_height", "camera_name", "camera_matrix", "distortion_model",
                          "distortion_coefficients", "rectification_matrix", "projection_matrix"}
    keep = info["camera_matrix"]["data"] == [v for row in camera["matrix"] for v in row]
    keep &= node["data"][:len(camera["distortion"])] == camera["distortion"] and not any(node["data"][len(camera["distortion"]):])
    want = {"kannala_brandt": "equidistant"}.get(camera["model"], "plumb_bob" if len(camera["distortion"]) <= 5 else "rational_polynomial")
    check("camera_info.yaml by its parser's rules", good and keep and info["distortion_model"] == want, info["distortion_model"])


def check_kalibr(folder, constants):
    """The rules of kalibr_common's CameraParameters: model, counts, floats, whole resolution, topic."""
    path, camera = folder / "kalibr.yaml", constants["camera"]
    sayable = camera["model"] != "brown_conrady" or not any(camera["distortion"][4:])
    check("kalibr.yaml stands where it can say the lens", path.exists() == sayable)
    if not path.exists():
        return
    chain = yaml.safe_load(path.read_text())
    cam = chain["cam0"]
    counts = {"radtan": 4, "equidistant": 4, "none": 0}
    good = list(chain) == ["cam0"] and cam["camera_model"] == "pinhole" and isinstance(cam["rostopic"], str)
    good &= len(cam["intrinsics"]) == 4 and all(isinstance(v, float) and v >= 0 for v in cam["intrinsics"])
    good &= len(cam["distortion_coeffs"]) == counts[cam["distortion_model"]]
    good &= cam["resolution"] == [camera["width"], camera["height"]] and all(isinstance(v, int) for v in cam["resolution"])
    model = {"kannala_brandt": "equidistant", "pinhole": "none", "brown_conrady": "radtan"}[camera["model"]]
    K = camera["matrix"]
    good &= cam["intrinsics"] == [K[0][0], K[1][1], K[0][2], K[1][2]] and cam["distortion_model"] == model
    check("kalibr.yaml by its reader's rules", good and cam["distortion_coeffs"] == camera["distortion"][:counts[model]], model)


def hold(model, data, body, force, moment):
    """A known wrench about the site, N and N m, until nothing moves any more: MuJoCo applies forces at the centre of mass."""
    import mujoco

    for step in range(20000):
        lever = data.site("wrench").xpos - data.xipos[body]
        data.xfrc_applied[body] = np.r_[force, moment + np.cross(lever, force)]
        mujoco.mj_step(model, data)
        if step > 100 and np.abs(data.qvel).max() < 1e-9 and np.abs(data.qacc).max() < 1e-6:
            break


def check_robots(folder, constants):
    import mujoco
    import yourdfpy

    robot = yourdfpy.URDF.load(str(folder / "sensor.urdf"), load_meshes=False)
    at = np.array(constants["springs"]["at_mm"]) * 1e-3
    mount = robot.get_transform("sensor", "base")[2, 3]
    check("URDF: frames", set(robot.link_map) == {"base", "sensor", "wrench", "camera"}
          and np.allclose(robot.get_transform("wrench", "sensor")[:3, 3], at), f"sensor {mount * 1e3:.1f} mm up")
    camera = np.linalg.inv(robot.get_transform("camera", "sensor"))
    want = np.array(constants["camera"]["camera_from_sensor"])
    want[:3, 3] *= 1e-3
    check("URDF: camera_from_sensor", np.allclose(camera, want, atol=1e-9))
    for name in ("base", "sensor"):
        inertia = robot.link_map[name].inertial.inertia
        values = np.linalg.eigvalsh(inertia)
        check(f"URDF: inertia of {name}", values.min() > 0 and values.max() < values.sum() - values.max(),
              f"{robot.link_map[name].inertial.mass * 1e3:.2f} g")
    model = mujoco.MjModel.from_xml_path(str(folder / "sensor.xml"))
    model.opt.gravity[:] = 0
    data = mujoco.MjData(model)
    body = model.body("sensor").id
    force, moment = np.array([0.3, -0.2, -2.0]), np.array([2e-3, 1e-3, -1e-3])
    mujoco.mj_forward(model, data)
    start = data.sensor("position").data.copy()
    hold(model, data, body, force, moment)
    R = data.site("wrench").xmat.reshape(3, 3)
    # MuJoCo reports what the body does to its parent at the site: the world's load handed on.
    got_force, got_moment = R @ data.sensor("force").data, R @ data.sensor("torque").data
    sign = -1.0 if got_force @ force < 0 else 1.0
    check("MJCF: force sensor", np.allclose(sign * got_force, force, atol=1e-4), str(np.round(got_force, 4)))
    check("MJCF: torque sensor", np.allclose(sign * got_moment, moment, atol=2e-5), str(np.round(got_moment, 5)))
    # A small load, about the whole 6x6: the platform moves as the constants say, couplings included.
    K = np.array(constants["springs"]["stiffness"])
    small = np.r_[0.02, -0.01, -0.05, 0.2, 0.1, -0.15]
    mujoco.mj_resetData(model, data)
    hold(model, data, body, small[:3], small[3:] * 1e-3)
    moved = np.r_[(data.sensor("position").data - start) * 1e3, cv2.Rodrigues(data.site("wrench").xmat.reshape(3, 3))[0][:, 0]]
    want = np.linalg.solve(K, small)
    check("MJCF: the 6x6 gives way as the constants say", np.allclose(moved, want, rtol=2e-3, atol=2e-6), str(np.round(moved, 5)))


def check_rigid(root, constants):
    """Without springs nothing moves: no marker, no wrench, no joint that could give way."""
    folder, report = root / "constants", json.loads((root / "report" / "force.json").read_text())
    check("rigid mount: no net wrench", report == {"mount": "rigid", "status": "rigid mount: no net wrench"})
    check("rigid mount: no white markers", constants["white_markers"] == [])
    store = cv2.FileStorage(str(folder / "opencv.yaml"), cv2.FileStorage_READ)
    same = np.array_equal(numbers(store, "camera_matrix"), np.array(constants["camera"]["matrix"]))
    check("cv2.FileStorage reads opencv.yaml", same and store.getNode("springs_stiffness").empty())
    mjcf, urdf = ET.parse(folder / "sensor.xml").getroot(), ET.parse(folder / "sensor.urdf").getroot()
    check("MJCF: no joint", not list(mjcf.iter("joint")) and not list(mjcf.iter("tendon")))
    check("URDF: fixed joints alone", {j.get("type") for j in urdf.findall("joint")} == {"fixed"})


for argument in sys.argv[1:]:
    print(argument)
    root = pathlib.Path(argument)
    folder = root / "constants"
    constants = json.loads((folder / "constants.json").read_text())
    check_layer_free(constants)
    if "springs" not in constants:
        check_rigid(root, constants)
        check_ros(folder, constants)
        check_kalibr(folder, constants)
        continue
    check_spring_law(constants)
    check_opencv(folder, constants)
    check_ros(folder, constants)
    check_kalibr(folder, constants)
    check_robots(folder, constants)
    report = json.loads((root / "report" / "force.json").read_text())
    check_plain_runtime(constants, report)
    check_resolution(constants, report)
sys.exit(1 if failed else 0)
