"""Play without the pause: the claims of its page, in few random visits."""

import numpy as np
import pytest

from farm_ar.scenes import builtin_scene
from farm_ar.showcases.live import UPDATES, play, random_script

VISITS = 8


@pytest.fixture(scope="module")
def rows():
    seeds = [np.random.SeedSequence(0, spawn_key=(i,)) for i in range(VISITS)]
    scripts = [random_script(builtin_scene("farm"), np.random.default_rng(seed)) for seed in seeds]
    return {update: [play(one, "spatial", update) for one in scripts] for update in UPDATES}


def mean(rows, name):
    return np.mean([row[name] for row in rows])


def test_looking_all_the_time_gets_more_labels_right_and_interrupts_nobody(rows):
    assert mean(rows["live"], "accuracy") > mean(rows["pause"], "accuracy") + 0.03
    assert mean(rows["pause"], "interrupted_s") > 5
    assert mean(rows["live"], "interrupted_s") == 0


def test_of_the_animals_that_arrive_fewer_go_astray(rows):
    share = {update: mean(of, "astray") / mean(of, "arrived") for update, of in rows.items()}
    assert share["live"] < share["pause"]
    assert mean(rows["live"], "arrived") > 1.5 * mean(rows["pause"], "arrived"), "they run all the time"
