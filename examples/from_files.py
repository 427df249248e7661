"""A scene and a snapshot of your own, from files: seven chairs of one category, and the label of each."""

from pathlib import Path

from farm_ar.reid import NearestReid, SpatialReid
from farm_ar.scenes import load_scene, load_snapshot

data = Path(__file__).parent / "data"
scene = load_scene(data / "before.json")
snapshot = load_snapshot(data / "seen.json")
found = SpatialReid(scene).identify(snapshot)
nearest = NearestReid(scene).identify(snapshot)

print(f"{'detection':10} {'label':12} {'cost':6} nearest label")
for name, label, cost, near in zip(
    snapshot.detections.ids, found.labels, found.cost, nearest.labels, strict=True
):
    print(f"{name:10} {label or 'none':12} {cost:.4f} {near}")
twice = sorted({label for label in nearest.labels if nearest.labels.count(label) > 1})
print(f"The nearest label for each would have assigned {', '.join(twice)} twice.")
