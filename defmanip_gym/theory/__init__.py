"""The paper's mathematics in its order; NumPy, SciPy and python-control only, no MuJoCo.

Arrays are batch-first, shapes ``(..., k)``. Vectors of the task space are written in the base
frame b: x forward along the heading, y to the left, z up, with inertial accelerations. Turning
them by the heading θ gives the paper's world coordinates.
"""
