"""The observations, by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from farm_ar.envs.features import NO_RIVAL, Features, part_shapes
from farm_ar.game_logic.farm_game import FarmGame
from farm_ar.scenes import Layout, Scene

if TYPE_CHECKING:
    from farm_ar.envs.config import EnvConfig
    from farm_ar.envs.worlds import World

Left = tuple[float, float, float, float]
"""What is left of metres, radians, moves (or time) and visits, as shares."""


class Observation(Protocol):
    """What an agent sees.

    Attributes:
        space: of what is observed.
    """

    space: spaces.Space[Any]

    def observe(self, features: Features, left: Left, world: World) -> Any:
        """The observation of the present state.

        Args:
            features: of the table.
            left: what is left of metres, radians, moves (or time) and visits, as shares.
            world: what is observed.
        """
        ...


BOUNDS: dict[str, tuple[float, float]] = {
    "position": (-2.0, 2.0),
    "heading": (-1.0, 1.0),
    "category": (0.0, 1.0),
    "in_view": (0.0, 1.0),
    "fixed": (0.0, 1.0),
    "camera": (-4.0, 4.0),
    "budget": (0.0, 1.0),
    "believed_position": (-2.0, 2.0),
    "believed_heading": (-1.0, 1.0),
    "difference": (-2.0, 2.0),
    "cost": (0.0, NO_RIVAL),
    "margin": (0.0, 1.0),
    "hand": (-4.0, 4.0),
}
"""The lowest and the highest value of each part of a state observation."""

BELIEVED = {"believed_position", "believed_heading", "difference", "cost", "margin"}
"""The parts about what the game believes."""

MIRROR: dict[str, tuple[int, ...]] = {
    "position": (-1, 1),
    "heading": (-1, 1),
    "believed_position": (-1, 1),
    "believed_heading": (-1, 1),
    "difference": (-1, 1, -1),
    "camera": (-1, 1, -1, 1),
    "hand": (-1, 1, -1, 1, -1, 1, 1, 1),
}
"""What changes its sign when the table is seen in a mirror: x, a turn, the sine of a heading."""


def mirror(observation: Mapping[str, npt.NDArray[Any]]) -> dict[str, npt.NDArray[Any]]:
    """The state observation, (..., L) arrays, of the table's mirror image; objects keep their numbers."""
    turned = dict(observation)
    for name in observation.keys() & MIRROR.keys():
        values, signs = observation[name], np.array(MIRROR[name], dtype=observation[name].dtype)
        turned[name] = (values.reshape(*values.shape[:-1], -1, len(signs)) * signs).reshape(values.shape)
    return turned


class StateObservation:
    """Numbers: a Dict of flat Boxes of about 1, every bound finite; object by object where there are several.

    Args:
        layout: the objects, for their number and kinds.
        white_box: whether what the game believes is part of it.
        hand: whether the hand is part of it.

    Attributes:
        places: where each part is among all numbers, by name.
    """

    def __init__(self, layout: Layout, white_box: bool, hand: bool) -> None:
        shapes = part_shapes(layout)
        ends = np.cumsum([int(np.prod(shape)) for shape in shapes.values()]).tolist()
        places = {
            name: slice(end - int(np.prod(shape)), end)
            for (name, shape), end in zip(shapes.items(), ends, strict=True)
        }
        unseen = (set() if white_box else BELIEVED) | (set() if hand else {"hand"})
        self.places = {name: place for name, place in places.items() if name not in unseen}
        self._names = list(self.places)
        self._parts_of = itemgetter(*self.places.values())
        boxes = {
            name: spaces.Box(*BOUNDS[name], (places[name].stop - places[name].start,), np.float32)
            for name in self._names
        }
        self.space: spaces.Space[Any] = spaces.Dict(dict(boxes))
        self._hand = hand

    def observe(self, features: Features, left: Left, world: World) -> dict[str, npt.NDArray[np.float32]]:
        """The observation of one moment, (L,) arrays by name."""
        features.parts.budget[:] = left
        if self._hand:
            assert isinstance(world, FarmGame)
            world.describe_hand(features.parts.hand)
        return dict(zip(self._names, self._parts_of(features.numbers.copy()), strict=True))


class FlatObservation:
    """The same numbers in one Box, for learners that know no Dict; joined by name, as Gymnasium flattens one.

    Args:
        state: the numbers by name.

    Attributes:
        places: as of the numbers by name.
    """

    def __init__(self, state: StateObservation) -> None:
        self._state, self.places = state, state.places
        self.space: spaces.Space[Any] = spaces.flatten_space(state.space)

    def observe(self, features: Features, left: Left, world: World) -> npt.NDArray[np.float32]:
        """(L,) the observation of one moment."""
        parts = self._state.observe(features, left, world)
        return np.concatenate([parts[name] for name in sorted(parts)])


class PixelObservation:
    """The table from above, (H, W, 3) bytes.

    Args:
        scene: the table.
        white_box: whether what the game believes is drawn too.
    """

    HEIGHT = 96

    def __init__(self, scene: Scene, white_box: bool) -> None:
        from farm_ar.drawing.game.above import TableFromAbove

        width = round(self.HEIGHT * scene.size[0] / scene.size[1])
        self._white_box = white_box
        self._picture = TableFromAbove(scene, (width, self.HEIGHT))
        self.space: spaces.Space[Any] = spaces.Box(0, 255, (self.HEIGHT, width, 3), np.uint8)

    def observe(self, features: Features, left: Left, world: World) -> Any:
        """The picture of now; the other arguments are not looked at."""
        return self._picture.draw_pixel_observation(world.render_state(), self._white_box)


class HeadsetObservation:
    """What the headset's camera sees, (H, W, 3) bytes: what is real, and nothing of what the game believes.

    Args:
        scene: the table.
    """

    SIDE = 84

    def __init__(self, scene: Scene) -> None:
        from farm_ar.drawing.game.real_things import CameraPicture

        self._picture = CameraPicture(scene, (self.SIDE, self.SIDE))
        self.space: spaces.Space[Any] = spaces.Box(0, 255, (self.SIDE, self.SIDE, 3), np.uint8)

    def observe(self, features: Features, left: Left, world: World) -> Any:
        """The picture of now; the other arguments are not looked at."""
        return self._picture.draw(world.render_state())


def _state(scene: Scene, config: EnvConfig) -> StateObservation:
    return StateObservation(scene.layout, config.white_box, config.control == "hand")


OBSERVATIONS: dict[str, Callable[[Scene, EnvConfig], Observation]] = {
    "state": _state,
    "flat": lambda scene, config: FlatObservation(_state(scene, config)),
    "pixels": lambda scene, config: PixelObservation(scene, config.white_box),
    "headset": lambda scene, config: HeadsetObservation(scene),
}
"""The observations by name."""
