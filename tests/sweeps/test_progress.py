"""How far a run is, in a terminal and in a file."""

import io
import itertools
import re
from types import SimpleNamespace

import pytest
from rich.console import Console

from farm_ar.sweeps import Standing, Sweep, grid, progress, run_sweep
from farm_ar.sweeps.progress import described, pace, shown


def doubles(number):
    return Sweep(f"{number} doubles", "sweep_functions:double", grid(x=range(number)))


def standing(**values):
    start = {"sweep": "s", "total": 10, "before": 0, "done": 0, "failures": 0, "seconds": 0.0}
    return Standing(**start | values)


@pytest.mark.parametrize(
    ("values", "line"),
    [
        ({}, "s: 0 of 10, time left not known yet"),
        ({"done": 4, "seconds": 8.0}, "s: 4 of 10, 0.5/s, 0:00:12 left"),
        ({"done": 2, "before": 3, "seconds": 0.01}, "s: 5 of 10, 3 from before, 200/s, 0:00:00 left"),
        ({"done": 1, "failures": 2, "seconds": 9.0}, "s: 3 of 10, 2 without result, 0.111/s, 0:01:03 left"),
        ({"done": 10, "seconds": 0.001}, "s: 10 of 10, 10000/s"),
        ({"before": 10}, "s: 10 of 10, 10 from before"),
    ],
)
def test_a_line_says_what_is_done_how_fast_and_how_long_the_rest_will_take(values, line):
    assert described(standing(**values)) == line


def test_the_rate_counts_only_what_this_run_has_done():
    assert pace(standing(before=8, done=1, seconds=2.0)) == "0.5/s, 0:00:02 left"


def test_outside_a_terminal_there_are_plain_lines_some_seconds_apart(monkeypatch):
    seconds = itertools.count()
    monkeypatch.setattr(progress, "time", SimpleNamespace(monotonic=lambda: float(next(seconds))))
    screen = io.StringIO()
    with shown(Console(file=screen, width=160)) as watch:
        run_sweep(doubles(40), watch=watch)
    lines = screen.getvalue().splitlines()
    assert len(lines) == 4, "41 steps of a second, a line every ten, and one at the end"
    assert re.fullmatch(r"40 doubles: 10 of 40, [\d.]+/s, 0:00:00 left", lines[0])
    assert re.fullmatch(r"40 doubles: 40 of 40, [\d.]+/s", lines[-1])


def test_a_short_sweep_has_one_plain_line():
    screen = io.StringIO()
    with shown(Console(file=screen, width=160)) as watch:
        run_sweep(doubles(40), watch=watch)
    assert re.fullmatch(r"40 doubles: 40 of 40, [\d.]+/s\n", screen.getvalue())


def test_in_a_terminal_each_sweep_has_a_bar():
    screen = io.StringIO()
    console = Console(file=screen, width=160, force_terminal=True, color_system=None)
    with shown(console) as watch:
        run_sweep(doubles(40), watch=watch)
        run_sweep(doubles(3), watch=watch)
    shows = screen.getvalue()
    assert re.search(r"40 doubles ━+ +40/40 +[\d.]+/s", shows)
    assert re.search(r"3 doubles +━+ +3/3 +[\d.]+/s", shows)
