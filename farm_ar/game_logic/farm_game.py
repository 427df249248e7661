"""The Farm-to-Table game (paper, section 4.3.1): its phases, and the order in which things happen."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.errors import SceneError
from farm_ar.game_logic.counters import Counters
from farm_ar.game_logic.flock import Arrivals, Flock
from farm_ar.game_logic.moment import Moment
from farm_ar.game_logic.motion import Motion
from farm_ar.game_logic.paths import clear_curve, door, running_curve
from farm_ar.game_logic.perception import GeometricHandDetector, HandDetector, Perception
from farm_ar.game_logic.tabletop import Tabletop
from farm_ar.game_logic.tracker import ReidFactory, Sighting, Tracker, spatial_by_category
from farm_ar.geometry import wrap
from farm_ar.scenes import Camera, Layout, Scene, visible

TICK_S = 1 / 60
"""Length of a tick."""

HAND_AWAY_S = 0.5
"""How long the hand must have been out of view, holding nothing, before a visit is over."""

ANIMAL_SPEED_M_S = 0.12

HAND_WAITS_AT_Z = -0.5
"""Where a hand that is out of view waits, metres."""

ANIMALS_A_SECOND = 10.0
"""How many animals leave the shed, all colours together; about four times as many are then on the table."""

WARM_UP_S = 8.0
"""How long animals have been leaving the shed when the game begins; those that would be home are."""

PATH_SPREAD_M = 0.03
"""How far to the side of one another animals of one colour run, standard deviation."""


class Phase(Enum):
    """What is going on."""

    PLAY = "play"
    HAND = "hand"


class FarmGame:
    """The game on one table.

    Args:
        scene: the table, with a fixed building (the shed) from which the animals come.
        layout: where everything is at the start, truth and belief alike; the scene's own by default.
        camera: the headset's camera.
        rng: where the randomness comes from.
        make_reid: makes the re-identifier for the scene as it is believed to be.
        perception: makes the snapshots; by default from the true poses.
        hand_detector: sees the hand; by default from where it truly is.
        animals_a_second: how many leave the shed, all colours together; not negative.

    Raises:
        SceneError: the scene has no fixed object for a shed.
    """

    def __init__(
        self,
        scene: Scene,
        camera: Camera,
        rng: np.random.Generator,
        layout: Layout | None = None,
        make_reid: ReidFactory = spatial_by_category,
        perception: Perception | None = None,
        hand_detector: HandDetector | None = None,
        animals_a_second: float = ANIMALS_A_SECOND,
    ) -> None:
        layout = layout or scene.layout
        if not layout.fixed.any():
            raise SceneError("objects", "must hold a fixed one, the shed", list(layout.labels))
        self.scene, self.camera, self.rng = scene, camera, rng
        self.tabletop = Tabletop(layout, scene.size)
        self.tracker = Tracker(scene, layout, make_reid, perception)
        self.hand_detector = hand_detector or GeometricHandDetector()
        self.counters = Counters.zero(len(layout))
        self.flock = Flock(ANIMAL_SPEED_M_S)
        self.phase = Phase.PLAY
        self.clock = 0.0
        self.sightings: list[Sighting] = []
        self._away = 0.0
        self._shed = int(np.flatnonzero(layout.fixed)[0])
        self._goals = np.flatnonzero(layout.movable)
        self._emitted = np.zeros(len(layout), dtype=np.int64)
        self._period = len(self._goals) / animals_a_second if animals_a_second > 0 else np.inf
        self._next_due = 0.0 if animals_a_second > 0 else np.inf
        self._warm_up()

    @property
    def truth(self) -> Layout:
        """Where everything really is."""
        return self.tabletop.layout

    @property
    def believed(self) -> Layout:
        """Where the game believes everything to be."""
        return self.tracker.belief.layout

    @property
    def miscounts(self) -> int:
        """Animals so far that did not get into the building of their colour."""
        return self.counters.miscounts

    def moment(self, caption: str = "") -> Moment:
        """All there is to see now."""
        return Moment(
            scene=self.scene,
            truth=self.truth,
            believed=self.believed,
            wrong=self.tracker.belief.wrong,
            camera=self.camera,
            phase=self.phase.value,
            seconds=self.clock,
            counts=self.counters.counted,
            misplaced=self.counters.misplaced,
            hand=self.tabletop.hand,
            animal=self.flock.position,
            animal_heading=self.flock.heading,
            animal_goal=self.flock.goal,
            caption=caption,
        )

    def state(self) -> list[FloatArray]:
        """All that may change, as arrays."""
        hand, camera = self.tabletop.hand, self.camera
        counters = [self.counters.counted, self.counters.misplaced, self.counters.stranded, self._emitted]
        held = -1 if hand is None or hand.gripped is None else hand.gripped
        arm = [] if hand is None else [*hand.position, hand.yaw, *hand.velocity, hand.raised]
        return [
            *self.tabletop.poses(),
            *self.tracker.belief.state(),
            *(values.astype(np.float64) for values in (*counters, self.flock.goal)),
            self.flock.curve,
            camera.position,
            np.array([camera.yaw, camera.pitch, 0.0 if camera.height is None else camera.height]),
            np.array([self.clock, self.tabletop.ticks, self._away, self.phase is Phase.HAND, held]),
            np.array(arm, dtype=np.float64),
        ]

    def begin_visit(self, camera: Camera | None = None) -> None:
        """The hand comes into view: the animals freeze. The camera is the one that will take the snapshot."""
        self.camera = camera or self.camera
        self.phase = Phase.HAND
        self._away = 0.0

    def move(
        self,
        index: int,
        displacement: FloatArray,
        turn: float,
        record: Callable[[Tabletop], None] | None = None,
    ) -> Motion:
        """The hand carries one building over the table and lets it go; what is in the way is pushed.

        Args:
            index: the building.
            displacement: (2,) metres in x and z.
            turn: radians, clockwise.
            record: called at every tick.
        """
        position, yaw = self.tabletop.poses()
        self.tabletop.carry(index, position[index] + displacement, float(yaw[index] + turn), record)
        return self._moved_since(position, yaw)

    def end_visit(self, camera: Camera | None = None) -> Sighting:
        """The hand has left: snapshot, poses, identification; then only the ends of the paths move."""
        sighting = self.tracker.look(self.truth, camera or self.camera, self.rng)
        self.sightings.append(sighting)
        believed = self.believed
        self.flock.redirect(believed.position, sighting.changed)
        self.phase = Phase.PLAY
        self._away = 0.0
        return sighting

    def play(self, seconds: float) -> None:
        """Let the animals run. While the hand is visible they do not.

        Args:
            seconds: not negative.
        """
        if self.phase is not Phase.PLAY:
            return
        self._emit(seconds)
        arrivals = self._run(seconds)
        if len(arrivals):
            self.counters.add(arrivals.goal, arrivals.building)
        self.clock += seconds

    def bring_hand(self) -> None:
        """A hand to steer, at the player's side, out of view."""
        width, _ = self.scene.size
        self.tabletop.bring_hand((width / 2, HAND_WAITS_AT_Z))

    def withdraw_hand(self) -> tuple[Motion, Sighting | None]:
        """The hand lets go and is gone at once.

        Returns:
            What the buildings still did, and the sighting if that ends a visit.
        """
        before = self.tabletop.poses()
        self.tabletop.remove_hand()
        self.tabletop.settle()
        return self._moved_since(*before), self.end_visit() if self.phase is Phase.HAND else None

    def tick(self, velocity: FloatArray, twist: float, grip: bool) -> tuple[Motion, Sighting | None]:
        """One tick under a hand that is steered: physics, freezing, and at the end of a visit the snapshot.

        Args:
            velocity: (2,) of the hand, metres a second.
            twist: of the hand, radians a second, clockwise.
            grip: whether the hand is closed. It grips what it closes on, if that is in view.

        Returns:
            What the tick did to the buildings, and the sighting if it ended a visit.
        """
        position, yaw = self.tabletop.poses()
        self._use_hand(grip)
        self.tabletop.tick(velocity, twist)
        hand = self.tabletop.hand
        if hand is not None and self.hand_detector.sees_hand(hand.position, self.camera):
            if self.phase is Phase.PLAY:
                self.begin_visit()
            self._away = 0.0
        elif hand is not None and hand.gripped is not None:
            self._away = 0.0
        else:
            self._away += TICK_S
        sighting = None
        if self.phase is Phase.PLAY:
            self.play(TICK_S)
        elif self._away >= HAND_AWAY_S - TICK_S / 2:
            self.tabletop.settle()
            sighting = self.end_visit()
        return self._moved_since(position, yaw), sighting

    def _use_hand(self, grip: bool) -> None:
        hand = self.tabletop.hand
        if hand is None:
            return
        if not grip and hand.gripped is not None:
            self.tabletop.release()
        elif grip and hand.gripped is None:
            index = self.tabletop.find_building(hand.position)
            if index is not None and visible(self.truth, self.camera)[index]:
                self.tabletop.grip(index)

    def _moved_since(self, position: FloatArray, yaw: FloatArray) -> Motion:
        new_position, new_yaw = self.tabletop.poses()
        if new_position is position:
            return Motion()
        metres = np.linalg.norm(new_position - position, axis=1).sum()
        return Motion(float(metres), float(np.abs(wrap(new_yaw - yaw)).sum()))

    def _emit(self, seconds: float) -> None:
        """Send out the animals that are due within the next `seconds`, each at its own time.

        The label in place k of n sends its j-th animal at (j + k / n) periods.
        """
        if self._next_due >= self.clock + seconds:
            return
        n = len(self._goals)
        goals, delays = [], []
        for place, label in enumerate(self._goals):
            due = (self._emitted[label] + place / n) * self._period
            while due < self.clock + seconds:
                goals.append(label)
                delays.append(due - self.clock)
                self._emitted[label] += 1
                due += self._period
        self._next_due = min(
            (self._emitted[label] + place / n) * self._period for place, label in enumerate(self._goals)
        )
        if goals:
            first = np.argsort(delays, kind="stable")
            self._send_out(np.array(goals)[first], np.array(delays)[first])

    def _warm_up(self) -> None:
        """Fill the paths with animals that left before the game began, and forget those that are home."""
        n, each = len(self._goals), int(np.ceil(WARM_UP_S / self._period))
        if each:
            place, earlier = np.divmod(np.arange(n * each), each)
            self._send_out(self._goals[place], -self._period * (earlier + 1 - place / n))
            self._run(0.0)

    def _run(self, seconds: float) -> Arrivals:
        position, yaw = self.tabletop.poses()
        layout = self.scene.layout
        return self.flock.play(seconds, position, yaw, layout.size, layout.movable)

    def _send_out(self, goals: IntArray, delays: FloatArray) -> None:
        believed, shed = self.believed, self._shed
        start = door(believed.position[shed], believed.yaw[shed], believed.size[shed])
        spread = PATH_SPREAD_M * self.rng.normal(size=len(goals))
        curve = running_curve(
            start, believed.yaw[shed], believed.position[goals], believed.yaw[goals], spread
        )
        where = believed.position, believed.yaw, believed.size
        self.flock.add(goals, clear_curve(curve, goals, *where, believed.movable, self.scene.size), delays)
