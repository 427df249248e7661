"""Checkpoints of a run as plain data: numbers and JSON, whose loading runs no code.

`model.zip` is what Stable-Baselines3 saves. Of it only the tensors are read, with torch's `weights_only`; the
learner itself is made anew from the run's hyperparameters. Older folders hold pickles beside it
(`vecnormalize.pkl`, `replay_buffer.pkl`), which may run code and are read only where that is allowed.
"""

from __future__ import annotations

import json
import zipfile
from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.save_util import load_from_zip_file, recursive_setattr
from stable_baselines3.common.vec_env import VecEnv, VecNormalize

from farm_ar.agents.training.run_folder import RunError

MODEL, NORMALIZATION, REPLAY, STATE = "model.zip", "normalization.npz", "replay_buffer.npz", "state.json"
DEMONSTRATIONS = "demonstrations.npz"

PICKLES = {NORMALIZATION: "vecnormalize.pkl", REPLAY: "replay_buffer.pkl"}
"""What older folders hold in place of a file of numbers."""

COUNTS = ("_n_updates", "_episode_num")
"""What a learner counts beside its steps."""

BUFFER = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")
"""The arrays of a replay buffer, or dicts of arrays."""


@contextmanager
def as_written(saved: Path) -> Iterator[None]:
    """Whatever goes wrong in here is the fault of files that are not as they were written.

    Args:
        saved: the folder of the model.

    Raises:
        RunError: something went wrong.
    """
    try:
        yield
    except RunError:
        raise
    except Exception as problem:  # of zip files, arrays, tensors: each has errors of its own
        expected = "must be as it was written; without its folder the run goes on from the one before"
        raise RunError("model", expected, " ".join(repr(problem).split()), str(saved)) from problem


def pickles_in(saved: Path) -> list[str]:
    """Names of the pickles without which a checkpoint, of an older version, cannot be loaded."""
    return [old for new, old in PICKLES.items() if (saved / old).exists() and not (saved / new).exists()]


def write_model(model: BaseAlgorithm, folder: Path, seconds: float | None = None) -> None:
    """Write a model and what belongs to it.

    Args:
        model: the learner.
        folder: where.
        seconds: how long it has learnt; given for a checkpoint, which a learner with a memory writes too.
    """
    model.save(folder / MODEL)
    normalization = model.get_vec_normalize_env()
    if normalization is not None:
        np.savez(folder / NORMALIZATION, **_statistics_of(normalization))
    if seconds is None:
        return
    episodes: Any = model.ep_info_buffer or ()
    state = {
        "steps": model.num_timesteps,
        "seconds": round(seconds, 3),
        "episodes": [[float(one["r"]), int(one["l"])] for one in episodes],
    }
    (folder / STATE).write_text(json.dumps(state) + "\n", encoding="utf-8")
    if isinstance(model, OffPolicyAlgorithm):
        np.savez(folder / REPLAY, **_memory_of(model.replay_buffer))
    demonstrations: Any = getattr(model, "demonstrations", ())
    if len(demonstrations):
        demonstrations.save(folder / DEMONSTRATIONS)


def read_state(saved: Path) -> tuple[int, float]:
    """Steps and seconds of a checkpoint."""
    with as_written(saved):
        state = json.loads((saved / STATE).read_text(encoding="utf-8"))
        return int(state["steps"]), float(state["seconds"])


