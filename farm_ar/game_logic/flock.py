"""Chickens and bunnies as arrays: hundreds run at once, and who arrives where and when is solved for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import BoolArray, FloatArray, IntArray, read_only
from farm_ar.errors import OptionError
from farm_ar.game_logic import kernels
from farm_ar.game_logic.paths import clear_curve, door, running_curve, target
from farm_ar.geometry import move_end

__all__ = ["Arrivals", "Flock", "clear_curve", "door", "running_curve", "target"]

# The arrays that hold the animals, one row each.
_STATE = ("_goal", "_curve", "_along", "_parameter", "_knot", "_travelled")


@dataclass(frozen=True, eq=False)
class Arrivals:
    """The animals that came to the end of their way within one call of `Flock.play`, in order of time.

    Args:
        goal: (K,) index of the label that each wanted to get to.
        building: (K,) index of the physical object that each is in, -1 where nothing stands.
        time: (K,) when, seconds since the call began, rising.
    """

    goal: IntArray
    building: IntArray
    time: FloatArray

    def __post_init__(self) -> None:
        for name, dtype in (("goal", np.int64), ("building", np.int64), ("time", np.float64)):
            object.__setattr__(self, name, read_only(getattr(self, name), dtype))

    def __len__(self) -> int:
        return len(self.goal)


class Flock:
    """Animals that run along cubic Béziers at constant speed until they are inside a building.

    Those on their way, A of them, keep the order in which they were added. Reading an array gives a copy.

    Args:
        speed: metres a second.

    Raises:
        OptionError: the speed is not positive and finite.
    """

    def __init__(self, speed: float = 0.25) -> None:
        if not (np.isfinite(speed) and speed > 0):
            raise OptionError("speed", "must be a positive number of metres a second", speed)
        self.speed = float(speed)
        self._goal = np.empty(0, dtype=np.int64)
        self._curve = np.empty((0, 4, 2))
        self._along = np.empty(0)
        self._parameter = np.empty(0)
        self._knot = np.empty((0, kernels.KNOTS))
        self._travelled = np.empty((0, kernels.KNOTS))

    def __len__(self) -> int:
        return len(self._goal)

    @property
    def goal(self) -> IntArray:
        """(A,) index of the label that each animal wants to get to."""
        return self._goal.copy()

    @property
    def position(self) -> FloatArray:
        """(A, 2) where the animals are, metres."""
        return self._stand()[0]

    @property
    def heading(self) -> FloatArray:
        """(A,) where they run to, radians; 0 for one whose curve has no length."""
        return self._stand()[1]

    @property
    def curve(self) -> FloatArray:
        """(A, 4, 2) control points of what is left of each animal's curve, metres."""
        return self._rest(np.ones(len(self), dtype=bool))

    def add(self, goal: npt.ArrayLike, curve: npt.ArrayLike, delay: npt.ArrayLike = 0.0) -> None:
        """Send animals on their way.

        Args:
            goal: (K,) index of the label that each wants to get to.
            curve: (K, 4, 2) control points of their curves, metres.
            delay: (K,) or one for all: how long each waits at the start of its curve, where no building
                takes it in, seconds; below 0 for one that is so far on its way already.

        Raises:
            ValueError: the shapes do not agree, or a value is not finite.
        """
        goals, curves = np.array(goal, dtype=np.int64), np.array(curve, np.float64, order="C")
        if goals.ndim != 1 or curves.shape != (len(goals), 4, 2):
            raise ValueError(
                f"goal and curve must be (K,) and (K, 4, 2), got {goals.shape} and {curves.shape}"
            )
        along = -self.speed * np.broadcast_to(np.asarray(delay, dtype=np.float64), goals.shape)
        if not (np.isfinite(curves).all() and np.isfinite(along).all()):
            raise ValueError("curve and delay must be finite")
        table = np.empty((len(goals), kernels.KNOTS))
        first = len(self)
        new = (goals, curves, along, np.zeros(len(goals)), table, table)
        for name, values in zip(_STATE, new, strict=True):
            setattr(self, name, np.concatenate([getattr(self, name), values]))
        self._measure(np.arange(len(self)) >= first)

    def redirect(self, goal_end: FloatArray, changed: BoolArray) -> None:
        """Move the ends of the curves that lead to labels now believed elsewhere.

        The rest of such a curve is split off where the animal stands, and its last two control points are
        moved together: the animal neither jumps nor turns, and comes up to the end from the same side.

        Args:
            goal_end: (M, 2) where the curves to each label are to end, metres.
            changed: (M,) labels for which that has changed.

        Raises:
            ValueError: the shapes do not agree.
            IndexError: an animal's label is not among them.
        """
        goal_end, changed = np.asarray(goal_end, dtype=np.float64), np.asarray(changed, dtype=np.bool_)
        if goal_end.shape != (*changed.shape, 2):
            raise ValueError(
                f"goal_end and changed must be (M, 2) and (M,), got {goal_end.shape}, {changed.shape}"
            )
        turned = changed[self._goal]
        if turned.any():
            self._curve[turned] = move_end(self._rest(turned), goal_end[self._goal[turned]])
            self._along[turned] = np.minimum(self._along[turned], 0.0)
            self._measure(turned)

    def play(
        self, seconds: float, position: FloatArray, yaw: FloatArray, size: FloatArray, obstacles: BoolArray
    ) -> Arrivals:
        """Let the animals run on. Those that arrive leave the flock.

        An animal arrives when it is first inside the footprint in which its curve ends, edges included, at
        once if that building has been put over it; or at the end of its curve, where nothing stands. It runs
        past what else is in its way. One call over a long time and many over short ones give the same.

        Args:
            seconds: for how long, not negative.
            position: (N, 2) true centres of the buildings, metres.
            yaw: (N,) their true headings, radians.
            size: (N, 3) width, height, depth, metres.
            obstacles: (N,) buildings that an animal can enter; not the shed that it comes from.

        Returns:
            Who has arrived, where and when.

        Raises:
            ValueError: the time is negative or not finite, or the shapes do not agree.
        """
        if not 0 <= seconds < np.inf:
            raise ValueError(f"seconds must be finite and not negative, got {seconds}")
        # Copies, because read-only or transposed arrays would have the kernels compiled once more.
        centre, turned = np.array(position, np.float64, order="C"), np.array(yaw, np.float64, order="C")
        sides, enterable = np.array(size, np.float64, order="C"), np.array(obstacles, dtype=np.bool_)
        n = len(enterable)
        shapes = (centre.shape, turned.shape, sides.shape, enterable.shape)
        if shapes != ((n, 2), (n,), (n, 3), (n,)):
            raise ValueError(
                f"position, yaw, size, obstacles must be (N, 2), (N,), (N, 3), (N,), got {shapes}"
            )
        building, run = np.empty(len(self), dtype=np.int64), np.empty(len(self))
        arrived = kernels.advance(
            self._curve,
            self._knot,
            self._travelled,
            self._along,
            self._parameter,
            kernels.boxes(centre, turned, sides, enterable),
            self.speed * seconds,
            building,
            run,
        )
        if not arrived:
            return _NOBODY
        there = building != kernels.RUNNING
        order = np.flatnonzero(there)[np.argsort(run[there], kind="stable")]
        arrivals = Arrivals(self._goal[order], building[order], run[order] / self.speed)
        for name in _STATE:
            setattr(self, name, getattr(self, name)[~there])
        return arrivals

    def _stand(self) -> tuple[FloatArray, FloatArray]:
        """(A, 2) positions and (A,) headings."""
        position, yaw = np.empty((len(self), 2)), np.empty(len(self))
        kernels.stand(self._curve, self._parameter, position, yaw)
        return position, yaw

    def _rest(self, chosen: BoolArray) -> FloatArray:
        """(C, 4, 2) what is left of the curves of the C chosen animals, from exactly where they stand."""
        curve = self._curve[chosen]
        rest = np.empty_like(curve)
        kernels.cut(curve, self._parameter[chosen], rest)
        return rest

    def _measure(self, chosen: BoolArray) -> None:
        """Tabulate the arc length of the chosen animals' curves, and find where on them they stand."""
        along = self._along[chosen]
        parameter, knot = np.empty(len(along)), np.empty((len(along), kernels.KNOTS))
        travelled = np.empty_like(knot)
        kernels.measure(self._curve[chosen], along, parameter, knot, travelled)
        self._parameter[chosen], self._knot[chosen], self._travelled[chosen] = parameter, knot, travelled


_NOBODY = Arrivals(np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64), np.empty(0))
