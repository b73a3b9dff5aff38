"""Many runs: the paper's grids, on all cores or on a cluster.

* `load_study` reads a study's file: a base experiment, axes, runs (`config`, `condition`).
* `run_study` does what is missing of it (`runner`), in blocks of runs that go through the generations side by side
  (`evolve_together`), computed by `LocalWorkers` or `ClusterWorkers`.
* `StudyReader` answers questions to its database (`store`, `schema`).
"""

from sceann_hil.study.blocks import Block, BlockResult, compute_block, evolve_together
from sceann_hil.study.condition import Condition
from sceann_hil.study.config import Study, StudyConfig, load_conditions, load_study, parse_study, study_schema_text
from sceann_hil.study.local import LocalWorkers, cores
from sceann_hil.study.runner import Observer, Todo, run_study
from sceann_hil.study.schema import STUDY_NAME
from sceann_hil.study.store import Effort, Runs, StudyReader, StudyStore

__all__ = [
    "STUDY_NAME",
    "Block",
    "BlockResult",
    "Condition",
    "Effort",
    "LocalWorkers",
    "Observer",
    "Runs",
    "Study",
    "StudyConfig",
    "StudyReader",
    "StudyStore",
    "Todo",
    "compute_block",
    "cores",
    "evolve_together",
    "load_conditions",
    "load_study",
    "parse_study",
    "run_study",
    "study_schema_text",
]
