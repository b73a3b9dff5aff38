"""A robot at the end of a serial or CAN line (``docs/link.md``).

`config`: the ``robot`` section of a configuration. `robot`: trials in the three control modes. `verdict`: what a trial
was worth as evidence. `ends`: task ends that a robot's own sensors tell. `rig`: a machine that puts the robot back.
"""

from backends.remote.config import RemoteConfig
from backends.remote.robot import RemoteRobot

__all__ = ["RemoteConfig", "RemoteRobot"]
