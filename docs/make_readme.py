"""Makes the films of README.md and its table of returns.

python docs/make_readme.py films RUNS     # docs/images/*.gif
python docs/make_readme.py returns RUNS   # the table between the marks in README.md; some minutes

RUNS is the folder of the runs that README.md names: hand, layout and scene.
"""

import json
import subprocess
import sys
from pathlib import Path

from farm_ar.drawing.video import write_gif
from farm_ar.showcases import ScriptRecorder, load_script
from farm_ar.showcases.film import FPS

ROOT = Path(__file__).parents[1]
README, IMAGES = ROOT / "README.md", ROOT / "docs" / "images"
BEGIN, END = "<!-- returns: begin -->", "<!-- returns: end -->"
WIDTH, EVERY = 560, 12

SCRIPTS = {
    "fooled": (str(ROOT / "examples" / "data" / "exchange.toml"), 160),
    "demonstration-1": ("demonstration-1", 96),
}
"""Films of scripts, by the names of the GIFs: the script, and how many colours keep the file below 700 kB."""

WATCHED = {
    "farm-to-table": ("farm-displacement", "--seed", "3"),
    "farm-to-table-hand": ("hand", "--seed", "13"),
    "farm-to-table-layout": ("layout", "--seed", "0"),
    "scene-layout": ("scene", "--seed", "23", "--arg", "visits=6"),
}
"""Films of policies, by the names of the GIFs: the policy, and options of farm-ar watch."""

BESIDE = {
    "FarmToTable-v0": ("farm-displacement", "analytic,greedy"),
    "FarmToTableHand-v0": ("hand", ""),
    "FarmToTableLayout-v0": ("layout", "analytic,greedy"),
    "SceneLayout-v0": ("scene", "analytic,greedy"),
}
"""Rows of the table: the trained policy, and those beside it."""


def farm_ar(command: str, policy: str, runs: Path, *options: str) -> str:
    """What a command prints of a policy: one that comes with farm-ar, or the last model of a run."""
    if (runs / policy).exists():
        policy, options = str(runs / policy), (*options, "--which", "last", "--trust")
    words = [sys.executable, "-m", "farm_ar", command, policy, *options]
    return subprocess.run(words, check=True, capture_output=True, text=True).stdout


def make_films(runs: Path) -> None:
    """All GIFs."""
    for name, (script, colours) in SCRIPTS.items():
        frames = [
            frame for n, frame in enumerate(ScriptRecorder(load_script(script)).frames()) if n % EVERY == 0
        ]
        write_gif(IMAGES / f"{name}.gif", frames, FPS / EVERY, WIDTH, colours)
    for name, (policy, *options) in WATCHED.items():
        print(
            farm_ar("watch", policy, runs, "--episodes", "1", "--out", str(IMAGES / f"{name}.gif"), *options)
        )


def table(runs: Path) -> str:
    """Mean returns of 100 held-out episodes, with standard errors."""
    lines = ["| id | random | greedy | analytic | trained |", "|---|---:|---:|---:|---:|"]
    for env, (policy, beside) in BESIDE.items():
        options = ("--json", "--arg", "reward=identity", "--beside", beside)
        rows = json.loads(farm_ar("evaluate", policy, runs, *options))
        found = {
            row["policy"]: f"{row['return']:.2f} ± {row['standard_error']:.2f}" for row in rows["policies"]
        }
        cells = [found.get(name, "–") for name in ("random", "greedy", "analytic", "trained")]
        lines.append(f"| `{env}` | {' | '.join(cells)} |".replace("-0.00 ", "0.00 "))
    return "\n".join(lines)


def main() -> None:
    """Make what is asked for."""
    what, runs = sys.argv[1], Path(sys.argv[2])
    if what == "films":
        make_films(runs)
        return
    made = table(runs)
    before, _, rest = README.read_text(encoding="utf-8").partition(BEGIN)
    _, _, after = rest.partition(END)
    README.write_text(f"{before}{BEGIN}\n\n{made}\n\n{END}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
