"""Alignment: right where it is certain, in worlds unlike one another; uncertain where there are several."""

import sys
from dataclasses import replace
from importlib import util
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farm_ar.errors import SnapshotError
from farm_ar.reid import RigidMotion, Session, align, identify
from farm_ar.reid.alignment import evidence, moved, spacing_of
from farm_ar.reid.alignment.problem import problem_of
from farm_ar.scenes import Camera, Detections, FieldOfView, Layout, Scene, Snapshot, builtin_scene, observe

_spec = util.spec_from_file_location(
    "alignment_worlds", Path(__file__).parents[2] / "benchmarks" / "alignment.py"
)
worlds = util.module_from_spec(_spec)
sys.modules[_spec.name] = worlds
_spec.loader.exec_module(worlds)

ALL_ROUND = FieldOfView(np.pi, np.pi, 1e6)


def scene_of(position, yaw, category=None, fixed=None, symmetry=None):
    n = len(position)
    category = ("thing",) * n if category is None else category
    layout = Layout(
        tuple(f"o{i}" for i in range(n)), category, position, yaw, np.full((n, 3), 0.1), fixed=fixed
    )
    return Scene("map", None, layout, symmetry=symmetry or {})


def snapshot_of(position, yaw, category=None, fov=ALL_ROUND, camera=(0.0, -50.0)):
    n = len(position)
    category = ("thing",) * n if category is None else category
    return Snapshot(
        Camera(np.array(camera), 0.0, fov), Detections(category, position, yaw, np.full((n, 3), 0.1))
    )


def motion_of(x, z, turn):
    return RigidMotion(np.zeros(2), np.array([x, z]), np.array(turn))


def off(found, motion, snapshot):
    """How far an answer is off at the detections' middle, metres, and radians."""
    middle = snapshot.detections.position.mean(axis=0, keepdims=True)
    turn = float(found.motion.turn - motion.turn)
    distance = np.linalg.norm(found.motion.position(middle) - motion.position(middle))
    return distance, abs((turn + np.pi) % (2 * np.pi) - np.pi)


def regular(n, radius=1.0):
    """n things around a circle, facing its middle: they look the same from n sides."""
    angle = np.arange(n) * 2 * np.pi / n
    return radius * np.stack([np.sin(angle), np.cos(angle)], axis=1), angle + np.pi


