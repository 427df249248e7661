"""Compiled kernels and the same code in plain Python, over pymunk's own calls: one game, byte for byte."""

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher
from pymunk._chipmunk_cffi import ffi, lib

from farm_ar.envs import FarmToTableEnv, features, table
from farm_ar.game_logic import farm_game, phases, visibility
from farm_ar.game_logic.animals import arrival, curve_intersection, flock, obstacle_avoidance, routes
from farm_ar.game_logic.animals.curve_intersection import NOWHERE
from farm_ar.game_logic.farm_game import FarmGame
from farm_ar.game_logic.headset import field_of_view, look_at
from farm_ar.game_logic.physics import (
    chipmunk,
    gripper,
    limits,
    overlap_resolution,
    proximity,
    sleeping,
    space,
    stepping,
    trajectory,
    velocity_control,
)
from farm_ar.game_logic.physics.tabletop import MotionLimit, Tabletop
from farm_ar.geometry import angles, arc_length, camera, rectangles
from farm_ar.scenes import Layout, Scene, builtin_scene

FARM = builtin_scene("farm")
SMALL = Scene(
    "small",
    FARM.size,
    FARM.layout.subset([FARM.layout.index(n) for n in ("red-coop", "orange-coop", "shed")]),
)
AHEAD = look_at(np.array([0.6, -0.3]), np.array([0.6, 0.4]), field_of_view("photo"))

MODULES = (
    *(angles, arc_length, camera, rectangles, arrival, curve_intersection, obstacle_avoidance, routes),
    *(gripper, limits, overlap_resolution, proximity, sleeping, space, stepping, trajectory),
    *(velocity_control, flock, phases, farm_game, visibility, table, features),
)


def both(play):
    """What `play` gives with compiled kernels, and in plain Python."""
    compiled = play()
    with pytest.MonkeyPatch.context() as patch:
        for module in MODULES:
            for name, kernel in vars(module).items():
                if isinstance(kernel, Dispatcher):
                    patch.setattr(module, name, kernel.py_func)
        plain = play()
    return compiled, plain


def pressed() -> bytes:
    """A crowd that is dragged through, pressed against the edge, and bumped into by a low hand."""
    place = np.array([[0.2, 0.2], [0.32, 0.2], [0.32, 0.32], [0.2, 0.33], [0.6, 0.4]])
    size = np.array([[0.10, 0.08, 0.09]] * 4 + [[0.2, 0.14, 0.16]])
    yaw = np.array([0.1, -0.3, 4.0, -4.0, 0.0])
    layout = Layout(tuple("abcds"), ("coop",) * 5, place, yaw, size, fixed=np.arange(5) == 4)
    table = Tabletop(layout, (0.8, 0.6))
    table.carry(0, (0.42, 0.22), 1.2, speed=1.5)
    table.carry(2, (-0.1, 0.3), 0.0, most=MotionLimit(metres=0.15))
    table.bring_hand((0.4, -0.05))
    for velocity in ((0.0, 1.5), (0.5, 0.2), (-1.5, 0.0)):
        table.tick(velocity, 1.0, 6)
        table.tick(velocity, 1.0)
    table.remove_hand()
    table.settle(60)
    bodies, states = table.space.bodies, table.space.states
    poses = [bodies[name] for name in ("x", "z", "angle", "old_x", "old_z", "old_angle")]
    motion = [states[name] for name in ("ticks", "still", "quiet", "metres", "radians", "changes")]
    hand = [states["hand"][name] for name in ("x", "z", "angle", "velocity_x", "velocity_z", "point_x")]
    return b"".join(values.tobytes() for values in (*poses, *motion, *hand))


def test_the_physics_are_the_same_to_the_last_bit():
    compiled, plain = both(pressed)
    assert compiled == plain


