"""``defmanip dataset``: episodes of any contestant as a Minari dataset, and their check."""
