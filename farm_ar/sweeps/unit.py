"""Sweeps and their units of work: functions by name, parameters, seeds, the code's version, and rows."""

from __future__ import annotations

import inspect
import itertools
import json
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from hashlib import sha256
from importlib import import_module, metadata, util
from numbers import Integral
from pathlib import Path
from typing import Any

import numpy as np

from farm_ar import __version__
from farm_ar.errors import OptionError
from farm_ar.moved import FORMER

FORM = "must be a function at the top of a module that can be imported"


def function_name(function: Callable[..., Any] | str) -> str:
    """The name `module:function` under which a function can be found in any process.

    One of a module that has moved keeps its first name, so that results in stores still count.

    Raises:
        OptionError: it cannot, being nested, a method, a lambda or typed in by hand.
    """
    if isinstance(function, str):
        name = function
    else:
        module = getattr(function, "__module__", None)
        if module == "__main__":
            module = _importable(module)
        name = f"{module}:{getattr(function, '__qualname__', type(function).__qualname__ + '()')}"
    load_function(name)
    module, _, attribute = name.partition(":")
    return f"{FORMER.get(module, module)}:{attribute}"


@lru_cache(maxsize=256)
def load_function(name: str) -> Callable[..., Any]:
    """The function named `module:function`.

    Raises:
        OptionError: there is none.
    """
    module, _, attribute = name.partition(":")
    if not (module and attribute.isidentifier()):
        raise OptionError("function", f"{FORM}, by name module:function", name)
    try:
        function = getattr(import_module(module), attribute)
    except ImportError as problem:
        if problem.name is not None and (module + ".").startswith(problem.name + "."):
            raise OptionError("function", FORM, name) from None
        raise
    except AttributeError:
        raise OptionError("function", FORM, name) from None
    if not callable(function):
        raise OptionError("function", FORM, name)
    return function  # type: ignore[no-any-return]


def _importable(module: str) -> str:
    """What the script that is being run is called when another process imports it."""
    main = sys.modules[module]
    spec = getattr(main, "__spec__", None)
    if spec is not None:
        return str(spec.name)
    file = getattr(main, "__file__", None)
    if file is None:
        raise OptionError("function", f"{FORM}, not typed in by hand", module)
    return Path(file).stem


BY_HAND = "by hand: "
"""How a version begins that somebody vouches for."""

NUMBERS_FROM = (
    "numpy",
    "scipy",
    "numba",
    "ortools",
    "pymunk",
    "gymnasium",
    "torch",
    "opencv-python-headless",
)
"""Distributions of which another version may give other numbers."""


@lru_cache(maxsize=64)
def code_version(function: str) -> str:
    """Version of what the function `module:function` may run.

    It changes with any file of farm-ar and any file of the function's own package (or its one file, if it is
    in no package), with the version of Python (3.11, 3.12) and of the libraries that the numbers come from.
    The whole package counts, not only what the function imports, for much is found by name: environments,
    solvers, scenes.
    """
    parts = sha256()
    for top in sorted({"farm_ar", function.partition(":")[0].partition(".")[0]}):
        for name, content in _files(top):
            parts.update(f"{name} {len(content)}\n".encode())
            parts.update(content)
    parts.update(_surroundings().encode())
    return f"{__version__}+{parts.hexdigest()[:16]}"


def _files(top: str) -> list[tuple[str, bytes]]:
    """Name and content of each file of a package or module that is part of its code."""
    spec = util.find_spec(top)
    if spec is None:
        return []
    if spec.submodule_search_locations is None:
        return [(top, Path(spec.origin).read_bytes())] if spec.origin else []
    folders = [Path(folder) for folder in spec.submodule_search_locations]
    return [
        (f"{top}/{file.relative_to(folder).as_posix()}", file.read_bytes())
        for folder in folders
        for file in sorted(folder.rglob("*"))
        if file.is_file() and "__pycache__" not in file.parts and not file.name.startswith(".")
    ]


def _surroundings() -> str:
    versions = [f"python {sys.version_info.major}.{sys.version_info.minor}"]
    for name in NUMBERS_FROM:
        try:
            versions.append(f"{name} {metadata.version(name)}")
        except metadata.PackageNotFoundError:
            versions.append(f"{name} none")
    return "; ".join(versions)


Row = Mapping[str, Any]
"""Column to JSON value; NumPy's scalars and arrays may stand for numbers and lists."""

EXACT_KINDS = "biufU"
"""Kinds of NumPy values that JSON holds exactly: Booleans, whole numbers, floats, text."""

ROWS = json.JSONEncoder(separators=(",", ":"), ensure_ascii=False)


@dataclass(frozen=True)
class Outcome:
    """What one unit gives.

    Args:
        rows: the results, a function of parameters and seed alone.
        measured: rows of measured times and the like, kept in a table of their own.
    """

    rows: Sequence[Row]
    measured: Sequence[Row] = ()


def as_outcome(result: object) -> Outcome:
    """What a unit's function returned, as an outcome: an `Outcome`, one row, or a list of rows.

    Raises:
        OptionError: it is none of these.
    """
    if isinstance(result, Outcome):
        return result
    if isinstance(result, Mapping):
        return Outcome([result])
    if isinstance(result, list | tuple) and all(isinstance(row, Mapping) for row in result):
        return Outcome(result)
    expected = "must be a row, a list of rows or an Outcome; a row is a mapping from column to JSON value"
    raise OptionError("result", expected, result)


