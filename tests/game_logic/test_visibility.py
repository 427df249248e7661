"""What a camera sees of points and of the player's arm, against the plain geometry."""

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numba.core.dispatcher import Dispatcher

from farm_ar.game_logic import visibility
from farm_ar.geometry import angles as angles_module
from farm_ar.geometry import bearing, in_vertical_view, in_view, wrap
from farm_ar.geometry import camera as camera_model
from farm_ar.scenes import Camera, FieldOfView, Layout, visible

MODULES = (angles_module, camera_model, visibility)
COMPILED = [
    (m, name, value) for m in MODULES for name, value in vars(m).items() if isinstance(value, Dispatcher)
]


@pytest.fixture(params=["compiled", "python"], autouse=True, scope="module")
def mode(request: pytest.FixtureRequest) -> Iterator[str]:
    """Every test sees the kernels as they are compiled, and as plain Python."""
    with pytest.MonkeyPatch.context() as patch:
        for module, name, kernel in COMPILED:
            if request.param == "python":
                patch.setattr(module, name, kernel.py_func)
        yield request.param


angles = st.floats(0.05, 1.5)
fields = st.builds(FieldOfView, angles, angles, st.floats(0.2, 3.0)) | st.builds(
    FieldOfView, angles, angles, st.floats(0.2, 3.0), st.floats(0.05, 1.4), st.floats(0.05, 1.4)
)
wide = st.builds(FieldOfView, st.floats(1.6, 3.14), st.floats(1.6, 3.14), st.floats(0.2, 3.0))
places = st.tuples(st.floats(-0.5, 1.7), st.floats(-0.6, 1.3))


def cameras(fov: st.SearchStrategy[FieldOfView]) -> st.SearchStrategy[Camera]:
    yaw, pitch = st.floats(-7, 7), st.floats(-1.4, 0.5)
    return st.builds(
        lambda place, yaw, fov, height, pitch: Camera(np.array(place), yaw, fov, height, pitch),
        places,
        yaw,
        fov,
        st.floats(0.1, 1.0),
        pitch,
    )


@given(cameras(fields | wide), places)
def test_a_point_is_seen_where_the_layouts_are(camera: Camera, place: tuple[float, float]) -> None:
    pivot = Layout(("a",), ("coop",), np.array([place]), np.zeros(1), np.ones((1, 3)))
    assert camera_model.sees(visibility.eye_of(camera), place[0], 0.0, place[1]) == visible(pivot, camera)[0]


@pytest.mark.parametrize("yaw", [6.2e6, -6.2e6])
def test_a_camera_that_has_turned_many_times_sees_what_one_does_that_has_not(yaw: float) -> None:
    fov = FieldOfView.symmetric(2.0, 3.0)
    turned, same = (visibility.eye_of(Camera(np.zeros(2), angle, fov)) for angle in (yaw, wrap(yaw)))
    for x, z in np.random.default_rng(0).uniform(-1, 1, (50, 2)):
        assert camera_model.bearing_to(turned, x, z) == pytest.approx(wrap(np.arctan2(x, z) - yaw), abs=1e-12)
        assert camera_model.sees(turned, x, 0.0, z) == camera_model.sees(same, x, 0.0, z)


def arm(hand: tuple[float, float], count: int) -> np.ndarray:
    """(2 count, 3) points of both sides of hand and forearm."""
    far, near = hand[1] + visibility.ARM_HALF_WIDTH_M, min(visibility.ELBOW_Z, hand[1])
    z = np.linspace(far, near, count)
    sides = [hand[0] - visibility.ARM_HALF_WIDTH_M, hand[0] + visibility.ARM_HALF_WIDTH_M]
    return np.concatenate(
        [np.stack([np.full(count, x), np.full(count, visibility.ARM_HEIGHT_M), z], 1) for x in sides]
    )


def seen_of(points: np.ndarray, camera: Camera, slack: float) -> np.ndarray:
    """(P,) points in view of a camera whose field of view is by so much wider."""
    fov = camera.fov
    flat = points[:, [0, 2]]
    seen = in_view(
        flat, camera.position, camera.yaw, fov.left + slack, fov.right + slack, fov.range_m + slack
    )
    if fov.up is not None and fov.down is not None:
        eye = np.array([camera.position[0], float(camera.height), camera.position[1]])
        seen &= in_vertical_view(points, eye, camera.yaw, camera.pitch, fov.up + slack, fov.down + slack)
    return seen


@given(cameras(fields), places)
def test_an_arm_is_seen_where_one_of_many_points_on_it_is(camera: Camera, hand: tuple[float, float]) -> None:
    points = arm(hand, 2000)
    clearly, perhaps = seen_of(points, camera, -0.002).any(), seen_of(points, camera, 0.002).any()
    assume(clearly == perhaps)
    assert visibility.sees_arm(visibility.eye_of(camera), *hand) == clearly


@given(cameras(wide), places)
def test_so_is_one_before_a_camera_that_sees_half_a_turn_or_more(
    camera: Camera, hand: tuple[float, float]
) -> None:
    assert (
        visibility.sees_arm(visibility.eye_of(camera), *hand)
        == seen_of(arm(hand, visibility.ARM_POINTS), camera, 0).any()
    )


@given(cameras(fields | wide), st.lists(places, min_size=1, max_size=6))
def test_what_is_seen_is_what_the_scenes_say_from_left_to_right(camera: Camera, place: list) -> None:
    n = len(place)
    layout = Layout(tuple(map(str, range(n))), ("a",) * n, np.array(place), np.zeros(n), np.ones((n, 3)))
    seen, number = visibility.seen_by(camera, layout)
    angle = bearing(camera.position, camera.yaw, layout.position)
    edges = np.abs(angle[:, None] - np.array([-camera.fov.left, camera.fov.right])).min()
    assume(edges > 1e-9)
    assume(np.abs(np.hypot(*(layout.position - camera.position).T) - camera.fov.range_m).min() > 1e-9)
    np.testing.assert_array_equal(np.sort(number), np.flatnonzero(seen))
    assert (np.diff(angle[number]) >= -1e-12).all()
    if camera.fov.up is None:
        np.testing.assert_array_equal(seen, visible(layout, camera))
