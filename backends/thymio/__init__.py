"""The Thymio II: real, in the makers' simulator, and as a simulated twin (``docs/robots/thymio.md``).

The package thymiodirect is an extra: ``pip install 'sceann-hil[thymio]'``. The twin needs nothing.
"""

from backends.thymio.config import ThymioConfig
from backends.thymio.twin import ThymioTwinConfig

__all__ = ["ThymioConfig", "ThymioTwinConfig"]
