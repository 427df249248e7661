"""Machine code on disk is never that of other sources: a small package, edited between processes."""

import importlib
import inspect
import os
import pkgutil
import re
import shutil
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import pytest
from numba.core.dispatcher import Dispatcher

import farm_ar
from farm_ar import inner_kernels, kernels
from farm_ar.agents.policies import beam_search
from farm_ar.envs import env

FILES = {
    "__init__.py": "",
    "constants.py": "FACTOR = 2.0\n",
    "inside/__init__.py": "from farm_ar.inside.inner import inner\nfrom .lone import lone\n",
    "inside/inner.py": """
from farm_ar.constants import FACTOR
from farm_ar.kernels import compiled

@compiled
def inner(x):
    return FACTOR * x + 1.0
""",
    "inside/lone.py": """
from ..kernels import compiled

@compiled(error_model="numpy")
def lone(x):
    return 7.0 / x
""",
    "middle.py": """
from farm_ar import inside, kernels

@kernels.compiled(inline="always")
def middle(x):
    return inside.inner(x)
""",
    "one.py": """
from .kernels import compiled
from .middle import middle

@compiled
def one(x):
    return middle(x)
""",
    "two.py": """
import farm_ar.kernels

def made():
    global middle
    from farm_ar.middle import middle

    @farm_ar.kernels.compiled
    def two(x):
        return 10.0 * middle(x)

    return two

two = made()
""",
    "apart.py": """
from farm_ar.inside import lone
from farm_ar.kernels import compiled

@compiled
def apart(x):
    return lone(x)
""",
}
PRINT = """
from farm_ar.apart import apart
from farm_ar.one import one
from farm_ar.two import two
for kernel in (one, two, apart):
    print(kernel(3.0), sum(kernel.stats.cache_hits.values()))
"""


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A small package of the name, with the decorator and nothing else of farm-ar."""
    folder = tmp_path / "farm_ar"
    for name, content in FILES.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(content)
    for module in (kernels, inner_kernels):
        shutil.copy(inspect.getfile(module), folder)
    return folder


def start(package: Path, code: str, **surroundings: str) -> "subprocess.Popen[str]":
    """Another process that runs code with the small package."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("NUMBA", "COV"))}
    return subprocess.Popen(
        [sys.executable, "-c", code],
        env=kept | {"PYTHONPATH": str(package.parent)} | surroundings,
        cwd=package.parent,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )


def run(package: Path, code: str = PRINT, **surroundings: str) -> list[tuple[float, bool]]:
    """What each kernel gives in a process of its own, and whether its code came from the disk."""
    process = start(package, code, **surroundings)
    out, err = process.communicate(timeout=120)
    assert process.returncode == 0, err
    return [(float(value), hits == "1") for value, hits in (line.split() for line in out.splitlines())]


def test_an_edit_two_imports_away_reaches_every_kernel_and_leaves_the_others_compiled(package):
    assert run(package) == [(7.0, False), (70.0, False), (7.0 / 3.0, False)]
    assert run(package) == [(7.0, True), (70.0, True), (7.0 / 3.0, True)]

    inner = package / "inside/inner.py"
    inner.write_text(inner.read_text().replace("+ 1.0", "+ 2.0"))
    assert run(package) == [(8.0, False), (80.0, False), (7.0 / 3.0, True)]

    (package / "constants.py").write_text("FACTOR = 3.0\n")
    assert run(package) == [(11.0, False), (110.0, False), (7.0 / 3.0, True)]


def test_what_was_compiled_from_other_content_is_removed(package):
    run(package)
    before = {file.name for file in package.rglob("*.nbc")}
    (package / "constants.py").write_text("FACTOR = 3.0\n")
    run(package)
    after = {file.name for file in package.rglob("*.nbc")}
    assert len(after) == len(before)
    assert before & after == {name for name in before if name.startswith(("apart", "lone"))}


def test_sources_with_the_same_content_share_what_is_compiled(package):
    run(package)
    for file in package.rglob("*.py"):
        content = file.read_text()
        file.unlink()
        file.write_text(content)
    assert all(kept for _, kept in run(package))


