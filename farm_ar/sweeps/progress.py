"""How far a run is: bars with rate and time left in a terminal, plain lines elsewhere."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timedelta

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from farm_ar.sweeps.run import Standing, Watcher

BAR_EVERY_S, LINE_EVERY_S = 0.1, 10.0


@contextmanager
def shown(console: Console, line_every: float = LINE_EVERY_S) -> Iterator[Watcher]:
    """A watcher that shows on a console how far each sweep is.

    Args:
        console: where.
        line_every: seconds between two lines about one sweep, where the console is no terminal.
    """
    if not console.is_terminal:
        yield _every(line_every, lambda standing: console.print(described(standing), highlight=False))
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[pace]}"),
        TimeElapsedColumn(),
    )
    tasks: dict[str, TaskID] = {}
    with Progress(*columns, console=console) as progress:

        def show(standing: Standing) -> None:
            if standing.sweep not in tasks:
                tasks[standing.sweep] = progress.add_task(standing.sweep, total=standing.total, pace="")
            ended = standing.total - standing.left
            progress.update(tasks[standing.sweep], completed=ended, pace=pace(standing))

        yield _every(BAR_EVERY_S, show)


def described(standing: Standing) -> str:
    """A line about how far a run is."""
    ended = standing.total - standing.left
    parts = [f"{standing.sweep}: {ended} of {standing.total}"]
    if standing.before:
        parts.append(f"{standing.before} from before")
    if standing.failures:
        parts.append(f"{standing.failures} without result")
    return ", ".join(filter(None, [*parts, pace(standing)]))


def pace(standing: Standing) -> str:
    """Rate and time left, as "12.3/s, 0:01:05 left"; without what is left once nothing is."""
    if not standing.left and not standing.done:
        return ""
    rate = f"{standing.rate:.3g}/s" if standing.rate < 1000 else f"{standing.rate:.0f}/s"
    if not standing.left:
        return rate
    if not standing.rate:
        return "time left not known yet"
    return f"{rate}, {timedelta(seconds=round(standing.left / standing.rate))} left"


def _every(seconds: float, show: Watcher) -> Watcher:
    """Passes on the last step of each sweep, and of the others as many as come so far apart."""
    shown_at: dict[str, float] = {}

    def watch(standing: Standing) -> None:
        now = time.monotonic()
        if not standing.left or now - shown_at.setdefault(standing.sweep, now) >= seconds:
            shown_at[standing.sweep] = now
            show(standing)

    return watch
