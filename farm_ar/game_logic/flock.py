"""Chickens and bunnies as arrays: hundreds run at once, and who arrives where and when is solved for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import BoolArray, FloatArray, IntArray, read_only
from farm_ar.errors import OptionError
from farm_ar.game_logic import arc_length, entering, running
from farm_ar.game_logic.paths import clear_curve, door, running_curve, target

__all__ = ["Arrivals", "Flock", "clear_curve", "door", "running_curve", "target"]


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
        self.clock = np.zeros(running.CLOCKS)
        self.clock[running.PACE], self.clock[running.NEXT] = self.speed, np.inf
        self._queue = np.empty((0, running.TURN))
        self._animal = np.empty((0, running.ANIMAL))
        self.box: FloatArray | None = None

    def __len__(self) -> int:
        return int(self.clock[running.RUNNERS])

    @property
    def arrays(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Queue, animals and clock, for compiled kernels."""
        return self._queue, self._animal, self.clock

    @property
    def goal(self) -> IntArray:
        """(A,) index of the label that each animal wants to get to."""
        goal: IntArray = self._animal[self._live, running.GOAL].astype(np.int64)
        return goal

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
        return self._rest(self._live)

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
        begin = self.clock[running.NOW] + np.broadcast_to(np.asarray(delay, dtype=np.float64), goals.shape)
        if not (np.isfinite(curves).all() and np.isfinite(begin).all()):
            raise ValueError("curve and delay must be finite")
        live, more = len(self), len(goals)
        self.make_room(more)
        slots = self._slots(live, live + more)
        self._animal[slots, running.GOAL], self._animal[slots, running.ZERO] = goals, begin
        self.clock[running.RUNNERS] = live + more
        self._set_curves(slots, curves)

    def make_room(self, more: int) -> None:
        """Have room for so many animals more."""
        held, needed = len(self._queue), len(self) + more
        if needed <= held:
            return
        room = max(needed, 2 * held, 64) - held
        free = np.zeros((room, running.TURN))
        free[:, running.SLOT] = np.arange(held, held + room)
        self._queue = np.concatenate([self._queue, free])
        self._animal = np.concatenate([self._animal, np.zeros((room, running.ANIMAL))])

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
        if running.redirect(*self.arrays, np.array(goal_end, order="C"), np.array(changed)):
            self.box = None

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
        self.look_ahead(position, yaw, size, obstacles)
        begin = self.clock[running.NOW]
        arrived = running.take_in(self._queue, self.clock, begin + seconds)
        if not arrived:
            return _NOBODY
        live = len(self)
        due = self._queue[live : live + arrived, running.DUE]
        first = np.argsort(due, kind="stable")
        home = self._animal[self._slots(live, live + arrived)[first], : running.ZERO].astype(np.int64)
        return Arrivals(home[:, running.GOAL], home[:, running.INTO], due[first] - begin)

    def look_ahead(
        self, position: FloatArray, yaw: FloatArray, size: FloatArray, obstacles: BoolArray
    ) -> FloatArray | None:
        """Find out anew who arrives where and when, if the buildings have moved; arguments as for `play`.

        Returns:
            Their footprints, as `entering.boxes` has them, if they have; else None.
        """
        # Copies, because read-only or transposed arrays would have the kernels compiled once more.
        centre, turned = np.array(position, np.float64, order="C"), np.array(yaw, np.float64, order="C")
        sides, enterable = np.array(size, np.float64, order="C"), np.array(obstacles, dtype=np.bool_)
        n = len(enterable)
        shapes = (centre.shape, turned.shape, sides.shape, enterable.shape)
        if shapes != ((n, 2), (n,), (n, 3), (n,)):
            raise ValueError(
                f"position, yaw, size, obstacles must be (N, 2), (N,), (N, 3), (N,), got {shapes}"
            )
        box = entering.boxes(centre, turned, sides, enterable)
        if self.box is not None and np.array_equal(self.box, box, equal_nan=True):
            return None
        self.box = box
        running.foresee(*self.arrays, box)
        return box

    @property
    def _live(self) -> IntArray:
        """(A,) slots of those on their way, in the order in which they were added."""
        return self._slots(0, len(self))

    def _slots(self, begin: int, end: int) -> IntArray:
        """Slots of a part of the queue."""
        slots: IntArray = self._queue[begin:end, running.SLOT].astype(np.int64)
        return slots

    def _along(self, slots: IntArray) -> FloatArray:
        """(C,) how far they have run, metres; 0 for those that wait."""
        ran = self.speed * (self.clock[running.NOW] - self._animal[slots, running.ZERO])
        along: FloatArray = np.maximum(ran, 0.0)
        return along

    def _curves(self, slots: IntArray) -> tuple[FloatArray, FloatArray]:
        """(C, 4, 2) the curves of animals, and (C,) the parameters where they are on them."""
        curve = self._animal[slots, running.CURVE :].reshape(-1, 4, 2)
        parameter = np.empty(len(curve))
        arc_length.locate(curve, self._along(slots), parameter)
        return curve, parameter

    def _stand(self) -> tuple[FloatArray, FloatArray]:
        """(A, 2) positions and (A,) headings."""
        position, yaw = np.empty((len(self), 2)), np.empty(len(self))
        running.stand(*self._curves(self._live), position, yaw)
        return position, yaw

    def _rest(self, slots: IntArray) -> FloatArray:
        """(C, 4, 2) what is left of the curves of animals, from exactly where they stand."""
        curve, parameter = self._curves(slots)
        rest = np.empty_like(curve)
        running.cut(curve, parameter, rest)
        return rest

    def _set_curves(self, slots: IntArray, curve: FloatArray) -> None:
        """Give animals other curves, (C, 4, 2)."""
        self._animal[slots, running.CURVE :] = curve.reshape(-1, 8)
        self.box = None


_NOBODY = Arrivals(np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64), np.empty(0))
