"""What may be chosen of an environment: arguments, defaults and checks, in one place."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from numbers import Integral, Real
from typing import Any

import numpy as np

from farm_ar.envs.actions import ACTIONS
from farm_ar.envs.generator import JITTERS
from farm_ar.envs.observations import OBSERVATIONS
from farm_ar.envs.perceptions import ORACLE_NOISE, check_perception
from farm_ar.envs.rewards import REWARDS
from farm_ar.envs.window import has_display, has_packages
from farm_ar.errors import OptionError, known_name
from farm_ar.game_logic.farm_game import CARRIES
from farm_ar.game_logic.headset import FIELDS_OF_VIEW
from farm_ar.game_logic.live import UPDATES
from farm_ar.game_logic.perception import Perception
from farm_ar.reid import ReidFactory, reid_factory
from farm_ar.scenes import Scene

CONTROLS: dict[str, tuple[str, ...]] = {control: tuple(actions) for control, actions in ACTIONS.items()}
"""The ways to play, and the actions of each, the default first."""

MOST = {
    "visits": 1e6,
    "moves": 1e6,
    "budget_m": 1e9,
    "budget_rad": 1e9,
    "budget": 1e9,
    "hand_seconds": 3600.0,
    "effort_weight": 1e6,
    "play_seconds": 3600.0,
    "head_noise_deg": 360.0,
    "animals_a_second": 1e4,
}
"""The largest that a number may be, so that an episode ends and nothing overflows."""

KNOWLEDGE = ("white-box", "black-box")


SESSIONS = ("off", "learn")

STEERING = (10, 20, 30, 60)

GAZES = ("random", "still")


def render_modes() -> tuple[str, ...]:
    """The ways to look at an environment here: a page takes a display and the extra `web`."""
    return ("rgb_array", "human") if has_packages() and has_display() else ("rgb_array",)


_AS_EVER = (
    ("session", "off"),
    ("carry", "drag"),
    ("steps_per_second", 10),
    ("gaze", "random"),
    ("oracle_noise", "none"),
    ("render_mode", "human"),
    ("update", "pause"),
)


@dataclass(frozen=True, kw_only=True)
class EnvConfig:
    """What may be chosen of an environment: its arguments, their defaults, and the checks of both.

    Numbers become Python's own, and `action` the control's first where none is given. All values are JSON,
    except for objects in place of names.

    Args:
        scene: a built-in scene's name, a `.json` file, or a `Scene`.
        control: how a visit is played, one of `CONTROLS`.
        action: how an action is encoded, one of those that the control understands.
        observation: one of `OBSERVATIONS`.
        knowledge: whether what the game believes is observed, one of `KNOWLEDGE`.
        reward: one of `REWARDS`.
        sign: 1 rewards wrong labels (an adversary), -1 right ones (a helper).
        effort_weight: cost of a unit of effort, a wrong label being 1.
        reid: a re-identifier's name, or a function from a `Scene` to a `Reidentifier`.
        session: whether the game learns from its answers how far things are moved, one of `SESSIONS`; only
            `adaptive`, or a function that makes such a re-identifier, learns.
        perception: one of `PERCEPTIONS`, or a `Perception`.
        oracle_noise: of the perception `oracle`, one of `ORACLE_NOISE`: none, or errors as large and frequent
            as were measured on pictures of the farm.
        budget_m: what a visit may move all objects together, metres.
        budget_rad: what it may turn them, radians.
        budget: one effort in place of both, metres / diagonal + radians / pi.
        visits: how many an episode has; None for no end.
        moves: how many a visit has in control `move`.
        hand_seconds: time of a visit in control `hand`.
        steps_per_second: steps in a second of it, one of `STEERING`.
        carry: how the hand moves what it holds, one of `CARRIES`; without the game nothing is carried.
        animals_a_second: how many animals leave the shed.
        jitter: how starting layouts are drawn, one of `JITTERS`.
        play_seconds: play after a snapshot.
        head_noise_deg: SD of the head's turn between the begin of a visit and its snapshot, degrees.
        fov: the headset's field of view, one of `FIELDS_OF_VIEW`.
        gaze: whether each visit has a camera of its own, or the first visit's, one of `GAZES`.
        update: whether the game looks once, after a visit, or all the time, one of `UPDATES`.
        game: whether there are physics, animals and counters.
        render_mode: one of `render_modes()`, or None.

    Raises:
        OptionError: a name is not known, or a number is out of its limits.
    """

    scene: str | Scene = "farm"
    control: str = "move"
    action: str | None = None
    observation: str = "state"
    knowledge: str = "white-box"
    reward: str = "identity"
    sign: int = 1
    effort_weight: float = 0.25
    reid: str | ReidFactory = "spatial"
    session: str = "off"
    perception: str | Perception = "oracle"
    oracle_noise: str = "none"
    budget_m: float = 0.6
    budget_rad: float = float(np.pi / 2)
    budget: float | None = None
    visits: int | None = 1
    moves: int = 6
    hand_seconds: float = 12.0
    steps_per_second: int = 10
    carry: str = "drag"
    animals_a_second: float = 10.0
    jitter: str = "default"
    play_seconds: float = 5.0
    head_noise_deg: float = 0.0
    fov: str = "photo"
    gaze: str = "random"
    update: str = "pause"
    game: bool = True
    render_mode: str | None = None

    def __post_init__(self) -> None:
        self._check_name("control", CONTROLS)
        actions = CONTROLS[self.control]
        if self.action is None:
            object.__setattr__(self, "action", actions[0])
        self._check_name("action", actions)
        self._check_name("observation", OBSERVATIONS)
        self._check_name("knowledge", KNOWLEDGE)
        self._check_name("reward", REWARDS)
        self._check_name("jitter", JITTERS)
        self._check_name("fov", FIELDS_OF_VIEW)
        self._check_name("session", SESSIONS)
        self._check_name("carry", CARRIES)
        self._check_name("gaze", GAZES)
        self._check_name("update", UPDATES)
        modes = render_modes()
        none = "" if len(modes) > 1 else "; there is no window (it takes a display and the extra web)"
        expected = f"must be {' or '.join(modes)}, through gym.make also rgb_array_list, or None{none}"
        self._check("render_mode", self.render_mode in (None, *modes), expected)
        reid_factory(self.reid)
        if self.session == "learn":
            learns = not isinstance(self.reid, str) or self.reid == "adaptive"
            self._check(
                "session", learns, f"must be off with reid {self.reid}: adaptive is the one that learns"
            )
        check_perception(self.perception)
        self._check_name("oracle_noise", ORACLE_NOISE)
        if self.oracle_noise != "none":
            expected = 'must be none where the perception is not "oracle"'
            self._check("oracle_noise", self.perception == "oracle", expected)
        if self.visits is not None:
            self._make_int("visits", 1, "must be a whole number not below 1, or None")
        self._make_int("moves", 1, "must be a whole number not below 1")
        self._make_int("steps_per_second", 1, "must be a whole number not below 1")
        self._check("steps_per_second", self.steps_per_second in STEERING, f"must be one of {STEERING}")
        self._make_int("sign", -1, "must be 1 (an adversary) or -1 (a helper)")
        self._check("sign", self.sign in (-1, 1), "must be 1 (an adversary) or -1 (a helper)")
        for name in ("budget_m", "budget_rad", "hand_seconds"):
            self._make_float(name, zero=False, expected="must be a positive number")
        for name in ("effort_weight", "play_seconds", "head_noise_deg", "animals_a_second"):
            self._make_float(name, zero=True, expected="must be a number not below 0")
        if self.budget is not None:
            self._make_float("budget", zero=False, expected="must be a positive number, or None")
        self._check("game", isinstance(self.game, bool), "must be True or False")
        if not self.game:
            self._check("control", self.control == "layout", 'must be "layout" without the game')
            self._check("update", self.update == "pause", 'must be "pause" without the game')
            without = [
                name for name, terms in REWARDS.items() if not any(t.needs_game for t in terms.values())
            ]
            known = ", ".join(without[:-1]) + f" or {without[-1]}"
            self._check("reward", self.reward in without, f"must be {known} without the game")

    @property
    def white_box(self) -> bool:
        """Whether what the game believes is observed."""
        return self.knowledge == "white-box"

    def arguments(self) -> dict[str, Any]:
        """The arguments, by name, of which an equal one is made, less those that are as they ever were.

        A window is not among them: copies and replays have none.
        """
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: value for name, value in values.items() if (name, value) not in _AS_EVER}

    def _check_name(self, name: str, names: Iterable[str]) -> None:
        value = getattr(self, name)
        known_name(name, value if isinstance(value, str) else repr(value), names)

    def _make_int(self, name: str, lowest: int, expected: str) -> None:
        value = getattr(self, name)
        right = isinstance(value, Integral) and not isinstance(value, bool)
        self._check(name, right and int(value) >= lowest, expected)
        self._check_most(name)
        object.__setattr__(self, name, int(value))

    def _make_float(self, name: str, zero: bool, expected: str) -> None:
        value = getattr(self, name)
        right = isinstance(value, Real) and not isinstance(value, bool) and value < np.inf
        self._check(name, right and (value > 0 or (zero and value == 0)), expected)
        self._check_most(name)
        object.__setattr__(self, name, float(value))

    def _check_most(self, name: str) -> None:
        most = MOST.get(name, np.inf)
        self._check(name, getattr(self, name) <= most, f"must be at most {most:g}")

    def _check(self, name: str, right: bool, expected: str) -> None:
        if not right:
            raise OptionError(name, expected, getattr(self, name))
