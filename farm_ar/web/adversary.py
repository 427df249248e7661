"""Who rearranges the table against a player, and the hand that carries it out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from farm_ar.agents.policies import POLICIES, Policy
from farm_ar.arrays import FloatArray
from farm_ar.envs import FarmToTableEnv
from farm_ar.errors import MissingPackageError, OptionError
from farm_ar.game_logic.farm_game import FarmGame
from farm_ar.geometry import wrap
from farm_ar.scenes import Camera, Layout, Scene, visible
from farm_ar.web.pointer import Pointer

TRAINED, TRAINED_SCENE, PLANNED = "farm-slot", "farm", "analytic"
"""The adversary: on the farm a trained policy where the extra `train` is installed, else one that plans."""

MESS, MESS_M, MESS_RAD = 5, 0.16, np.pi / 4
"""How many objects are moved out of place to be tidied up, how far along x and z and turned at most."""

ROOM_M = 0.05
"""How far apart places are at which room is looked for."""

NEAR_M, NEAR_RAD, PATIENCE = 1e-3, 5e-3, 240
"""How near the hand has to come; after how many steps it gives up a way."""


class Carry(NamedTuple):
    """An object that the hand takes to a place: x and z in metres, heading in radians."""

    thing: int
    x: float
    z: float
    yaw: float


class Rearrangement(NamedTuple):
    """What an adversary does, one object after the other, and who it is."""

    by: str
    carries: Sequence[Carry]


def adversary_plan(
    layout: Layout, camera: Camera, reid: str, seed: int, scene: str = "farm"
) -> Rearrangement:
    """What the adversary does in one visit, within the environment's usual budget.

    Args:
        layout: where everything stands, and is believed to stand.
        camera: that takes the snapshot.
        reid: name of the method that is to be fooled.
        seed: of a policy that draws.
        scene: where; a policy that plans plays in any, the trained one on the farm.
    """
    arguments: dict[str, Any] = {"carry": "lift", "visits": 1, "reid": reid, "animals_a_second": 0.0}
    by, policy, env = _adversary(scene, arguments, seed)
    env.reset(seed=seed, options={"layout": layout, "camera": camera})
    carries, before, over = [], layout, False
    while not over:
        _, _, over, _, _ = env.step(policy.act(env))
        after = env.world.truth
        moved = np.any(after.position != before.position, axis=1) | (after.yaw != before.yaw)
        carries += [_carry(after, int(i)) for i in np.flatnonzero(moved)]
        before = after
    return Rearrangement(by, carries)


def _adversary(scene: str, arguments: dict[str, Any], seed: int) -> tuple[str, Policy, FarmToTableEnv]:
    """Who rearranges, and the environment in which it acts."""
    if scene == TRAINED_SCENE:
        with suppress(ImportError, MissingPackageError):
            from farm_ar.agents.policies.trained import policy_and_env

            return TRAINED, *policy_and_env(TRAINED, arguments=arguments)
    policy = POLICIES[PLANNED](np.random.default_rng(seed))
    return PLANNED, policy, FarmToTableEnv(scene=scene, action="slot", **arguments)


def mess_plan(scene: Scene, camera: Camera, rng: np.random.Generator) -> Rearrangement:
    """Some of the scene's objects moved a little by chance, and seen before and after."""
    layout = scene.layout
    position = layout.position + rng.uniform(-MESS_M, MESS_M, layout.position.shape)
    moved = layout.with_poses(
        np.clip(position, 0.0, scene.size), layout.yaw + rng.uniform(-MESS_RAD, MESS_RAD, len(layout))
    )
    seen = visible(layout, camera) & visible(moved, camera) & layout.movable
    chosen = rng.permutation(np.flatnonzero(seen))[:MESS]
    return Rearrangement("chance", [_carry(moved, int(i)) for i in chosen])


