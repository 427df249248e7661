"""Training of policies with Stable-Baselines3, and their scores beside those of other policies."""
