"""Training of Stable-Baselines3 agents through the batched environment."""
