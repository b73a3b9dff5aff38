"""The operator's web panel: `WebPanel` serves it, `gate` and `access` keep strangers out, `pose` draws."""

from sceann_hil.supervision.operators.web.link import described
from sceann_hil.supervision.operators.web.panel import WebPanel
from sceann_hil.supervision.operators.web.pose import draw_pose

__all__ = ["WebPanel", "described", "draw_pose"]
