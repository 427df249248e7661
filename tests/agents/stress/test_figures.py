"""Figures of the stress test's report."""

import re

import numpy as np
import pytest

from farm_ar.agents.stress.figures import (
    Line,
    bar_chart,
    cell_chart,
    failure_picture,
    key_picture,
    line_chart,
)
from farm_ar.agents.stress.study import known_case


def test_a_method_that_fails_with_no_distance_at_all_has_a_chart():
    drawn = line_chart([Line("none", [0.0, 0.0], [0.0, 1.0], "#000")], "effort", "share", 0.0)
    assert drawn.startswith("<svg")
    assert not re.search(r"\b(nan|inf)\b", drawn)


def test_a_figure_depends_on_nothing_but_its_numbers():
    lines = [Line("a <b>", [0.0, 1.0], [0.0, 1.0], "#000", bound=True)]
    drawn = [line_chart(lines, "effort", "share", 1.0) for _ in range(2)]
    assert drawn[0] == drawn[1]
    assert "a &lt;b&gt;" in drawn[0]
    assert "<metadata" not in drawn[0]


def test_a_bar_without_answers_is_a_gap():
    both, one = (bar_chart(v, [4.0, 4.0], "x", "y") for v in ([0.5, 0.5], [np.nan, 0.5]))
    assert both.count("<path") == one.count("<path") + 1


@pytest.mark.parametrize("cells", [np.zeros((12, 24)), np.eye(12, 24)])
def test_cells_are_drawn_where_failures_are(cells):
    drawn = cell_chart(cells.tolist(), "effort", "wrong", 1.0)
    assert drawn.startswith("<svg")
    assert ("12+" in drawn) == bool(cells.any())


def test_the_picture_of_a_failure_says_what_was_taken_for_what():
    case = known_case("farm", 0, "none", 0)
    position = case.layout.position.copy()
    position[0] += 0.1
    failure = {"position": position, "yaw": case.layout.yaw, "misread": [[case.layout.labels[0], None]]}
    assert f"{case.layout.labels[0]} → nothing" in failure_picture(case, failure)


def test_every_object_has_a_mark_of_its_heading_and_so_has_where_it_stood():
    """Turned on the spot, a moved object differs from its former outline in the line to its front."""
    case = known_case("farm", 0, "none", 0)
    still = {"position": case.layout.position, "yaw": case.layout.yaw, "misread": []}
    turned = still | {"yaw": case.layout.yaw + np.eye(len(case.layout))[0]}
    drawn = [failure_picture(case, one).count("<path") for one in (still, turned)]
    assert drawn[1] == drawn[0] + 2  # an outline and a heading
    assert drawn[0] >= 2 * len(case.layout)


def test_the_key_explains_each_mark_of_a_failure():
    drawn = key_picture()
    for words in ("in view", "out of view", "moved, out of view", "stood", "moved", "what it was read as"):
        assert words in drawn
