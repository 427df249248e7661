"""The game: tabletop, hand, animals, belief and counters."""
