"""The paper's simulation (Section VI) on the MuJoCo plant: ``defmanip reproduce``."""
