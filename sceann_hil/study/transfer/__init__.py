"""What a transfer found: its conclusion in words, for programs, and as a page with figures.

* `conclude` looks at a run and writes the page: `report`, on top of `findings` and `figures`.
"""

from sceann_hil.study.transfer.findings import Findings
from sceann_hil.study.transfer.report import Conclusion, conclude

__all__ = ["Conclusion", "Findings", "conclude"]
