"""Analytic controllers: the paper's own and the ladder beside it, one file each."""
