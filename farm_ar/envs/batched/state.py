"""What a batch of environments consists of: records and arrays, one row an environment."""

from __future__ import annotations

from typing import Annotated, Generic, NamedTuple, TypeVar, overload

from farm_ar.arrays import BoolArray, FloatArray, IntArray
from farm_ar.envs.batched.streams import Stream
from farm_ar.envs.features import Float32Array, Room
from farm_ar.game_logic.animals.arrival import Animal, Clock, Counts, Due
from farm_ar.game_logic.animals.curve_intersection import Footprint
from farm_ar.game_logic.animals.routes import Route
from farm_ar.game_logic.physics.state import Body, Limits, State
from farm_ar.geometry.camera import Eye
from farm_ar.reid.assignment import Answer, CostModel, Seen, Workspace
from farm_ar.structs import Struct, Structs

S = TypeVar("S", bound=Struct)


class Rows(Generic[S]):
    """How arrays of structs are typed that have a row, or more, for each environment."""

    shape: tuple[int, ...]

    @overload
    def __getitem__(self, index: int) -> Structs[S]: ...
    @overload
    def __getitem__(self, index: tuple[int, ...]) -> S: ...
    def __getitem__(self, index: int | tuple[int, ...]) -> Structs[S] | S:
        """The structs of one environment, or one struct."""
        raise NotImplementedError

    def __setitem__(self, index: tuple[int, ...], value: S) -> None:
        """Fill in one struct."""
        raise NotImplementedError


TERMS = 2
"""The most terms that a reward has, beside effort."""


class Choices(Struct):
    """What was chosen of all environments; numbers as in `EnvConfig`."""

    game: bool
    action: int
    reward: int
    sign: float
    effort_weight: float
    by_effort: bool
    """Whether the budget is one effort in place of metres and radians."""
    budget_m: float
    budget_rad: float
    budget: float
    visits: int
    """0 for no end."""
    moves: int
    layouts: int
    """How they are drawn."""
    spread_m: float
    spread_rad: float
    yaw_limit: float
    gap_m: float
    apart_m: float
    """How far apart places are that are drawn anywhere, metres."""
    cameras: int
    eye_height_m: float
    head_noise: float
    """Radians."""
    new_gaze: bool
    """Whether each visit has a camera of its own."""
    animals_a_second: float
    play_seconds: float
    lazy: bool
    """Whether only those animals are played that may go astray: there is one visit, and `info` has
    only how many did."""
    reach_m: float
    """Of the action, metres and radians, and how far it picks."""
    reach_rad: float
    pick_m: float
    most_alike: int
    """The most movable objects of one kind."""
    width: float
    depth: float
    diagonal_m: float
    shed: int
    budget_at: int
    """Where the budget is among the numbers of an observation."""
    same_step: bool
    """Whether an episode that is over is followed by another within the step."""


class Table(Struct):
    """One environment, beside its arrays."""

    stream: Stream
    stage: int
    over: bool
    metres: float
    """Left of the budget."""
    radians: float
    effort: float
    moves_left: int
    visits_left: int
    accuracy: float
    wrong: int
    least_margin: float
    ambiguity: float
    expected_wrong: float
    before: Annotated[FloatArray, (TERMS,)]
    """What the reward's terms measured when the step began."""
    foreseen: float
    moved: float
    """In the step, as an effort."""
    until: float
    """When a play that is under way ends, seconds."""
    led: bool
    """Whether their routes lead to where labels are believed to be."""
    known: int
    """The `changes` of the table for which they know where they arrive, -1 for none."""
    foresaw: bool
    """Whether the footprints are those for which that was found out."""


class Report(Struct):
    """What `info` has of one environment."""

    accuracy: float
    wrong_labels: int
    paper_margin: float
    effort: float
    miscounts: int
    phase: int
    terms: Annotated[FloatArray, (TERMS,)]
    effort_cost: float


class Scenery(NamedTuple):
    """What does not change: M objects, and how they are drawn and identified.

    Args:
        position: (M, 2) the scene's own layout, metres.
        yaw: (M,) radians.
        kind: (M,) codes of categories.
        size: (M, 3) metres.
        elevation: (M,) metres.
        fixed: (M,) whether they never move.
        movable: (N,) numbers of the others.
        edge: (M, 2) how far from the room's edges objects keep, metres.
        room: (2,) its width and depth, metres.
        keeps_clear: (M, M) pairs whose footprints must not overlap.
        path: (P, 3) x, z and yaw of the places on a camera's path.
        bows: by how much animals' routes may be bowed, metres.
        levels: of the action `displacement`, from -1 to 1.
        shares: of the action `slot`.
        log_sides: (M, 3) sorted logarithms of the sides.
        size_of: (M,) which of the sizes a label has, for the method.
        sides: (U, 3) sorted logarithms of the sides of each size, likewise.
        model: the method's weights and terms.
        clutter_model: those of the reward `clutter`.
        features: what `read_table` needs.
        eyes: (1,) a camera that looks like all that are drawn.
    """

    position: FloatArray
    yaw: FloatArray
    kind: IntArray
    size: FloatArray
    elevation: FloatArray
    fixed: BoolArray
    movable: IntArray
    edge: FloatArray
    room: FloatArray
    keeps_clear: BoolArray
    path: FloatArray
    bows: FloatArray
    levels: FloatArray
    shares: FloatArray
    log_sides: FloatArray
    size_of: IntArray
    sides: FloatArray
    model: CostModel
    clutter_model: CostModel
    features: Room
    eyes: Structs[Eye]


