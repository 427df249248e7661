"""Measures the errors of poses from pictures of the farm, for `oracle_noise="measured"`.

    python benchmarks/measured_noise.py [--pictures N] [--seed N] [--out FILE]

By default it writes the file that comes with the package. Poses are estimated by its own estimator, of
pictures of 640 x 360 pixels with noise of SD 8 and JPEG 80, the camera exact.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from farm_ar.scenes import builtin_scene
from farm_ar.vision.measured_noise import FILE, measure, moments_of
from farm_ar.vision.perception import PixelPerception


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--pictures", type=int, default=300)
    parser.add_argument("--seed", type=int, default=20)
    parser.add_argument("--out", type=Path, default=FILE)
    asked = parser.parse_args()
    scene = builtin_scene("farm")
    moments = moments_of(scene, asked.pictures, asked.seed)
    print(f"Estimating poses from {len(moments)} pictures ...", flush=True)
    found = measure(PixelPerception(scene), moments, asked.seed)
    command = f"python benchmarks/measured_noise.py --pictures {asked.pictures} --seed {asked.seed}"
    asked.out.write_text(json.dumps({"made_by": command, **found}, indent=1) + "\n")
    for k, (miss, flip, spread) in enumerate(
        zip(found["miss"], found["flip"], found["covariance"], strict=True)
    ):
        sd = np.sqrt(np.diag(spread))
        low, high = (0.0, *found["edges"])[k], (*found["edges"], np.inf)[k]
        print(
            f"{low:.2f} to {high:.2f} m: missed {miss:.1%}, flipped {flip:.1%}, "
            f"SD {100 * sd[0]:.2f} x {100 * sd[1]:.2f} cm, {np.rad2deg(sd[2]):.1f} degrees"
        )
    print(f"false: {found['false_rate']:.2f} a picture; wrote {asked.out}")


if __name__ == "__main__":
    main()
