"""A film of an episode: every move of the hand, every snapshot, and the play after it."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any, NamedTuple, Protocol

from farm_ar.drawing.game.frames import GameFrames
from farm_ar.envs import FarmToTableEnv
from farm_ar.game_logic.farm_game import FarmGame
from farm_ar.game_logic.physics.tabletop import Tabletop
from farm_ar.showcases.film import FPS, HEIGHT, TICKS_PER_FRAME, Image

STILL_S = 0.8
"""How long a picture stays: before the first move, after a step that is a whole visit, and at the end."""


class Policy(Protocol):
    """Anything that says what to do in an environment."""

    def act(self, env: FarmToTableEnv) -> Any:
        """The next action."""
        ...


class Watched(NamedTuple):
    """The result of an episode."""

    total: float
    wrong_labels: int


def film_episode(
    env: FarmToTableEnv, policy: Policy, seed: int, caption: str = ""
) -> Generator[Image, None, Watched]:
    """The frames of an episode, (H, W, 3) bytes, 30 a second; and in the end its return and its wrong labels.

    Args:
        env: where it is played. Where the hand is steered, or without the game, there is one picture for each
            step, as long as the step takes, or `STILL_S`.
        policy: chooses the actions.
        seed: of the reset.
        caption: shown with every frame.
    """
    env.reset(seed=seed)
    frames: list[Image] = []
    pictures = GameFrames(env.world.tracker.scene, HEIGHT)
    hand = env.config.control == "hand"
    stepwise, held = hand or not isinstance(env.world, FarmGame), 3 if hand else round(STILL_S * FPS)

    def show() -> None:
        frames.append(pictures.frame(env.world.render_state(caption)))

    if isinstance(env.world, FarmGame) and not stepwise:
        _film_game(env.world, show)
    show()
    yield from frames * round(STILL_S * FPS)
    over, total, info = False, 0.0, dict[str, Any]()
    while not over:
        frames.clear()
        _, reward, over, _, info = env.step(policy.act(env))
        total += reward
        if stepwise:
            show()
            frames *= held
        yield from frames
    yield from frames[-1:] * round(STILL_S * FPS)
    return Watched(total, int(info["wrong_labels"]))


def _film_game(game: FarmGame, show: Any) -> None:
    """Have every move and all play of a game shown, frame by frame."""
    move, play = game.move, game.play

    def watched_move(*asked: Any, **named: Any) -> Any:
        def at_tick(table: Tabletop) -> None:
            if table.ticks % TICKS_PER_FRAME == 0:
                show()

        return move(*asked, **{**named, "record": at_tick})

    def watched_play(seconds: float) -> None:
        for _ in range(round(seconds * FPS)):
            play(1 / FPS)
            show()

    # Watching is no part of the game, and this game is played once.
    game.move, game.play = watched_move, watched_play  # type: ignore[method-assign]
