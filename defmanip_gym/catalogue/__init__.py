"""``defmanip agents``: the shipped agents, their cards and their scores."""
