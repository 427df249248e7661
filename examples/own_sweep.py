"""A sweep of your own: the accuracy of the paper's method by scene and noise; finished units are kept.

Killed and run again, it continues where it stopped. `farm-ar sweeps status out/own_sweep.sqlite` says more.
"""

import numpy as np

from farm_ar.reid import SpatialReid, batch_accuracy
from farm_ar.scenes import LayoutNoise, builtin_scene, observe_many
from farm_ar.sweeps import ProcessExecutor, Sweep, grid, run_sweep


def accuracy(seed, scene, noise_m):
    """One unit: a row for a scene, a noise and a seed."""
    room, rng = builtin_scene(scene), np.random.default_rng(seed)
    noisy = LayoutNoise.of(noise_m, 0.0).disturb(room.layout, room.size, rng)
    seen = observe_many(noisy, room.camera_path.cameras(80, room.fov))
    found = SpatialReid(room).identify_many(seen)
    return {"accuracy": np.nanmean(batch_accuracy(found.label, seen.truth, seen.count))}


if __name__ == "__main__":
    sweep = Sweep("accuracy", accuracy, grid(scene=["L1", "H1"], noise_m=[0.1, 0.3]), seeds=range(10))
    with ProcessExecutor(workers=2, time_limit=60) as executor:
        results = run_sweep(sweep, "out/own_sweep.sqlite", executor)
    for parameters in sweep.parameters:
        found = [
            outcome.rows[0]["accuracy"]
            for unit, outcome in results.finished()
            if unit.parameters == parameters
        ]
        print(f"{parameters['scene']}, noise {parameters['noise_m']} m: accuracy {np.mean(found):.3f}")
