"""Chickens and bunnies as arrays: hundreds run at once, and who arrives where and when is solved for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import BoolArray, FloatArray, IntArray, read_only
from farm_ar.errors import OptionError
from farm_ar.game_logic.animals import arrival
from farm_ar.game_logic.animals.arrival import Animal, Clock, Due, Herd
from farm_ar.game_logic.animals.curve_intersection import Footprint, footprints
from farm_ar.geometry import arc_length
from farm_ar.structs import Structs, new_structs, words_of


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
        self.herd = Herd(new_structs(Clock, 1), new_structs(Due, 0), new_structs(Animal, 0))
        clocks = self.herd.clocks
        clocks["speed"], clocks["next"] = self.speed, np.inf
        self.buildings: Structs[Footprint] | None = None

    def __len__(self) -> int:
        return int(self.herd.clocks["running"].item())

    @property
    def now(self) -> float:
        """The time, seconds."""
        return float(self.herd.clocks["now"].item())

    @property
    def goal(self) -> IntArray:
        """(A,) index of the label that each animal wants to get to."""
        goal: IntArray = self.herd.animals["goal"][self._live]
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
        begin = self.now + np.broadcast_to(np.asarray(delay, dtype=np.float64), goals.shape)
        if not (np.isfinite(curves).all() and np.isfinite(begin).all()):
            raise ValueError("curve and delay must be finite")
        live, more = len(self), len(goals)
        self.make_room(more)
        slots = self._slots(live, live + more)
        animals = self.herd.animals
        animals["goal"][slots], animals["start"][slots], animals["curve"][slots] = goals, begin, curves
        self.herd.clocks["running"] = live + more
        self.buildings = None

    def make_room(self, more: int) -> None:
        """Have room for so many animals more."""
        clocks, before, known = self.herd
        held, needed = len(before), len(self) + more
        if needed <= held:
            return
        room = max(needed, 2 * held, 64)
        queue, animals = new_structs(Due, room), new_structs(Animal, room)
        queue["slot"] = np.arange(room)
        queue[:held], animals[:held] = before, known
        self.herd = Herd(clocks, queue, animals)

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
        if arrival.redirect(self.herd, np.array(goal_end, order="C"), np.array(changed)):
            self.buildings = None

    def hold(self, waiting: BoolArray, seconds: float) -> None:
        """Have animals on their way to (M,) marked labels stand where they are for the next seconds."""
        arrival.hold(self.herd, np.array(waiting, dtype=np.bool_), float(seconds))

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
        begin = self.now
        arrived = arrival.take_in(self.herd, begin + seconds)
        if not arrived:
            return _NOBODY
        live = len(self)
        time = self.herd.queue["time"][live : live + arrived]
        first = np.argsort(time, kind="stable")
        home = self.herd.animals[self._slots(live, live + arrived)[first]]
        return Arrivals(home["goal"], home["into"], time[first] - begin)

    def look_ahead(
        self, position: FloatArray, yaw: FloatArray, size: FloatArray, obstacles: BoolArray
    ) -> Structs[Footprint]:
        """Find out anew who arrives where and when, if the buildings have moved; arguments as for `play`.

        Returns:
            (N,) their footprints.
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
        buildings = footprints(centre, turned, sides, enterable)
        before, self.buildings = self.buildings, buildings
        if before is None or not np.array_equal(words_of(before), words_of(buildings), equal_nan=True):
            arrival.find_arrivals(self.herd, buildings)
        return buildings

    @property
    def _live(self) -> IntArray:
        """(A,) slots of those on their way, in the order in which they were added."""
        return self._slots(0, len(self))

    def _slots(self, begin: int, end: int) -> IntArray:
        """Slots of a part of the queue."""
        slots: IntArray = self.herd.queue["slot"][begin:end]
        return slots

    def _along(self, slots: IntArray) -> FloatArray:
        """(C,) how far they have run, metres; 0 for those that wait."""
        ran = self.speed * (self.now - self.herd.animals["start"][slots])
        along: FloatArray = np.maximum(ran, 0.0)
        return along

    def _curves(self, slots: IntArray) -> tuple[FloatArray, FloatArray]:
        """(C, 4, 2) the curves of animals, and (C,) the parameters where they are on them."""
        curve: FloatArray = self.herd.animals["curve"][slots]
        parameter = np.empty(len(curve))
        arc_length.locate(curve, self._along(slots), parameter)
        return curve, parameter

    def _stand(self) -> tuple[FloatArray, FloatArray]:
        """(A, 2) positions and (A,) headings."""
        position, yaw = np.empty((len(self), 2)), np.empty(len(self))
        arrival.stand(*self._curves(self._live), position, yaw)
        return position, yaw

    def _rest(self, slots: IntArray) -> FloatArray:
        """(C, 4, 2) what is left of the curves of animals, from exactly where they stand."""
        curve, parameter = self._curves(slots)
        rest = np.empty_like(curve)
        arrival.cut(curve, parameter, rest)
        return rest


_NOBODY = Arrivals(np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64), np.empty(0))