def read_tensors(saved: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """The state of each part of a learner by its name, and its other tensors."""
    with as_written(saved):
        _, parameters, others = load_from_zip_file(saved / MODEL, load_data=False, device="cpu")
        if "policy" not in parameters:
            raise ValueError(f"no policy in {MODEL}")
        return parameters, others or {}


def restore(model: BaseAlgorithm, saved: Path, trust: bool = False) -> None:
    """Put a learner that was made anew where a checkpoint left it.

    Args:
        model: made as the run's hyperparameters say.
        saved: the checkpoint.
        trust: whether a pickle of an older version may be loaded.
    """
    parameters, others = read_tensors(saved)
    with as_written(saved):
        model.set_parameters(parameters, exact_match=True, device="cpu")
        for name, tensor in others.items():
            if tensor is not None:
                recursive_setattr(model, f"{name}.data", tensor.data)
        state = json.loads((saved / STATE).read_text(encoding="utf-8"))
        model.num_timesteps = int(state["steps"])
        with zipfile.ZipFile(saved / MODEL) as archive:
            counts = json.loads(archive.read("data"))
        for name in COUNTS:
            if isinstance(counts.get(name), int):
                setattr(model, name, counts[name])
        window = model._stats_window_size
        latest = [{"r": float(r), "l": int(length), "t": 0.0} for r, length in state.get("episodes", [])]
        model.ep_info_buffer, model.ep_success_buffer = deque(latest, window), deque(maxlen=window)
        if isinstance(model, OffPolicyAlgorithm):
            if (saved / REPLAY).exists():
                with np.load(BytesIO((saved / REPLAY).read_bytes()), allow_pickle=False) as file:
                    _remember(model.replay_buffer, dict(file))
            else:
                _need_trust(saved, trust)
                model.load_replay_buffer(saved / PICKLES[REPLAY])


def normalized(envs: VecEnv, settings: Mapping[str, Any], saved: Path, trust: bool = False) -> VecNormalize:
    """Environments whose observations are normalized as they were at a checkpoint.

    Args:
        envs: of one kind with those of the training.
        settings: arguments of `VecNormalize`.
        saved: the checkpoint.
        trust: whether a pickle of an older version may be loaded.
    """
    with as_written(saved):
        if not (saved / NORMALIZATION).exists():
            _need_trust(saved, trust)
            return VecNormalize.load(str(saved / PICKLES[NORMALIZATION]), envs)
        kept = VecNormalize(envs, **settings)
        with np.load(BytesIO((saved / NORMALIZATION).read_bytes()), allow_pickle=False) as file:
            for name, part in _moments_of(kept).items():
                mean, var = file[f"{name}.mean"], file[f"{name}.var"]
                if mean.shape != part.mean.shape or var.shape != part.var.shape:
                    raise ValueError(f"{name} of shape {mean.shape}")
                part.mean, part.var, part.count = mean, var, float(file[f"{name}.count"])
        return kept


def _need_trust(saved: Path, trust: bool) -> None:
    if not trust:
        expected = "must be trusted (--trust), as loading pickles may run code of whoever wrote them"
        raise RunError("model", expected, " and ".join(pickles_in(saved)) or "nothing", str(saved))


def _moments_of(kept: VecNormalize) -> dict[str, RunningMeanStd]:
    """The running moments of observations and of returns, by name."""
    moments = {"returns": kept.ret_rms}
    if kept.norm_obs:
        seen = kept.obs_rms
        moments |= (
            {f"observation.{name}": part for name, part in seen.items()}
            if isinstance(seen, dict)
            else {"observation": seen}
        )
    return moments


def _statistics_of(kept: VecNormalize) -> dict[str, Any]:
    return {
        f"{name}.{what}": getattr(part, what)
        for name, part in _moments_of(kept).items()
        for what in ("mean", "var", "count")
    }


def _memory_of(buffer: Any) -> dict[str, Any]:
    """The filled part of a replay buffer, as arrays by name."""
    filled = slice(None) if buffer.full else slice(buffer.pos)
    arrays: dict[str, Any] = {"pos": buffer.pos, "full": buffer.full}
    for name in BUFFER:
        part = getattr(buffer, name, None)
        if isinstance(part, dict):
            arrays |= {f"{name}.{key}": values[filled] for key, values in part.items()}
        elif part is not None:
            arrays[name] = part[filled]
    return arrays


def _remember(buffer: Any, arrays: Mapping[str, npt.NDArray[Any]]) -> None:
    """Fill a new replay buffer with what `_memory_of` gave."""
    buffer.pos, buffer.full = int(arrays["pos"]), bool(arrays["full"])
    filled = slice(None) if buffer.full else slice(buffer.pos)
    for name in BUFFER:
        part = getattr(buffer, name, None)
        if isinstance(part, dict):
            for key, values in part.items():
                values[filled] = arrays[f"{name}.{key}"]
        elif part is not None:
            part[filled] = arrays[name]
