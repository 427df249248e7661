"""What kernels of a batch work on, from a scene and what was chosen."""

from __future__ import annotations

import math
from typing import Any, cast

import numpy as np

from farm_ar.arrays import BoolArray
from farm_ar.envs.actions import (
    LAYOUT_ACTIONS,
    MOVE_ACTIONS,
    ContinuousAction,
    DisplacementAction,
    SlotAction,
)
from farm_ar.envs.batched.kinds import ActionKind, Draw, RewardKind
from farm_ar.envs.batched.state import Batch, Choices, Given, Herds, Output, Report, Scenery, Table
from farm_ar.envs.config import EnvConfig
from farm_ar.envs.features import Features, Float32Array, Found, part_shapes
from farm_ar.envs.generator import (
    GAP_M,
    PLACES_ON_PATH,
    SPREADS,
    YAW_LIMIT,
    StartingLayouts,
    VisitCameras,
    unit_of,
)
from farm_ar.envs.table import Objects
from farm_ar.game_logic.animals import routes
from farm_ar.game_logic.animals.arrival import Animal, Clock, Counts, Due
from farm_ar.game_logic.animals.curve_intersection import Footprint
from farm_ar.game_logic.animals.routes import ROUTES, Route
from farm_ar.game_logic.farm_game import ANIMAL_SPEED_M_S
from farm_ar.game_logic.headset import EYE_HEIGHT_M, field_of_view
from farm_ar.game_logic.physics.state import Body, State
from farm_ar.game_logic.visibility import eyes_of
from farm_ar.geometry.camera import Eye
from farm_ar.reid import reid_factory
from farm_ar.reid.assignment import CostModel
from farm_ar.reid.costs import sorted_log_sides
from farm_ar.reid.spatial import SpatialReid
from farm_ar.scenes import Scene
from farm_ar.structs import Structs, new_structs, words_of

ACTIONS = {
    ("move", "displacement"): ActionKind.DISPLACEMENT,
    ("move", "slot"): ActionKind.SLOT,
    ("move", "continuous"): ActionKind.CONTINUOUS,
    ("move", "discrete"): ActionKind.DISCRETE,
    ("layout", "offsets"): ActionKind.OFFSETS,
    ("layout", "discrete"): ActionKind.EXCHANGE,
}
"""The actions that kernels understand, by control and name."""

REWARDS = {
    "identity": RewardKind.IDENTITY,
    "margin": RewardKind.MARGIN,
    "clutter": RewardKind.CLUTTER,
    "miscount": RewardKind.MISCOUNT,
    "endpoint": RewardKind.ENDPOINT,
    "shaped": RewardKind.SHAPED,
}
"""The rewards, by name."""

_ANIMALS = 64  # for so many there is room at first


def choices_of(config: EnvConfig, scene: Scene, same_step: bool) -> Structs[Choices]:
    """(1,) what was chosen, for kernels."""
    made = new_structs(Choices, 1)
    own, unit = made[0], unit_of(scene)
    action = (MOVE_ACTIONS if config.control == "move" else LAYOUT_ACTIONS)[str(config.action)]
    own.action = ACTIONS[config.control, str(config.action)]
    own.game, own.reward = config.game, REWARDS[config.reward]
    own.most_alike = int(np.bincount(scene.layout.category_code[scene.layout.movable]).max())
    own.sign, own.effort_weight = float(config.sign), config.effort_weight
    own.by_effort, own.budget = config.budget is not None, config.budget or 1.0
    own.budget_m, own.budget_rad = config.budget_m, config.budget_rad
    own.visits, own.moves = config.visits or 0, config.moves if config.control == "move" else 1
    own.layouts = Draw.ANYWHERE if config.jitter == "hard" else Draw.NEARBY
    if config.jitter == "none":
        own.layouts = Draw.STILL
    metres, radians = SPREADS.get(config.jitter, (0.0, 0.0))
    own.spread_m, own.spread_rad = metres * unit, float(radians)
    own.yaw_limit, own.gap_m = YAW_LIMIT, GAP_M
    own.apart_m = StartingLayouts(scene, config.jitter).apart
    on_path = scene.camera_path is not None and not config.game
    own.cameras = Draw.ON_PATH if on_path else Draw.NEARBY
    own.width, own.depth = scene.size
    own.eye_height_m = EYE_HEIGHT_M * own.depth / 0.8
    own.head_noise, own.new_gaze = float(np.deg2rad(config.head_noise_deg)), config.gaze == "random"
    own.animals_a_second = config.animals_a_second if config.game else 0.0
    own.play_seconds = config.play_seconds
    own.lazy = config.visits == 1
    own.reach_m, own.reach_rad = action.reach_m * unit, action.reach_rad
    own.pick_m = ContinuousAction.PICK_M * unit
    own.diagonal_m, own.same_step = scene.diagonal, same_step
    shapes = part_shapes(scene.layout)
    before_budget = list(shapes)[: list(shapes).index("budget")]
    own.budget_at = sum(math.prod(shapes[name]) for name in before_budget)
    own.shed = int(np.flatnonzero(scene.layout.fixed)[0]) if config.game else -1
    return made


