"""Training of players with Stable-Baselines3, and what they are worth beside other players."""