def exchange_plan(scene: Scene, camera: Camera) -> Rearrangement:
    """The two nearest objects in view that look alike take each other's place, by way of a third.

    Raises:
        OptionError: no two look alike, or there is no room for one of them beside.
    """
    layout = scene.layout
    movable = np.flatnonzero(visible(layout, camera) & layout.movable).tolist()
    pairs = [
        (float(np.hypot(*(layout.position[a] - layout.position[b]))), a, b)
        for a, b in combinations(movable, 2)
        if layout.category[a] == layout.category[b]
    ]
    if not pairs:
        raise OptionError("camera", "must see two objects that look alike", camera)
    _, a, b = min(pairs)
    aside = _room_for(scene, camera, a)
    first, second = _carry(layout, a), _carry(layout, b)
    return Rearrangement(
        "chance", [first._replace(x=aside[0], z=aside[1]), first._replace(thing=b), second._replace(thing=a)]
    )


def _room_for(scene: Scene, camera: Camera, index: int) -> tuple[float, float]:
    """The place nearest to where an object stands at which there is room beside, and that is in view."""
    layout = scene.layout
    grid = np.stack(np.meshgrid(*(np.arange(ROOM_M, side, ROOM_M) for side in scene.size)), axis=-1)
    places = grid.reshape(-1, 2)
    away = np.hypot(*(places - layout.position[index]).T)
    half = np.hypot(layout.size[:, 0], layout.size[:, 2]) / 2
    apart = np.linalg.norm(places[:, None] - layout.position, axis=-1) > half[index] + half
    inside = ((places > half[index]) & (places < np.array(scene.size) - half[index])).all(axis=1)
    for k in np.argsort(away, kind="stable"):
        if inside[k] and apart[k].all():
            position = layout.position.copy()
            position[index] = places[k]
            if visible(layout.with_poses(position, layout.yaw), camera)[index]:
                return float(places[k, 0]), float(places[k, 1])
    raise OptionError("layout", "must have room for one more", list(layout.labels))


def hand_carries(
    game: FarmGame, plan: Sequence[Carry], rest: FloatArray, metres: float = np.inf
) -> Iterator[Pointer]:
    """The pointer, step by step, that carries a plan out and then comes to rest over a point.

    Args:
        game: that is stepped after every pointer.
        plan: what is carried where.
        rest: (2,) x and z, metres.
        metres: that the hand goes in a step at most.
    """
    for one in plan:
        truth = game.truth
        start, yaw = truth.position[one.thing], float(truth.yaw[one.thing])
        turn = _hand(game)[2]
        yield from _until(game, metres, Pointer(float(start[0]), float(start[1]), False, turn))
        for _ in range(PATIENCE):
            yield Pointer(float(start[0]), float(start[1]), True, turn)
            if _held(game) is not None:
                break
        turned = turn + float(wrap(np.array(one.yaw - yaw)))
        yield from _until(game, metres, Pointer(one.x, one.z, True, turned))
        yield Pointer(one.x, one.z, False, turned)
    yield from _until(game, metres, Pointer(*rest.tolist()))


def _until(game: FarmGame, metres: float, pointer: Pointer) -> Iterator[Pointer]:
    """The pointer, until the hand is where it says."""
    for _ in range(PATIENCE):
        x, z, yaw = _hand(game)
        assert pointer.x is not None
        assert pointer.z is not None
        there = np.hypot(x - pointer.x, z - pointer.z) < NEAR_M
        if there and abs(wrap(np.array(yaw - pointer.turn))) < NEAR_RAD:
            return
        way = float(np.hypot(pointer.x - x, pointer.z - z))
        if way <= metres:
            yield pointer
        else:
            share = metres / way
            yield replace(pointer, x=x + share * (pointer.x - x), z=z + share * (pointer.z - z))


def _hand(game: FarmGame) -> tuple[float, float, float]:
    hand = game.tabletop.hand
    assert hand is not None
    return float(hand.position[0]), float(hand.position[1]), float(hand.yaw)


def _held(game: FarmGame) -> int | None:
    hand = game.tabletop.hand
    return None if hand is None else hand.gripped


def _carry(layout: Layout, index: int) -> Carry:
    x, z = layout.position[index].tolist()
    return Carry(index, x, z, float(layout.yaw[index]))
