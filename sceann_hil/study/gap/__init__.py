"""The same genomes here and there: how far simulation and robot are apart, and why.

`GapReport` compares two measurements (`sceann_hil.run.measuring`), `Spread` says what one genome's fitness scatters,
`section` says the estimated gap, `figures` draws all of it.
"""

from sceann_hil.run.measuring import Measurement
from sceann_hil.study.gap.comparison import GapReport
from sceann_hil.study.gap.section import estimate_rows, gap_section
from sceann_hil.study.gap.spread import Spread

__all__ = ["GapReport", "Measurement", "Spread", "estimate_rows", "gap_section"]
