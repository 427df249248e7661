"""Running the paper's experiments: one report each, and a summary of all."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from rich.console import Console
from rich.table import Table

from farm_ar.errors import OptionError, UnfinishedError, known_name
from farm_ar.experiments.ablation import fig7, table2
from farm_ar.experiments.catalogue import experiment_of
from farm_ar.experiments.headroom import headroom
from farm_ar.experiments.headset_frames import fig13
from farm_ar.experiments.noise_sweep import fig5
from farm_ar.experiments.overview import table1
from farm_ar.experiments.pruning import fig9, table3
from farm_ar.experiments.real_rooms_report import fig14, table4, table5
from farm_ar.experiments.relations import relations
from farm_ar.experiments.report import Report, comparison_table
from farm_ar.experiments.sequences import sequences
from farm_ar.experiments.setting import Setting
from farm_ar.experiments.shelves import shelf_experiment
from farm_ar.reid import load_reid
from farm_ar.scenes import builtin_scene
from farm_ar.scenes.files import write_text
from farm_ar.sweeps import Executor, Store, UnfinishedSweepError, make_executor
from farm_ar.sweeps.progress import shown

EXPERIMENTS: dict[str, Callable[[Setting], Report]] = {
    "table1": table1,
    "table2": table2,
    "table3": table3,
    "table4": table4,
    "table5": table5,
    "fig5": fig5,
    "fig7": fig7,
    "fig9": fig9,
    "fig13": fig13,
    "fig14": fig14,
    "shelf": shelf_experiment,
    "headroom": headroom,
    "relations": relations,
    "sequences": sequences,
}
"""The experiments by name."""

TAKES_REIDS = ("headroom", "relations", "sequences")
"""Experiments that compare a re-identifier of the user's own."""

BEYOND_THE_PAPER = ("shelf", *TAKES_REIDS)
"""Experiments that "all" leaves out: they are not in the paper, and most take long."""

QUICK_LAYOUTS, LAYOUTS = 5, 20
OWN_LAYOUTS = {"headroom": (2, 24), "relations": (1, 8), "sequences": (1, 6)}
"""Noisy layouts, quick or not, of the experiments that need another number."""

STORE = "sweeps.sqlite"


def names_of(what: str | Sequence[str]) -> list[str]:
    """The experiments that give tables and figures, each once, in the order in which they were named.

    Args:
        what: names in `EXPERIMENTS`, tables or figures as "Fig. 8", or "all" for those of the paper.

    Raises:
        OptionError: there is no such experiment.
    """
    found: list[str] = []
    for one in [what] if isinstance(what, str) else what:
        if one == "all":
            found += [name for name in EXPERIMENTS if name not in BEYOND_THE_PAPER]
        else:
            found.append(known_name("what", experiment_of(one), EXPERIMENTS))
    return list(dict.fromkeys(found))


def setting_of(
    what: str | Sequence[str],
    scenes: Path | None = None,
    layouts: int | None = None,
    seed: int = 0,
    quick: bool = False,
    fresh: bool = False,
    reid: str | None = None,
) -> Setting:
    """The setting in which `reproduce` runs.

    Args:
        what: a name in `EXPERIMENTS`, a table or figure as "Fig. 8", or "all" for those of the paper; or
            several.
        scenes: folder with L1.json to H2.json to use in place of the built-in scenes.
        layouts: noisy layouts for each noise level; 20 by default, 5 if quick, or as `OWN_LAYOUTS` says.
        seed: where all randomness comes from.
        quick: fewer layouts and rotation noises.
        fresh: start over, even with what is finished.
        reid: `module:Class` of your own, to be compared with the others in `TAKES_REIDS`.

    Raises:
        OptionError: an option is out of its limits.
        SceneError: a scene file is missing or cannot be used.
    """
    names = names_of(what)
    if reid is not None:
        if not set(names) <= set(TAKES_REIDS):
            raise OptionError("reid", f"must be given with {', '.join(TAKES_REIDS)} only", reid)
        load_reid(reid)(builtin_scene("L1"))
    numbers = {OWN_LAYOUTS.get(name, (QUICK_LAYOUTS, LAYOUTS)) for name in names}
    if len(numbers) > 1 and layouts is None:
        raise OptionError("layouts", "must be given where experiments have different defaults", layouts)
    few, many = min(numbers)
    number = layouts if layouts is not None else few if quick else many
    setting = Setting(scenes, number, seed, quick, fresh=fresh, reids=() if reid is None else (reid,))
    _ = setting.scenes  # a file that cannot be used is refused before anything is written
    return setting


def reproduce(
    what: str | Sequence[str] = "all",
    setting: Setting | None = None,
    out: Path = Path("out"),
    workers: int = 2,
    console: Console | None = None,
    executor: Executor | None = None,
) -> list[Report]:
    """Run one of the paper's experiments, some or all, and write their files and `summary.md`.

    What is finished is kept in `sweeps.sqlite` beside them, and not computed again after an interruption.

    Args:
        what: a name in `EXPERIMENTS`, a table or figure as "Fig. 8", or "all" for those of the paper; or
            several.
        setting: of the experiments; by default `setting_of` it.
        out: folder for the files; made if need be.
        workers: processes that share the work, or 1 to do it in this one; the results do not depend on it.
        console: where progress and the summary are shown.
        executor: where the work is done, in place of processes; it stays open.

    Raises:
        OptionError: there is no such experiment, or the number of workers is out of its limits.
        StoreError: the store cannot be read or written.
        UnfinishedError: some units gave no result; the others are kept, and the other experiments done.
    """
    names = names_of(what)
    setting = setting or setting_of(what)
    console = console or Console(markup=False, highlight=False)
    own = make_executor("process" if workers != 1 else "serial", workers)
    begin = time.perf_counter()
    out.mkdir(parents=True, exist_ok=True)
    reports, unfinished = [], []
    with Store(out / STORE) as store, own, shown(console) as watch:
        setting = replace(setting, store=store, executor=executor or own, watch=watch)
        for name in names:
            try:
                reports.append(EXPERIMENTS[name](setting))
            except UnfinishedSweepError as problem:
                unfinished.append(problem)
            else:
                reports[-1].write(out)
    write_text(out / "summary.md", _summary(reports, setting))
    _show(reports, console)
    if unfinished:
        raise UnfinishedError("\n".join(map(str, unfinished)))
    console.print(f"Done in {time.perf_counter() - begin:.0f} s. Pictures, tables and summary.md: {out}/")
    return reports


def _summary(reports: Sequence[Report], setting: Setting) -> str:
    origin = f"the scenes of `{setting.folder.resolve().name}`" if setting.folder else "the built-in scenes"
    form = ", the quick form" if setting.quick else ""
    how = f"On {origin}, seed {setting.seed}, {setting.layouts} noisy layouts per noise level{form}."
    paper = "The paper is Yu et al., doi:10.1007/s10055-025-01305-y."
    head = ["# The paper's experiments, reproduced", "", how, paper, ""]
    return "\n".join(head + [report.markdown() for report in reports])


def _show(reports: Sequence[Report], console: Console) -> None:
    for report in reports:
        console.print(f"\n{report.title}", style="bold")
        table = Table()
        headings, rows = comparison_table(report.comparisons)
        for column in headings:
            table.add_column(column, overflow="fold")
        for row in rows:
            table.add_row(*row)
        console.print(table)
        if report.note:
            console.print(report.note, style="dim")
    console.print()
