"""Functions by name, so that a unit can be run anywhere the same code is installed."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any

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
