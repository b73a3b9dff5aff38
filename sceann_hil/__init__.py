"""Hardware-in-the-loop evolution of tiny neural controllers.

The way of the data, in one direction::

    configuration -> experiment -> algorithm -> genomes -> task -> trials -> robot -> results -> fitness -> algorithm
                                                             (beside it: journal, recording, operator, progress)

The rooms, from the bottom up; a room imports only from the rooms before it:

* `network`: genome codings, the neuron's exact arithmetic, compiled neurons, one controller as an image.
* `robot`: what a body, a trial, a result and a task are. `tasks` has the shipped tasks; `backends` the robots.
* `evolution`: the algorithms, ask and tell.
* `journal`: the record of truth of one run.
* `link`: the host's side of the robot protocol.
* `supervision`: who has a say between trials: operator, budget, forecast, suspenders, drift, saving.
* `config`, `plugins`, `registry`: configuration, and what other packages may add.
* `run`: trials to results to fitness; evolve, resume, replay, rehearse, plan.
* `firmware`: header, build, flash, verify; `firmware.emulated` has the boards without hardware.
* `recording`: every trial in the rerun viewer, made from the journal.
* `study`: many runs, landscapes, disturbed bodies, simulation against robot, the report.
* `commands`, `cli`: the `sceann` command.
"""
