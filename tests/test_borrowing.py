"""What kernels borrow is the same memory, and has no owner that would be told of its users."""

from typing import NamedTuple

import numpy as np

from farm_ar.borrowing import borrowed
from farm_ar.kernels import compiled


class Pair(NamedTuple):
    """Arrays of two kinds, and a number."""

    whole: np.ndarray
    real: np.ndarray
    number: float


@compiled
def lend(pair, alone):
    both = borrowed((pair, alone))
    own, one = both
    own.whole[0] += 1
    total = own.number + borrowed(one).sum()
    for k in range(len(own.real)):
        total += own.real[k].sum()
    return total


@compiled
def give_back(alone):
    return borrowed(alone)


def test_what_is_borrowed_is_the_same_memory():
    pair, alone = Pair(np.zeros(2, dtype=np.int64), np.arange(6.0).reshape(2, 3), 0.5), np.ones(4)
    for _ in range(100):
        assert lend(pair, alone) == 0.5 + 15 + 4
    assert pair.whole.tolist() == [100, 0]


def test_what_is_borrowed_has_no_owner():
    given = np.arange(3.0)
    found = give_back(given)
    assert found is not given
    assert found.base is None
    assert np.shares_memory(found, given)


def test_python_borrows_the_thing_itself():
    given = np.arange(3.0)
    assert borrowed(given) is given
