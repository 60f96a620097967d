"""Controllers behind one interface, Stable-Baselines3's ``predict``."""