def to_text(value: object, field: str) -> str:
    """A value as JSON text, in the order in which it stands; floats exactly, not-a-number among them.

    Raises:
        OptionError: there is something in it that JSON cannot hold exactly; the message says where.
    """
    return ROWS.encode(plain(value, field))


def plain(value: object, field: str) -> Any:
    """A value made of Python's own JSON types, each number exactly what it was.

    Raises:
        OptionError: there is something in it that JSON cannot hold exactly; the message says where.
    """
    if value is None or type(value) in (str, float, int, bool):
        return value
    if isinstance(value, np.ndarray | np.generic):
        if value.dtype.kind in EXACT_KINDS and value.dtype != np.longdouble:
            return value.tolist()
    elif isinstance(value, Mapping):
        for name in value:
            if not isinstance(name, str):
                raise OptionError(field, "must have text for names", name)
        return {str(name): plain(item, f"{field}.{name}") for name, item in value.items()}
    elif isinstance(value, list | tuple):
        return [plain(item, f"{field}[{i}]") for i, item in enumerate(value)]
    raise OptionError(field, "must be a JSON value, or a NumPy one that JSON holds exactly", value)


PARAMETERS = json.JSONEncoder(separators=(",", ":"), sort_keys=True, allow_nan=False)


@dataclass(frozen=True)
class Unit:
    """One piece of work: a function by name, its parameters, a seed. It can be run anywhere.

    Args:
        function: `module:function`.
        text: the parameters as JSON text, names sorted.
        seed: where the unit's randomness comes from.
        version: of the code, as `code_version` gives it.
    """

    function: str
    text: str
    seed: int
    version: str

    @cached_property
    def key(self) -> str:
        """What identifies this unit: a hash of all it consists of."""
        whole = "\0".join((self.function, self.text, str(self.seed), self.version))
        return sha256(whole.encode()).hexdigest()[:32]

    @property
    def parameters(self) -> dict[str, Any]:
        """The parameters, made anew from JSON."""
        parameters: dict[str, Any] = json.loads(self.text)
        return parameters

    def __str__(self) -> str:
        return f"{self.function.partition(':')[2]} {self.text} seed {self.seed}"


@dataclass(frozen=True, eq=False)
class Sweep:
    """A function, the parameters to call it with, and seeds.

    A unit calls `function(seed=seed, **parameters)`, which returns a row, a list of rows or an `Outcome`; its
    rows must be a function of parameters and seed alone.

    Args:
        name: under which the store keeps it: "fig5".
        function: one at the top of a module, or its name `module:function`.
        parameters: the names and JSON values of each call; NumPy's numbers and arrays may stand in them.
            `grid` makes them of lists of values.
        seeds: with each of which every call is made.
        version: of the code, by hand, for who knows that its results did not change; by default the hash
            that `code_version` makes of the code.

    Raises:
        OptionError: the function cannot be found by name or not be called so, a value is none of JSON's, or
            the same unit is there twice.
    """

    name: str
    function: Callable[..., Any] | str
    parameters: Sequence[Mapping[str, Any]]
    seeds: Sequence[int] = (0,)
    version: str | None = None

    def __post_init__(self) -> None:
        if not self.name:
            raise OptionError("name", "must be a non-empty string", self.name)
        for i, seed in enumerate(self.seeds):
            if not isinstance(seed, Integral) or isinstance(seed, bool) or seed < 0:
                raise OptionError(f"seeds[{i}]", "must be a whole number not below 0", seed)
        self._check_calls()
        if len({unit.key for unit in self.units}) < len(self.units):
            seen: set[str] = set()
            twice = next(unit for unit in self.units if unit.key in seen or seen.add(unit.key))  # type: ignore[func-returns-value]
            raise OptionError("parameters", "must not have the same unit twice", str(twice))

    @cached_property
    def units(self) -> tuple[Unit, ...]:
        """The units, in the order of the parameters and, for each, of the seeds."""
        name = function_name(self.function)
        version = code_version(name) if self.version is None else BY_HAND + self.version
        texts = [_canonical(values, f"parameters[{i}]") for i, values in enumerate(self.parameters)]
        return tuple(Unit(name, text, int(seed), version) for text in texts for seed in self.seeds)

    def _check_calls(self) -> None:
        """See that the function takes the parameters, before a thousand units fail one by one."""
        name = function_name(self.function)
        signature = inspect.signature(load_function(name))
        checked: set[frozenset[str]] = set()
        for i, values in enumerate(self.parameters):
            names = frozenset(values)
            if names not in checked:
                checked.add(names)
                if "seed" in names:
                    raise OptionError(f"parameters[{i}]", "must not have the name seed", sorted(names))
                try:
                    signature.bind(**dict.fromkeys(names), seed=0)
                except TypeError as problem:
                    expected = f"must be what {name} takes beside a seed ({problem})"
                    raise OptionError(f"parameters[{i}]", expected, sorted(names)) from None


def grid(**values: Iterable[Any]) -> list[dict[str, Any]]:
    """The parameters of all combinations of the values of each name; the last name varies fastest."""
    lists = [list(several) for several in values.values()]
    return [dict(zip(values, chosen, strict=True)) for chosen in itertools.product(*lists)]


def _canonical(values: Mapping[str, Any], field: str) -> str:
    try:
        return PARAMETERS.encode(plain(values, field))
    except ValueError as problem:
        if isinstance(problem, OptionError):
            raise
        raise OptionError(field, "must have finite numbers", dict(values)) from None
