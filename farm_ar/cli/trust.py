"""Files that may run code of whoever wrote them are loaded only with `--trust`, and never without a line."""

from __future__ import annotations

from collections.abc import Sequence


def require_trust(source: str, code: Sequence[str], trust: bool) -> None:
    """Say what a file or folder would run; go on only if it is trusted.

    Args:
        source: the file or folder.
        code: what it would run; nothing is said if that is nothing.
        trust: whether `--trust` was given.

    Raises:
        OptionError: there is code, and it is not trusted.
    """
    from farm_ar.errors import OptionError

    if not code:
        return
    runs = " and ".join(code)
    if not trust:
        expected = f"must be given to load {source}, which runs {runs}, code of whoever wrote it"
        raise OptionError("--trust", expected, "nothing")
    import typer

    from farm_ar.cli.output import printable

    typer.echo(printable(f"Loading {source} runs {runs}, code of whoever wrote it."), err=True)


def code_of(run: str, which: str) -> list[str]:
    """What loading a run's folder runs beside farm-ar's own code; nothing for what is no run's folder.

    Args:
        run: the folder, or the name of a policy that comes with farm-ar.
        which: "best" or "last".

    Raises:
        RunError: its files are damaged.
    """
    from pathlib import Path

    from farm_ar.agents.training.checkpoints import pickles_in
    from farm_ar.agents.training.run_folder import BEST, CHECKPOINTS, RunFolder

    folder = RunFolder(Path(run))
    if not folder.exists:
        return []
    saved = folder.kept(BEST if which == "best" else CHECKPOINTS)[-1:]
    pickles = [f"the pickle {name}" for path in saved for name in pickles_in(path)]
    return [f"the module {name}" for name in folder.read().modules()] + pickles
