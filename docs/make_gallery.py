"""Makes the failures that come with the page: a small stress test of two methods, by a seed.

    python docs/make_gallery.py

writes farm_ar/web/gallery.json (about a minute).
"""

import json
from pathlib import Path

from farm_ar.agents.stress import StressOptions, run_stress, summarise
from farm_ar.agents.stress.report import as_json
from farm_ar.scenes import builtin_scene

OUT = Path(__file__).parents[1] / "farm_ar" / "web" / "gallery.json"
ATTACKS, QUERIES, CASES = ("planned", "analytic"), 600, 6
SHOWN = {"cheapest": 3, "worst": 2}
KEYS = ("scene", "jitter", "seed", "case", "reid", "position", "yaw", "effort", "wrong")


def main() -> None:
    options = StressOptions(
        reids=("spatial", "likelihood"),
        attacks=ATTACKS,
        queries=QUERIES,
        cases=CASES,
        noise_draws=1,
        jitter="easy",
    )
    study = run_stress(options)
    found = as_json(study, summarise(study, builtin_scene("farm").layout.labels))["failures"]
    chosen = [
        one
        for reid in options.reids
        for kind, most in SHOWN.items()
        for one in [one for one in found if (one["reid"], one["kind"]) == (reid, kind)][:most]
    ]
    kept = [{key: one[key] for key in KEYS} for one in chosen]
    OUT.write_text(json.dumps({"failures": kept}, indent=1) + "\n", encoding="utf-8")
    print(f"Wrote {OUT}, {len(kept)} failures")


if __name__ == "__main__":
    main()
