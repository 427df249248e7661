"""Traces: an episode as JSON values, which plays again to the same state."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.errors import OptionError
from farm_ar.scenes import Camera, Layout

if TYPE_CHECKING:
    from farm_ar.envs.farm_to_table import FarmToTableEnv

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

    def add(self, action: Any) -> None:
        """One more action."""
        self.actions.append(np.asarray(action).tolist())

    def as_json(self, arguments: Mapping[str, Any], digest: str) -> dict[str, Json]:
        """All that `replay` needs, as JSON values.

        Raises:
            OptionError: an argument is an object, which has no name to be found by.
        """
        for name, value in arguments.items():
            if not isinstance(value, str | int | float | bool | None):
                raise OptionError(name, "must be a name for a trace", type(value).__name__)
        return {
            "arguments": dict(arguments),
            "generator": self.generator,
            "options": self.options,
            "actions": self.actions,
            "hash": digest,
        }

    def play_in(self, env: FarmToTableEnv) -> None:
        """Play the episode in an environment made with the same arguments."""
        env.np_random.bit_generator.state = self.generator
        env.reset(options=self.options)
        for action in self.actions:
            env.step(np.asarray(action))


def replay(trace: Mapping[str, Json], env: FarmToTableEnv | None = None) -> str:
    """Play a trace again; the hash of the state at its end, which is the trace's own if all is well.

    Args:
        trace: as `FarmToTableEnv.trace` gives it.
        env: where to play it; by default an environment made with the trace's arguments.
    """
    from farm_ar.envs.farm_to_table import FarmToTableEnv

    env = env or FarmToTableEnv(**trace["arguments"])
    Trace(trace["generator"], trace["options"], trace["actions"]).play_in(env)
    return env.state_hash()


def state_digest(state: Iterable[FloatArray], rng: np.random.Generator) -> str:
    """A digest of arrays and of the state of a generator."""
    digest = hashlib.sha256()
    for values in state:
        digest.update(np.ascontiguousarray(values).tobytes())
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
