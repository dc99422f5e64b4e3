"""The simulators' side of the wheel, judged by MuJoCo's own geometry and gymnasium's own checker.

    simulators.py REPOSITORY
"""

import json
import sys
import time
import warnings
from pathlib import Path

import domecast
import domecast.gym
import domecast.live
import domecast.mujoco
import gymnasium
import mujoco
import numpy as np
from gymnasium.utils.env_checker import check_env

REPOSITORY = Path(sys.argv[1])
DESIGN = domecast.Design.load(REPOSITORY / "designs/thumb24.json")
FAULTS = []


def check(is_so, what):
    print(f"{'ok  ' if is_so else 'FAIL'} {what}")
    if not is_so:
        FAULTS.append(what)


def model_of(geoms, euler="0 0 0", place="0 0 0", assets=""):
    """A sensor's site on a body that stands turned somewhere, and geoms on a mocap body."""
    text = f"""<mujoco><compiler angle="degree" eulerseq="xyz"/><asset>{assets}</asset><worldbody>
      <geom type="plane" size="1 1 .1" pos="0 0 -1"/>
      <body pos="{place}" euler="{euler}"><site name="fingertip"/><geom name="own" type="sphere" size=".01" pos="0 0 0"/></body>
      <body name="other" mocap="true">{geoms}</body></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(text)
    return model, mujoco.MjData(model)


def put(model, data, at_m, turn=None):
    """The mocap body at a place and turn of the site's frame."""
    mujoco.mj_forward(model, data)
    site = data.site_xmat[0].reshape(3, 3)
    data.mocap_pos[0] = data.site_xpos[0] + site @ np.asarray(at_m)
    rotation = site @ (np.eye(3) if turn is None else turn)
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, np.ascontiguousarray(rotation).ravel())
    data.mocap_quat[0] = quat
    mujoco.mj_forward(model, data)


def felt(geoms, at_m, turn=None, **where):
    """What a sensor that stands `where` feels of geoms at a place and turn of its own frame."""
    model, data = model_of(geoms, **where)
    sensor = domecast.mujoco.TouchSensor(model, "fingertip", DESIGN, images=False)
    put(model, data, at_m, turn)
    return sensor.read(data)


def mujoco_side():
    # a ball of 4 mm, half a millimetre into the dome of 10 mm
    ball, at = '<geom type="sphere" size=".004"/>', (0, 0, 0.0135)
    touch = felt(ball, at)
    scene = {"version": 1, "name": "same", "tolerance": {"px": 0.05, "grey": 16}, "contact": {"level": "linear", "element_mm": 1.0},
             "effects": {"contact": "always"}, "frames": {"count": 1, "rate_hz": 60, "images": False},
             "objects": [{"name": "ball", "shape": {"kind": "sphere", "radius_mm": 4}, "path": [{"time_s": 0, "position_mm": [0, 0, 13.5]}]}]}
    [(_, truth)] = domecast.Scene(scene, design=DESIGN).frames(everything=True)
    check(np.allclose(touch.wrench, truth["wrench"], rtol=1e-3, atol=1e-6), f"a ball: Fz {touch.wrench[2]:.4f} N, as the scene file says")
    moved = felt(ball, at, place="0.3 -0.2 0.7", euler="20 70 130")
    check(np.allclose(moved.wrench, touch.wrench, rtol=1e-6, atol=1e-7), "the same, wherever the sensor stands in the world")
    check(np.allclose(moved.dots_px, touch.dots_px, atol=1e-5, equal_nan=True), "and the same dots")
    check(not np.any(felt(ball, (0, 0, 0.02)).wrench), "a ball beside it is not felt")
    # Off the pole, the force points from the ball into the dome. Springs turn the platform by little.
    side = np.array([np.sin(0.3), 0, np.cos(0.3)])
    aside = felt(ball, 0.0137 * side)
    along = aside.wrench[:3] / np.linalg.norm(aside.wrench[:3])
    check(float(along @ -side) > 0.97, f"a ball at the side pushes along its normal: cosine {float(along @ -side):.4f}")

    def near(name, geoms, at_m, turn=None, part=0.02, **where):
        other = felt(geoms, at_m, turn, **where)
        off = abs(other.wrench[2] / touch.wrench[2] - 1)
        check(off < part, f"{name}: Fz {other.wrench[2]:.4f} N, {100 * off:.2f} % from the ball's")
    across = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    near("the end of a capsule", '<geom type="capsule" size=".004 .01"/>', (0, 0, 0.0235))
    near("an ellipsoid that is a ball", '<geom type="ellipsoid" size=".004 .004 .004"/>', at)
    vertices, faces = domecast.live.ellipsoid(np.full(3, 0.004), rings=32)
    mesh = f'<mesh name="ball" vertex="{" ".join(map(str, vertices.ravel()))}" face="{" ".join(map(str, np.asarray(faces).ravel()))}"/>'
    near("a mesh that is a ball", '<geom type="mesh" mesh="ball"/>', at, assets=mesh)
    near("the same, turned", '<geom type="mesh" mesh="ball"/>', at, across, assets=mesh)
    flat = felt('<geom type="box" size=".01 .01 .002"/>', (0, 0, 0.0117))
    round_end = felt('<geom type="cylinder" size=".01 .002"/>', (0, 0, 0.0117))
    check(abs(flat.wrench[2] / round_end.wrench[2] - 1) < 0.01, f"under a wide box and a wide cylinder's end: {flat.wrench[2]:.4f} N, {round_end.wrench[2]:.4f} N")
    model, data = model_of('<geom type="sphere" size=".002" pos="-.0035 0 0"/><geom type="sphere" size=".002" pos=".0035 0 0"/>')
    sensor = domecast.mujoco.TouchSensor(model, "fingertip", DESIGN, images=False)
    put(model, data, (0, 0, 0.0111))
    both = sensor.read(data)
    check(len(sensor.geoms) == 2 and both.wrench[2] < 0 and abs(both.wrench[0]) < 0.05 * -both.wrench[2], f"two geoms at once: {np.round(both.wrench, 3)}")
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        domecast.mujoco.TouchSensor(model, "fingertip", DESIGN, images=False)
    check(len(said) == 1 and "planes" in str(said[0].message), f"a plane that is not felt: {[str(one.message) for one in said]}")
    for geoms, words in [([-1], "no geom of number"), ([99], "no geom of number"), ("fingertips", "no geom named"), ([0], "plane")]:
        try:
            domecast.mujoco.TouchSensor(model, "fingertip", DESIGN, geoms=[geoms] if isinstance(geoms, str) else geoms)
            check(False, f"{geoms} is refused")
        except domecast.DomecastError as error:
            check(words in str(error).lower(), f"{geoms}: {error}")
    return touch


