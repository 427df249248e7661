"""Puts what `farm-ar reproduce headroom --out DIR` found into reidentification.md, and its figure beside it.

Run it after that command: python docs/make_reidentification.py DIR
"""

import json
import shutil
import sys
from pathlib import Path

from farm_ar.experiments.headroom_report import report_of

PAGE = Path(__file__).parent / "reidentification.md"
BEGIN, END = "<!-- headroom: begin -->", "<!-- headroom: end -->"


def section(rows: list[dict[str, str | int | float | None]]) -> str:
    """The goals and the tables."""
    report = report_of(rows, int(rows[0]["layouts"] or 0))
    lines = ["| | the paper's method | `likelihood` | |", "|---|---|---|---|"]
    lines += [f"| {c.what} | {c.paper} | {c.ours} | {c.spread} |" for c in report.comparisons]
    return "\n".join(lines) + f"\n\n{report.tables}"


def main() -> None:
    """Rewrite what stands between the marks."""
    folder = Path(sys.argv[1])
    rows = json.loads((folder / "headroom.json").read_text(encoding="utf-8"))
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    _, _, after = rest.partition(END)
    PAGE.write_text(f"{before}{BEGIN}\n\n{section(rows)}\n\n{END}{after}", encoding="utf-8")
    shutil.copy(folder / "headroom.svg", PAGE.parent / "images" / "headroom.svg")
    print(f"Wrote {PAGE}")


if __name__ == "__main__":
    main()
