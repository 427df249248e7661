"""The places that the user names for results."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from farm_ar.errors import OptionError


@contextmanager
def writing(option: str, path: Path) -> Iterator[None]:
    """Make a place that cannot be written a mistake in the option that named it.

    Raises:
        OptionError: the operating system refused what was done inside.
    """
    try:
        yield
    except OSError as problem:
        reason = problem.strerror or str(problem)
        raise OptionError(option, f"must be a place that can be written ({reason})", str(path)) from None


def make_folder(option: str, path: Path) -> None:
    """Make a folder unless it exists, and see that files can be made in it, before the work begins.

    Raises:
        OptionError: they cannot.
    """
    with writing(option, path):
        path.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=path).close()