class Batch(NamedTuple):
    """B environments of M objects, N of them movable.

    Args:
        tables: (B,).
        eyes: (B,) their cameras.
        states: (B,) of the tabletops.
        bodies: (B, M) of the tabletops.
        places: (B, M, W) the same memory: x and z, metres, and Chipmunk's angle, radians.
        believed: (B, M, 2) where labels are believed to be, metres.
        facing: (B, M) how they are believed to be turned, radians.
        holder: (B, M) the object from which each label was last read.
        number: (B, M) the objects in the agent's order, as in `Objects`.
        kind: (B, M) likewise.
        fixed: (B, M) likewise.
        rivals: (B, M, W') likewise.
        pose: (B, M, 4) as in `Found`.
        margin: (B, M) likewise.
        right: (B, M) likewise.
        cost: (B, M, M) likewise.
    """

    tables: Structs[Table]
    eyes: Structs[Eye]
    states: Structs[State]
    bodies: Rows[Body]
    places: FloatArray
    believed: FloatArray
    facing: FloatArray
    holder: IntArray
    number: IntArray
    kind: IntArray
    fixed: BoolArray
    rivals: IntArray
    pose: FloatArray
    margin: FloatArray
    right: BoolArray
    cost: FloatArray


class Herds(NamedTuple):
    """The animals of B environments, N labels sending them on L routes each.

    Args:
        clocks: (B,).
        queue: (B, C) as in `Herd`.
        animals: (B, C) likewise.
        routes: (B, N, L).
        spread: (B, N, L) how far each bows out, metres.
        counts: (B, M).
        buildings: (B, M) footprints for which it was last found out who arrives where.
        start: (B, M, 2) where everything stood when the episode began, metres.
        start_yaw: (B, M) radians.
    """

    clocks: Structs[Clock]
    queue: Rows[Due]
    animals: Rows[Animal]
    routes: Rows[Route]
    spread: FloatArray
    counts: Rows[Counts]
    buildings: Rows[Footprint]
    start: FloatArray
    start_yaw: FloatArray


class Given(NamedTuple):
    """What `reset` was given in place of what would be drawn.

    Args:
        has: (2,) whether there are a layout and a camera.
        position: (M, 2) metres.
        yaw: (M,) radians.
        eyes: (1,) the camera.
    """

    has: BoolArray
    position: FloatArray
    yaw: FloatArray
    eyes: Structs[Eye]


class Output(NamedTuple):
    """What a call fills in, of each environment that it plays.

    Args:
        numbers: (B, L) all parts of the observation, as in `features`.
        reports: (B,).
        masks: (B, A) which choices make sense; (B, 0) for none.
        reward: (B,).
        over: (B,) whether the episode ended.
        last_numbers: (B, L) the last observation of an episode after which another has begun.
        last_reports: (B,) likewise.
        last_masks: (B, A) likewise.
    """

    numbers: Float32Array
    reports: Structs[Report]
    masks: BoolArray
    reward: FloatArray
    over: BoolArray
    last_numbers: Float32Array
    last_reports: Structs[Report]
    last_masks: BoolArray


class Environments(NamedTuple):
    """All that the environments of a batch consist of, and what their calls fill in."""

    batch: Batch
    scenery: Scenery
    herds: Herds
    given: Given
    output: Output


class Work(NamedTuple):
    """What a thread works in.

    Args:
        position: (M, 2).
        yaw: (M,).
        seen: (M,).
        order: (M,).
        asked: (M,) objects of the moves that an action asks for.
        shift: (M, 2) of these, metres.
        turn: (M,) of these, radians.
        tan: (3,) and (7,) for `arctan2`.
        tan_places: likewise.
        tan_data: likewise.
        eyes: (1,).
        streams: (1,).
        changed: (M,) labels whose believed pose changed.
        stray: (M,) labels whose animals may be in another's building.
        limits: (1,).
    """

    position: FloatArray
    yaw: FloatArray
    seen: BoolArray
    order: IntArray
    asked: IntArray
    shift: FloatArray
    turn: FloatArray
    tan: FloatArray
    tan_places: IntArray
    tan_data: int
    eyes: Structs[Eye]
    streams: Structs[Stream]
    changed: BoolArray
    stray: BoolArray
    limits: Structs[Limits]


class Sight(NamedTuple):
    """What a thread identifies a snapshot in, of all M objects.

    Args:
        seen: the detections: views of what it works in.
        site: (M,) zeros: there are no sites.
        sites: (0, 2).
        order: (1, M) of the labels.
        answer: room for it.
        space: to work in.
    """

    seen: Seen
    site: IntArray
    sites: FloatArray
    order: IntArray
    answer: Answer
    space: Workspace
