"""The conformance kits: what every plug-in must do, ours and other people's, as classes of pytest tests.

In a test file::

    class TestMyRobot(RobotConformance):
        def config(self) -> RobotConfig:
            return MyRobotConfig()
"""

from sceann_hil.testing.algorithms import AlgorithmConformance
from sceann_hil.testing.bodies import BodyConformance
from sceann_hil.testing.robots import RobotConformance
from sceann_hil.testing.tasks import TaskConformance

__all__ = ["AlgorithmConformance", "BodyConformance", "RobotConformance", "TaskConformance"]
