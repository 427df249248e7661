"""A film of a delivery: the room from above, the robot's own view, and what is sent between its parts."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.drawing.game.text import text_sprite
from farm_ar.drawing.video import write_gif, write_mp4
from farm_ar.envs.delivery import Courier, Delivery
from farm_ar.envs.delivery.picture import INK, WRONG, paste, picture
from farm_ar.rendering import Intrinsics, Renderer, View
from farm_ar.showcases.delivery.trials import Trial, deliver
from farm_ar.showcases.interior import LAMP, chair_instances, fixed_instances
from farm_ar.showcases.result import Image

FPS = 10
"""Twice as fast as it happened: the robot takes five steps a second."""

PANE = (480, 300)
"""Width and height of the robot's view, pixels."""

SENT = 8
"""Lines of what was sent that are shown."""


class DeliveryFilm:
    """Keeps a frame of every step of a delivery."""

    def __init__(self) -> None:
        self.frames: list[Image] = []
        self._trail: list[FloatArray] = []
        self._sent: list[str] = []
        self._goals = 0
        self._renderer: Renderer | None = None

    def __call__(self, now: Delivery, courier: Courier) -> None:
        """Watch a step."""
        self._trail.append(now.robot.truth.place)
        for goal in courier.goals[self._goals :]:
            x, y = goal.place[1], -goal.place[0]
            if self._goals:
                self._sent.append(f"{now.seconds:5.1f} s  cancel goal {self._goals}")
            self._goals += 1
            self._sent.append(
                f"{now.seconds:5.1f} s  goal {self._goals}, {goal.kind}: map ({x:.2f}, {y:.2f})"
            )
        if now.delivered is not None:
            right = now.delivered == now.target
            self._sent.append(
                f"{now.seconds:5.1f} s  delivered to chair {now.layout.labels[now.delivered]}: "
                + ("right" if right else "WRONG")
            )
        goal_place = courier.goals[-1].place if courier.goals else None
        above = picture(now, courier.way, goal_place, np.array(self._trail))
        beside = np.full((above.shape[0], PANE[0], 3), 255, np.uint8)
        beside[: PANE[1]] = self._seen(now)
        for k, line in enumerate(self._sent[-SENT:]):
            colour = WRONG if "WRONG" in line else INK
            paste(beside, text_sprite(line, 15, colour), 10, PANE[1] + 30 + 24 * k)
        self.frames.append(np.hstack([above, beside]))

    def _seen(self, now: Delivery) -> Image:
        """What the robot's camera sees."""
        if self._renderer is None:
            standing = [*fixed_instances(now.room), *chair_instances(now.layout)]
            self._renderer = Renderer(standing, light=LAMP, smooth=True)
        lens = Intrinsics.of_view(*PANE, now.camera.across)
        view = View.of(now.camera.at(now.robot.truth), lens)
        return self._renderer.draw(view).rgb


def film_delivery(out: Path, method: str, seed: int, layout: int) -> tuple[Trial, list[Path]]:
    """Film one delivery: delivery-METHOD.mp4, and a GIF of every second frame."""
    film = DeliveryFilm()
    trial = deliver(method, seed, layout, film)
    frames = film.frames + film.frames[-1:] * (2 * FPS)
    paths = [out / f"delivery-{method}.mp4", out / f"delivery-{method}.gif"]
    write_mp4(paths[0], frames, FPS)
    write_gif(paths[1], frames[::2], FPS / 2, 720, 96)
    return trial, paths
