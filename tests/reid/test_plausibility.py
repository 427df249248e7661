"""The check before identifying: silent where all is right, a warning for each kind of fault, in any world."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import multivariate_normal, norm

from farm_ar.benchmark.suite import made_examples
from farm_ar.benchmark.worlds import ROWS
from farm_ar.reid.plausibility import check, frames, set_aside
from farm_ar.reid.plausibility.evidence import TURNS
from farm_ar.reid.plausibility.frames import Ratio, ratios
from farm_ar.reid.plausibility.motions import best_motions
from farm_ar.reid.plausibility.patterns import Variant, log_evidence, places_of
from farm_ar.reid.registration import RigidMotion
from farm_ar.scenes import (
    BUILTIN,
    UNKNOWN,
    Bounds,
    Camera,
    Detections,
    FieldOfView,
    Layout,
    LayoutNoise,
    Scene,
    Snapshot,
    builtin_scene,
    observe,
    observe_many,
)


def world(seed=0, scale=1.0, origin=(0.0, 0.0), number=14, bounds=True):
    """A room of `scale` times 6 x 5 metres at an origin, with chairs and tables that do not touch."""
    rng = np.random.default_rng(seed)
    position = np.zeros((0, 2))
    while len(position) < number:
        one = rng.uniform((0.4, 0.4), (5.6, 4.6))
        if not len(position) or np.linalg.norm(position - one, axis=1).min() > 0.75:
            position = np.vstack([position, one])
    category = tuple("table" if k % 4 == 0 else "chair" for k in range(number))
    size = np.array([(1.0, 0.7, 0.6) if one == "table" else (0.45, 0.9, 0.5) for one in category])
    layout = Layout(
        labels=tuple(f"{name} {k}" for k, name in enumerate(category)),
        category=category,
        position=scale * position + origin,
        yaw=rng.uniform(-np.pi, np.pi, number),
        size=scale * size,
    )
    place = Bounds.rectangle(6 * scale, 5 * scale, origin) if bounds else None
    return Scene("world", None, layout, fov=FieldOfView(0.8, 0.8, 5 * scale), bounds=place)


def look(scene, seed=0, scale=1.0, moved=0.05):
    """A snapshot from the middle of the south wall, in a world of that scale; things moved a little."""
    rng = np.random.default_rng(seed)
    corner = scene.bounds.corners[0] if scene.bounds is not None else np.zeros(2)
    camera = Camera(corner + scale * np.array([3.0, -0.5]), np.asarray(0.0), scene.fov)
    layout = scene.layout
    shift, turn = rng.normal(0, moved * scale, (len(layout), 2)), rng.normal(0, 0.1, len(layout))
    return observe(layout.placed(layout.position + shift, layout.yaw + turn), camera)[0]


def changed(snapshot, **values):
    return replace(snapshot, detections=replace(snapshot.detections, **values))


def kinds(scene, snapshot):
    return [one.kind for one in check(scene, snapshot)]


WORLDS = [
    {"seed": 1},
    {"seed": 2, "scale": 0.02},  # a toy on a table
    {"seed": 3, "scale": 20.0},  # a warehouse of 120 m
    {"seed": 4, "scale": 100.0},  # in centimetres
    {"seed": 5, "origin": (-420.0, 977.0)},
    {"seed": 6, "scale": 0.3048, "origin": (8.0, -3.0)},
]


@pytest.fixture(params=WORLDS, ids=str)
def place(request):
    """A world unlike the built-in ones, and a snapshot of it in which all is right."""
    scene = world(**request.param)
    return scene, look(scene, seed=request.param["seed"], scale=request.param.get("scale", 1.0))


def test_nothing_is_said_where_all_is_right(place):
    scene, snapshot = place
    assert len(snapshot.detections) >= 6
    assert check(scene, snapshot) == ()
    assert set_aside(scene, snapshot) == (None,) * len(snapshot.detections)


def mirrored(seen):
    return {"position": seen.position * [1, -1], "yaw": -seen.yaw}


def turned_and_shifted(seen):
    sine, cosine, reach = np.sin(0.7), np.cos(0.7), 3 * np.ptp(seen.position)
    return {
        "position": seen.position @ np.array([[cosine, -sine], [sine, cosine]]) + [reach, -reach],
        "yaw": seen.yaw + 0.7,
    }


FAULTS = {
    "mirrored": mirrored,
    "units": lambda seen: {"position": seen.position * 100},
    "sizes": lambda seen: {"size": seen.size * 1000},
    "radians": lambda seen: {"yaw": np.deg2rad(np.remainder(seen.yaw, 2 * np.pi))},
    "headings": lambda seen: {"yaw": -seen.yaw},
    "frame": turned_and_shifted,
    "repeated": lambda seen: {"position": np.zeros((len(seen), 2)), "yaw": np.zeros(len(seen))},
    "categories": lambda seen: {"category": ("Stuhl",) * len(seen)},
}


@pytest.mark.parametrize("kind", FAULTS)
def test_each_fault_is_found_in_worlds_of_any_scale_and_origin(place, kind):
    scene, snapshot = place
    wrong = changed(snapshot, **FAULTS[kind](snapshot.detections))
    found = kinds(scene, wrong)
    assert kind in found
    assert len(found) == len(set(found))


@pytest.mark.parametrize("row", ["players-4s", "corridor-4s"])
def test_a_crowd_that_has_moved_as_far_as_to_others_places_is_not_called_mirrored(row):
    found = [
        one.kind
        for example in made_examples(ROWS[row], 777, 60)
        for one in check(example.scene, example.snapshot)
    ]
    assert found.count("mirrored") + found.count("headings") == 0


def test_that_all_moved_a_little_alike_is_a_seldom_way_of_being_right(monkeypatch):
    scene = world(seed=1)
    snapshot = look(scene, seed=1)
    codes = np.array([scene.layout.categories.index(name) for name in snapshot.detections.category])

    def found(evidence, spoils):
        """The ratios by kind, if the best motion of the frame has that evidence."""
        motion = Ratio(evidence, "frame", "", spoils)
        monkeypatch.setattr(frames, "_moved", lambda *_: [motion])
        return {one.kind: one.ratio for one in ratios(scene, snapshot, codes)}

    right = -found(0.0, True)["frame"]
    gained = found(right + 2.0, False)["units"] - found(right + 2.0, True)["units"]
    assert gained == pytest.approx(-np.log(1 + frames.NATURAL * np.exp(2.0)))


@pytest.mark.parametrize("factor", [1e-3, 1e-2, 0.1, 0.3048, 1 / 0.3048, 10, 100, 1000])
def test_positions_in_another_unit_are_found_and_the_unit_is_named(factor):
    scene = world(seed=7)
    snapshot = look(scene, seed=7)
    (found,) = [
        one
        for one in check(scene, changed(snapshot, position=snapshot.detections.position * factor))
        if one.kind == "units"
    ]
    unit = {1000: "milli", 100: "centi", 10: "deci", 1 / 0.3048: "feet"}
    name = unit.get(factor) or unit[min(unit, key=lambda one: abs(one - 1 / factor))]
    assert name in found.said
    assert ("the map taken as" in found.said) == (factor < 1)


def test_a_camera_turned_around_is_told_from_one_that_merely_sees_less(place):
    scene, snapshot = place
    camera = snapshot.camera
    assert kinds(scene, replace(snapshot, camera=replace(camera, yaw=camera.yaw + np.pi))) == ["camera"]
    narrow = replace(camera, fov=replace(camera.fov, left=0.05, right=0.05))
    assert kinds(scene, replace(snapshot, camera=narrow)) == ["view"]


def test_the_one_detection_outside_the_view_is_named(place):
    scene, snapshot = place
    seen = snapshot.detections
    position = seen.position.copy()
    position[2] = snapshot.camera.position - 0.3 * np.ptp(scene.layout.position, axis=0)
    (found,) = [one for one in check(scene, changed(snapshot, position=position)) if one.kind == "view"]
    assert found.detections == (2,)
    assert f"({seen.ids[2]})" in found.said


def test_an_edge_of_the_view_that_the_pivot_has_just_left_is_no_fault():
    scene = world()
    camera = Camera(np.array([3.0, 0.0]), np.asarray(0.0), FieldOfView(0.5, 0.5, 4.0))
    side = np.array([np.sin(0.55), np.cos(0.55)])
    for distance in (1.0, 2.0, 3.9):
        seen = Detections(
            ("chair",), camera.position + distance * side[None], np.zeros(1), [(0.45, 0.9, 0.5)]
        )
        assert "view" not in kinds(scene, Snapshot(camera, seen))
    seen = Detections(("chair",), camera.position[None] - [0.0, 1.0], np.zeros(1), [(0.45, 0.9, 0.5)])
    assert set(kinds(scene, Snapshot(camera, seen))) & {"view", "camera"}


def test_things_outside_the_bounds_are_told_of_and_a_map_outside_its_own():
    scene = world(seed=3)
    snapshot = look(scene, seed=3)
    position = snapshot.detections.position.copy()
    position[0] = (3.0, 9.0)
    found = [one for one in check(scene, changed(snapshot, position=position)) if one.kind == "bounds"]
    assert [one.detections for one in found] == [(0,)]
    elsewhere = world(seed=3, origin=(50.0, 50.0))
    wrong = Scene("wrong", (6.0, 5.0), elsewhere.layout, fov=elsewhere.fov)
    (found,) = [one for one in check(wrong, look(elsewhere, seed=3)) if one.kind == "bounds"]
    assert "14 labels of 14 outside" in found.said


def test_without_bounds_nothing_is_outside_them():
    scene = world(seed=3, bounds=False)
    assert check(scene, look(scene, seed=3)) == ()


def test_one_size_that_is_far_off_is_named_and_sizes_that_are_not_known_are_not():
    scene = world(seed=2)
    snapshot = look(scene, seed=2)
    size = snapshot.detections.size.copy()
    size[1] *= 10
    (found,) = check(scene, changed(snapshot, size=size))
    assert (found.kind, found.detections) == ("sizes", (1,))
    assert check(scene, changed(snapshot, size=np.full_like(size, np.nan))) == ()
    assert check(scene, changed(snapshot, yaw=np.full(len(size), np.nan))) == ()


def test_headings_of_zero_are_not_taken_for_radians():
    scene = world(seed=2)
    snapshot = look(scene, seed=2)
    assert "radians" not in kinds(scene, changed(snapshot, yaw=np.zeros(len(snapshot.detections))))
    facing = replace(scene.layout, yaw=np.zeros(len(scene.layout)))
    straight = scene.knowing(facing)
    small = np.linspace(-0.1, 0.1, len(snapshot.detections))
    assert "radians" not in kinds(straight, changed(snapshot, yaw=small))


def test_a_pose_that_labels_share_in_the_map_may_be_shared_by_detections():
    scene = world(seed=2)
    snapshot = look(scene, seed=2)
    position, yaw = snapshot.detections.position.copy(), snapshot.detections.yaw.copy()
    position[1], yaw[1] = position[0], yaw[0]
    twice = changed(snapshot, position=position, yaw=yaw)
    assert "repeated" in kinds(scene, twice)
    layout = scene.layout
    stack = layout.position.copy(), layout.yaw.copy()
    stack[0][1], stack[1][1] = stack[0][5], stack[1][5]
    piled = scene.knowing(layout.with_poses(*stack))
    assert "repeated" not in kinds(piled, twice)


def test_a_pose_of_the_camera_to_the_last_digit_is_no_measurement():
    scene = world(seed=2)
    snapshot = look(scene, seed=2)
    position, yaw = snapshot.detections.position.copy(), snapshot.detections.yaw.copy()
    position[3], yaw[3] = snapshot.camera.position, snapshot.camera.yaw
    lost = changed(snapshot, position=position, yaw=yaw)
    assert kinds(scene, lost) == ["repeated"]
    assert [i for i, reason in enumerate(set_aside(scene, lost)) if reason] == [3]


def test_small_drift_of_the_frame_is_no_fault():
    scene = world(seed=4)
    snapshot = look(scene, seed=4, moved=0.0)
    assert check(scene, changed(snapshot, position=snapshot.detections.position - [0.15, 0.1])) == ()


def test_a_doubt_is_the_posterior_probability_of_a_fault_of_one_in_a_thousand():
    scene = world(seed=4)
    snapshot = look(scene, seed=4)
    wrong = changed(snapshot, **mirrored(snapshot.detections))
    (found,) = [one for one in check(scene, wrong) if one.kind == "mirrored"]
    code = {name: k for k, name in enumerate(scene.layout.categories)}
    codes = np.array([code[name] for name in wrong.detections.category])
    (ratio,) = [np.exp(one.ratio) for one in ratios(scene, wrong, codes) if one.kind == "mirrored"]
    assert found.doubt == pytest.approx(1e-3 * ratio / (1 + 1e-3 * ratio))
    assert found.doubt > 0.99


@settings(max_examples=30, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    exponent=st.floats(-3, 3),
    turn=st.floats(-np.pi, np.pi),
    x=st.floats(-100, 100),
    z=st.floats(-100, 100),
)
def test_no_alarm_depends_on_how_the_world_is_turned_shifted_and_scaled(seed, exponent, turn, x, z):
    scale, sine, cosine = 10.0**exponent, np.sin(turn), np.cos(turn)

    def other(points):
        matrix = scale * np.array([[cosine, -sine], [sine, cosine]])
        return points @ matrix + scale * np.array([x, z])

    scene = world(seed=seed % 7, bounds=False)
    snapshot = look(scene, seed=seed)
    layout, seen, camera = scene.layout, snapshot.detections, snapshot.camera
    moved = replace(layout, position=other(layout.position), yaw=layout.yaw + turn, size=scale * layout.size)
    fov = replace(scene.fov, range_m=scale * scene.fov.range_m)
    there = Scene("there", None, moved, fov=fov)
    elsewhere = Snapshot(
        Camera(other(camera.position), camera.yaw + turn, fov),
        replace(seen, position=other(seen.position), yaw=seen.yaw + turn, size=scale * seen.size),
    )
    codes = np.array([scene.layout.categories.index(name) for name in seen.category])
    here, beyond = (
        log_evidence(places_of(one), codes, [Variant(look_.detections.position, look_.detections.yaw, 0.0)])
        for one, look_ in ((scene, snapshot), (there, elsewhere))
    )
    assert beyond[0] + 2 * len(seen) * np.log(scale) == pytest.approx(here[0], abs=1e-6)
    assert kinds(there, changed(elsewhere, **FAULTS["headings"](elsewhere.detections))) == ["headings"]
    assert check(there, elsewhere) == ()


EXTREMES = {
    "nothing detected": lambda seen: slice(0, 0),
    "one detection": lambda seen: slice(0, 1),
    "everything thrice": lambda seen: np.repeat(np.arange(len(seen)), 3),
}


def some(seen, index):
    index = np.arange(len(seen))[index]
    return Detections(
        tuple(seen.category[i] for i in index), seen.position[index], seen.yaw[index], seen.size[index]
    )


@pytest.mark.parametrize("extreme", EXTREMES)
def test_any_number_of_detections_is_checked(place, extreme):
    scene, snapshot = place
    few = replace(snapshot, detections=some(snapshot.detections, EXTREMES[extreme](snapshot.detections)))
    aside = set_aside(scene, few)
    assert len(aside) == len(few.detections)
    n = len(snapshot.detections)
    if extreme == "everything thrice":
        assert sum(reason is not None for reason in aside) == 2 * n
        assert kinds(scene, few) == ["repeated"]
    else:
        assert check(scene, few) == ()


@pytest.mark.parametrize("far", [0.0, 1e6])
def test_all_labels_at_one_place_and_the_largest_coordinates_end_without_an_error(far):
    n = 5
    layout = Layout(tuple("abcde"), ("box",) * n, np.full((n, 2), far), np.zeros(n), np.full((n, 3), 0.3))
    scene = Scene("heap", None, layout)
    seen = Detections(("box",) * n, np.full((n, 2), far), np.zeros(n), np.full((n, 3), 0.3))
    assert check(scene, Snapshot(Camera(np.full(2, far - 1.0), np.asarray(0.8)), seen)) == ()
    none_known = replace(layout, yaw=np.full(n, np.nan), size=np.full((n, 3), np.nan))
    unknown = replace(seen, yaw=np.full(n, np.nan), size=np.full((n, 3), np.nan), category=(None,) * n)
    check(Scene("heap", None, none_known), Snapshot(Camera(np.full(2, -far), np.asarray(0.8)), unknown))


@pytest.mark.parametrize("name", sorted(BUILTIN))
def test_the_papers_noise_raises_no_alarm(name):
    scene, rng = builtin_scene(name), np.random.default_rng(11)
    metres = 1.0 if scene.diagonal > 5 else 0.2
    if scene.camera_path is None:
        cameras = Camera(np.array([[0.6, -0.3]] * 40), rng.normal(0.0, 0.2, 40), scene.fov)
    else:
        cameras = scene.camera_path.cameras(40, scene.fov)
    for share, degrees in ((0.1, 15), (0.3, 120), (1.0, 30)):
        noise = LayoutNoise.of(share * metres, degrees)
        batch = observe_many(noise.disturb(scene.layout, scene.size, rng, (40,)), cameras)
        for b in range(len(batch)):
            assert check(scene, batch.snapshot(b)) == ()
    assert UNKNOWN == -1


def test_things_that_all_go_ahead_or_turn_alike_are_no_fault():
    scene = world(seed=4)
    snapshot = look(scene, seed=4)
    seen = snapshot.detections
    ahead = np.stack([np.sin(seen.yaw), np.cos(seen.yaw)], axis=1)
    assert check(scene, changed(snapshot, position=seen.position + 0.4 * ahead)) == ()
    assert check(scene, changed(snapshot, yaw=seen.yaw + np.pi / 3)) == ()


def test_those_who_walk_past_one_another_are_not_mirrored():
    rng = np.random.default_rng(2)
    n = 10
    east = np.arange(n) % 2 == 0
    before = np.column_stack([np.where(east, 1.0, 5.0) + rng.uniform(-0.6, 0.6, n), np.linspace(0.3, 4.7, n)])
    yaw = np.where(east, np.pi / 2, -np.pi / 2)
    walkers = tuple(f"walker {k}" for k in range(n)), ("walker",) * n
    scene = Scene("hall", (6.0, 5.0), Layout(*walkers, before, yaw, np.full((n, 3), 0.4)))
    after = before + np.column_stack(
        [np.where(east, 4.0, -4.0) + rng.normal(0, 0.05, n), rng.normal(0, 0.05, n)]
    )
    camera = Camera(np.array([3.0, 2.5]), np.asarray(0.0), FieldOfView(np.pi, np.pi, 5.0))
    seen = Detections(walkers[1], after, yaw, np.full((n, 3), 0.4))
    assert check(scene, Snapshot(camera, seen)) == ()


def test_evidence_is_the_mean_over_scales_of_the_product_of_mixtures():
    scene = world(seed=3)
    snapshot = look(scene, seed=3)
    places, seen, layout = places_of(scene), snapshot.detections, scene.layout
    codes = np.array([layout.categories.index(name) for name in seen.category])
    codes[0] = UNKNOWN
    yaw = np.where(np.arange(len(seen)) == 1, np.nan, seen.yaw)
    variants = [
        Variant(seen.position + np.array((x, 0.3)), yaw + x, 0.7, close)
        for x in (0.0, 4.0)
        for close in (0, 1)
    ]
    middle, extent = layout.position.mean(axis=0), places.extent
    expected = []
    for position, heading, volume, close in variants:
        terms = []
        for shift in places.widths:
            for turn in (*TURNS, np.inf):
                near = []
                for i, at in enumerate(position):
                    may = [j for j in range(len(layout)) if codes[i] in (UNKNOWN, layout.category_code[j])]
                    around = multivariate_normal(at, shift**2 * np.eye(2)).pdf(layout.position[may])
                    off = heading[i] - layout.yaw[may] + 2 * np.pi * np.arange(-3, 4)[:, None]
                    off = np.where(np.isnan(off), 0.0, off)
                    told = np.isfinite(turn) and np.isfinite(heading[i])
                    facing = norm(0, turn).pdf(off).sum(axis=0) if told else 1 / (2 * np.pi)
                    away = ((at - middle) ** 2).sum()
                    anywhere = multivariate_normal(middle, extent**2 * np.eye(2)).pdf(at)
                    anywhere = anywhere / 2 + extent / (4 * np.pi * (away + extent**2) ** 1.5)
                    near.append(0.7 * np.mean(around * facing) + 0.3 * anywhere / (2 * np.pi))
                terms.append(0.0 if close and shift > 0.35 * places.spacing else np.prod(near))
        outside = (~scene.bounds.contains(position)).sum()
        expected.append(np.log(np.mean(terms)) + volume + outside * np.log(0.05))
    assert log_evidence(places, codes, variants) == pytest.approx(expected, rel=1e-6)


def test_all_motions_that_fit_equally_well_are_found():
    rng = np.random.default_rng(0)
    square = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 2.0), (0.0, 2.0)])
    turn, shift = 0.4, np.array([30.0, -7.0])
    sine, cosine = np.sin(turn), np.cos(turn)
    # From where things were detected, `turn` clockwise takes them to the labels.
    detected = (square - shift) @ np.array([[cosine, sine], [-sine, cosine]])
    found = best_motions(detected, np.ones((4, 4), dtype=bool), square, 1.0, 2.3)
    turns = np.sort(np.remainder(found[:, 4], 2 * np.pi))
    assert turns == pytest.approx(sorted(np.remainder([turn, turn + np.pi], 2 * np.pi)), abs=1e-6)
    lone = np.vstack([square, [(5.0, 0.3)]])
    detected = (lone - shift) @ np.array([[cosine, sine], [-sine, cosine]]) + rng.normal(0, 1e-6, (5, 2))
    (one,) = best_motions(detected, np.ones((5, 5), dtype=bool), lone, 1.0, 5.0)
    assert RigidMotion(one[:2], one[2:4], one[4]).position(detected) == pytest.approx(lone, abs=1e-4)


def test_the_prior_of_motions_that_fit_as_well_is_that_of_laplaces_approximation():
    """Where each thing fits one label, and no other: what is left over has the least spread then."""
    labels = np.array([(0.0, 0.0), (3.0, 0.4), (1.0, 7.0), (9.0, 2.0)])
    spacing, extent, turn, shift, width = 1.0, 9.5, 0.3, np.array([2.0, -1.0]), 0.15
    cosine, sine = np.cos(turn), np.sin(turn)
    middle = labels.mean(axis=0)
    detected = middle + (labels - middle - shift) @ np.array([[cosine, sine], [-sine, cosine]])
    (found,) = best_motions(detected, np.ones((4, 4), dtype=bool), labels, spacing, extent)
    near = 0.7 * multivariate_normal.pdf(np.zeros(2), np.zeros(2), width**2) / 4
    total, spread = 4 * near / (near + 0.3 / extent**2), 0.03 * spacing
    arm = np.sqrt(((labels - middle) ** 2).sum(axis=1).mean()) + spread
    density = extent / (2 * np.pi * (extent**2 + shift @ shift) ** 1.5) / (2 * np.pi)
    volume = 2 * np.pi * spread**2 / total * np.sqrt(2 * np.pi / total) * spread / arm
    assert found[5] == pytest.approx(np.log(density * volume), abs=1e-3)


def test_what_follows_from_a_scene_is_worked_out_once_for_each():
    scene = world(seed=3)
    assert places_of(scene) is places_of(scene)
    twice = scene.knowing(scene.layout.with_poses(2 * scene.layout.position, scene.layout.yaw))
    assert places_of(twice).extent == pytest.approx(2 * places_of(scene).extent)