def test_a_file_edited_after_it_was_loaded_does_not_pass_for_the_new_one(package):
    edit = "import pathlib; pathlib.Path('farm_ar/constants.py').write_text('FACTOR = 5.0')\n"
    loaded = PRINT.replace("for kernel", edit + "for kernel")
    assert run(package, loaded)[0] == (7.0, False)
    assert run(package)[0] == (16.0, False)


def test_processes_that_compile_at_once_leave_code_for_every_signature(package):
    code = "from farm_ar.one import one\n" + "one({})\n" * 3
    arguments = (["1", "2.0", "True"], ["2.0", "True", "1"], ["True", "1", "2.0"])
    processes = [start(package, code.format(*order)) for order in arguments * 2]
    for process in processes:
        _, err = process.communicate(timeout=120)
        assert process.returncode == 0, err
    assert len(list(package.rglob("one.one-*.nbc"))) == 3
    found = "from farm_ar.one import one\nfor x in (1, 2.0, True): print(one(x), 0)\n"
    found += "print(sum(one.stats.cache_hits.values()), sum(one.stats.cache_misses.values()))"
    assert run(package, found) == [(3.0, False), (5.0, False), (3.0, False), (3.0, False)]


def test_without_a_folder_to_write_to_kernels_are_compiled_all_the_same(package):
    no_folder = package.parent / "file"
    no_folder.write_text("")
    for folder in (package, package / "inside"):
        shutil.rmtree(folder / "__pycache__", ignore_errors=True)
        (folder / "__pycache__").write_text("")
    surroundings = dict.fromkeys(("NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "HOME"), f"{no_folder}/a")
    assert run(package, **surroundings) == [(7.0, False), (70.0, False), (7.0 / 3.0, False)]


def test_from_an_archive_kernels_are_compiled_all_the_same(package):
    archive = package.parent / "archive.zip"
    with zipfile.ZipFile(archive, "w") as made:
        for file in package.rglob("*.py"):
            made.write(file, file.relative_to(package.parent))
    shutil.rmtree(package)
    values = run(package, PYTHONPATH=str(archive), XDG_CACHE_HOME=str(package.parent / "cache"))
    assert [value for value, _ in values] == [7.0, 70.0, 7.0 / 3.0]


def test_a_damaged_file_is_compiled_anew(package):
    run(package)
    for file in package.rglob("*.nbc"):
        file.write_bytes(file.read_bytes()[:20])
    assert run(package) == [(7.0, False), (70.0, False), (7.0 / 3.0, False)]


ANNOUNCED = """
from farm_ar import inner_kernels, kernels
kernels.PATIENCE_S = 0.0
kernels.COMPILED.update(one=("numbers", 3), two=("others", 4))
from farm_ar.one import one
from farm_ar.two import two
one(1), one(2.0), two(1.0)
"""


def told(package: Path, code: str, **surroundings: str) -> str:
    """What a process says on the error output; it prints nothing."""
    out, err = start(package, code, **surroundings).communicate(timeout=120)
    assert out == ""
    return err


def test_compiling_is_announced_once_for_each_package_and_only_where_it_takes_place(package):
    lines = (
        "farm-ar: compiling numbers (once; up to 3 s) ...\nfarm-ar: compiling others (once; up to 4 s) ...\n"
    )
    assert told(package, ANNOUNCED, FARM_AR_QUIET="") == lines
    assert told(package, ANNOUNCED, FARM_AR_QUIET="") == ""


def test_every_package_with_kernels_is_announced():
    root = Path(farm_ar.__file__).parent
    decorated = re.compile(r"^from farm_ar\.(inner_)?kernels import", re.MULTILINE)
    files = [file.relative_to(root) for file in root.rglob("*.py") if decorated.search(file.read_text())]
    assert {file.parts[0] for file in files if len(file.parts) > 1} <= kernels.COMPILED.keys()


def test_sources_dated_in_the_future_say_why_no_code_is_kept(package):
    later = time.time() + 3600
    os.utime(package / "constants.py", (later, later))
    code = "from farm_ar.one import one\none(1), one(2.0)"
    line = "farm-ar: constants.py is dated in the future: no machine code is kept (is the clock right?)\n"
    assert told(package, code, FARM_AR_QUIET="") == line
    assert told(package, code, FARM_AR_QUIET="1") == ""


def test_short_compiling_quiet_processes_and_workers_say_nothing(package):
    assert told(package, ANNOUNCED.replace("0.0", "60.0"), FARM_AR_QUIET="") == ""
    shutil.rmtree(package / "__pycache__")
    assert told(package, ANNOUNCED, FARM_AR_QUIET="1") == ""
    shutil.rmtree(package / "__pycache__")
    (package / "work.py").write_text(
        "def work():\n" + "".join(f"    {line}\n" for line in ANNOUNCED.splitlines())
    )
    starts = "import multiprocessing\nfrom farm_ar.work import work\nif __name__ == '__main__':\n"
    starts += (
        "    one = multiprocessing.get_context('spawn').Process(target=work)\n    one.start(); one.join()\n"
    )
    script = package.parent / "script.py"
    script.write_text(starts)
    assert (
        told(package, f"import runpy; runpy.run_path({str(script)!r}, run_name='__main__')", FARM_AR_QUIET="")
        == ""
    )
    assert list(package.rglob("one.one-*.nbc"))


POSITIVE = """
@compiled
def positive(x):
    if x < 0.0:
        raise ValueError("too small", x)
    return x
"""
RAISES = """
from farm_ar.one import one
from farm_ar.inside import inner
for kernel in {}:
    try:
        kernel(-1.0)
    except ValueError as problem:
        print(problem.args[1], sum(kernel.stats.cache_hits.values()))
    print(kernel(3.0), sum(kernel.stats.cache_hits.values()))
"""


def test_what_kernels_have_called_can_be_called_from_python_too_and_the_other_way_round(package):
    inner = package / "inside/inner.py"
    inner.write_text(inner.read_text().replace("* x", "* positive(x)") + POSITIVE)
    for order in ("(one, inner)", "(inner, one)"):
        assert run(package, RAISES.format(order)) == [(-1.0, False), (7.0, False)] * 2
        assert run(package, RAISES.format(order)) == [(-1.0, True), (7.0, True)] * 2
        for file in package.rglob("*.nbc"):
            file.unlink()


def test_a_new_caller_takes_what_it_calls_from_the_disk(package):
    run(package)
    (package / "one.py").write_text(FILES["one.py"].replace("middle(x)", "middle(x) + 1.0"))
    code = PRINT.replace("(one, two, apart)", "(one,)") + "from farm_ar.inside import inner\n"
    code += "print(len(inner.overloads), sum(inner.stats.cache_hits.values()))\n"
    assert run(package, code) == [(8.0, False), (1.0, True)]


def test_collecting_garbage_goes_on_after_compiling(package):
    code = "import gc\nfrom farm_ar.one import one\none(1.0)\nprint(int(gc.isenabled()), 0)\n"
    assert run(package, code)[0][0] == 1
    assert run(package, code.replace("one(1.0)", "gc.disable(); one(1)"))[0][0] == 0


def test_no_kernel_is_compiled_past_the_decorator():
    folder = Path(inspect.getfile(farm_ar)).parent
    using = [
        file for file in folder.rglob("*.py") if re.search(r"\b(n?jit|vectorize|Kernel)\(", file.read_text())
    ]
    assert sorted(using) == [folder / "inner_kernels.py", folder / "kernels.py"]


def test_the_key_of_every_kernel_covers_all_kernels_and_modules_that_it_names():
    """Found here from the functions as they are in memory, there from the text of the imports."""
    checked = 0
    for found in pkgutil.walk_packages(farm_ar.__path__, "farm_ar."):
        if found.name.endswith("__main__"):
            continue
        module = importlib.import_module(found.name)
        for kernel in vars(module).values():
            if not isinstance(kernel, Dispatcher) or kernel.py_func.__module__ != module.__name__:
                continue
            key = kernels._closure(Path(inspect.getfile(module)))
            for name in kernel.py_func.__code__.co_names:
                value = vars(module).get(name)
                other = inspect.getmodule(value.py_func if isinstance(value, Dispatcher) else value)
                if other is not None and other.__name__.startswith("farm_ar"):
                    assert Path(inspect.getfile(other)) in key, (module, name)
                    checked += other is not module
    assert checked > 50


def test_an_edit_of_the_environment_leaves_the_search_for_plans_compiled():
    files = kernels._closure(Path(inspect.getfile(beam_search)))
    assert files is not None
    assert Path(inspect.getfile(env)) not in files
