"""One run: trials to results, evolve, resume, replay, rehearse, plan."""
