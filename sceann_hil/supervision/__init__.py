"""Who has a say between trials: operator, budget, forecast, suspenders, drift, saving."""
