"""From simulation to a robot in a few trials.

An ensemble of simulated robots tells how the fitnesses of many controllers vary together from robot to robot; a few
trials on the real one then say which of them it resembles, and so which controller is best on it. ``docs/transfer.md``
has method, numbers and limits.

* `robots`: the simulated robots, drawn once each from the `uncertainty` section.
* `candidates`: controllers to choose from; `ensemble`: their fitness in every simulated robot; `cache` keeps both.
* `model`: what a few trials say of all candidates; `choice`: which trial to do next, and whether it is worth it.
* `algorithm`: the same as an algorithm, one trial a generation, so that evolve, resume and study know it.
"""
