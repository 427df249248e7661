"""Rows as a table."""

import csv
import io

from farm_ar.sweeps import ProcessExecutor, Store, Sweep, grid, run_sweep
from farm_ar.sweeps.results import as_csv, summarise


def table(results, **options):
    return list(csv.DictReader(io.StringIO(as_csv(results, **options))))


def test_a_row_stands_behind_the_parameters_and_the_seed_of_its_unit():
    results = run_sweep(Sweep("doubles", "sweep_functions:double", grid(x=(3, 1)), seeds=(5, 6)))
    lines = table(results)
    assert list(lines[0]) == ["x", "seed", "double", "drawn"]
    assert [(line["x"], line["seed"], line["double"]) for line in lines] == [
        ("3", "5", "6"),
        ("3", "6", "6"),
        ("1", "5", "2"),
        ("1", "6", "2"),
    ]
    assert [float(line["drawn"]) for line in lines] == [row["drawn"] for row in results.rows()]


def test_every_kind_of_value_has_its_form():
    results = run_sweep(Sweep("numpy", "sweep_functions:of_numpy", [{"values": [0, 1]}]))
    assert as_csv(results) == (
        "values,seed,float,small,whole,flag,pair,none,list,nan,infinite\n"
        '"[0, 1]",0,0.1,0.10000000149011612,4611686018427387904,true,"[1, null]",,,,\n'
        '"[0, 1]",0,,,,,,,"[0.0, 0.3333333333333333]",,-Infinity\n'
    )


def test_a_column_called_like_a_parameter_is_told_apart():
    results = run_sweep(Sweep("echo", "sweep_functions:echo", grid(text=('a, "b"\n', "ä"))))
    assert as_csv(results) == ('text,seed,result.text\n"a, ""b""\n",0,"a, ""b""\n"\nä,0,ä\n')


def test_measured_rows_are_a_table_of_their_own():
    results = run_sweep(Sweep("timed", "sweep_functions:timed", grid(x=(1, 2))))
    assert "clock" not in as_csv(results)
    lines = table(results, measured=True)
    assert list(lines[0]) == ["x", "seed", "unit_seconds", "clock"]
    assert all(float(line["clock"]) > 0 and float(line["unit_seconds"]) >= 0 for line in lines)
    doubles = run_sweep(Sweep("doubles", "sweep_functions:double", grid(x=(1, 2))))
    assert [list(line) for line in table(doubles, measured=True)] == [["x", "seed", "unit_seconds"]] * 2


def test_what_is_not_finished_is_left_out():
    results = run_sweep(Sweep("fails", "sweep_functions:fails", grid(x=range(3))))
    assert [line["x"] for line in table(results)] == ["0", "2"]


def test_the_table_is_that_of_the_last_plan_in_its_order(tmp_path):
    for xs in ((1, 2, 3), (4, 2)):
        results = run_sweep(Sweep("doubles", "sweep_functions:double", grid(x=xs)), tmp_path / "store")
    assert [line["x"] for line in table(results)] == ["4", "2"]


def test_a_status_counts_the_units_by_what_became_of_them(tmp_path):
    parameters = grid(x=range(5), deadly=[[3]], how=["exit"], log=[str(tmp_path / "log")])
    sweep = Sweep("deadly", "sweep_functions:dies", parameters)
    with Store(tmp_path / "store") as store, ProcessExecutor(1) as executor:
        results = run_sweep(sweep, store, executor)
        status = summarise(results, store.claimed(results))
    assert status.cells()[:-1] == ("deadly", "5", "4", "0", "0", "1")
    assert status.seconds == sum(results.seconds.values()) > 0
