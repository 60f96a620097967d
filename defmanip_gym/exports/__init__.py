"""``defmanip export``: agents as ONNX graphs, and as zip files of Stable-Baselines3."""
