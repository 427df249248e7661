import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.patches import FancyArrowPatch, Polygon

from farm_ar.arrays import FloatArray
from farm_ar.drawing import Tag, Tags, draw_identification, new_picture
from farm_ar.drawing.palette import INK, RIGHT, WRONG
from farm_ar.errors import SnapshotError
from farm_ar.geometry import footprint_corners
from farm_ar.reid import Identification, SpatialReid
from farm_ar.scenes import Camera, Detections, LayoutNoise, Scene, Snapshot, builtin_scene, observe

SCENE = builtin_scene("M2")
CAMERA = Camera(np.array([2.5, 1.0]), np.array(0.0))
LABELS = SCENE.layout.labels


def snapshot(count: int = 4, category: tuple[str | None, ...] | None = None) -> Snapshot:
    """The first objects of the scene, a little to the right of where they were."""
    layout = SCENE.layout
    detections = Detections(
        category=layout.category[:count] if category is None else category,
        position=layout.position[:count] + np.array([0.3, 0.0]),
        yaw=layout.yaw[:count],
        size=layout.size[:count],
    )
    return Snapshot(CAMERA, detections)


def drawn(
    seen: Snapshot,
    labels: tuple[str | None, ...],
    truth: tuple[str | None, ...] | None = None,
    scene: Scene = SCENE,
    **options: bool,
) -> Axes:
    _, axes = new_picture(scene.size)
    draw_identification(axes, scene, seen, Identification(labels), truth, **options)
    return axes


def tags_of(axes: Axes) -> Tags:
    (tags,) = (artist for artist in axes.get_children() if isinstance(artist, Tags))
    return tags


def verdicts(axes: Axes) -> list[Tag]:
    return [tag for tag in tags_of(axes).tags if tag.boxed]


def boxes_of(axes: Axes) -> FloatArray:
    canvas = FigureCanvasAgg(axes.figure)  # type: ignore[arg-type]
    canvas.draw()
    return tags_of(axes).place(canvas.get_renderer())


def arrows(axes: Axes) -> list[tuple[FloatArray, FloatArray]]:
    """Both ends of each arrow, metres."""
    found = [patch for patch in axes.patches if isinstance(patch, FancyArrowPatch)]
    return [(np.asarray(p._posA_posB[0]), np.asarray(p._posA_posB[1])) for p in found]


def test_right_labels_are_green_and_wrong_ones_red_with_the_true_one() -> None:
    axes = drawn(snapshot(), (LABELS[0], LABELS[2], None, None), (LABELS[0], LABELS[1], LABELS[2], None))
    assert [(tag.text, tag.color) for tag in verdicts(axes)] == [
        (LABELS[0], RIGHT),
        (f"{LABELS[2]} ({LABELS[1]})", WRONG),
        (f"? ({LABELS[2]})", WRONG),
        ("?", RIGHT),
    ]


def test_a_label_for_a_false_detection_is_wrong() -> None:
    (tag,) = verdicts(drawn(snapshot(1), (LABELS[0],), (None,)))
    assert (tag.text, tag.color) == (f"{LABELS[0]} (none)", WRONG)


def test_labels_are_black_where_the_truth_is_not_known() -> None:
    axes = drawn(snapshot(2), (LABELS[1], None))
    assert [(tag.text, tag.color) for tag in verdicts(axes)] == [(LABELS[1], INK), ("?", INK)]


def test_an_arrow_leads_from_where_each_label_was_to_what_it_was_given_to() -> None:
    seen = snapshot(3)
    axes = drawn(seen, (LABELS[1], None, LABELS[2]))
    before = SCENE.layout.position
    ends = arrows(axes)
    assert len(ends) == 2
    np.testing.assert_allclose(ends[0], [before[1], seen.detections.position[0]])
    np.testing.assert_allclose(ends[1], [before[2], seen.detections.position[2]])


def test_a_label_that_the_scene_does_not_have_is_drawn_without_an_arrow() -> None:
    axes = drawn(snapshot(1), ("somebody else",))
    assert [tag.text for tag in verdicts(axes)] == ["somebody else"]
    assert not arrows(axes)


def test_the_reference_is_in_outline_and_detections_are_filled_and_hatched_when_unknown() -> None:
    seen = snapshot(2, (None, SCENE.layout.category[1]))
    axes = drawn(seen, (LABELS[0], LABELS[1]))
    rectangles = [patch for patch in axes.patches if isinstance(patch, Polygon) and len(patch.xy) == 5]
    outlines = [patch for patch in rectangles if not patch.get_fill()]
    unknown, known = (patch for patch in rectangles if patch.get_fill())
    assert len(outlines) == len(LABELS)
    at = seen.detections
    np.testing.assert_allclose(unknown.xy[:-1], footprint_corners(at.position, at.yaw, at.size)[0])
    assert unknown.get_hatch()
    assert not known.get_hatch()
    legend = axes.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == [SCENE.layout.category[1], "not known"]


def test_the_reference_is_named_on_request() -> None:
    named = {tag.text for tag in tags_of(drawn(snapshot(1), (None,))).tags if not tag.boxed}
    assert named == set(LABELS)
    assert len(tags_of(drawn(snapshot(1), (None,), reference_labels=False)).tags) == 1


def test_what_was_seen_outside_the_room_is_on_the_page() -> None:
    far = Detections(("chair",), np.array([(-3.0, 1.0)]), np.zeros(1), np.full((1, 3), 0.4))
    axes = drawn(Snapshot(CAMERA, far), (LABELS[0],))
    assert axes.get_xlim()[0] < -3.2


@pytest.mark.parametrize("name", ["H1", "farm"])
def test_no_tags_overlap_in_a_crowd(name: str, rng: np.random.Generator) -> None:
    scene = builtin_scene(name)
    layout = LayoutNoise.of(0.04 * scene.diagonal, 30).disturb(scene.layout, scene.size, rng)
    middle = np.array([scene.size[0] / 2, -0.3])
    seen, truth = observe(layout, Camera(middle, np.array(0.0), scene.fov))
    axes = drawn(seen, SpatialReid(scene).identify(seen).labels, truth, scene)
    boxes = boxes_of(axes)
    low = np.maximum(boxes[:, None, :2], boxes[:, :2])
    high = np.minimum(boxes[:, None, 2:], boxes[:, 2:])
    area = np.prod(np.maximum(high - low, 0.0), axis=-1)
    assert len(seen.detections) >= 4
    assert area[np.triu_indices(len(boxes), 1)].max() == 0.0


def test_an_empty_snapshot_is_drawn() -> None:
    nothing = Detections((), np.empty((0, 2)), np.empty(0), np.empty((0, 3)))
    assert not verdicts(drawn(Snapshot(CAMERA, nothing), (), ()))


def test_a_label_is_needed_for_every_detection() -> None:
    with pytest.raises(SnapshotError, match="identification: must have 3 labels, one per detection, got 2"):
        drawn(snapshot(3), (LABELS[0], None))
    with pytest.raises(SnapshotError, match="truth: must have 3 labels, one per detection, got 1"):
        drawn(snapshot(3), LABELS[:3], (None,))
