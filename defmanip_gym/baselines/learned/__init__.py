"""Learned controllers: portable actors, shipped agents, hyperparameters."""
