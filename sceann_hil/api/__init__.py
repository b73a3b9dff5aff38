"""What Python users see of a run, its individuals and its trials; all of it is public as `sceann_hil`."""

from sceann_hil.api.evolving import evolve, transfer
from sceann_hil.api.individual import Individual, export
from sceann_hil.api.run import Run, open_run
from sceann_hil.api.simulating import simulate
from sceann_hil.api.trial import Trial

open = open_run

__all__ = ["Individual", "Run", "Trial", "evolve", "export", "open", "simulate", "transfer"]
