"""The true system in MuJoCo: built with MjSpec, stepped in batches, read by name."""
