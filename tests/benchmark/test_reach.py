"""The reference of benchmarks/reach.py: a method that is told a row's motions knows what can be known."""

import sys
from pathlib import Path

import numpy as np
import pytest

from farm_ar.benchmark.evaluation import SIMPLE, answer
from farm_ar.benchmark.scores import Scored, calibration
from farm_ar.benchmark.suite import made_examples
from farm_ar.benchmark.worlds import ROWS
from farm_ar.reid import REIDENTIFIERS

sys.path.append(str(Path(__file__).parents[2] / "benchmarks"))
from told import Motion, ToldReid


@pytest.mark.parametrize("row", ["carts-3s", "crossing-1.2s", "lounge-new", "sizes-20"])
def test_who_is_told_the_motions_is_right_more_often_than_any_simple_assignment_and_calibrated(row: str):
    examples = made_examples(ROWS[row], 9, 80)
    motion = Motion(examples)
    found = [answer(lambda scene: ToldReid(scene, motion), example) for example in examples]
    assert not any(one.problem for one in found)
    told = Scored.joined([Scored(np.zeros(len(o), dtype=np.int64), o, c, b) for o, c, b, _ in found])
    simple = max(
        np.mean(
            [letter == "r" for example in examples for letter in answer(REIDENTIFIERS[name], example).outcome]
        )
        for name in SIMPLE
    )
    assert told.right.mean() >= simple
    assert calibration(told, np.random.default_rng(0)).excess < 0.03
