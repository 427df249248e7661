"""A frame that is to be found, and a unit that was forgotten: the unit is named as the cause."""

from dataclasses import replace

import numpy as np
import pytest

from farm_ar.reid import RigidMotion, align, identify
from farm_ar.reid.alignment import moved, other_unit
from farm_ar.scenes import Camera, Detections, FieldOfView, Layout, Scene, Snapshot

FACTORS = {"millimetres": 1e3, "centimetres": 1e2, "inches": 1 / 0.0254, "feet": 1 / 0.3048}


def world(rng, number=14):
    """A scene of chairs and tables anywhere, 6 x 5 m, at an origin of its own."""
    position = np.zeros((0, 2))
    while len(position) < number:
        one = rng.uniform(0, (6, 5))
        if not len(position) or np.linalg.norm(position - one, axis=1).min() > 0.7:
            position = np.vstack([position, one])
    category = tuple("table" if k % 4 == 0 else "chair" for k in range(number))
    layout = Layout(
        tuple(f"{name} {k}" for k, name in enumerate(category)),
        category,
        position + rng.uniform(-20, 20, 2),
        rng.uniform(-np.pi, np.pi, number),
        np.full((number, 3), np.nan),
    )
    return Scene("anywhere", None, layout)


def look(scene, rng, factor=1.0, stayed=0.75):
    """Two thirds of it, a share where it stood, in a frame of their own and another unit of length."""
    layout = scene.layout
    seen = np.sort(rng.permutation(len(layout))[: 2 * len(layout) // 3])
    gone = rng.random(len(seen)) > stayed
    place = layout.position[seen] + rng.normal(0, 0.01, (len(seen), 2))
    place[gone] = layout.position.min(axis=0) + rng.uniform(0, (6, 5), (int(gone.sum()), 2))
    found = Detections(
        tuple(layout.category[j] for j in seen), place, layout.yaw[seen], np.full((len(seen), 3), np.nan)
    )
    camera = Camera(layout.position.mean(axis=0), np.asarray(0.3), FieldOfView(np.pi, np.pi, 20.0))
    motion = RigidMotion(camera.position, rng.normal(0, 9, 2), np.array(rng.uniform(-3, 3)))
    there = moved(Snapshot(camera, found), motion)
    return replace(
        there,
        camera=replace(there.camera, position=factor * there.camera.position),
        detections=replace(there.detections, position=factor * there.detections.position),
    )


@pytest.mark.parametrize("unit", FACTORS)
@pytest.mark.parametrize("whose", ["the snapshot", "the map"])
def test_a_forgotten_unit_is_named_where_the_frame_is_looked_for(unit, whose):
    rng = np.random.default_rng(5)
    named = 0
    for _ in range(4):
        scene = world(rng)
        factor = FACTORS[unit] if whose == "the snapshot" else 1 / FACTORS[unit]
        found = identify(scene, look(scene, rng, factor), "distance", frame="unknown")
        said = " ".join(found.warnings)
        named += unit in said and ("the map is in" in said or "the map were in" in said) == (
            whose == "the map"
        )
        assert "use frame=" not in said
        assert "outside" not in said
    assert named == 4


def test_where_the_unit_is_right_none_is_named_however_much_has_moved():
    rng = np.random.default_rng(6)
    for stayed in (0.9, 0.5, 0.0) * 4:
        scene = world(rng)
        snapshot = look(scene, rng, stayed=stayed)
        assert other_unit(scene, snapshot, align(scene, snapshot)) is None


def test_too_few_things_tell_no_unit():
    rng = np.random.default_rng(7)
    scene = world(rng, 3)
    snapshot = look(scene, rng, 100.0)
    assert other_unit(scene, snapshot, align(scene, snapshot)) is None


@pytest.mark.parametrize("reid", ["adaptive", "likelihood"])
def test_costs_and_margins_follow_a_confidence_that_the_frame_lowers(reid):
    rng = np.random.default_rng(8)
    scene = world(rng)
    snapshot = look(scene, rng, stayed=0.0)
    found, frame = identify(scene, snapshot, reid, frame="unknown"), align(scene, snapshot)
    assert frame.confidence < 0.9
    given = [i for i, label in enumerate(found.labels) if label is not None]
    assert given
    np.testing.assert_allclose(found.cost[given], 1 - found.confidence[given], atol=1e-9)
    plain = identify(scene, frame.apply(snapshot), reid, checks=False)
    ratio = found.margin[given] / plain.margin[given]
    np.testing.assert_allclose(ratio, ratio[0], atol=1e-9)
    assert ratio[0] <= frame.confidence + 1e-9


def test_costs_that_are_no_probabilities_stay():
    rng = np.random.default_rng(9)
    scene = world(rng)
    snapshot = look(scene, rng, stayed=0.0)
    frame = align(scene, snapshot)
    found = identify(scene, snapshot, "spatial", frame="unknown")
    np.testing.assert_array_equal(
        found.cost, identify(scene, frame.apply(snapshot), "spatial", checks=False).cost
    )
