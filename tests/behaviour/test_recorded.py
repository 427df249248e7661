"""What the package does is what it did when `recorded.npz` was made; `record.py` compares all of it."""

import importlib
from pathlib import Path

import numpy as np
import pytest

HERE = Path(__file__).parent
SOME = (
    r'^episode .* (\{\}|\{"(reward|knowledge|visits|jitter)|\{"action": "(slot|c))'
    r"|^answers (L1|farm) |^mistake|^batch"
)


@pytest.fixture
def record(monkeypatch):
    monkeypatch.syspath_prepend(HERE)
    return importlib.import_module("record")


def test_episodes_answers_and_mistakes_are_as_recorded(record):
    changes = list(record.compare(record.load(HERE / "recorded.npz"), SOME))
    # A method that is new has no answers of before; one that is gone or renamed is said to be gone.
    assert [line for line in changes if not line.endswith(record.NEW_CASE)] == []


def test_a_recording_comes_back_as_it_was_written(record, tmp_path):
    values = {
        "a": {
            "numbers": np.array([[1.5, np.nan], [np.inf, 2.0]]),
            "empty": np.array([]),
            "text": ["x", None],
        },
        "b": {"single": np.float32([0.1, 0.2]), "flags": np.array([True, False]), "more": np.arange(3.0)},
    }
    record.save(values, tmp_path / "some.npz")
    again = record.load(tmp_path / "some.npz")
    for name in values:
        assert list(record.differences(name, again[name], values[name])) == []
        assert list(record.differences(name, values[name], again[name])) == []


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            {"seen": np.array([1.0])},
            {"seen": np.array([1.0 + 2e-6])},
            "seen: old 1.0, new 1.000002 at 0 of 1",
        ),
        ({"seen": np.array([100.0])}, {"seen": np.array([100.0 + 2e-5])}, None),
        ({"rewards": np.array([0.5])}, {"rewards": np.array([0.5 + 1e-11])}, "rewards: old 0.5"),
        ({"seen": np.array([np.nan])}, {"seen": np.array([0.0])}, "seen: old nan, new 0.0"),
        ({"seen": np.array([np.inf])}, {"seen": np.array([np.inf])}, None),
        ({"seen": np.zeros(2)}, {"seen": np.zeros(3)}, "old shape (2,), new shape (3,)"),
        ({"labels": ["a", "b"]}, {"labels": ["a", None]}, "labels: old ['[1] b'], new ['[1] None']"),
        ({"hash": "x"}, {}, "hash: is gone"),
        ({}, {"phase": 1}, "phase: is new"),
        ({"phase": ["play"]}, {"phase": np.array([0.0])}, "phase: old ['play'], new"),
    ],
)
def test_each_difference_is_said_in_a_line(record, old, new, said):
    lines = list(record.differences("case", old, new))
    assert lines == [] if said is None else (len(lines) == 1 and said in lines[0])
