"""An episode as a video, with Gymnasium's own recorder."""

import sys
from pathlib import Path

import gymnasium as gym
import numpy as np
from gymnasium.wrappers import RecordVideo

try:
    import moviepy  # noqa: F401  # with which Gymnasium writes videos
except ImportError:
    print("Gymnasium records videos with MoviePy, which is not installed.")
    print("It comes with: pip install moviepy")
    print("Nothing was recorded.")
    sys.exit()

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "videos")
env = gym.make("farm_ar:FarmToTable-v0", action="slot", visits=3, render_mode="rgb_array")
env = RecordVideo(env, str(folder), name_prefix="random-policy")
env.action_space.seed(1)
env.reset(seed=1)
parts = np.cumsum(env.action_space.nvec)[:-1]
steps, over = 0, False
while not over:
    mask = env.unwrapped.action_masks().astype(np.int8)
    _, _, over, _, info = env.step(env.action_space.sample(mask=tuple(np.split(mask, parts))))
    steps += 1
env.close()

print(f"Played {steps} steps in 3 visits; {info['wrong_labels']} labels are wrong at the end.")
print(f"One picture stands for one step, {env.metadata['render_fps']} a second.")
for path in sorted(folder.glob("random-policy*.mp4")):
    print(f"Wrote {path}, {path.stat().st_size / 1000:.0f} kB")
