"""Training of policies with Stable-Baselines3, and what they are worth beside other policies."""
