"""The game as pictures: the table from above, the headset's view, and both side by side."""
