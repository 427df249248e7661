"""Makes an adversary that comes with farm-ar of a run, and the picture of its learning curve and of others'.

python docs/make_adversary.py farm-displacement last runs/displacement-0 runs/displacement-1
"""

import sys
from pathlib import Path

from matplotlib.figure import Figure

import farm_ar
from farm_ar.agents.policies.trained import load_policy, save_weights
from farm_ar.agents.training.run_folder import BEST, CHECKPOINTS, RunFolder, read_table
from farm_ar.drawing import save_picture

MODELS = Path(farm_ar.__file__).parent / "agents" / "policies" / "models"
IMAGES = Path(__file__).parent / "images"


def curve(runs: list[Path], name: str) -> Figure:
    """Mean return in training and in evaluations, against steps: of the first run, and of others thinner."""
    figure = Figure(figsize=(6.4, 3.4))
    axes = figure.subplots()
    axes.margins(y=0.12)
    for n, run in enumerate(runs):
        learnt, judged = read_table(run / "training.csv"), read_table(run / "evaluations.csv")
        thick, front = (1.6, 2) if n == 0 else (0.7, 1)
        labels = ("while learning", "evaluations, on the environment") if n == 0 else (None, None)
        for rows, colour, mark, label in zip(
            (learnt, judged), ("#9aa5b1", "#1f5fa8"), ("", "o"), labels, strict=True
        ):
            steps, means = [row["steps"] / 1000 for row in rows], [row["mean_return"] for row in rows]
            axes.plot(
                steps, means, color=colour, marker=mark, ms=3 * thick, lw=thick, zorder=front, label=label
            )
    recipe = RunFolder(runs[0]).read().recipe
    shown = recipe.imitate["steps"] / 1000 if recipe.imitate else 0.0
    for begin, end, what in ((0.0, shown, "planner"), (shown, recipe.before / 1000, "lifting")):
        if end > begin:
            axes.axvspan(begin, end, color="#f1ede4" if begin else "#e7efe2", zorder=0)
            axes.text((begin + end) / 2, axes.get_ylim()[0], what, ha="center", va="bottom", color="#7a6f5a")
    axes.set_xlabel("thousand steps")
    axes.set_ylabel("mean return of an episode")
    axes.set_title(name)
    axes.legend(frameon=False, loc="upper right")
    return figure


def main() -> None:
    """Write both files: the weights of the first run, and the picture of all."""
    name, which, *paths = sys.argv[1:]
    runs = [Path(path) for path in paths]
    run = runs[0]
    described = RunFolder(run).read()
    saved = RunFolder(run).newest(BEST if which == "best" else CHECKPOINTS)
    about = {
        "name": name,
        "env_kwargs": {"action": described.recipe.env_kwargs.get("action", "displacement")},
        "policy_kwargs": described.recipe.policy_kwargs,
        "steps": int(saved.name),
        "seed": described.seed,
        "version": farm_ar.__version__,
    }
    MODELS.mkdir(exist_ok=True)
    save_weights(load_policy(run, which), MODELS / f"{name}.npz", about)
    save_picture(curve(runs, name), IMAGES / f"{name}.svg")
    print(f"{name}: {which} after {int(saved.name)} steps")


if __name__ == "__main__":
    main()
