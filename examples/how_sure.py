"""The confidence of an identification, runner-up, alternatives, and why a detection has its label.

python examples/how_sure.py
"""

from pathlib import Path

from farm_ar.reid import LikelihoodReid, SpatialReid, alternatives, explain
from farm_ar.scenes import load_scene, load_snapshot

data = Path(__file__).parent / "data"
scene, snapshot = load_scene(data / "before.json"), load_snapshot(data / "seen.json")

reid = LikelihoodReid(scene)
answer = reid.identify(snapshot)
for name, label, sure, second in zip(
    snapshot.detections.ids, answer.labels, answer.confidence, answer.runner_up, strict=True
):
    print(f"{name} is {label} with probability {sure:.2f}; if not, {second}")

noise = reid.posterior(snapshot)
print(f"Things seem to have moved by about {noise.translation_sd:.2f} m along each axis.")

first, second, *_ = alternatives(reid, snapshot, 3)
different = [a for a, b in zip(second.labels, first.labels, strict=True) if a != b]
print(f"The next best answer gives other detections the labels {', '.join(map(str, different))}.")

print(explain(SpatialReid(scene), snapshot, "d1").words())
