"""``defmanip plan``: the optimum of every start of every suite, and whether it can be driven."""