def steered() -> list[np.ndarray]:
    """A hand that comes, grips, drags, spends its budget and goes; animals before, during and after."""
    game = FarmGame(SMALL, AHEAD, np.random.default_rng(0))
    game.allow(MotionLimit(metres=0.2))
    game.bring_hand()
    for vx, vz, grip, ticks in ((0.5, 1.2, False, 20), (0.4, 0.9, True, 20), (-0.6, 0.3, True, 12)):
        for _ in range(ticks // 4):
            game.steer(vx, vz, 0.5, grip, 4)
    while game.steer(0.0, -1.4, 0.0, False, 6)[2] is None:
        pass
    game.play(1.0)
    return [*game.state().values()]


def test_so_is_a_game_with_a_steered_hand():
    for compiled, plain in zip(*both(steered), strict=True):
        np.testing.assert_allclose(compiled, plain, rtol=0, atol=1e-9)


def observed() -> list[np.ndarray]:
    env = FarmToTableEnv(scene=SMALL, jitter="none", control="hand", reward="margin", play_seconds=0.0)
    seen = [env.reset(seed=3, options={"camera": AHEAD})[0]]
    seen += [env.step(np.array([0.3, 1.0, 0.2, 1.0], dtype=np.float32))[0] for _ in range(6)]
    return [values for one in seen for values in one.values()]


def test_so_are_observations():
    for compiled, plain in zip(*both(observed), strict=True):
        np.testing.assert_allclose(compiled, plain, rtol=0, atol=1e-6)


def arrivals() -> np.ndarray:
    rng = np.random.default_rng(0)
    curve = rng.uniform(-1, 1, (40, 4, 2))
    place, yaw = np.array([[0.1, -0.2], [0.4, 0.1]]), np.array([0.4, -2.0])
    box = curve_intersection.footprints(
        place, yaw, np.array([[0.3, 1.0, 0.2], [0.1, 1.0, 0.5]]), np.array([True, True])
    )
    curve[:10, 3], curve[10:20, 3] = place
    along = np.where(np.arange(40) % 2, 0.1, -0.01)
    return np.array([arrival.arrival(*given, box) for given in zip(curve, along, strict=True)])


def test_so_are_arrivals():
    compiled, plain = both(arrivals)
    assert set(compiled[:, 0]) == {NOWHERE, 0, 1}
    np.testing.assert_allclose(compiled, plain, rtol=0, atol=1e-13)


def bowed() -> tuple[np.ndarray, np.ndarray]:
    """Curves before and after: some keep their distance, some cannot, and some cannot get past."""
    rng = np.random.default_rng(0)
    curve = rng.uniform(0, 1, (40, 4, 2))
    position, yaw, size = rng.uniform(0, 1, (9, 2)), rng.uniform(-3, 3, 9), rng.uniform(0.1, 0.2, (9, 3))
    box = np.stack(
        [
            curve_intersection.footprints(position, yaw, size + wider, np.arange(9) != 3)
            for wider in (0.1, 0.0, 0.0)
        ]
    )
    goal, aside = rng.integers(0, 9, 40), rng.normal(size=(40, 2))
    bows, table = np.linspace(0, 0.3, 4), np.array([1.0, 0.9])
    before, untouched = curve.copy(), box.tobytes()
    obstacle_avoidance.avoid(curve, aside, bows, goal, box, table)
    assert box.tobytes() == untouched
    return before, curve


def test_so_is_obstacle_avoidance():
    (before, compiled), (_, plain) = both(bowed)
    np.testing.assert_array_equal(compiled, plain)
    assert 5 < np.any(compiled != before, axis=(1, 2)).sum() < 35


def test_without_the_bridge_functions_stay_as_they_are_and_call_through_pymunk(monkeypatch):
    monkeypatch.setattr(chipmunk, "BRIDGED", False)
    assert chipmunk.compiled(pressed) is pressed
    table = Tabletop(FARM.layout, FARM.size)
    body = int(table.space.bodies["address"][0])
    chipmunk.foreign("cpBodySetVelocity")(body, 1.0, 2.0)
    assert chipmunk.foreign("cpBodyGetVelocity")(body) == (1.0, 2.0)


def test_a_filter_says_what_a_shape_is_and_what_it_collides_with():
    body = chipmunk.foreign("cpBodyNew")(1.0, 1.0)
    shape = chipmunk.foreign("cpCircleShapeNew")(body, 0.1, 0.0, 0.0)
    for others, expected in ((0b0101, 0b0101), (-1, 0xFFFFFFFF)):
        both = chipmunk.touches(0b0010, others)
        assert both == getattr(chipmunk.touches, "py_func", chipmunk.touches)(0b0010, others)
        chipmunk.foreign("cpShapeSetFilter")(shape, 0, both)
        got = lib.cpShapeGetFilter(ffi.cast("cpShape *", shape))
        assert (got.group, got.categories, got.mask) == (0, 0b0010, expected)
    chipmunk.foreign("cpShapeFree")(shape)
    chipmunk.foreign("cpBodyFree")(body)


def test_functions_that_take_anything_else_are_refused():
    with pytest.raises(ImportError, match="which farm-ar does not know"):
        chipmunk.foreign("cpBoxShapeNew2")


def test_a_hand_that_rests_goes_by_as_if_every_tick_of_it_were_played(monkeypatch):
    def play() -> list[np.ndarray]:
        game = FarmGame(SMALL, AHEAD, np.random.default_rng(0))
        game.allow(MotionLimit(metres=0.2))
        game.bring_hand()
        for vz in (0.0, 0.9, 0.0, -0.9, 0.0):
            for _ in range(8):
                game.steer(0.1 * vz, vz, 0.0, False, 6)
        return [*game.state().values()]

    quick = play()
    monkeypatch.setattr(phases, "steer", getattr(phases.steer, "py_func", phases.steer))
    monkeypatch.setattr(phases, "rests", lambda *_: False)
    for one, other in zip(quick, play(), strict=True):
        np.testing.assert_array_equal(one, other)
