"""Traces: an episode as JSON values, which plays again to the same state."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from farm_ar import __version__
from farm_ar.arrays import ANGLE, FINITE, POSITION, RANGE, Limits
from farm_ar.errors import InputError, OptionError
from farm_ar.scenes import Camera, Layout
from farm_ar.scenes.documents import Document, Listing, Named, Object
from farm_ar.scenes.files import read_json, write_text
from farm_ar.scenes.kinds import Anything, Either, Number, Numbers, OrNull, Text, Whole

if TYPE_CHECKING:
    from farm_ar.envs.recorded import RecordedEnv

Json = Any


@dataclass
class Trace:
    """How an episode began, and what was done in it.

    Args:
        generator: state of the generator when it began.
        options: what `reset` was given, as JSON values.
        actions: the actions so far, as JSON values.
    """

    generator: dict[str, Any]
    options: dict[str, Any] = field(default_factory=dict)
    actions: list[Json] = field(default_factory=list)

    @classmethod
    def begin(cls, rng: np.random.Generator, options: Mapping[str, Any]) -> Trace:
        """The trace of an episode that begins now."""
        return cls(dict(rng.bit_generator.state), {name: _as_json(value) for name, value in options.items()})

    def as_json(self, arguments: Mapping[str, Any], digest: str, again: RecordedEnv) -> dict[str, Json]:
        """All that `replay` needs, as JSON values.

        Args:
            arguments: of the environment.
            digest: of the state now.
            again: an environment like it, in which the episode is played again for the hash of every step.

        Raises:
            OptionError: an argument is an object, which has no name to be found by.
        """
        for name, value in arguments.items():
            if not isinstance(value, str | int | float | bool | None):
                raise OptionError(name, "must be a name for a trace", type(value).__name__)
        trace: dict[str, Json] = {
            "version": __version__,
            "arguments": dict(arguments),
            "generator": self.generator,
            "options": self.options,
            "actions": list(self.actions),
            "hash": digest,
        }
        return trace | {"hashes": list(self.states(again))}

    def play_in(self, env: RecordedEnv) -> None:
        """Play the episode in an environment made with the same arguments."""
        for _ in self.states(env):
            pass

    def states(self, env: RecordedEnv) -> Iterator[str]:
        """Play the episode; the hash of the state after the reset and after each step."""
        env.np_random.bit_generator.state = self.generator
        env.reset(options=self.options)
        yield env.state_hash()
        for action in list(self.actions):
            env.step(np.asarray(action))
            yield env.state_hash()


class TraceError(InputError):
    """A trace that cannot be used."""


_FINITE = Number(FINITE)
_POINT = Numbers(2, POSITION, "[x, z] in metres, from -1e6 to 1e6")
_UP_OR_DOWN = OrNull(Number(Limits(0.0, np.pi / 2, "")), "an angle from 0 to pi / 2", default=None)

TRACE = Document(
    "trace",
    Object(
        {
            "version": Text(about="Of farm-ar, which made it."),
            "arguments": Named(Anything(), about="Of the environment, by name."),
            "generator": Object(
                {
                    "bit_generator": Text(("PCG64",)),
                    "state": Object({"state": Whole(0, 2**128 - 1), "inc": Whole(0, 2**128 - 1)}),
                    "has_uint32": Whole(0, 1),
                    "uinteger": Whole(0, 2**32 - 1),
                },
                about="State of the random generator before the reset, as NumPy gives it.",
            ),
            "options": Object(
                {
                    "layout": OrNull(
                        Object({"position": Listing(_POINT), "yaw": Listing(Number(ANGLE))}),
                        "a JSON object",
                        default=None,
                    ),
                    "camera": OrNull(
                        Object(
                            {
                                "position": _POINT,
                                "yaw": Number(ANGLE),
                                "height": OrNull(Number(POSITION), "a number of metres", default=None),
                                "pitch": Number(ANGLE, default=0.0),
                                "fov": Object(
                                    {
                                        "left": Number(Limits(0.0, np.pi, "")),
                                        "right": Number(Limits(0.0, np.pi, "")),
                                        "range_m": Number(RANGE),
                                        "up": _UP_OR_DOWN,
                                        "down": _UP_OR_DOWN,
                                    },
                                    default=None,
                                ),
                            }
                        ),
                        "a JSON object",
                        default=None,
                    ),
                },
                about="What reset was given, metres and radians.",
            ),
            "actions": Listing(
                Either((_FINITE, Listing(_FINITE)), "a number or a list of numbers"),
                about="Of all steps, in order.",
            ),
            "hash": Text(about="Of the state now."),
            "hashes": Listing(Text(), about="Of the state after the reset and after each step."),
        },
        notes=True,
        about="An episode of an environment, which plays again to the same state.",
    ),
    TraceError,
)
"""What a trace holds."""


def first_difference(trace: Mapping[str, Json]) -> int | None:
    """Play a trace again and find where it goes another way than it did when it was made.

    Args:
        trace: as `FarmToTableEnv.trace` gives it.

    Returns:
        The first step after which the state is another, 0 for the reset; None if all are bit-exact.
    """
    from farm_ar.envs.env import FarmToTableEnv

    env = FarmToTableEnv(**trace["arguments"])
    states = Trace(trace["generator"], trace["options"], trace["actions"]).states(env)
    for step, (then, now) in enumerate(zip(trace["hashes"], states, strict=True)):
        if then != now:
            return step
    return None


def save_trace(trace: Mapping[str, Json], path: str | os.PathLike[str]) -> None:
    """Write a trace as JSON, whole or not at all."""
    write_text(path, json.dumps(trace) + "\n")


def load_trace(path: str | os.PathLike[str]) -> dict[str, Json]:
    """Read a trace.

    Raises:
        TraceError: it cannot be read, or is not a trace.
    """
    trace: dict[str, Json] = read_json(path, TraceError)
    name = Path(path).name
    TRACE.read(trace, name)
    if len(trace["hashes"]) != len(trace["actions"]) + 1:
        expected = f"must hold {len(trace['actions']) + 1} hashes, one for the reset and one per action"
        raise TraceError("hashes", expected, len(trace["hashes"]), name)
    return trace


def replay(trace: Mapping[str, Json], env: RecordedEnv | None = None) -> str:
    """Play a trace again; the hash of the state at its end, which is the trace's own if all is well.

    Args:
        trace: as `FarmToTableEnv.trace` gives it.
        env: where to play it; by default an environment made with the trace's arguments.
    """
    from farm_ar.envs.env import FarmToTableEnv

    env = env or FarmToTableEnv(**trace["arguments"])
    Trace(trace["generator"], trace["options"], trace["actions"]).play_in(env)
    return env.state_hash()


GAME_STATE = (
    *("position", "yaw", "believed_position", "believed_yaw", "holder"),
    *("counted", "misplaced", "stranded", "animal_goal", "animal_curve"),
    *("camera_position", "camera_yaw", "camera_pitch", "camera_height", "ticks", "gripped"),
    *("time", "animal_speed", "animals", "next_arrival", "seconds_between", "animals_sent", "astray"),
    *("hand_in_view", "ticks_away", "ticks_pending", "foreseen", "hand"),
)
PLAIN_STATE = (
    *("position", "yaw", "camera_position", "camera_yaw"),
    *("believed_position", "believed_yaw", "holder"),
)
WHOLE_NUMBERS = ("ticks", "gripped")
"""What a state hash digests, in this order: names of a world's `state`, with the game and without it, each as
float64 or, of these, as int64; then the shares left of metres, radians, moves or time, and visits; then the
generator's state. Traces hold such hashes, so the order stays as it is, whatever becomes of the records that
the values come from; a value that is new comes last, and makes all hashes others.
"""


def state_digest(state: Mapping[str, Any], left: Sequence[float], rng: np.random.Generator) -> str:
    """A digest of all that may change in an episode.

    Args:
        state: a world's; its names are those of `GAME_STATE` or of `PLAIN_STATE`.
        left: shares left of metres, radians, moves or time, and visits.
        rng: where the randomness comes from.
    """
    digest = hashlib.sha256()
    for name in GAME_STATE if "ticks" in state else PLAIN_STATE:
        dtype = np.int64 if name in WHOLE_NUMBERS else np.float64
        digest.update(np.ascontiguousarray(state[name], dtype=dtype).tobytes())
    digest.update(np.array(left, dtype=np.float64).tobytes())
    digest.update(repr(rng.bit_generator.state).encode())
    return digest.hexdigest()


def _as_json(value: Any) -> Json:
    if isinstance(value, Layout):
        return {"position": value.position.tolist(), "yaw": value.yaw.tolist()}
    if isinstance(value, Camera):
        return {
            "position": value.position.tolist(),
            "yaw": float(value.yaw),
            "height": None if value.height is None else float(value.height),
            "pitch": float(value.pitch),
            "fov": asdict(value.fov),
        }
    if isinstance(value, Mapping):
        return {name: _as_json(inner) for name, inner in value.items()}
    return np.asarray(value).tolist()
