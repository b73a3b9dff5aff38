"""Less robot time, each way an option of its own: pooling, racing, and the order of trials.

`Pool` runs identical genomes less often, `still_open` ends an individual's trials early, and
`rounds` says in which order a generation's trials are run. `SavingConfig` is the configuration's section.
"""

from sceann_hil.supervision.saving.order import rounds
from sceann_hil.supervision.saving.pooling import Pool
from sceann_hil.supervision.saving.racing import bounds, raced_fitness, still_open
from sceann_hil.supervision.saving.settings import Racing, SavingConfig

__all__ = ["Pool", "Racing", "SavingConfig", "bounds", "raced_fitness", "rounds", "still_open"]
