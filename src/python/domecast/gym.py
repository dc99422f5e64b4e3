"""Two tasks for learning, felt by a domecast sensor: `pip install domecast[gym]`.

>>> env = gymnasium.make("domecast/PressToForce-v0", design="designs/thumb24.json")

A rigid object moves where the action says; contact is domecast's own. Observations: `dots` (how far each dot is from where it is at
rest in the image, px; 0 for one that is not seen) and `wrench` (N, N mm), or with `images=True` the camera's `image` instead of the dots.
"""

from __future__ import annotations

import os
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium import spaces

from ._design import Design
from ._error import DomecastError
from ._types import Floats
from .live import LiveSensor, Touch

# gymnasium's classes take their types as parameters, which this one fixes
_Env: Any = gymnasium.Env

MAX_PX = 200.0
MAX_N = 100.0
MAX_NMM = 5000.0
KEPT_STEPS = 3


class _Touching(_Env):  # type: ignore[misc]
    """An object over the dome, moved by the action."""

    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["rgb_array"], "render_fps": 30}
    step_mm: ClassVar[float] = 0.1
    axes: ClassVar[int] = 1
    goals: ClassVar[int] = 0

    def __init__(
        self,
        design: Design | str | os.PathLike[str],
        *,
        images: bool = False,
        scene: dict[str, Any] | None = None,
        max_steps: int = 100,
        render_mode: str | None = None,
    ) -> None:
        self.design = design if isinstance(design, Design) else Design.load(design)
        self.render_mode = render_mode
        self.max_steps = max_steps
        self.images = images
        shape = self._shape(float(self.design["dome"]["radius_mm"]))
        draws = images or render_mode == "rgb_array"
        self.live = LiveSensor(self.design, [shape], images=draws, scene=scene)
        away = self.live.step([None])
        self._rest_px = away.dots_px
        dots = spaces.Box(-MAX_PX, MAX_PX, self._rest_px.shape, np.float32)
        width, height = self.live.scene.size
        seen: dict[str, spaces.Space[Any]] = {"dots": dots} if not images else {
            "image": spaces.Box(0, 255, (height, width, 3), np.uint8)}
        wrench = np.array([MAX_N] * 3 + [MAX_NMM] * 3, dtype=np.float32)
        seen["wrench"] = spaces.Box(-wrench, wrench, dtype=np.float32)
        if self.goals:
            seen["goal"] = spaces.Box(0.0, np.float32(MAX_N), (self.goals,), np.float32)
        self.observation_space = spaces.Dict(seen)
        self.action_space = spaces.Box(-1.0, 1.0, (self.axes,), np.float32)
        self._at_mm: Floats = np.zeros(3)
        self._touch: Touch = away
        self._steps = self._kept = 0

    def _shape(self, radius_mm: float) -> dict[str, Any]:
        raise NotImplementedError

    def _start(self) -> Floats:
        raise NotImplementedError

    def _moves(self, action: Floats) -> Floats:
        raise NotImplementedError

    def _judge(self) -> tuple[float, bool]:
        """Reward, and whether the goal is met now."""
        raise NotImplementedError

    def _goal(self) -> Floats:
        return np.zeros(0)

    def _feel(self) -> Touch:
        pose = np.eye(4)
        pose[:3, 3] = self._at_mm
        return self.live.step([pose])

    def _observation(self) -> dict[str, Any]:
        touch = self._touch
        wrench: Any = self.observation_space["wrench"]
        seen: dict[str, Any] = {"wrench": np.clip(touch.wrench, wrench.low, wrench.high).astype(np.float32)}
        if self.images:
            seen["image"] = np.asarray(touch.frame)
        else:
            moved = np.nan_to_num(touch.dots_px - self._rest_px)
            seen["dots"] = np.clip(moved, -MAX_PX, MAX_PX).astype(np.float32)
        if self.goals:
            seen["goal"] = self._goal().astype(np.float32)
        return seen

    def _info(self) -> dict[str, Any]:
        return {"status": self._touch.status, "position_mm": self._at_mm.copy(), "wrench": self._touch.wrench}

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[dict[str, Any], dict[str, Any]]:
        super().reset(seed=seed)  # pyright: ignore[reportUnknownMemberType]
        self.live.restart()
        self._steps = self._kept = 0
        self._at_mm = self._start()
        self._touch = self._feel()
        return self._observation(), self._info()

    def step(self, action: Floats) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        before = self._at_mm
        self._at_mm = before + self.step_mm * self._moves(np.clip(np.asarray(action, dtype=np.float64), -1, 1))
        self._steps += 1
        beyond = ""
        try:
            self._touch = self._feel()
        except DomecastError as error:
            # deeper than the contact's level goes: the object stays where it was
            self._at_mm, beyond = before, error.problem
        reward, is_met = self._judge()
        self._kept = self._kept + 1 if is_met and not beyond else 0
        info = self._info()
        if beyond:
            reward -= 1.0
            info["beyond"] = beyond
        done = self._kept >= KEPT_STEPS
        return self._observation(), reward + (10.0 if done else 0.0), done, self._steps >= self.max_steps, info

    def render(self) -> Any:
        return None if self._touch.frame is None else np.asarray(self._touch.frame)


