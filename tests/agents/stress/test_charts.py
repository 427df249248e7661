"""Charts of the stress test's report."""

from farm_ar.agents.stress.charts import Line, line_chart


def test_a_rule_that_fails_with_no_effort_at_all_has_a_chart():
    drawn = line_chart([Line("none", [0.0, 0.0], [0.0, 1.0], "#000")], "effort", "share", 0.0)
    assert drawn.startswith("<svg")
    assert "nan" not in drawn
    assert "inf" not in drawn.replace("infinite", "")