def frames_and_tracking():
    model, data = model_of('<geom type="sphere" size=".004"/>')
    ball = json.loads((REPOSITORY / "designs/scenes/ball.json").read_text())
    lit = {name: ball[name] for name in ("light", "electronics", "tolerance")}
    sensor = domecast.mujoco.TouchSensor(model, 0, DESIGN, scene=lit)
    tracker = domecast.Tracker(sensor.live.sensor())
    worst, times = 0.0, []
    for depth_mm in (-0.5, 0.2, 0.4, 0.6):
        put(model, data, (0, 0, 0.014 - 1e-3 * depth_mm))
        began = time.perf_counter()
        touch = sensor.read(data)
        times.append(time.perf_counter() - began)
        reading = tracker.update(touch.frame, rgb=True)
        if reading.wrench is not None:
            worst = max(worst, abs(reading.wrench[2] - touch.wrench[2]) / reading.wrench_sd[2])
        check(reading.wrench is not None, f"{depth_mm} mm: felt {reading.wrench[2]:.3f} N, true {touch.wrench[2]:.3f} N, {reading.status}")
    check(worst < 4, f"a tracker of the frames feels the true force: {worst:.2f} deviations off at most")
    print(f"     a lit frame with its contact: {1e3 * sorted(times)[1]:.0f} ms (median), the first {1e3 * times[0]:.0f} ms")


def gym_side():
    design = str(REPOSITORY / "designs/thumb24.json")
    for name in ("PressToForce", "FindEdge"):
        for options in ({}, {"images": True, "render_mode": "rgb_array"}):
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                warnings.filterwarnings("ignore", message=".*(different action space range|hard coded seeds|render_modes|human).*")
                env = gymnasium.make(f"domecast/{name}-v0", design=design, **options)
                check_env(env.unwrapped, skip_render_check=True)
            check(True, f"check_env: {name} {options}")
    env = gymnasium.make("domecast/PressToForce-v0", design=design)
    met = []
    began, steps = time.perf_counter(), 0
    for seed in range(4):
        seen, _ = env.reset(seed=seed)
        done = cut = False
        while not (done or cut):
            error = (seen["goal"][0] + seen["wrench"][2]) / seen["goal"][0]
            seen, _, done, cut, _ = env.step(np.array([np.clip(2 * error, -1, 1)], dtype=np.float32))
            steps += 1
        met.append(done)
    print(f"     PressToForce: {1e3 * (time.perf_counter() - began) / steps:.1f} ms a step")
    check(all(met), "PressToForce: a proportional controller meets the goal")
    again = [env.reset(seed=5)[0] for _ in range(2)]
    check(all(np.array_equal(again[0][key], again[1][key]) for key in again[0]), "the same seed gives the same start")
    env = gymnasium.make("domecast/FindEdge-v0", design=design)
    met = []
    for seed in range(3):
        env.reset(seed=seed)
        done = cut = False
        while not (done or cut):
            off = env.unwrapped.edge_mm
            _, _, done, cut, _ = env.step(np.array([np.clip(-10 * off, -1, 1), 0.0], dtype=np.float32))
        met.append(done)
    check(all(met), "FindEdge: who knows the edge brings it over the pole")


def main():
    mujoco_side()
    frames_and_tracking()
    gym_side()
    print(f"simulators: {len(FAULTS)} faults")
    return 1 if FAULTS else 0


if __name__ == "__main__":
    sys.exit(main())
