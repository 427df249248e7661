from matplotlib.figure import Figure

from farm_ar.drawing import draw_explanation
from farm_ar.drawing.palette import RIGHT
from farm_ar.reid.explanations import Candidate, Explanation

GIVEN = Candidate("a", 0.1, 5.0, {"distance": 0.2, "turn": 0.1})
OTHER = Candidate("b", 0.8, 50.0, {"distance": 0.9, "turn": 0.4})


def drawn(explanation):
    axes = Figure().subplots()
    draw_explanation(axes, explanation)
    return axes


def test_each_term_has_a_bar_for_the_label_and_one_for_the_runner_up():
    axes = drawn(Explanation("d1", GIVEN, OTHER, 0.9, 0.5))
    assert [bar.get_width() for bar in axes.patches] == [0.2, 0.1, 0.9, 0.4]
    assert [label.get_text() for label in axes.get_yticklabels()] == ["distance", "turn"]
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["a: 0.30", "b: 1.30"]
    assert axes.get_title() == "why d1 is a"
    green = tuple(int(RIGHT[i : i + 2], 16) / 255 for i in (1, 3, 5))
    assert axes.patches[0].get_facecolor()[:3] == green


def test_without_a_label_only_the_title_says_so():
    axes = drawn(Explanation("d1", None, None, 0.9, float("nan")))
    assert axes.get_title() == "why d1 is none of the labels"
    assert not axes.patches
