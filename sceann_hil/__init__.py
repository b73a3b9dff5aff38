"""Hardware-in-the-loop evolution of tiny neural controllers.

The way of the data, in one direction::

    config -> experiment -> evolution -> evaluator -> robot -> task (fitness) -> evolution

* `sceann_hil.coding`, `sceann_hil.controller`: from bits to a network, and what the network computes.
* `sceann_hil.evolution`: the algorithms, behind ask and tell.
* `sceann_hil.task`, `sceann_hil.tasks`: what a trial is and what it is worth.
* `sceann_hil.robot`: the abstract robot; the package `backends` has the robots themselves.
* `sceann_hil.evaluator`: where genomes, trials, robot and fitness meet; `sceann_hil.companion`: who has a say in it.
* `sceann_hil.experiment`, `sceann_hil.journal`, `sceann_hil.replay`: one run, its record, and the proof of it.
* `sceann_hil.operators`, `sceann_hil.budget`, `sceann_hil.suspenders`: who stands beside the robot, what the run may
  cost, what pauses it; `sceann_hil.supervision` has all of them speak between trials, `sceann_hil.forecast` the end.
* `sceann_hil.saving`: less robot time. `sceann_hil.rehearsal`: a run without the robot.
* `sceann_hil.gap_report`, `sceann_hil.drift`: simulation against robot, and the robot against itself.
* `sceann_hil.recording`: every trial in the rerun viewer, made from the journal.
* `sceann_hil.study`, `sceann_hil.landscape`, `sceann_hil.robustness`: many runs, every genome, disturbed bodies.
* `sceann_hil.report`: the paper's tables, figures and claims from studies.
* `sceann_hil.config`, `sceann_hil.plugins`, `sceann_hil.registry`: configuration, and what other packages may add.
* `sceann_hil.cli`, `sceann_hil.commands`: the `sceann` command.
"""
