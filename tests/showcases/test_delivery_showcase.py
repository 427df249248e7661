"""The showcase of the delivery robot: its claim, in few layouts, and its files."""

import json
from dataclasses import asdict

import numpy as np
import pytest

from farm_ar.showcases.delivery import deliver, film_delivery, show_deliveries
from farm_ar.showcases.delivery.trials import success_by_length

LAYOUTS = 24


@pytest.fixture(scope="module")
def trials():
    return {
        method: [deliver(method, 0, i) for i in range(LAYOUTS)]
        for method in ("naive", "spatial", "likelihood")
    }


def test_likelihood_delivers_to_fewer_wrong_chairs_than_the_paper_s_method(trials):
    wrong = {method: sum(trial.wrong for trial in of) for method, of in trials.items()}
    assert wrong["spatial"] >= 0.3 * LAYOUTS
    assert wrong["likelihood"] <= wrong["spatial"] / 2


def test_nothing_is_touched(trials):
    assert all(trial.touches == 0 for of in trials.values() for trial in of)


def test_a_way_that_was_driven_is_not_shorter_than_the_shortest(trials):
    for of in trials.values():
        for trial in of:
            # The shortest way runs over cells, and to 5 cm within reach.
            assert not trial.right or trial.driven_m >= 0.9 * trial.shortest_m - 0.15


def test_all_methods_meet_the_same_rooms_and_a_delivery_repeats(trials):
    assert [t.shortest_m for t in trials["spatial"]] == [t.shortest_m for t in trials["likelihood"]]
    assert str(deliver("likelihood", 0, 3)) == str(trials["likelihood"][3])


def test_success_by_length_is_what_anderson_et_al_define():
    rows = [
        {"right": True, "shortest_m": 2.0, "driven_m": 4.0},
        {"right": True, "shortest_m": 2.0, "driven_m": 1.9},
        {"right": False, "shortest_m": 2.0, "driven_m": 2.0},
        {"right": True, "shortest_m": 0.0, "driven_m": 0.0},
    ]
    assert success_by_length(rows).tolist() == [0.5, 1.0, 0.0, 1.0]


def test_the_table_and_the_trials_are_written(tmp_path):
    shown = show_deliveries(tmp_path, 2, 0, lambda what, share: None, ("spatial", "likelihood"))
    table = json.loads((tmp_path / "delivery.json").read_text())
    assert [row["method"] for row in table["rows"]] == ["spatial", "likelihood"]
    lines = (tmp_path / "delivery.csv").read_text().splitlines()
    assert lines[0].split(",") == list(asdict(deliver("spatial", 0, 0)))
    assert len(lines) == 1 + 4
    assert shown.paths


def test_a_film_shows_every_step(tmp_path, monkeypatch):
    kept = []
    monkeypatch.setattr(
        "farm_ar.showcases.delivery.film.write_mp4", lambda path, frames, fps: kept.extend(frames)
    )
    monkeypatch.setattr("farm_ar.showcases.delivery.film.write_gif", lambda *given: None)
    trial, _ = film_delivery(tmp_path, "spatial", 0, 1)
    assert len(kept) == round(trial.seconds * 5) + 1 + 20
    assert not np.array_equal(kept[0], kept[-1])
