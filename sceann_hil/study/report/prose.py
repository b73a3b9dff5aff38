"""The report's words that do not depend on the numbers."""

from __future__ import annotations

WHAT_THIS_IS = (
    "Every table, figure and claim of Y. Katada and J. Nakazawa, *Investigation of Simply Coded Evolutionary "
    "Artificial Neural Networks on Robot Control Problems*, computed again with SCEANN-Q10 controllers in simulated "
    "bodies. This page was written by `sceann report`; nothing in it was typed in by hand except the paper's own "
    "numbers."
)

HOW_CLAIMS_ARE_TESTED = (
    "A claim is a list of comparisons that should all be positive. It **holds** if every one is significantly positive "
    "(95 %), **does not hold** if at least one is significantly negative (95 % after Bonferroni's correction for the "
    "number of comparisons), and else we **cannot tell**. Fewer than ten runs of a condition tell nothing. Where the "
    "paper's words allow a weak and a strong reading, both are tested. More runs turn *cannot tell* into one of the "
    "others; they cannot make a claim hold that is false."
)

READINGS = (
    "**Neuron.** Eq. (1) has no memory, but the text speaks of successive inputs and of a state that is reset. Here "
    "the state accumulates its inputs and is reset to 0 beyond 8 (`neuron: accumulating`); the section on exact "
    "landscapes shows why.",
    "**OGA.** The paper refers to the operon-GA without defining it. Ours is a reconstruction, OGA-R, in which every "
    "ambiguity is a named option. Its default was chosen with the claim *OGA above SGA* in view, on other seeds; the "
    "sensitivity study shows every alternative, and an SGA with the OGA's tournament as control.",
    "**Pole balancing.** Explicit Euler; the ranges that scale the velocities to [0, 1] are not given: 3 m/s and "
    "3.5 rad/s.",
    "**Goal reach.** Size and speed of the robot, arena, sensors and response are not given; our calibration is the "
    "default of the models, and all individuals, the elite included, are evaluated anew in every generation. An "
    "infrared sensor that sees only the target needs a beacon on it.",
    "**Arithmetic.** 10-bit sensors and integer neurons, the same bits in simulation and on a microcontroller.",
)

HOW_TO_REPEAT = (
    "The same commands give the same numbers to the last bit on any number of cores, in any order, and after any "
    "interruption; `--runs` chooses how many."
)

ABOUT_TIMES = (
    "The times are wall-clock times of the sessions that added runs, on a machine that was doing other work as well."
)

HOW_TO_CITE = (
    "To cite: Y. Katada and J. Nakazawa, *Investigation of Simply Coded Evolutionary Artificial Neural Networks on "
    "Robot Control Problems*, for the method; sceann-hil with its version for the software (`CITATION.cff`)."
)
