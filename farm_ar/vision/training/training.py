"""Trains the network on samples that another process renders, and writes it as ONNX."""

from __future__ import annotations

import multiprocessing
import os
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from farm_ar.errors import OptionError
from farm_ar.rendering import Mesh
from farm_ar.vision.base import size_of
from farm_ar.vision.training.network import Network
from farm_ar.vision.training.samples import Sample, Samples
from farm_ar.vision.training.targets import WEIGHTS, losses_of, targets_of

Report = Callable[[str, float], None]


@dataclass(frozen=True)
class Training:
    """How the network is trained.

    Args:
        images: that it learns from in all, each one `reuse` times.
        seed: of all randomness.
        batch: images of a step.
        reuse: how often each image is used.
        block: samples that are made together.
        kept: blocks of samples of which batches are drawn.
        rate: of learning; it falls to 0 over the last `fall` of all images.
        fall: share of the images.
        average: memory of the running average of the weights, steps.
        threads: of the network.
        workers: processes that render.

    Raises:
        OptionError: a number is out of its limits.
    """

    images: int = 100_000
    seed: int = 0
    batch: int = 16
    reuse: int = 3
    block: int = 256
    kept: int = 8
    rate: float = 2e-3
    fall: float = 0.7
    average: int = 1000
    threads: int = 1
    workers: int = 1

    def __post_init__(self) -> None:
        for name in ("images", "batch", "reuse", "block", "kept", "threads", "workers", "average"):
            if getattr(self, name) < 1:
                raise OptionError(name, "must be at least 1", getattr(self, name))

    @property
    def blocks(self) -> int:
        """How many blocks of samples are made."""
        return max(1, -(-self.images // (self.block * self.reuse)))

    def rate_at(self, step: int) -> float:
        """The rate of learning at a step."""
        last = self.blocks * self.steps_per_block
        fall = (last - step) / max(self.fall * last, 1.0)
        return self.rate * min(1.0, (step + 1) / 200, max(fall, 0.0))

    @property
    def steps_per_block(self) -> int:
        """Steps between two new blocks of samples."""
        return max(1, self.block * self.reuse // self.batch)


def train(
    meshes: Mapping[str, Mesh],
    out: Path,
    training: Training | None = None,
    report: Report = lambda what, share: None,
    resume: bool = False,
) -> Network:
    """Train a network for some meshes and write it.

    Args:
        meshes: of each category.
        out: the file `*.onnx`; what else a user of it needs to know stands beside it as `*.json`. Meanwhile
            `*.checkpoint` holds how far it is.
        training: how.
        report: is called with the progress.
        resume: whether to go on with the checkpoint, if there is one.

    Raises:
        OptionError: the file has another ending, or its checkpoint is one of other categories.
    """
    from farm_ar.vision.training.export import write_model

    training = training or Training()
    check_ending(out)
    torch.set_num_threads(training.threads)
    run = _Run(meshes, training)
    checkpoint = out.with_suffix(".checkpoint")
    if resume and checkpoint.exists():
        run.restore(torch.load(checkpoint, weights_only=True), str(checkpoint))
    blocks = _blocks(meshes, training, run.block)
    pool: deque[list[Sample]] = deque(maxlen=training.kept)
    started, first = time.monotonic(), run.block
    while run.block < training.blocks:
        pool.append(next(blocks))
        terms = run.learn([sample for block in pool for sample in block])
        seen = run.block * training.reuse * training.block
        speed = (run.block - first) * training.reuse * training.block / (time.monotonic() - started)
        words = ", ".join(f"{name} {value:.3f}" for name, value in terms.items())
        report(f"{seen} images, {speed:.0f} a second: {words}", run.block / training.blocks)
        _save(run.state(), checkpoint)
    network = run.averaged()
    write_model(network, out, categories_of(meshes))
    return network


def check_ending(out: Path) -> None:
    """See that a network's file ends as it should.

    Raises:
        OptionError: it does not.
    """
    if out.suffix != ".onnx":
        raise OptionError("out", "must end in .onnx", str(out))


def categories_of(meshes: Mapping[str, Mesh]) -> dict[str, list[float]]:
    """Width, height and depth of each category in the network's order, metres."""
    return {name: size_of(meshes[name]).tolist() for name in sorted(meshes)}


class _Run:
    """What changes while a network is trained."""

    def __init__(self, meshes: Mapping[str, Mesh], training: Training) -> None:
        torch.manual_seed(training.seed)
        self.training, self.names, self.block = training, sorted(meshes), 0
        self.network = Network(len(meshes)).to(memory_format=torch.channels_last)  # type: ignore[call-overload]
        self._average = {key: value.clone().float() for key, value in self.network.state_dict().items()}
        self._optimizer = torch.optim.AdamW(self.network.parameters(), training.rate, weight_decay=0.01)

    def learn(self, pool: list[Sample]) -> dict[str, float]:
        """The steps of one block; the mean of each term of the loss."""
        training, network = self.training, self.network
        rng = np.random.default_rng(np.random.SeedSequence(training.seed, spawn_key=(1, self.block)))
        network.train()
        sums = dict.fromkeys(WEIGHTS, 0.0)
        order: list[int] = []
        for k in range(training.steps_per_block):
            while len(order) < training.batch:
                order += rng.permutation(len(pool)).tolist()
            chosen, order = [pool[i] for i in order[: training.batch]], order[training.batch :]
            targets = targets_of(chosen, len(self.names))
            step = self.block * training.steps_per_block + k
            for group in self._optimizer.param_groups:
                group["lr"] = training.rate_at(step)
            images = _recoloured(targets[0], rng).contiguous(memory_format=torch.channels_last)
            with torch.autocast("cpu", torch.bfloat16):
                output = network(images)
            terms = losses_of(output, targets)
            loss = torch.stack([WEIGHTS[name] * term for name, term in terms.items()]).sum()
            self._optimizer.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            torch.nn.utils.clip_grad_norm_(network.parameters(), 10.0)
            self._optimizer.step()
            self._follow(step)
            for name, term in terms.items():
                sums[name] += float(term.detach()) / training.steps_per_block
        self.block += 1
        return sums

    @torch.no_grad()
    def _follow(self, step: int) -> None:
        """Take the weights into their running average."""
        share = 1 / min(step + 1.0, float(self.training.average))
        share = max(share, 1 / (1 + step / 10))
        for key, value in self.network.state_dict().items():
            self._average[key].lerp_(value.float(), share)

    def averaged(self) -> Network:
        """A network with the average of the weights."""
        network = Network(len(self.names))
        like = network.state_dict()
        network.load_state_dict({key: value.to(like[key].dtype) for key, value in self._average.items()})
        return network.eval()

    def state(self) -> dict[str, Any]:
        """All that `restore` needs."""
        return {
            "names": self.names,
            "block": self.block,
            "network": self.network.state_dict(),
            "average": self._average,
            "optimizer": self._optimizer.state_dict(),
        }

    def restore(self, state: dict[str, Any], source: str) -> None:
        """Go on where another left off.

        Raises:
            OptionError: it was trained for other categories.
        """
        if state["names"] != self.names:
            expected = f"must be those of the checkpoint, {state['names']}"
            raise OptionError("meshes", expected, self.names, source)
        self.block = int(state["block"])
        self.network.load_state_dict(state["network"])
        self._average = state["average"]
        self._optimizer.load_state_dict(state["optimizer"])


def _recoloured(images: torch.Tensor, rng: np.random.Generator) -> torch.Tensor:
    """The images with other gains and noise than the last time."""
    count = len(images)
    gain = rng.uniform(0.8, 1.2, (count, 1, 1, 1)) * (1 + 0.05 * rng.standard_normal((count, 3, 1, 1)))
    noise = rng.uniform(0, 0.02, (count, 1, 1, 1)).astype(np.float32)
    grain = noise * rng.standard_normal(images.shape, dtype=np.float32)
    changed = images * torch.from_numpy(gain.astype(np.float32)) + torch.from_numpy(grain)
    return changed.clamp(0, 1)


def _blocks(meshes: Mapping[str, Mesh], training: Training, first: int) -> Iterator[list[Sample]]:
    """Blocks of samples in order, made ahead by other processes."""
    context = multiprocessing.get_context("spawn")
    part = min(32, training.block)
    with ProcessPoolExecutor(training.workers, context, _begin, (dict(meshes), training.seed)) as pool:
        ahead: deque[Future[list[Sample]]] = deque()
        number = first * training.block
        try:
            while True:
                while len(ahead) < max(1, 3 * training.block // part):
                    ahead.append(pool.submit(_make, number, part))
                    number += part
                block: list[Sample] = []
                while len(block) < training.block:
                    block += ahead.popleft().result()
                yield block
        finally:
            for future in ahead:
                future.cancel()


_samples: list[Samples] = []


def _begin(meshes: dict[str, Mesh], seed: int) -> None:
    os.nice(5)
    _samples[:] = [Samples(meshes, seed)]


def _make(first: int, count: int) -> list[Sample]:
    return [_samples[0][number] for number in range(first, first + count)]


def _save(state: dict[str, Any], path: Path) -> None:
    temporary = path.with_name(path.name + ".tmp")
    torch.save(state, temporary)
    temporary.replace(path)
