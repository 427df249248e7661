"""Whatever takes long says what it does, on the error output."""

import time

import pytest

from farm_ar.cli import output
from farm_ar.cli.output import saying


@pytest.fixture(autouse=True)
def patience(monkeypatch):
    monkeypatch.setattr(output, "PATIENCE_S", 0.05)
    monkeypatch.delenv("FARM_AR_QUIET")


def test_what_takes_long_says_what_it_does(capsys):
    @saying("Working")
    def work(seconds):
        time.sleep(seconds)
        return seconds

    assert work(0.0) == 0.0
    time.sleep(0.2)
    assert capsys.readouterr() == ("", "")
    assert work(0.2) == 0.2
    assert capsys.readouterr() == ("", "Working ...\n")


def test_what_shows_its_progress_does_not_say_it_twice(capsys):
    with saying("Working"), output.progress("Filming"):
        time.sleep(0.2)
    assert capsys.readouterr() == ("", "Filming ...\n")


def test_a_quiet_process_says_nothing(capsys, monkeypatch):
    monkeypatch.setenv("FARM_AR_QUIET", "1")
    with saying("Working"):
        time.sleep(0.2)
    assert capsys.readouterr() == ("", "")
