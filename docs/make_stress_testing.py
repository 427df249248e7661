"""Writes the tables of docs/stress-testing.md from the reports of farm-ar stress.

python docs/make_stress_testing.py OUT, where OUT holds the folders that the commands on that page make: farm,
H1, farm-attacks and H1-attacks.
"""

import csv
import json
import re
import sys
from pathlib import Path

import numpy as np

RULE_COLUMNS = (
    "rule",
    "median least",
    "certified",
    "found / certified, 10 / 50 / 90%",
    "by T1 alone",
    "fails in everyday disorder",
    "endpoint error, m",
    "miscounted animals",
    "calibration error, everyday / attacked",
)
PAGE = Path(__file__).parent / "stress-testing.md"


def rules_table(folder: Path) -> str:
    report = json.loads((folder / "stress.json").read_text())
    lines = [
        f"| {' | '.join(RULE_COLUMNS)} |",
        "| --- |" + " ---: |" * (len(RULE_COLUMNS) - 1),
    ]
    for rule in report["rules"]:
        least = next(one for one in rule["attacks"] if one["attack"] == "best")["least"]
        certified = rule["theorem"] != "none"
        ratios = [a / b for a, b in zip(least, rule["bounds"], strict=True) if a and b] if certified else []
        tight = " / ".join(f"{v:.2f}" for v in np.percentile(ratios, [10, 50, 90])) if ratios else "–"
        low_high = "{:.1%} ({:.1%} to {:.1%})".format(*rule["noise_failures"])
        errors = [rule["calibration_error"], rule["calibration_error_attacked"]]
        lines.append(
            f"| {rule['reid']} | {number(rule['median_least'])} | "
            f"{number(rule['bound_median']) if certified else 'none'} | {tight} | "
            f"{number(rule['bound_t1_median']) if certified else 'none'} | {low_high} | "
            f"{number(rule['mean_endpoint_error_m'])} | {number(rule['mean_miscounts'])} | "
            f"{' / '.join(number(v) for v in errors) if errors[0] is not None else '–'} |"
        )
    return "\n".join(lines)


def transfer_table(folder: Path) -> str:
    report = json.loads((folder / "stress.json").read_text())
    names = [rule["reid"] for rule in report["rules"]]
    lines = ["| made for | " + " | ".join(names) + " |", "| --- |" + " ---: |" * len(names)]
    for rule in report["rules"]:
        cells = " | ".join(f"{rule['transfer'][name][0]:.0%}" for name in names)
        lines.append(f"| {rule['reid']} | {cells} |")
    return "\n".join(lines)


def attacks_table(folder: Path) -> str:
    report = json.loads((folder / "stress.json").read_text())
    (rule,) = report["rules"]
    with (folder / "stress-times.csv").open() as file:
        times = list(csv.DictReader(file))
    lines = [
        "| attack | failed | median least | / certified | queries a second |",
        "| --- | ---: | ---: | ---: | ---: |",
    ]
    for one in rule["attacks"]:
        mine = [row for row in times if row["attack"] == one["attack"]]
        seconds = sum(float(row["seconds"]) for row in mine)
        pace = f"{sum(int(row['asked']) for row in mine) / seconds:,.0f}" if seconds else "–"
        tight = "–" if one["tightness_median"] is None else f"{one['tightness_median']:.2f}"
        lines.append(
            f"| {one['attack']} | {one['failed'][0]:.0%} | {number(one['median_least'])} | {tight} | {pace} |"
        )
    return "\n".join(lines)


def number(value: float | None) -> str:
    return "–" if value is None else f"{value:.3g}"


def main(out: Path) -> None:
    tables = {
        "farm rules": rules_table(out / "farm"),
        "farm transfer": transfer_table(out / "farm"),
        "H1 rules": rules_table(out / "H1"),
        "H1 transfer": transfer_table(out / "H1"),
        "farm attacks": attacks_table(out / "farm-attacks"),
        "H1 attacks": attacks_table(out / "H1-attacks"),
    }
    page = PAGE.read_text(encoding="utf-8")
    for name, table in tables.items():
        mark = re.compile(f"(<!-- {name} -->\\n).*?(<!-- end -->)", re.DOTALL)
        page, found = mark.subn(lambda match, text=table: f"{match[1]}{text}\n{match[2]}", page)
        if found != 1:
            sys.exit(f"{PAGE.name}: must hold the mark <!-- {name} --> once, got it {found} times")
    PAGE.write_text(page, encoding="utf-8")
    print(f"Wrote {len(tables)} tables into {PAGE}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
