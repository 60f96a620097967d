"""Adversaries: the worst admissible inputs for an object, searched for on its MuJoCo plant."""
