"""An estimated gap in words and as the `gap` section of a simulated robot."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from sceann_hil.robot import Estimated, GapEstimate

UNKNOWN = "not identifiable from these trials"
_DEFAULTS = {"sensor_offset": 0.0, "sensor_gain": 1.0, "sensor_noise": 0.0, "motor_gain": 1.0, "latency_steps": 0.0}


def gap_section(estimate: GapEstimate | None) -> str:
    """The section, to be pasted; what the trials do not tell stays at its default and is named. Empty without one."""
    if estimate is None:
        return ""
    lines = ["gap:"]
    for key, default in _DEFAULTS.items():
        found = _as_sequence(getattr(estimate, key))
        if not any(one.is_known for one in found):
            lines.append(f"  # {key}: {UNKNOWN}")
            continue
        values = [f"{default if one.value is None else one.value:g}" for one in found]
        unknown = [str(number) for number, one in enumerate(found, 1) if not one.is_known]
        note = f"  # number {', '.join(unknown)}: {UNKNOWN}" if unknown else ""
        text = values[0] if len(values) == 1 else f"[{', '.join(values)}]"
        lines.append(f"  {key}: {text}{note}")
    return "\n".join(lines) + "\n" if any(line[2] != "#" for line in lines[1:]) else ""


def estimate_rows(
    estimate: GapEstimate, sensors: Sequence[str], motors: Sequence[str]
) -> Iterator[tuple[str, str, str]]:
    """Quantity, value and 95 % interval of everything that is estimated, for a table.

    Args:
        estimate: of a simulated body.
        sensors: a name for each sensor.
        motors: a name for each motor.
    """
    for key in _DEFAULTS:
        found = _as_sequence(getattr(estimate, key))
        names = sensors if len(found) == len(sensors) and key.startswith("sensor") else motors
        for number, one in enumerate(found):
            single = key in ("sensor_noise", "latency_steps")
            name = key.replace("_", " ") + ("" if single else f", {names[number]}")
            if one.value is None or one.low is None or one.high is None:
                yield name, UNKNOWN, ""
            else:
                yield name, f"{one.value:.4g}", f"{one.low:.4g} to {one.high:.4g}"


def _as_sequence(found: Estimated | tuple[Estimated, ...]) -> tuple[Estimated, ...]:
    return (found,) if isinstance(found, Estimated) else found