def scenery_of(config: EnvConfig, scene: Scene) -> Scenery:
    """What does not change of a scene, for kernels."""
    layout, weights = scene.layout, scene.cost_weights
    reid = reid_factory(config.reid)(scene)
    assert isinstance(reid, SpatialReid)
    known, model = reid.compiled_problem()
    metre = weights.translation / scene.diagonal
    layouts = StartingLayouts(scene, config.jitter)
    cameras = VisitCameras(scene, field_of_view(config.fov), config.game)
    path = np.empty((0, 3))
    if not config.game and scene.camera_path is not None:
        on_path = scene.camera_path.cameras(PLACES_ON_PATH, scene.fov)
        path = np.column_stack([on_path.position, on_path.yaw])
    return Scenery(
        position=layout.position.copy(),
        yaw=layout.yaw.copy(),
        kind=layout.category_code.astype(np.int64),
        size=layout.size.copy(),
        elevation=layout.elevation.copy(),
        fixed=layout.fixed.copy(),
        movable=np.flatnonzero(layout.movable),
        edge=layouts.edge.copy(),
        room=np.array(scene.size, dtype=np.float64),
        keeps_clear=layouts.keeps_clear.copy(),
        path=path,
        bows=routes.bows_on(scene.size),
        levels=DisplacementAction.LEVELS.copy(),
        shares=np.array(SlotAction.SHARES),
        log_sides=np.ascontiguousarray(sorted_log_sides(layout.size)),
        size_of=known.kind.copy(),
        sides=known.sides.copy(),
        model=model,
        clutter_model=CostModel(metre, float(weights.rotation), compare_sizes=True),
        features=Features(scene).room,
        eyes=eyes_of(cameras.draw(np.random.default_rng(0))).copy(),
    )


def new_batch(count: int, scene: Scene) -> Batch:
    """Environments that have yet to begin."""
    layout, m = scene.layout, len(scene.layout)
    bodies: Any = new_structs(Body, (count, m))
    bodies["half_width"], bodies["half_depth"] = layout.size[:, 0] / 2, layout.size[:, 2] / 2
    bodies["movable"], bodies["elevation"] = layout.movable, layout.elevation
    states = new_structs(State, count)
    states["width"], states["depth"] = scene.size
    states["hand"]["gripped"] = -1
    states["lifts"] = states["still"] = True
    objects = Objects.unmet(layout)
    found = Found(np.empty((m, 4)), np.empty(m), np.empty(m, dtype=np.bool_), np.empty((m, m)))
    return Batch(
        new_structs(Table, count),
        new_structs(Eye, count),
        states,
        bodies,
        words_of(bodies),
        np.zeros((count, m, 2)),
        np.zeros((count, m)),
        np.zeros((count, m), dtype=np.int64),
        *(np.zeros((count, *part.shape), dtype=part.dtype) for part in objects),
        *(np.zeros((count, *part.shape), dtype=part.dtype) for part in found),
    )


def new_herds(count: int, scene: Scene, game: bool) -> Herds:
    """Their animals, of which there are none yet."""
    m, goals = len(scene.layout), np.flatnonzero(scene.layout.movable)
    rows, room = (count, _ANIMALS) if game else (0, 0)
    clocks, animals = new_structs(Clock, rows), cast(Any, new_structs(Animal, (rows, room)))
    counts: Any = new_structs(Counts, (rows, m))
    buildings: Any = new_structs(Footprint, (rows, m))
    clocks["speed"], clocks["next"] = ANIMAL_SPEED_M_S, math.inf
    queue: Any = new_structs(Due, (rows, room))
    queue["slot"] = np.arange(room)
    leading: Any = new_structs(Route, (rows, len(goals), ROUTES))
    leading["goal"] = goals[:, None]
    return Herds(
        clocks,
        queue,
        animals,
        leading,
        np.zeros((rows, len(goals), ROUTES)),
        counts,
        buildings,
        np.zeros((count, m, 2)),
        np.zeros((count, m)),
    )


def with_more_room(herds: Herds) -> Herds:
    """The same animals, with room for twice as many."""
    count, held = herds.queue.shape
    queue: Any = new_structs(Due, (count, 2 * held))
    animals: Any = new_structs(Animal, (count, 2 * held))
    queue["slot"] = np.arange(2 * held)
    queue[:, :held], animals[:, :held] = herds.queue, herds.animals
    return herds._replace(queue=queue, animals=animals)


def new_output(count: int, scene: Scene, choices: int) -> Output:
    """Room for observations and info, with masks of so many choices."""
    shapes = part_shapes(scene.layout)
    length = sum(math.prod(shape) for shape in shapes.values())

    def numbers() -> Float32Array:
        return np.zeros((count, length), dtype=np.float32)

    def masks() -> BoolArray:
        return np.zeros((count, choices), dtype=np.bool_)

    return Output(
        numbers(),
        new_structs(Report, count),
        masks(),
        np.zeros(count),
        np.zeros(count, dtype=np.bool_),
        numbers(),
        new_structs(Report, count),
        masks(),
    )


def nothing_given(scene: Scene) -> Given:
    """What is drawn is not given."""
    m = len(scene.layout)
    return Given(np.zeros(2, dtype=np.bool_), np.zeros((m, 2)), np.zeros(m), new_structs(Eye, 1))
