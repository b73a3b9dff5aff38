"""The same genomes here and there: how far simulation and robot are apart, and why.

`GapReport` compares two measurements (`sceann_hil.run.measuring`), `Spread` says what one genome's fitness scatters,
`figures` draws all of it.
"""

from sceann_hil.run.measuring import Measurement
from sceann_hil.study.gap.comparison import GapReport
from sceann_hil.study.gap.spread import Spread

__all__ = ["GapReport", "Measurement", "Spread"]
