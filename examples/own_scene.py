"""A scene of your own: built in Python, saved, checked, identified in, and used as an environment."""

import json
import tempfile
from pathlib import Path

import gymnasium as gym
import numpy as np

from farm_ar.errors import SceneError
from farm_ar.reid import SpatialReid, accuracy
from farm_ar.scenes import (
    Camera,
    CameraPath,
    FieldOfView,
    Layout,
    LayoutNoise,
    Scene,
    Site,
    load_scene,
    observe,
    save_scene,
)

# A reading room, 6 by 4 metres: two tables that stay, six chairs of one kind, two lamps of another.
labels = ("window", "corner", "ada", "ben", "cleo", "dan", "eva", "finn", "left lamp", "right lamp")
scene = Scene(
    name="reading room",
    size=(6.0, 4.0),
    layout=Layout(
        labels=labels,
        category=("table",) * 2 + ("chair",) * 6 + ("lamp",) * 2,
        position=[
            *[(1.5, 2.0), (4.5, 2.0)],
            *[(0.6, 2.0), (1.5, 2.8), (2.4, 2.0), (3.6, 2.0), (4.5, 2.8), (5.4, 2.0)],
            *[(0.4, 3.6), (5.6, 3.6)],
        ],
        yaw=np.deg2rad([0, 0, 90, 180, 270, 90, 180, 270, 0, 0]),
        size=[(1.2, 0.7, 0.8)] * 2 + [(0.5, 0.9, 0.5)] * 6 + [(0.3, 1.6, 0.3)] * 2,
        fixed=[label in ("window", "corner") for label in labels],
    ),
    sites=(Site("west", 1.5, 2.0), Site("east", 4.5, 2.0)),
    camera_path=CameraPath([(0.2, 0.2), (1.0, 0.6), (2.0, 1.2), (3.0, 1.2)]),
    fov=FieldOfView.symmetric(np.deg2rad(110), 4.0),
)

with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "reading-room.json"
    save_scene(scene, path)
    assert load_scene(path).layout.labels == labels
    print(f"{path.name} is a valid scene: {scene!r}")
    contents = json.loads(path.read_text(encoding="utf-8"))
    contents["objects"][2]["yaw_deg"] = "east"
    path.write_text(json.dumps(contents), encoding="utf-8")
    try:
        load_scene(path)
    except SceneError as problem:
        print(f"With a mistake in it: {problem}")

untidy = LayoutNoise.of(0.3, 20).disturb(scene.layout, scene.size, np.random.default_rng(3))
snapshot, truth = observe(untidy, Camera(position=[3.0, 0.0], yaw=0.0, fov=scene.fov))
found = SpatialReid(scene).identify(snapshot)
print(f"\nA snapshot of the untidy room: {accuracy(found, truth):.0%} of {len(truth)} labels are right.")
for category, label, true in zip(snapshot.detections.category, found.labels, truth, strict=True):
    print(f"  {category:6} {label!s:10} {'' if label == true else f'(it is {true})'}".rstrip())

env = gym.make("farm_ar:SceneLayout-v0", scene=scene, visits=4, budget=1.0)
env.action_space.seed(0)
env.reset(seed=0)
print("\nThe room as an environment, in which everything is moved at random:")
over, visit = False, 0
while not over:
    _, reward, over, _, info = env.step(env.action_space.sample())
    visit += 1
    print(f"  visit {visit}: {info['wrong_labels']} wrong labels, reward {reward:.2f}")
