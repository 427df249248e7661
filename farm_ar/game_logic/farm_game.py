"""The Farm-to-Table game (paper, section 4.3.1): its phases, and the order in which things happen."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.errors import OptionError, SceneError, known_name
from farm_ar.game_logic import phases
from farm_ar.game_logic.animals import arrival
from farm_ar.game_logic.animals.flock import Flock
from farm_ar.game_logic.animals.routes import Routes
from farm_ar.game_logic.belief import Sighting, Tracker
from farm_ar.game_logic.counters import Counters
from farm_ar.game_logic.perception import GeometricHandDetector, HandDetector, HandView, Perception
from farm_ar.game_logic.phases import AWAY_TICKS, GameArrays, Phase, Visit
from farm_ar.game_logic.physics.limits import Motion, MotionLimit
from farm_ar.game_logic.physics.state import TICK
from farm_ar.game_logic.physics.tabletop import Tabletop
from farm_ar.game_logic.physics.velocity_control import control_tick
from farm_ar.game_logic.render_state import RenderState
from farm_ar.game_logic.visibility import eye_of
from farm_ar.reid import ReidFactory, SpatialReid
from farm_ar.scenes import Camera, Layout, Scene
from farm_ar.structs import new_structs

__all__ = ["HAND_AWAY_S", "TICK_S", "UNMOVED", "FarmGame", "Phase"]

TICK_S = TICK

HAND_AWAY_S = AWAY_TICKS * TICK_S
"""How long the hand must have been out of view, holding nothing, before a visit is over."""

ANIMAL_SPEED_M_S = 0.12

HAND_WAITS_AT_Z = -0.5
"""Where a hand that is out of view waits, metres."""

ANIMALS_A_SECOND = 10.0
"""How many animals leave the shed, all colours together; 3.3 times as many are then on the table."""

MOST_ANIMALS_A_SECOND, LONGEST_PLAY_S = 1e4, 86400.0
"""Limits of what the game plays."""

WARM_UP_S = 8.0
"""How long animals have been leaving the shed when the game begins; those that would be home are."""


UNMOVED = Motion()

CARRIES = ("drag", "lift")
"""How the hand moves what it holds: over the table, or over everything else to where there is room."""


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
        animals_a_second: how many leave the shed, all colours together; 0 to `MOST_ANIMALS_A_SECOND`.
        carry: how the hand moves what it holds, one of `CARRIES`.

    Raises:
        SceneError: the scene has no fixed object for a shed.
        OptionError: there are to be too many animals.
    """

    def __init__(
        self,
        scene: Scene,
        camera: Camera,
        rng: np.random.Generator,
        layout: Layout | None = None,
        make_reid: ReidFactory = SpatialReid,
        perception: Perception | None = None,
        hand_detector: HandDetector | None = None,
        animals_a_second: float = ANIMALS_A_SECOND,
        carry: str = "drag",
    ) -> None:
        layout = layout or scene.layout
        if not layout.fixed.any():
            raise SceneError("objects", "must hold a fixed one, the shed", list(layout.labels))
        if not 0 <= animals_a_second <= MOST_ANIMALS_A_SECOND:
            expected = f"must be 0 to {MOST_ANIMALS_A_SECOND:g}"
            raise OptionError("animals_a_second", expected, animals_a_second)
        self.scene, self.rng = scene, rng
        self._visits = new_structs(Visit, 1)
        self.camera = camera
        self._lifts = known_name("carry", carry, CARRIES) == "lift"
        self.tabletop = Tabletop(layout, scene.size, self._lifts)
        self.tracker = Tracker(scene, layout, make_reid, perception)
        self.hand_detector = hand_detector or GeometricHandDetector()
        self.counters = Counters.zero(len(layout))
        self.flock = Flock(ANIMAL_SPEED_M_S)
        self.sightings: list[Sighting] = []
        self.missing: dict[int, tuple[str, ...]] = {}
        self.open_gates: dict[int, float] = {}
        self._shed = int(np.flatnonzero(layout.fixed)[0])
        self._goals = np.flatnonzero(layout.movable)
        self._routes = Routes(self._goals, self._shed, rng)
        self._led, self._visits["known"] = False, -1
        self._by_geometry = type(self.hand_detector) is GeometricHandDetector
        self._make_room(0)
        self.allow(None)
        self._warm_up(animals_a_second)

    @property
    def camera(self) -> Camera:
        """The headset's camera."""
        return self._camera

    @camera.setter
    def camera(self, camera: Camera) -> None:
        self._camera, self._visits["eye"][0] = camera, eye_of(camera)

    @property
    def phase(self) -> Phase:
        """What is going on."""
        return Phase.HAND if self._visits["visited"].item() else Phase.PLAY

    @property
    def clock(self) -> float:
        """Seconds played so far."""
        return self.flock.now

    @property
    def truth(self) -> Layout:
        """Where everything really is."""
        return self.tabletop.layout

    @property
    def places(self) -> FloatArray:
        """(N, 3 or more) true x and z, metres, and pymunk's angle, radians, of all objects."""
        return self.tabletop.space.places

    @property
    def changes(self) -> int:
        """How often that has changed."""
        return int(self._changes.item())

    @property
    def believed(self) -> Layout:
        """Where the game believes everything to be."""
        return self.tracker.belief.layout

    @property
    def miscounts(self) -> int:
        """Animals so far that did not get into the building of their colour."""
        return int(self._astray.item())

    def render_state(self, caption: str = "") -> RenderState:
        """All there is to see now."""
        return RenderState(
            scene=self.scene,
            truth=self.truth,
            believed=self.believed,
            wrong=self.tracker.belief.wrong,
            camera=self.camera,
            phase=self.phase.text,
            seconds=self.clock,
            counts=self.counters.counted,
            misplaced=self.counters.misplaced,
            hand=self.tabletop.hand,
            animal=self.flock.position,
            animal_heading=self.flock.heading,
            animal_goal=self.flock.goal,
            caption=caption,
            missing=self.missing,
            open_gates=self.open_gates,
        )

    def state(self) -> dict[str, FloatArray | float]:
        """All that may change, by name."""
        hand, camera = self.tabletop.hand, self.camera
        clock, visit = self.flock.herd.clocks, self._visits
        position, yaw = self.tabletop.poses()
        counters = self.counters
        arm = [] if hand is None else [*hand.position, hand.yaw, *hand.velocity, hand.raised]
        return {
            "position": position,
            "yaw": yaw,
            **self.tracker.belief.state(),
            "counted": counters.counted.astype(np.float64),
            "misplaced": counters.misplaced.astype(np.float64),
            "stranded": counters.stranded.astype(np.float64),
            "animal_goal": self.flock.goal.astype(np.float64),
            "animal_curve": self.flock.curve,
            "camera_position": camera.position,
            "camera_yaw": camera.yaw,
            "camera_pitch": camera.pitch,
            "camera_height": 0.0 if camera.height is None else camera.height,
            "ticks": self.tabletop.ticks,
            "gripped": -1 if hand is None or hand.gripped is None else hand.gripped,
            "time": float(clock["now"].item()),
            "animal_speed": float(clock["speed"].item()),
            "animals": float(clock["running"].item()),
            "next_arrival": float(clock["next"].item()),
            "seconds_between": float(clock["period"].item()),
            "animals_sent": float(clock["sent"].item()),
            "astray": float(clock["astray"].item()),
            "hand_in_view": float(visit["visited"].item()),
            "ticks_away": float(visit["away"].item()),
            "ticks_pending": float(visit["pending"].item()),
            "foreseen": float(visit["known"].item()),
            "hand": np.array(arm, dtype=np.float64),
        }

    def rearrange(self, layout: Layout) -> None:
        """Have everything stand elsewhere at once, unseen and untouched; beliefs stay as they are.

        Args:
            layout: where the same objects are from now on.
        """
        self.tabletop = Tabletop(layout, self.scene.size, self._lifts)
        self._visits["known"] = -1
        self._make_room(0)
        self.allow(None)

    def begin_visit(self, camera: Camera | None = None) -> None:
        """The hand comes into view: the animals freeze. The camera is the one that will take the snapshot."""
        self.camera = camera or self.camera
        self._visits["visited"], self._visits["away"] = True, 0

    def move(
        self,
        index: int,
        displacement: FloatArray,
        turn: float,
        record: Callable[[Tabletop], None] | None = None,
        *,
        most: MotionLimit | None = None,
    ) -> Motion:
        """The hand carries one building to another place; dragged, it pushes what is in the way.

        Args:
            index: the building.
            displacement: (2,) metres in x and z.
            turn: radians, clockwise.
            record: called at every tick.
            most: how much all buildings may be moved; the hand stops before it is more.
        """
        position, yaw = self.tabletop.poses()
        before = self.tabletop.moved
        goal = position[index] + displacement
        self.tabletop.carry(index, goal, float(yaw[index] + turn), record, most=most)
        return self.tabletop.moved - before

    def end_visit(self, camera: Camera | None = None) -> Sighting:
        """The hand has left: snapshot, poses, identification; then only the ends of the paths move."""
        sighting = self.look(camera)
        self._visits["visited"], self._visits["away"] = False, 0
        return sighting

    def look(self, camera: Camera | None = None) -> Sighting:
        """Take a snapshot, and believe what it is identified as."""
        sighting = self.tracker.look(self.truth, camera or self.camera, self.rng)
        self.sightings.append(sighting)
        if sighting.changed.any():
            self._follow(sighting.changed)
        return sighting

    def play(self, seconds: float) -> None:
        """Let the animals run. While the hand is visible they do not.

        Args:
            seconds: 0 to `LONGEST_PLAY_S`.

        Raises:
            OptionError: it is less, or more.
        """
        if not 0 <= seconds <= LONGEST_PLAY_S:
            raise OptionError("seconds", f"must be 0 to {LONGEST_PLAY_S:g}", seconds)
        if self.phase is Phase.PLAY:
            self._run(seconds)

    def send(self, animals_a_second: float) -> None:
        """From now on so many animals leave the shed, all colours together; 0 for none."""
        clock, n = self.flock.herd.clocks[0], len(self._goals)
        clock.period = n / animals_a_second if animals_a_second > 0 else np.inf
        clock.sent = int(np.ceil(clock.now / clock.period * n)) if animals_a_second > 0 else n

    def house(self, label: int, other: int) -> None:
        """From now on animals of a label go to another label's building and count as its own.

        Args:
            label: whose animals, those on their way too.
            other: in whose building; the same for their own again, which those under way elsewhere let be.
        """
        routes, animals = self._routes.all, self.flock.herd.animals
        routes["goal"][np.flatnonzero(self._goals == label)] = other
        running = self.flock.herd.queue["slot"][: len(self.flock)]
        if label != other:
            animals["goal"][running[animals["goal"][running] == label]] = other
            self.flock.redirect(self.believed.position, np.arange(len(self.truth)) == other)
        self._forget_routes()

    def bring_hand(self) -> None:
        """A hand to steer, at the player's side, out of view."""
        width, _ = self.scene.size
        self.tabletop.bring_hand((width / 2, HAND_WAITS_AT_Z))

    def allow(self, most: MotionLimit | None) -> None:
        """From now on a steered hand may move the buildings by so much, by default as much as it likes.

        It stops before it is more, and then touches nothing any more.
        """
        (most or MotionLimit()).begin(self._visits["limits"], self.tabletop.moved)

    def withdraw_hand(self) -> tuple[Motion, Sighting | None]:
        """The hand lets go and is gone at once.

        Returns:
            What the buildings still did, and the sighting if that ends a visit.
        """
        before = self.tabletop.moved
        self.tabletop.put_down(self._visits["limits"])
        self.tabletop.remove_hand()
        self.tabletop.settle()
        sighting = self.end_visit() if self.phase is Phase.HAND else None
        return self.tabletop.moved - before, sighting

    def tick(self, velocity: FloatArray, twist: float, grip: bool) -> tuple[Motion, Sighting | None]:
        """One tick under a hand that is steered, as `steer` describes it."""
        motion, _, sighting = self.steer(float(velocity[0]), float(velocity[1]), twist, grip, 1)
        return motion, sighting

    def steer(
        self, vx: float, vz: float, twist: float, grip: bool, ticks: int
    ) -> tuple[Motion, int, Sighting | None]:
        """Ticks under a hand that is steered: physics, freezing, and at the end of a visit the snapshot.

        Args:
            vx: velocity of the hand along x, metres a second.
            vz: the same along z.
            twist: of the hand, radians a second, clockwise.
            grip: whether the hand is closed. It grips what it closes on, if that is in view.
            ticks: how many at most; fewer if a visit ends before.

        Returns:
            What they did to the buildings, how many there were, and the sighting if they ended a visit.
        """
        passed, over, metres, radians = 0, False, 0.0, 0.0
        while passed < ticks and not over:
            left = ticks - passed
            if not self._by_geometry:
                self._tick_and_look(vx, vz, -twist, grip)
            elif not phases.steer(self._arrays, vx, vz, -twist, grip, left):
                passed = ticks
                break
            done, over, pending, way, turn = self._outcomes.item()
            passed, metres, radians = passed + done, metres + way, radians + turn
            if pending:
                self._run(pending * TICK_S)
        motion = Motion(metres, radians) if metres or radians else UNMOVED
        if not over:
            return motion, passed, None
        before = self.tabletop.moved
        self.tabletop.settle()
        return motion + (self.tabletop.moved - before), passed, self.end_visit()

    def _tick_and_look(self, vx: float, vz: float, spin: float, grip: bool) -> None:
        """What `phases.steer` does in a tick, with a detector of its own."""
        before, visit, state = self.tabletop.moved, self._visits[0], self.tabletop.space.states[0]
        control_tick(state, self.tabletop.space.bodies, visit.eye, visit.limits, vx, vz, spin, grip)
        over = phases.watch(state, visit, self.sees_hand())
        pending, visit.pending = visit.pending, 0
        self._outcomes[0] = (1, over, pending, *(self.tabletop.moved - before))

    def describe_hand(self, numbers: npt.NDArray[np.float32]) -> None:
        """Fill in the (8,) numbers that an observation has of the hand, as `phases.describe_hand` says."""
        phases.describe_hand(self.tabletop.space.states, self._visits, numbers)

    def sees_hand(self) -> bool:
        """Whether the hand detector sees the hand now."""
        return bool(
            self.hand_detector.sees_hand(HandView(self.camera, self.tabletop.hand, self.render_state))
        )

    def _run(self, seconds: float) -> None:
        """Let the animals run."""
        if self._visits["known"].item() != self.changes:
            self._look_ahead()
        end = self.flock.now + seconds
        while not arrival.run(self.flock.herd, self._routes.all, self.counters.counts, end):
            self._make_room(1)

    def _follow(self, changed: BoolArray) -> None:
        """Move the ends of paths of (N,) labels to where their buildings are believed to be."""
        self._redirect(self.believed.position, changed)

    def _redirect(self, ends: FloatArray, changed: BoolArray) -> None:
        """Move the ends of paths, (N, 2) metres, of the labels that are marked."""
        self.flock.redirect(ends, changed)
        self._forget_routes()

    def _forget_routes(self) -> None:
        """Have routes and arrivals worked out anew before animals run."""
        self._led, self._visits["known"] = False, -1

    def _make_room(self, more: int) -> None:
        """Have room for so many animals more, and know what kernels work on."""
        self.flock.make_room(more)
        space, herd = self.tabletop.space, self.flock.herd
        self._arrays = GameArrays(
            space.states, space.bodies, self._visits, *herd, self._routes.all, self.counters.counts
        )
        self._changes, self._astray = space.states["changes"], herd.clocks["astray"]
        self._outcomes = self._visits["outcome"]

    def _look_ahead(self) -> None:
        """Have everybody know who arrives where, now that buildings have moved or are believed elsewhere."""
        if not self._led:
            self._routes.lead_to(self.believed, self.scene.size)
        layout = self.scene.layout
        arrival.find_arrivals_on(
            self._routes.all, self.flock.look_ahead(*self.tabletop.poses(), layout.size, layout.movable)
        )
        self._led, self._visits["known"] = True, self.changes

    def _warm_up(self, animals_a_second: float) -> None:
        """Fill the routes with animals that left before the game began, and forget those that are home."""
        clock, n = self.flock.herd.clocks[0], len(self._goals)
        if animals_a_second <= 0:
            clock.period = np.inf
            return
        clock.period = n / animals_a_second
        each = int(np.ceil(WARM_UP_S / clock.period))
        clock.sent = -n * each
        self._make_room(n * each // 2)  # for about those that are still on their way
        clock.now = -each * clock.period
        self.play(float(-clock.now))
        clock.now, clock.astray = 0.0, 0
        for name in ("counted", "misplaced", "stranded"):
            self.counters.counts[name][:] = 0
