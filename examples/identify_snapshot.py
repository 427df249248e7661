"""Noise moves everything in a room, one snapshot is taken, and every object in it is identified."""

import numpy as np

from farm_ar.reid import SpatialReid, accuracy
from farm_ar.scenes import Camera, LayoutNoise, builtin_scene, observe

scene = builtin_scene("M2")
noise = LayoutNoise.of(translation_sd=0.3, rotation_sd_deg=15)
untidy = noise.disturb(scene.layout, scene.size, np.random.default_rng(2))
snapshot, truth = observe(untidy, Camera(position=[2.5, 2.5], yaw=np.deg2rad(150), fov=scene.fov))
found = SpatialReid(scene).identify(snapshot)

for category, label, true in zip(snapshot.detections.category, found.labels, truth, strict=True):
    print(f"{category:6} {label:3} {'right' if label == true else f'wrong: it is {true}'}")
print(f"Accuracy: {accuracy(found, truth):.2f} of {len(truth)} detections")