@pytest.mark.parametrize("look", ["30% moved", "partial view", "partial view, misses, a false one"])
def test_what_is_called_certain_is_right_and_most_whole_views_are_certain(look):
    row = worlds.measure(worlds.LOOKS[look], max(36, settings().max_examples // 5))
    assert row["right of certain"] >= 0.95
    assert row["certain"] >= (0.9 if look == "30% moved" else 0.15)


@pytest.mark.parametrize(
    "look", ["three times the noise", "headings uninformative", "categories unknown", "5% moved"]
)
def test_noise_headings_and_categories_are_not_taken_for_granted(look):
    row = worlds.measure(worlds.LOOKS[look], 24)
    assert row["right of certain"] >= 0.95
    assert row["certain"] >= 0.7


@pytest.mark.parametrize("sides", [2, 3, 4, 6])
def test_a_layout_that_looks_the_same_from_n_sides_has_n_answers(sides):
    place, yaw = regular(sides)
    motion = motion_of(3.0, -2.0, 0.7)
    snapshot = moved(snapshot_of(place, yaw), motion.inverse())
    found = align(scene_of(place, yaw), snapshot)
    assert found.ambiguous
    assert not found.certain
    assert "several sides" in found.reason
    assert len(found.alternatives) == sides - 1
    motions = [found.motion, *(one.motion for one in found.alternatives)]
    turns = np.sort([np.rad2deg(float(one.turn - motion.turn)) % 360 for one in motions])
    turns = np.sort((turns + 1e-6) % 360)
    assert turns == pytest.approx(np.arange(sides) * 360 / sides, abs=1e-3)
    assert found.confidence == pytest.approx(1 / sides, abs=0.05)


@settings(max_examples=max(20, settings().max_examples // 5))
@given(
    sides=st.integers(2, 9),
    rings=st.integers(1, 2),
    share=st.floats(0, 0.3),
    seed=st.integers(0, 10_000),
)
def test_symmetric_layouts_are_never_certain_and_wrong(sides, rings, share, seed):
    rng = np.random.default_rng(seed)
    parts = [regular(sides, radius) for radius in (1.0, 2.3)[:rings]]
    place, yaw = np.vstack([p for p, _ in parts]), np.concatenate([y for _, y in parts])
    now, facing = place.copy(), yaw.copy()
    away = rng.permutation(len(place))[: int(share * len(place))]
    now[away], facing[away] = rng.uniform(-2, 2, (len(away), 2)), rng.uniform(-np.pi, np.pi, len(away))
    motion = motion_of(*rng.uniform(-100, 100, 2), rng.uniform(-np.pi, np.pi))
    snapshot = moved(snapshot_of(now, facing), motion.inverse())
    found = align(scene_of(place, yaw), snapshot)
    assert not found.certain


def test_a_part_of_a_regular_grid_can_be_shifted():
    grid = np.stack(np.meshgrid(np.arange(8.0), np.arange(8.0)), axis=-1).reshape(-1, 2)
    part = grid[(grid[:, 0] < 3) & (grid[:, 1] < 3)]
    narrow = FieldOfView(np.pi, np.pi, 1e-3)  # nothing is in its view, so that empty places tell nothing
    found = align(scene_of(grid, np.zeros(64)), snapshot_of(part, np.zeros(9), fov=narrow))
    assert found.ambiguous
    assert not found.certain


def test_an_empty_place_in_view_tells_a_grid_from_its_shift():
    grid = np.stack(np.meshgrid(np.arange(6.0), np.arange(5.0)), axis=-1).reshape(-1, 2)
    grid = np.delete(grid, [8, 21], axis=0)
    motion = motion_of(7.0, 1.0, 2.0)
    snapshot = moved(snapshot_of(grid, np.zeros(28)), motion.inverse())
    found = align(scene_of(grid, np.zeros(28)), snapshot)
    assert found.certain
    assert off(found, motion, snapshot) == pytest.approx((0, 0), abs=1e-6)


def _frames(seed):
    """A case, and the same with map and snapshot written down in other units and frames."""
    case = worlds.make_case("room", seed, worlds.Look())
    rng = np.random.default_rng(seed)
    scale = 10 ** rng.uniform(-3, 3) / case.spacing
    scale = min(scale, 100.0 / np.ptp(case.scene.layout.position, axis=0).max())
    to_map = motion_of(*rng.uniform(-1000, 1000, 2), rng.uniform(-np.pi, np.pi))
    to_snapshot = motion_of(*rng.uniform(-1000, 1000, 2), rng.uniform(-np.pi, np.pi))
    layout, camera = case.scene.layout, case.snapshot.camera
    origin = layout.position.mean(axis=0)
    layout = replace(
        layout,
        position=to_map.position((layout.position - origin) * scale),
        yaw=to_map.yaw(layout.yaw),
        size=layout.size * scale,
    )
    fov = replace(camera.fov, range_m=camera.fov.range_m * scale)
    seen = case.snapshot.detections
    middle = seen.position.mean(axis=0)
    snapshot = Snapshot(
        replace(camera, position=(camera.position - middle) * scale, fov=fov),
        replace(seen, position=(seen.position - middle) * scale, size=seen.size * scale),
    )
    return case, replace(case.scene, layout=layout), moved(snapshot, to_snapshot)


@pytest.mark.parametrize("seed", range(8))
def test_units_origins_and_turns_of_either_frame_change_nothing(seed):
    case, scene, snapshot = _frames(seed)
    first, second = align(case.scene, case.snapshot), align(scene, snapshot)
    assert second.matches == first.matches
    assert second.confidence == pytest.approx(first.confidence, abs=1e-6)
    place = first.motion.position(case.snapshot.detections.position)
    other = second.motion.position(snapshot.detections.position)
    within = [np.linalg.norm(one - one.mean(axis=0), axis=1) for one in (place, other)]
    assert within[1] / spacing_of(scene.layout.position, scene.layout.size) == pytest.approx(
        within[0] / case.spacing, abs=1e-6
    )


def test_one_anchor_is_enough_where_the_layout_is_symmetric():
    place, yaw = regular(4)
    motion = motion_of(3.0, -2.0, 0.7 + np.pi / 2)
    snapshot = moved(snapshot_of(place, yaw), motion.inverse())
    before = np.array([0.4, 0.3])
    # the anchor is 5 cm and 3 degrees off, where things stand 1.4 m apart
    after = motion.position(before[None])[0] + [0.03, 0.04]
    anchor = ((*before, 0.2), (*after, 0.2 + float(motion.turn) + np.deg2rad(3)))
    found = align(scene_of(place, yaw), snapshot, anchor)
    assert found.certain
    assert off(found, motion, snapshot) == pytest.approx((0, 0), abs=1e-6)


def test_an_anchor_is_believed_where_nothing_is_in_view_or_nothing_is_known():
    place, yaw = regular(4)
    nothing = snapshot_of(np.zeros((0, 2)), np.zeros(0))
    anchor = ((1.0, 2.0, 0.0), (5.0, 5.0, np.pi / 2))
    for scene, snapshot in (
        (scene_of(place, yaw), nothing),
        (scene_of(np.zeros((0, 2)), np.zeros(0)), snapshot_of(place, yaw)),
        (scene_of(np.zeros((0, 2)), np.zeros(0)), nothing),
    ):
        found = align(scene, snapshot, anchor)
        assert found.certain
        assert found.motion.position(np.array([[1.0, 2.0], [1.0, 3.0]])) == pytest.approx(
            np.array([[5.0, 5.0], [6.0, 5.0]])
        )
        assert align(scene, snapshot).confidence == 0


@pytest.mark.parametrize("anchor", [((0, 0), (0, 0, 0)), ((0, 0, np.nan), (0, 0, 0))])
def test_an_anchor_that_is_no_pose_is_refused(anchor):
    with pytest.raises(SnapshotError, match="anchor"):
        align(scene_of(*regular(4)), snapshot_of(*regular(4)), anchor)


def test_the_heading_of_one_fixed_thing_is_enough_and_a_movable_one_is_not():
    place, yaw = np.array([[0.0, 0.0], [4.0, 1.0], [1.0, 5.0]]), np.array([0.3, 1.0, 2.0])
    names = ("lamp", "sofa", "table")
    motion = motion_of(10.0, 20.0, 2.5)
    narrow = FieldOfView(0.3, 0.3, 3.0)
    snapshot = moved(snapshot_of(place[:1], yaw[:1], names[:1], narrow, (0.0, -2.0)), motion.inverse())
    fixed = np.array([True, False, False])
    found = align(scene_of(place, yaw, names, fixed), snapshot)
    # A heading is known to about 2 degrees at best, so it is the turn that is not certain.
    assert off(found, motion, snapshot) == pytest.approx((0, 0), abs=1e-9)
    loose = align(scene_of(place, yaw, names), snapshot)
    assert not loose.certain
    assert loose.confidence < found.confidence


def test_another_place_and_a_mirrored_frame_are_not_certain():
    for seed in range(min(settings().max_examples // 4, 30)):
        kind = list(worlds.WORLDS)[seed % 6]
        case = worlds.make_case(kind, seed, worlds.Look(moved=0.0, noise=0.0))
        seen = case.snapshot.detections
        mirror = np.array([-1.0, 1.0])
        mirrored = replace(seen, position=seen.position * mirror, yaw=-seen.yaw)
        camera = case.snapshot.camera
        camera = replace(camera, position=camera.position * mirror, yaw=-camera.yaw)
        found = align(case.scene, Snapshot(camera, mirrored))
        assert found.confidence < 0.95 or kind == "circle"  # some circles are their own mirror image
        other = worlds.make_case(kind, seed + 1000, worlds.Look())
        scale = case.spacing / other.spacing
        place = other.snapshot.detections.position
        place = (place - place.mean(axis=0)) * scale
        elsewhere = Snapshot(
            Camera(np.zeros(2), 0.0, ALL_ROUND), replace(other.snapshot.detections, position=place)
        )
        assert not align(case.scene, elsewhere).certain


def test_a_mirrored_frame_is_named():
    case = worlds.make_case("room", 3, worlds.Look())
    seen = case.snapshot.detections
    camera = case.snapshot.camera
    mirror = np.array([-1.0, 1.0])
    found = align(
        case.scene,
        Snapshot(
            replace(camera, position=camera.position * mirror, yaw=-camera.yaw),
            replace(seen, position=seen.position * mirror, yaw=-seen.yaw),
        ),
    )
    assert not found.certain
    assert "handedness" in found.reason


def test_things_that_look_alike_when_turned_may_have_been_turned():
    rng = np.random.default_rng(2)
    place, yaw = rng.uniform(0, 5, (9, 2)), rng.uniform(-np.pi, np.pi, 9)
    motion = motion_of(-4.0, 9.0, 1.1)
    quarter = yaw + rng.integers(0, 4, 9) * np.pi / 2
    snapshot = moved(snapshot_of(place, quarter), motion.inverse())
    for period in (np.pi / 2, 0.0):
        found = align(scene_of(place, yaw, symmetry={"thing": period}), snapshot)
        assert found.certain
        assert off(found, motion, snapshot) == pytest.approx((0, 0), abs=1e-6)


def test_detections_far_away_and_in_one_place_are_borne():
    place, yaw = np.random.default_rng(0).uniform(0, 4, (8, 2)), np.zeros(8)
    scene = scene_of(place, yaw)
    lost = np.vstack([place[:6], [[1e6, -1e6], [1e6, -1e6], [0, 0], [0, 0]]])
    found = align(scene, snapshot_of(lost, np.zeros(10)))
    assert found.inliers == (0, 1, 2, 3, 4, 5)
    assert off(found, motion_of(0, 0, 0), snapshot_of(place, yaw))[1] == pytest.approx(0, abs=1e-6)
    one = snapshot_of(np.vstack([place, [[0.0, 0.0]]]), np.zeros(9))
    broken = {"position": np.vstack([place, [[np.nan, np.nan]]]), "yaw": np.append(yaw, np.nan)}
    broken = replace(one, detections=Detections.trusted(**vars(one.detections) | broken))
    assert align(scene, broken).inliers == tuple(range(8))
    assert align(scene, broken).confidence == pytest.approx(align(scene, snapshot_of(place, yaw)).confidence)
    same = np.zeros((8, 2))
    pile = align(scene_of(same, yaw), snapshot_of(same, yaw))
    assert off(pile, motion_of(0, 0, 0), snapshot_of(same, yaw)) == pytest.approx((0, 0), abs=1e-9)
    assert not align(scene, snapshot_of(np.array([[2.0, 2.0]]), np.zeros(1))).certain


@pytest.mark.parametrize("name", ["farm", "L1", "M2", "cafeteria"])
def test_the_built_in_scenes_are_aligned(name):
    scene = builtin_scene(name)
    low, high = scene.layout.position.min(axis=0), scene.layout.position.max(axis=0)
    camera = Camera(low - 0.2 * (high - low), np.pi / 4, FieldOfView(1.5, 1.5, 1e3))
    motion = motion_of(12.0, -7.0, -2.0)
    snapshot = moved(observe(scene.layout, camera)[0], motion.inverse())
    found = align(scene, snapshot)
    spacing = spacing_of(scene.layout.position, scene.layout.size)
    distance, turn = off(found, motion, snapshot)
    assert (distance < 0.05 * spacing and turn < np.deg2rad(2)) or not found.certain


def test_identify_finds_an_unknown_frame_and_says_where_it_is_not_certain():
    case = worlds.make_case("room", 5, worlds.Look(moved=0.1))
    known = identify(case.scene, moved(case.snapshot, case.motion), "likelihood")
    found = identify(case.scene, case.snapshot, "likelihood", frame="unknown")
    assert found.labels == known.labels
    assert found.confidence == pytest.approx(known.confidence, abs=0.05)
    assert not any("frame" in warning for warning in found.warnings)
    place, yaw = regular(4)
    seen = moved(snapshot_of(place, yaw), motion_of(5.0, 5.0, 1.0))
    doubtful = identify(scene_of(place, yaw), seen, "likelihood", frame="unknown")
    assert any("several sides" in warning and "3 others" in warning for warning in doubtful.warnings)
    # One of four motions is right, and by the others every label is another one's.
    assert doubtful.confidence == pytest.approx(0.25 + 0.75 / 5, abs=0.05)
    assert identify(scene_of(place, yaw), snapshot_of(place[:0], yaw[:0]), frame="unknown").labels == ()


@pytest.mark.parametrize(("stayed", "group"), [(6, 6), (5, 7), (7, 5)])
def test_things_that_moved_as_one_are_not_taken_for_those_that_stayed(stayed, group):
    rng = np.random.default_rng(stayed)
    place, yaw = rng.uniform(0, 8, (12, 2)), rng.uniform(-np.pi, np.pi, 12)
    now, facing = place.copy(), yaw.copy()
    away = motion_of(1.5, -0.8, 0.5)
    now[:group], facing[:group] = away.position(place[:group]), away.yaw(yaw[:group])
    snapshot = moved(snapshot_of(now, facing), motion_of(20.0, 30.0, 1.0).inverse())
    found = align(scene_of(place, yaw), snapshot)
    assert found.ambiguous
    assert not found.certain


def test_a_small_group_that_moved_as_one_leaves_the_rest_certain():
    rng = np.random.default_rng(1)
    place, yaw = rng.uniform(0, 8, (12, 2)), rng.uniform(-np.pi, np.pi, 12)
    now, facing = place.copy(), yaw.copy()
    away = motion_of(1.5, -0.8, 0.5)
    now[:3], facing[:3] = away.position(place[:3]), away.yaw(yaw[:3])
    motion = motion_of(20.0, 30.0, 1.0)
    snapshot = moved(snapshot_of(now, facing), motion.inverse())
    found = align(scene_of(place, yaw), snapshot)
    assert found.certain
    assert found.inliers == tuple(range(3, 12))


@pytest.mark.parametrize("stayed", [6, 20])
def test_few_of_many_that_fit_are_a_coincidence_and_things_of_other_kinds_do_not_count(stayed):
    rng = np.random.default_rng(0)
    place, yaw = rng.uniform(0, 8, (30, 2)), rng.uniform(-np.pi, np.pi, 30)
    now, facing = rng.uniform(0, 8, (60, 2)), rng.uniform(-np.pi, np.pi, 60)
    now[:stayed], facing[:stayed] = place[:stayed], yaw[:stayed]
    names = ("thing",) * 30 + ("stranger",) * 30
    narrow = FieldOfView(np.pi, np.pi, 1e-3)  # so that empty places tell nothing
    snapshot = moved(snapshot_of(now, facing, names, narrow), motion_of(20.0, 30.0, 1.0).inverse())
    found = align(scene_of(place, yaw), snapshot)
    assert found.inliers == tuple(range(stayed))
    assert found.certain == (stayed == 20)


def mixture(fov, match, heading=np.inf, stayed=0.65, turn=0.0):
    """Log likelihood of one detection that stands where the first of two labels does, and the problem."""
    place = np.array([[0.0, 0.0], [4.0, 0.0]])
    scene, seen = scene_of(place, np.zeros(2)), snapshot_of(place[:1], np.array([turn]), fov=fov)
    problem = problem_of(scene, seen)
    motion = problem.scaled(motion_of(0.0, 0.0, 0.0))[:, :3]
    found = evidence._mixture(
        problem, evidence._look(problem, motion, np.array([[match]])), 0.03, heading, stayed
    )
    return float(found[0][0]), problem


def test_what_is_in_view_and_not_detected_lessens_the_evidence_by_its_having_stayed():
    ahead = FieldOfView(0.02, 0.02, 1e6)  # from (0, -50) it holds the first label only
    assert mixture(ahead, 0)[0] - mixture(ALL_ROUND, 0)[0] == pytest.approx(-np.log(1 - 0.65))


def test_if_no_thing_stayed_a_motion_is_as_probable_as_none():
    found, problem = mixture(ALL_ROUND, -1, stayed=0.0)
    assert found == pytest.approx(evidence.nothing_stayed(problem))


def test_the_likelihood_of_headings_is_that_of_none_on_average():
    turns = np.linspace(-np.pi, np.pi, 720, endpoint=False)
    likely = [np.exp(mixture(ALL_ROUND, 0, 0.1, turn=turn)[0]) for turn in turns]
    assert np.mean(likely) == pytest.approx(np.exp(mixture(ALL_ROUND, 0)[0]))


def test_a_detection_looks_like_the_label_of_its_size_in_any_unit():
    place = np.array([[0.0, 0.0], [4.0, 0.0]])
    for unit in (0.01, 1.0, 100.0):
        size = unit * np.array([[0.1, 0.1, 0.1], [0.11, 0.1, 0.1]])
        layout = Layout(("o0", "o1"), ("thing",) * 2, place, np.zeros(2), size)
        seen = Detections(("thing",), place[:1], np.zeros(1), size[1:])
        fit = problem_of(Scene("map", None, layout), Snapshot(Camera(place[0], 0.0, ALL_ROUND), seen)).fit[0]
        assert fit[1] - fit[0] == pytest.approx(0.5 * (np.log(1.1) / 0.15) ** 2)
        assert np.exp(fit).mean() == pytest.approx(1)


@pytest.mark.parametrize("seed", range(6))
def test_an_anchor_decides_where_everything_has_moved_a_little_and_a_session_takes_it(seed):
    rng, scene = np.random.default_rng(seed), builtin_scene("farm")
    layout = scene.layout
    shift, turn = rng.normal(0, 0.02, layout.position.shape), rng.normal(0, 0.14, len(layout))
    camera = Camera(np.array([0.6, -0.5]), 0.0, FieldOfView(1.2, 1.2, 5.0))
    seen, truth = observe(layout.with_poses(layout.position + shift, layout.yaw + turn), camera)
    motion = RigidMotion(np.zeros(2), rng.uniform(-5, 5, 2), np.array(rng.uniform(-3, 3)))
    strange = moved(seen, motion.inverse())
    place = motion.position(np.array([[1.0, 2.0]]))[0]
    anchor = ((1.0, 2.0, 0.3), (*place, 0.3 + float(motion.turn)))
    found = align(scene, strange, anchor)
    assert found.certain
    assert found.reason == ""
    there = found.motion.position(strange.detections.position) - seen.detections.position
    assert np.linalg.norm(there, axis=1).max() < 0.12  # a third of a building's distance to the next
    session = Session(scene, "spatial")
    session.align(strange, anchor)
    right = sum(a == b for a, b in zip(session.identify(strange).labels, truth, strict=True))
    assert right >= len(truth) - 2
    # Without it nothing stands exactly where it stood, so how exact the motion is cannot be certain.
    assert align(scene, strange).confidence <= align(scene, strange).roughly


def anchored_world(seed, moved_by, anchor_off=0.0, stayed=0.0):
    """A world whose things moved by so much of the spacing (SD), but some; an anchor that is off likewise."""
    rng = np.random.default_rng(seed)
    place, yaw, category = (worlds.room, worlds.tabletop, worlds.warehouse, worlds.clusters)[seed % 4](rng)
    n, names = len(place), tuple(f"k{code}" for code in category)
    spacing = spacing_of(place, np.full((n, 3), 0.1))
    loose = (rng.random(n) >= stayed)[:, None]
    later = place + loose * rng.normal(0, moved_by * spacing, (n, 2))
    turned = yaw + loose[:, 0] * rng.normal(0, 0.2, n)
    motion = motion_of(*(rng.uniform(-5, 5, 2) * spacing), rng.uniform(-3, 3))
    seen = snapshot_of(later, turned, names, FieldOfView(np.pi, np.pi, 100 * spacing), place.mean(axis=0))
    strange = moved(seen, motion.inverse())
    before = strange.detections.position.mean(axis=0)
    after = motion.position(before[None])[0] + rng.normal(0, anchor_off * spacing, 2)
    turn = float(motion.turn) + rng.normal(0, 0.3 * anchor_off)
    return scene_of(place, yaw, names), strange, motion, ((*before, 0.3), (*after, 0.3 + turn)), spacing


def test_the_motion_of_an_exact_anchor_stays_though_all_has_moved_a_little():
    close = []
    for seed in range(24):
        scene, strange, motion, anchor, spacing = anchored_world(seed, 0.3 if seed % 2 else 0.1)
        found = align(scene, strange, anchor)
        assert found.certain
        distance, turn = off(found, motion, strange)
        close.append(distance < 0.05 * spacing and turn < np.deg2rad(2))
    assert np.mean(close) >= 0.95


def test_what_stayed_mends_an_anchor_that_is_somewhat_off():
    close = []
    for seed in range(24):
        scene, strange, motion, anchor, spacing = anchored_world(seed, 1.0, anchor_off=0.15, stayed=0.6)
        distance, turn = off(align(scene, strange, anchor), motion, strange)
        close.append(distance < 0.05 * spacing and turn < np.deg2rad(2))
    assert np.mean(close) >= 0.95
