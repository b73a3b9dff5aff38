"""What a robot is, how it is, and how it differs from its simulation."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class RobotSpec:
    """What a robot is, readable before it is connected.

    Attributes:
        name: a short name for messages.
        n_sensors: sensor values per tick, in the order of the controller's sensor neurons.
        n_motors: motor neurons it listens to.
        tick_s: length of one control step.
        start_fields: names, with units, of a trial's start values.
        state_fields: names, with units, of the body's state in traces and final states.
        attended: a person stands beside it, so prompts make sense.
        batch_size: how many trials `Robot.run` takes at once; None for any number.
        deterministic: the same trial gives the same bits again, so nothing is lost by running it twice.
        noise_free: a trial's noise key has no influence on it, so equal weights and starts give equal results.
    """

    name: str
    n_sensors: int
    n_motors: int
    tick_s: float
    start_fields: tuple[str, ...]
    state_fields: tuple[str, ...]
    attended: bool = False
    batch_size: int | None = None
    deterministic: bool = True
    noise_free: bool = False

    @property
    def takes_batches(self) -> bool:
        """Any number of trials at once, with nobody beside it."""
        return self.batch_size is None and not self.attended


@dataclass(frozen=True, slots=True)
class Health:
    """What a robot says of itself between trials.

    Attributes:
        ok: trials may run.
        battery_fraction: 0..1, or None where it is not measured.
        temperature_c: degrees Celsius, or None where it is not measured.
        link_quality: part 0..1 of the last trial's messages that came through at the first try; None where there is no
            link.
        messages: what a person should know, most important first.
    """

    ok: bool = True
    battery_fraction: float | None = None
    messages: tuple[str, ...] = field(default=())
    temperature_c: float | None = None
    link_quality: float | None = None


@dataclass(frozen=True, slots=True)
class Estimated:
    """One quantity of a gap and its 95 % interval; all three are None where the trials do not tell it.

    Attributes:
        value: the estimate.
        low: lower end of the interval.
        high: upper end.
    """

    value: float | None = None
    low: float | None = None
    high: float | None = None

    @property
    def is_known(self) -> bool:
        """The trials tell it."""
        return self.value is not None


NOT_IDENTIFIABLE = Estimated()
"""A quantity that these trials do not tell."""


@dataclass(frozen=True, slots=True)
class GapEstimate:
    """The gap with which a simulated body behaves like a robot.

    Attributes:
        sensor_offset: of each sensor, in units of full scale.
        sensor_gain: factor on each sensor.
        sensor_noise: standard deviation at each step, in units of full scale.
        motor_gain: factor on each motor's distance from standing still.
        latency_steps: control steps between a motor value and its effect.
        residual: root mean square of the sensors' differences that are left, in units of full scale.
        residual_without: the same of the body without a gap.
        trials: different trials that it is estimated from.
        overlap: samples of each sensor that lie within its range on the robot and in the simulation.
    """

    sensor_offset: tuple[Estimated, ...]
    sensor_gain: tuple[Estimated, ...]
    sensor_noise: Estimated
    motor_gain: tuple[Estimated, ...]
    latency_steps: Estimated
    residual: float
    residual_without: float
    trials: int
    overlap: tuple[int, ...]
