"""What kernels of a batch distinguish: stages, actions, rewards, ways of drawing."""

from __future__ import annotations

from enum import IntEnum


class Stage(IntEnum):
    """What comes next for an environment within a call.

    Where the arrays have no room for more animals it stays in a stage, and goes on from there in the next
    call.
    """

    DONE = 0
    ACT = 1
    LATE = 2
    PLAY = 3
    CLOSE = 4
    BEGIN = 5
    WARM_UP = 6
    SHOW = 7


class ActionKind(IntEnum):
    """The actions by name, as kernels know them."""

    DISPLACEMENT = 0
    SLOT = 1
    CONTINUOUS = 2
    OFFSETS = 3
    DISCRETE = 4
    EXCHANGE = 5


class RewardKind(IntEnum):
    """The rewards by name, as kernels know them."""

    IDENTITY = 0
    MARGIN = 1
    CLUTTER = 2
    MISCOUNT = 3
    ENDPOINT = 4
    SHAPED = 5


class Draw(IntEnum):
    """How layouts are drawn (`STILL`: not at all), and how cameras (`NEARBY` the table, or `ON_PATH`)."""

    STILL = 0
    NEARBY = 1
    ANYWHERE = 2
    ON_PATH = 3
