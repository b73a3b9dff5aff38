"""The operator's web panel: `WebPanel` serves it, `pose` draws the start pose, `access` keeps strangers out."""

from sceann_hil.supervision.operators.web.panel import WebPanel, announce
from sceann_hil.supervision.operators.web.pose import draw_pose

__all__ = ["WebPanel", "announce", "draw_pose"]