class PressToForce(_Touching):
    """A ball over the pole is to be pressed until the sensor bears the goal's force, N, and held there. Action: one number, the
    way towards the dome, in tenths of a millimetre."""

    goals: ClassVar[int] = 1

    def __init__(self, design: Design | str | os.PathLike[str], *, force_n: tuple[float, float] = (0.2, 1.0), **options: Any) -> None:
        low_n, high_n = force_n
        if not 0 < low_n <= high_n < MAX_N:
            raise DomecastError(f"force_n is {force_n}; allowed: two forces, 0 < first <= second < {MAX_N:g} N",
                                field="force_n", value=repr(force_n), allowed=f"0 < first <= second < {MAX_N:g} N")
        self._range_n = force_n
        self._force_n = force_n[0]
        super().__init__(design, **options)

    def _shape(self, radius_mm: float) -> dict[str, Any]:
        self._ball_mm = 0.5 * radius_mm
        return {"kind": "sphere", "radius_mm": self._ball_mm}

    def _start(self) -> Floats:
        self._force_n = float(self.np_random.uniform(*self._range_n))
        self._top_mm = float(self.design.resolve().pole_mm) + self._ball_mm + 0.5
        return np.array([0.0, 0.0, self._top_mm - float(self.np_random.uniform(0.0, 0.4))])

    def _moves(self, action: Floats) -> Floats:
        # not away for ever
        down = min(-float(action[0]), max(0.0, (self._top_mm - self._at_mm[2]) / self.step_mm))
        return np.array([0.0, 0.0, down])

    def _goal(self) -> Floats:
        return np.array([self._force_n])

    def _judge(self) -> tuple[float, bool]:
        error = abs(-self._touch.wrench[2] - self._force_n) / self._force_n
        return -float(min(error, 2.0)), bool(error < 0.05)


class FindEdge(_Touching):
    """A block lies on the dome, its edge somewhere beside the pole: bring the edge over the pole. Action: two numbers, the
    way across the edge and towards the dome, in tenths of a millimetre."""

    axes: ClassVar[int] = 2

    def _shape(self, radius_mm: float) -> dict[str, Any]:
        self._half_mm, self._thick_mm = radius_mm, 0.3 * radius_mm
        return {"kind": "box", "size_mm": [2 * self._half_mm, 4 * self._half_mm, 2 * self._thick_mm]}

    def _start(self) -> Floats:
        self._lowest_mm = float(self.design.resolve().pole_mm) + self._thick_mm
        off_mm = float(self.np_random.uniform(0.1, 0.25)) * self._half_mm
        return np.array([off_mm - self._half_mm, 0.0, self._lowest_mm - 0.2])

    @property
    def edge_mm(self) -> float:
        """How far the edge is beyond the pole."""
        return float(self._at_mm[0] + self._half_mm)

    def _moves(self, action: Floats) -> Floats:
        low, high = self._lowest_mm - 0.5 - self._at_mm[2], self._lowest_mm + 0.2 - self._at_mm[2]
        across = np.clip(self.edge_mm + self.step_mm * float(action[0]), -0.5 * self._half_mm, 0.5 * self._half_mm) - self.edge_mm
        down = np.clip(-self.step_mm * float(action[1]), low, high)
        return np.array([across / self.step_mm, 0.0, down / self.step_mm])

    def _judge(self) -> tuple[float, bool]:
        # an edge that is not felt is not found
        is_felt = bool(-self._touch.wrench[2] > 0.02)
        off = abs(self.edge_mm) / self._half_mm
        return -float(off) - (0.0 if is_felt else 0.5), is_felt and bool(off < 0.02)


for _task in (PressToForce, FindEdge):
    _entry = f"domecast.gym:{_task.__name__}"
    gymnasium.register(id=f"domecast/{_task.__name__}-v0", entry_point=_entry)  # pyright: ignore[reportUnknownMemberType]
