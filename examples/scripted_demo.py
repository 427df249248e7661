"""A game of one's own as a script: two coops change places. It is played, not filmed."""

import tempfile
from pathlib import Path

from farm_ar.showcases import Screening, load_script

SCRIPT = """
title = "Red and yellow change places"
gaze = "S1"
seed = 4

[[visits]]
play_s = 3.0

[[visits.moves]]
building = "red-coop"
to = [0.12, 0.4]

[[visits.moves]]
building = "yellow-coop"
to = [0.15, 0.56]

[[visits.moves]]
building = "red-coop"
to = [0.185, 0.26]
turn_deg = 30
"""

with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "exchange.toml"
    path.write_text(SCRIPT, encoding="utf-8")
    film = Screening(load_script(path), make_pictures=None).play()

print(film.title)
print(f"{'category':9} {'x, m':>6} {'z, m':>6}  {'label given':14} {'truth':14}")
for row in film.detections:
    print(f"{row['category']:9} {row['x']:6.3f} {row['z']:6.3f}  {row['given']!s:14} {row['truth']!s:14}")
print(f"{film.right} of {len(film.detections)} detections were given their own label.")
print()
print(f"{'after visit':11}  counter")
for row in film.counters:
    if row["label"].startswith(("Red", "Yellow")):
        print(f"{row['after']:11}  {row['label']}, {row['misplaced']} in the wrong building")
print("The same with pictures: farm-ar demo exchange.toml")
