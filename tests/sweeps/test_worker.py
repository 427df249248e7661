"""The inside of a worker, run here: what it says, and what it says of a unit that cannot be run."""

import contextlib
import os
import signal
import socket
from multiprocessing.connection import Connection

import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.sweeps import Sweep, Unit, grid
from farm_ar.sweeps.executors.base import Attempt
from farm_ar.sweeps.executors.process import (
    BEGUN,
    pack_attempt,
    pack_unit,
    unpack_attempt,
    unpack_unit,
    work,
)
from farm_ar.sweeps.unit import BY_HAND


@pytest.fixture
def say(monkeypatch):
    """Sends units to a worker, lets it work until there are no more, and gives what it said."""
    monkeypatch.setattr(signal, "signal", lambda *_: None)

    def say(*units):
        ours, theirs = socket.socketpair()
        ears, mouth = Connection(ours.detach()), Connection(theirs.detach())
        for unit in units:
            ears.send_bytes(pack_unit(unit))
        with socket.socket(fileno=os.dup(ears.fileno())) as end:
            end.shutdown(socket.SHUT_WR)
        work(mouth)
        mouth.close()
        said = []
        with contextlib.suppress(EOFError):
            while True:
                said.append(ears.recv_bytes())
        ears.close()
        return said

    return say


def test_a_worker_says_when_it_is_ready_and_when_it_begins_with_a_function(say):
    units = Sweep("doubles", "sweep_functions:double", grid(x=(1, 2))).units
    ready, begun, *rest = say(*units)
    assert (ready, begun) == (BEGUN, BEGUN)
    attempts = [unpack_attempt(unit, data) for unit, data in zip(units, rest, strict=True)]
    assert [attempt.rows[:12] for attempt in attempts] == ['[{"double":2', '[{"double":4']


def test_a_function_that_is_not_there_is_the_problem_of_its_unit(say):
    unit = Unit("sweep_functions:triple", "{}", 0, f"{BY_HAND}1")
    _, data = say(unit)
    assert "OptionError: function: must be a function at the top" in unpack_attempt(unit, data).problem


def test_a_unit_planned_with_other_code_is_not_run(say):
    unit = Unit("sweep_functions:double", '{"x":1}', 0, "0.0.0+1234")
    _, data = say(unit)
    problem = unpack_attempt(unit, data).problem
    assert "the code of sweep_functions:double is not that which the sweep began with" in problem


@given(st.text('aé"\\\n\0{', max_size=9), st.integers(0, 2**63 - 1))
def test_units_and_attempts_come_out_of_bytes_as_they_went_in(text, seed):
    unit = Unit("m:f", text, seed, "v")
    assert unpack_unit(pack_unit(unit)) == unit
    done = Attempt(unit, rows=text, measured="[]", seconds=0.1, problem=text)
    assert unpack_attempt(unit, pack_attempt(done)) == done
