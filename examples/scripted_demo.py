"""A script of the game, played without being filmed: two coops change places, and the headset is fooled."""

from pathlib import Path

from farm_ar.showcases import ScriptRecorder, load_script

script = Path(__file__).parent / "data" / "exchange.toml"
film = ScriptRecorder(load_script(script), make_pictures=None).play()

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
print("The same with pictures: farm-ar demo examples/data/exchange.toml")
