"""Sweeps and the units of work that they are made of."""

from __future__ import annotations

import inspect
import itertools
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from numbers import Integral
from typing import Any

from farm_ar.errors import OptionError
from farm_ar.sweeps.functions import function_name, load_function
from farm_ar.sweeps.rows import plain
from farm_ar.sweeps.versions import BY_HAND, code_version


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
        """What tells this unit from all others: a hash of all it consists of."""
        whole = json.dumps([self.function, self.text, self.seed, self.version])
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
        signature = inspect.signature(load_function(function_name(self.function)))
        checked: set[frozenset[str]] = set()
        for i, values in enumerate(self.parameters):
            names = frozenset(values)
            if names not in checked:
                checked.add(names)
                try:
                    signature.bind(**dict.fromkeys(names), seed=0)
                except TypeError as problem:
                    expected = f"must be what {self.function} takes beside a seed ({problem})"
                    raise OptionError(f"parameters[{i}]", expected, sorted(names)) from None


def grid(**values: Iterable[Any]) -> list[dict[str, Any]]:
    """The parameters of all combinations of the values of each name; the last name varies fastest."""
    lists = [list(several) for several in values.values()]
    return [dict(zip(values, chosen, strict=True)) for chosen in itertools.product(*lists)]


def _canonical(values: Mapping[str, Any], field: str) -> str:
    try:
        return json.dumps(plain(values, field), sort_keys=True, separators=(",", ":"), allow_nan=False)
    except ValueError as problem:
        if isinstance(problem, OptionError):
            raise
        raise OptionError(field, "must have finite numbers", dict(values)) from None
