"""Gymnasium and MuJoCo environments as robots, and our robots as Gymnasium environments (``docs/robots/gymnasium.md``).

The packages gymnasium and mujoco are an extra: ``pip install 'sceann-hil[gymnasium]'``.
"""

from backends.gymnasium.config import GymnasiumConfig

__all__ = ["GymnasiumConfig"]
