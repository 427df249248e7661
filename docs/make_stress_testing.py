"""Makes the reports of docs/stress-testing.md with farm-ar stress, and writes its tables from them.

python docs/make_stress_testing.py [OUT] [FOLDER...]

OUT (by default out) holds the reports, pages to look at among them, each in a folder. Those that are named
are made first (hours for all of them; an interrupted one goes on): farm, H1, farm-attacks, H1-attacks,
farm-ungated, H1-ungated. Tables of folders that are not there stay as they are.
"""

import csv
import json
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

RULE_COLUMNS = (
    "method",
    "median minimum",
    "certified",
    "found / certified, 10 / 50 / 90%",
    "simple bound",
    "fails under random noise",
    "calibration error, noise / attacked",
)
HARM_COLUMNS = (
    "method",
    "endpoint error, m",
    "miscounted animals",
    "physically realizable",
    "median D of that",
    "most labels wrong",
    "median D of that",
)
TIGHTNESS = """\
How tight the bound of the paper's method is: the least D found, divided by the certified one,
case by case; and by the simple bound. The game keeps categories apart; the method of the
paper's synthetic experiments, `--reid spatial-ungated`, does not (`--cases 8 --out out/farm-ungated`, and
`out/H1-ungated` with `--jitter none`)."""
METHODS = "spatial,likelihood,relational,distance,nearest,last-known"
UNGATED = "--reid spatial-ungated"
ON = {"farm": "--scene farm", "H1": "--scene H1 --jitter none"}
REPORTS = {
    "farm": f"{ON['farm']} --compare {METHODS} --cases 10",
    "H1": f"{ON['H1']} --compare {METHODS} --cases 8",
    "farm-attacks": f"{ON['farm']} --attack all,learned --cases 8",
    "H1-attacks": f"{ON['H1']} --attack all --cases 6",
    "farm-ungated": f"{ON['farm']} {UNGATED} --cases 8",
    "H1-ungated": f"{ON['H1']} {UNGATED} --cases 8",
}
"""The options of farm-ar stress by folder."""

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
            f"{' / '.join(number(v) for v in errors) if errors[0] is not None else '–'} |"
        )
    return "\n".join(lines)


def harm_table(folder: Path) -> str:
    report = json.loads((folder / "stress.json").read_text())
    lines = [
        f"| {' | '.join(HARM_COLUMNS)} |",
        "| --- |" + " ---: |" * (len(HARM_COLUMNS) - 1),
    ]
    for rule in report["rules"]:
        by_hand = "–" if rule["by_hand"] is None else "{:.0%} ({:.0%} to {:.0%})".format(*rule["by_hand"])
        effort = "> budget" if rule["by_hand"] is not None and rule["by_hand_median"] is None else None
        lines.append(
            f"| {rule['reid']} | {number(rule['mean_endpoint_error_m'])} | "
            f"{number(rule['mean_miscounts'])} | {by_hand} | {effort or number(rule['by_hand_median'])} | "
            f"{number(rule['most_wrong_median'])} | {number(rule['most_wrong_effort_median'])} |"
        )
    return "\n".join(lines)


def tightness_table(out: Path) -> str:
    lines = [
        TIGHTNESS,
        "",
        "| categories | scene | found / certified, 10 / 50 / 90% | by the simple bound, 50% |",
        "| --- |" + " ---: |" * 3,
    ]
    for kind, scene, folder in (
        ("kept apart", "farm", "farm-attacks"),
        ("kept apart", "H1", "H1-attacks"),
        ("not kept apart", "farm", "farm-ungated"),
        ("not kept apart", "H1", "H1-ungated"),
    ):
        report = json.loads((out / folder / "stress.json").read_text())
        (rule,) = report["rules"]
        least = next(one for one in rule["attacks"] if one["attack"] == "best")["least"]
        with (out / folder / "stress.csv").open() as file:
            first = {int(row["case"]): float(row["bound_t1"] or "inf") for row in csv.DictReader(file)}
        cases = rule["cases"]
        ratios = [a / b for a, b in zip(least, rule["bounds"], strict=True) if a and b]
        tight = " / ".join(f"{v:.2f}" for v in np.percentile(ratios, [10, 50, 90]))
        alone = np.median([effort / first[case] for case, effort in zip(cases, least, strict=True) if effort])
        lines.append(f"| {kind} | {scene} | {tight} | {alone:.2f} |")
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
        "| attack | failed | median minimum | / certified | queries a second |",
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


TABLES: dict[str, tuple[Callable[[Path], str], tuple[str, ...]]] = {
    "farm rules": (rules_table, ("farm",)),
    "farm harm": (harm_table, ("farm",)),
    "farm transfer": (transfer_table, ("farm",)),
    "H1 rules": (rules_table, ("H1",)),
    "H1 harm": (harm_table, ("H1",)),
    "H1 transfer": (transfer_table, ("H1",)),
    "tightness": (tightness_table, ("farm-attacks", "H1-attacks", "farm-ungated", "H1-ungated")),
    "farm attacks": (attacks_table, ("farm-attacks",)),
    "H1 attacks": (attacks_table, ("H1-attacks",)),
}
"""By the mark on the page: what makes a table, and of which folders."""


def main(out: Path, wanted: list[str]) -> None:
    for folder in wanted:
        command = [sys.executable, "-m", "farm_ar", "stress", *REPORTS[folder].split()]
        subprocess.run([*command, "--out", str(out / folder)], check=True)
    page = PAGE.read_text(encoding="utf-8")
    for name, (make, needed) in TABLES.items():
        missing = [folder for folder in needed if not (out / folder / "stress.json").exists()]
        if missing:
            print(f"{name}: left as it is, without {', '.join(missing)}")
            continue
        table = make(out / needed[0] if len(needed) == 1 else out)
        mark = re.compile(f"(<!-- {name} -->\\n).*?(<!-- end -->)", re.DOTALL)
        page, found = mark.subn(lambda match, text=table: f"{match[1]}{text}\n{match[2]}", page)
        if found != 1:
            sys.exit(f"{PAGE.name}: must hold the mark <!-- {name} --> once, got it {found} times")
    PAGE.write_text(page, encoding="utf-8")
    print(f"Wrote {PAGE}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"), sys.argv[2:])
