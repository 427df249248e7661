"""A way to type commands, and the example files to type them about."""

from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from farm_ar.cli import app

DATA = Path(__file__).parents[2] / "examples" / "data"

Run = Callable[..., Result]


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Types `farm-ar` with arguments in an empty folder; an error that is ours comes out as it is."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv(
        "COLUMNS", "160"
    )  # as where there is no terminal; parallel runs of the tests set another

    def run(*arguments: object) -> Result:
        result = CliRunner().invoke(app, [str(argument) for argument in arguments], prog_name="farm-ar")
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result

    return run


@pytest.fixture
def mistake(run: Run) -> Callable[..., str]:
    """Types a command that has to be refused in one line, and gives that line."""

    def mistake(*arguments: object) -> str:
        result = run(*arguments)
        assert result.exit_code == 2
        assert result.stdout == ""
        assert result.stderr.count("\n") == 1
        return result.stderr.rstrip("\n")

    return mistake


@pytest.fixture
def before() -> Path:
    return DATA / "before.json"


@pytest.fixture
def seen() -> Path:
    return DATA / "seen.json"
