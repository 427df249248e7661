"""Units, their keys, and what a sweep refuses before it begins."""

import subprocess
import sys
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from farm_ar.errors import OptionError
from farm_ar.sweeps import Sweep, Unit, grid

DOUBLE = "sweep_functions:double"


def test_a_grid_has_every_combination_and_the_last_name_varies_fastest():
    assert grid(a=(1, 2), b="xy") == [
        {"a": 1, "b": "x"},
        {"a": 1, "b": "y"},
        {"a": 2, "b": "x"},
        {"a": 2, "b": "y"},
    ]


def test_the_units_are_all_parameters_with_all_seeds():
    import sweep_functions

    units = Sweep("s", sweep_functions.double, grid(x=(1, 2)), seeds=(3, 4)).units
    assert [(unit.function, unit.parameters, unit.seed) for unit in units] == [
        (DOUBLE, {"x": x}, seed) for x in (1, 2) for seed in (3, 4)
    ]


def test_every_part_of_a_unit_is_part_of_its_key():
    unit = Unit("m:f", '{"x":1}', 0, "v")
    others = [Unit("m:g", '{"x":1}', 0, "v"), Unit("m:f", '{"x":2}', 0, "v"), Unit("m:f", '{"x":1}', 1, "v")]
    others.append(Unit("m:f", '{"x":1}', 0, "w"))
    assert len({each.key for each in [unit, *others]}) == 5
    assert Unit("m:f", '{"x":1}', 0, "v").key == unit.key


def test_numpy_numbers_and_the_order_of_names_make_no_other_unit():
    plain = Sweep("s", "sweep_functions:logged", [{"x": 1, "log": "a", "seconds": 0.1}]).units[0]
    values = {"seconds": np.float64(0.1), "log": "a", "x": np.int64(1)}
    assert Sweep("s", "sweep_functions:logged", [values]).units[0].key == plain.key


def test_the_key_is_the_same_in_another_process():
    sweep = Sweep("s", DOUBLE, grid(x=(0.1,)))
    program = f"from farm_ar.sweeps import *; print(Sweep('s', {DOUBLE!r}, grid(x=(0.1,))).units[0].key)"
    paths = [str(Path(__file__).parent / "modules"), *sys.path]
    run = [sys.executable, "-c", f"import sys; sys.path[:] = {paths!r}; {program}"]
    assert (
        subprocess.run(run, capture_output=True, text=True, check=True).stdout.strip() == sweep.units[0].key
    )


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"name": ""}, "name: must be a non-empty string, got ''"),
        ({"seeds": (1, -1)}, "seeds[1]: must be a whole number not below 0, got -1"),
        ({"seeds": (True,)}, "seeds[0]: must be a whole number not below 0, got True"),
        ({"seeds": (1, 1)}, "parameters: must not have the same unit twice, got 'double {\"x\":1} seed 1'"),
        ({"parameters": grid(x=(1, 2, 1))}, "parameters: must not have the same unit twice"),
        ({"parameters": [{"x": 1}, {"y": 1}]}, "parameters[1]: must be what sweep_functions:double takes"),
        ({"parameters": [{"x": 1, "seed": 2}]}, "parameters[0]: must not have the name seed"),
        ({"parameters": [{"x": np.nan}]}, "parameters[0]: must have finite numbers"),
        ({"parameters": [{"x": 1j}]}, "parameters[0].x: must be a JSON value"),
        ({"function": "double"}, "function: must be a function at the top of a module that can be imported"),
        ({"function": "sweep_functions:triple"}, "function: must be a function at the top of a module"),
        ({"function": "no_such_module:double"}, "function: must be a function at the top of a module"),
        ({"function": "sweep_functions:os"}, "function: must be a function at the top of a module"),
        ({"function": lambda seed, x: {}}, "function: must be a function at the top of a module"),
        ({"function": str.upper}, "function: must be a function at the top of a module"),
    ],
)
def test_a_sweep_that_cannot_be_run_is_refused_when_it_is_made(options, message):
    with pytest.raises(OptionError) as problem:
        Sweep(**{"name": "s", "function": DOUBLE, "parameters": grid(x=(1,)), **options})
    assert str(problem.value).startswith(message)


def test_an_import_error_inside_the_functions_module_is_not_hidden(tmp_path, monkeypatch):
    (tmp_path / "broken_module.py").write_text("import a_package_that_nobody_has\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ModuleNotFoundError, match="a_package_that_nobody_has"):
        Sweep("s", "broken_module:double", grid(x=(1,)))


SCRIPT = """
from farm_ar.sweeps import ProcessExecutor, Sweep, grid, run_sweep

def square(seed, x):
    return {"square": x * x}

if __name__ == "__main__":
    with ProcessExecutor(1) as executor:
        sweep = Sweep("squares", square, grid(x=range(3)))
        print(sweep.units[0].function, run_sweep(sweep, executor=executor).rows())
"""


@pytest.mark.parametrize("how", [["own_sweep.py"], ["-m", "own_sweep"]])
def test_the_function_may_stand_in_the_script_that_is_run(tmp_path, how):
    (tmp_path / "own_sweep.py").write_text(SCRIPT)
    run = subprocess.run([sys.executable, *how], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.stdout == "own_sweep:square [{'square': 0}, {'square': 1}, {'square': 4}]\n", run.stderr


def test_a_function_typed_in_by_hand_is_refused(monkeypatch):
    def typed(seed):
        return {}

    typed.__module__, typed.__qualname__ = "__main__", "typed"
    monkeypatch.setitem(sys.modules, "__main__", ModuleType("__main__"))
    with pytest.raises(OptionError, match="can be imported, not typed in by hand, got '__main__'"):
        Sweep("s", typed, [{}])


@pytest.mark.parametrize(
    "of_the_script", [{"__file__": "/any/where/sweep_functions.py"}, {"spec": "sweep_functions"}]
)
def test_a_function_of_the_script_goes_by_the_name_under_which_the_script_is_imported(
    monkeypatch, of_the_script
):
    import sweep_functions

    main = ModuleType("__main__")
    main.__dict__.update(of_the_script)
    if "spec" in of_the_script:
        main.__spec__ = ModuleSpec("sweep_functions", loader=None)
    monkeypatch.setitem(sys.modules, "__main__", main)
    monkeypatch.setattr(sweep_functions.double, "__module__", "__main__")
    sweep = Sweep("s", sweep_functions.double, grid(x=(1,)))
    assert sweep.units[0].function == "sweep_functions:double"
