"""A line follower: two wheels and three ground sensors on a track like a stadium, with its picture and its task."""

from typing import Any, ClassVar, Literal

import numpy as np

from backends.simulation.engine import SimulatedRobot
from backends.simulation.lanes import RUNNING
from backends.simulation.maths import cosine, sine, wrap_angle
from backends.simulation.settings import GapConfig
from sceann_hil.network.compiled import compiled_part
from sceann_hil.network.neurons import LANES
from sceann_hil.plugins import RobotConfig, TaskConfig
from sceann_hil.robot import EndReason, RobotSpec
from sceann_hil.robot.drawing import Drawing, Fan, Look, Strip, round_robot
from sceann_hil.tasks import StepTask, step_value

F = np.float32
POSE = ("x_m", "y_m", "heading_rad")
SPEC = RobotSpec("line_follower", n_sensors=3, n_motors=2, tick_s=0.05, start_fields=POSE, state_fields=POSE)
STRAIGHT_M, BEND_M, LINE_M = 0.25, 0.2, 0.03  # half a straight, radius of the bends, width of the line
RADIUS_M, AHEAD_M, APART_M = 0.04, 0.04, 0.02  # the robot; its sensors before the axle and beside each other
LOST = int(EndReason.OUT_OF_BOUNDS)


@compiled_part
def off_line(x: Any, y: Any) -> Any:
    beyond = max(abs(x) - F(STRAIGHT_M), F(0.0))
    return abs(np.sqrt(beyond * beyond + y * y) - F(BEND_M))


@compiled_part
def sense(state: Any, sensors: Any, work: Any, parameters: Any) -> None:  # 1 over the line, 0 a line's width beside it
    for lane in range(LANES):
        c, s = cosine(state[2, lane]), sine(state[2, lane])
        for i in range(3):
            side = F(APART_M) * F(1 - i)
            x, y = state[0, lane] + F(AHEAD_M) * c - side * s, state[1, lane] + F(AHEAD_M) * s + side * c
            sensors[i, lane] = F(1.0) - min(off_line(x, y) / F(LINE_M), F(1.0))


@compiled_part
def advance(state: Any, motors: Any, noise: Any, end_reasons: Any, work: Any, parameters: Any) -> None:
    for lane in range(LANES):
        left, right = parameters[0] * motors[0, lane], parameters[0] * motors[1, lane]
        heading, way = wrap_angle(state[2, lane] + (right - left) / F(2.0 * RADIUS_M)), F(0.5) * (left + right)
        x, y = state[0, lane] + way * cosine(heading), state[1, lane] + way * sine(heading)
        state[0, lane], state[1, lane], state[2, lane] = x, y, heading
        end_reasons[lane] = np.int32(LOST if off_line(x, y) > F(0.1) else RUNNING)


class LineFollower(SimulatedRobot):
    spec, sense, advance = SPEC, staticmethod(sense), staticmethod(advance)
    parameters = np.array([0.2 * SPEC.tick_s], np.float32)  # 0.2 m/s at motor value 1, as metres in a step
    bend = BEND_M * np.exp(1j * np.linspace(-np.pi / 2, np.pi / 2, 19))
    track = np.array([-1j * BEND_M, *(STRAIGHT_M + bend), *(-STRAIGHT_M - bend), -1j * BEND_M])
    line = Strip(tuple(zip(track.real.tolist(), track.imag.tolist(), strict=True)), LINE_M, Look.LINE)
    robot = round_robot(RADIUS_M, tuple(Fan((AHEAD_M, side * APART_M), 0.0, 0.4, 0.02) for side in (1, 0, -1)))
    sides, bounds_m = ("left", "middle", "right"), (-0.6, 0.6, -0.35, 0.35)
    drawing = Drawing("Track", bounds_m, (line,), (robot,), True, sensor_names=sides, motor_names=sides[::2])


class LineFollowerConfig(RobotConfig):
    """Two wheels and three ground sensors on a track like a stadium."""

    type: Literal["line_follower"] = "line_follower"
    gap: GapConfig = GapConfig()
    spec: ClassVar[RobotSpec] = SPEC

    def build(self) -> LineFollower:
        return LineFollower(self.gap.build(SPEC.n_sensors, SPEC.n_motors))


@step_value
def along(sensors, motors, state):
    return 0.5 * (motors[0] + motors[1]) * max(sensors[0], sensors[1], sensors[2])


class AlongConfig(TaskConfig):
    """Follow the line, fast: the sum over 300 steps of speed times how much of the line is seen, each 0..1."""

    type: Literal["along"] = "along"

    def build(self) -> StepTask:
        starts = [(0.0, -BEND_M, 0.0), (0.0, BEND_M, 0.0), (STRAIGHT_M + BEND_M, 0.0, 2.0)]  # on the line, both ways
        task = {"value": along, "combine": "sum", "max_steps": 300, "start_fields": POSE, "starts": starts}
        return StepTask(**task, succeeded=lambda fitness: fitness > 150, best_fitness=300, worst_fitness=0)
