"""Many runs: the paper's grids, on all cores or on a cluster."""
