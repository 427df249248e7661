"""Boxes that came to rest wedged in; compiled and in plain Python."""

from collections.abc import Iterator

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher

from farm_ar.arrays import FloatArray
from farm_ar.game_logic.physics import overlap_resolution
from farm_ar.game_logic.physics.state import Body
from farm_ar.game_logic.physics.tabletop import Tabletop
from farm_ar.geometry import deepest_overlap
from farm_ar.scenes import Layout
from farm_ar.structs import Structs

COMPILED = {
    name: kernel for name, kernel in vars(overlap_resolution).items() if isinstance(kernel, Dispatcher)
}
COOP, SIZE = (0.10, 0.08, 0.09), (0.4, 0.3)


@pytest.fixture(params=["compiled", "python"])
def mode(request: pytest.FixtureRequest) -> Iterator[str]:
    with pytest.MonkeyPatch.context() as patch:
        for name, kernel in COMPILED.items():
            if request.param == "python":
                patch.setattr(overlap_resolution, name, kernel.py_func)
        yield request.param


def table(position: list[tuple[float, float]], yaw: list[float], fixed: int) -> Tabletop:
    """Coops, one of which never moves."""
    n = len(yaw)
    layout = Layout(
        tuple(f"b{i}" for i in range(n)),
        ("coop",) * n,
        np.array(position),
        np.array(yaw),
        np.array([COOP] * n),
        fixed=np.arange(n) == fixed,
    )
    return Tabletop(layout, SIZE)


def overlap_of(bodies: Structs[Body], size: FloatArray) -> float:
    return deepest_overlap(np.stack([bodies["x"], bodies["z"]], axis=-1), -bodies["angle"], size)


def test_the_depth_and_the_way_out_are_those_of_the_separating_axes(mode: str) -> None:
    rng, deep = np.random.default_rng(0), 0
    for _ in range(200):
        place, yaw = rng.uniform(0.1, 0.25, (2, 2)), rng.uniform(-np.pi, np.pi, 2)
        box = table([tuple(p) for p in place], yaw.tolist(), 0).space.bodies.copy()
        gap, x, z = overlap_resolution.separation(box, 0, 1)
        depth = -gap
        expected = overlap_of(box, np.array([COOP] * 2))
        if expected > 0.05:  # there shadows that hold one another are measured in another way
            continue
        assert max(depth, 0.0) == pytest.approx(expected, abs=1e-12)
        assert np.hypot(x, z) == pytest.approx(1)
        if depth > 0:
            deep += 1
            box["x"][1] += (depth + 1e-9) * x
            box["z"][1] += (depth + 1e-9) * z
            assert overlap_of(box, np.array([COOP] * 2)) < 1e-12
    assert deep > 20


def test_footprints_share_the_room_between_the_edge_and_what_never_moves(mode: str) -> None:
    """Two coops, 0.10 m wide each, of 0.2005 m; the first is over the edge, the second in the third."""
    narrow = table([(0.049, 0.15), (0.152, 0.15), (0.2505, 0.15)], [0.0] * 3, 2)
    state, box = narrow.space.states[0], narrow.space.bodies
    assert overlap_resolution.has_overlap(state, box)
    freed = box.copy()
    for _ in range(200):
        if overlap_resolution.push_apart(state, freed) <= 1e-5:
            break
    assert overlap_of(freed, narrow.layout.size) <= 1e-5
    assert freed["x"][0] >= 0.05 - 1e-5
    assert freed[2] == box[2]
    np.testing.assert_allclose(freed["z"], 0.15, atol=1e-12)


def test_what_stands_as_it_should_is_left(mode: str) -> None:
    clear = table([(0.0501, 0.15), (0.1503, 0.15), (0.3, 0.15)], [0.0] * 3, 2)
    state, box = clear.space.states[0], clear.space.bodies
    before = box.tobytes()
    assert not overlap_resolution.has_overlap(state, box)
    overlap_resolution.resolve_overlaps(state, box)
    assert box.tobytes() == before


def test_where_there_is_no_room_at_all_it_ends_all_the_same(mode: str) -> None:
    full = table([(0.05, 0.15), (0.13, 0.15), (0.21, 0.15)], [0.0] * 3, 2)
    overlap_resolution.resolve_overlaps(full.space.states[0], full.space.bodies)
    full.settle()
    assert np.isfinite(full.poses()[0]).all()


@pytest.mark.parametrize("gap", [0.2005, 0.201, 0.202])
def test_at_rest_nothing_is_wedged_in_between_the_edge_and_what_never_moves(gap: float) -> None:
    """The surfaces stand out by 1 mm each: the physics would want 0.205 m for two coops."""
    narrow = table([(0.05, 0.15), (gap - 0.05, 0.15), (gap + 0.05, 0.15)], [0.0] * 3, 2)
    narrow.settle()
    assert narrow.still
    assert narrow.overlap() <= 3e-4
    assert narrow.on_table(3e-4).all()
    poses = narrow.poses()
    narrow.tick(count=100)  # and so it stays
    assert narrow.poses() is poses
