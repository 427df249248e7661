"""Plans of visits: the best there are, within the budget, on clear ways."""

import itertools

import gymnasium as gym
import numpy as np
import pytest

import farm_ar  # noqa: F401  # registers the environments
from farm_ar.agents.policies import beam_search, plan_steps
from farm_ar.agents.policies.analytic import Step, _table, best_plan, move_of, terms_of
from farm_ar.agents.policies.base import possible
from farm_ar.agents.policies.lookahead import effort_of, look_ahead, placed
from farm_ar.agents.policies.plan_steps import SHARES, Allowance, Table
from farm_ar.game_logic.visibility import eyes_of
from farm_ar.scenes import builtin_scene

QUICK = {"play_seconds": 0.0, "animals_a_second": 0.0}
ANYTHING = Allowance(np.inf, np.inf, np.inf, 1.0, 6)


def game(**arguments):
    return gym.make("FarmToTable-v0", **QUICK, **arguments).unwrapped


def two(yaw=(0.0, 0.0)):
    """Two objects of 10 cm, 30 cm apart."""
    position, turned = np.array([[0.1, 0.1], [0.4, 0.1]]), np.array(yaw)
    all_of = np.ones(2, dtype=np.bool_)
    size = np.full((2, 3), 0.1)
    return Table(
        position, turned, position, turned, ~all_of, np.zeros(2, dtype=int), all_of, size, np.zeros(2)
    )


@pytest.fixture
def terms():
    return terms_of(builtin_scene("farm"), "slot", 0.25)


@pytest.mark.parametrize("kernel", [plan_steps.is_clear, plan_steps.is_clear.py_func])
@pytest.mark.parametrize(
    ("target", "clear"),
    [
        ((0.25, 0.1), True),
        ((0.35, 0.1), False),
        ((0.7, 0.1), False),
        ((0.7, 0.5), True),
        ((0.1, -0.1), False),
    ],
)
def test_a_way_through_another_object_or_off_the_table_is_not_clear(terms, kernel, target, clear):
    table = two()
    assert kernel(table, terms, table.position, table.yaw, 0, *target, 0.0) is clear


def test_plans_have_a_step_per_object_and_no_more_than_moves_are_left():
    env = game(action="slot", moves=3)
    for seed in range(3):
        env.reset(seed=seed)
        plan = best_plan(env, 4)
        assert 0 < len(plan) <= 3
        assert len({step.mover for step in plan}) == len(plan)


@pytest.mark.parametrize("kernel", [plan_steps.target, plan_steps.target.py_func])
def test_what_the_budget_does_not_reach_is_scaled_down(terms, kernel):
    table, spent = two((0.0, 0.4)), np.array([0.25, 0.0])
    x, z, yaw, metres, radians = kernel(table, terms, ANYTHING._replace(metres=0.4), spent, 0, 1, 2)
    assert (x, z, yaw) == pytest.approx((0.25, 0.1, 0.4))
    assert (metres, radians) == pytest.approx((0.15, 0.4))
    *_, metres, radians = kernel(table, terms, ANYTHING._replace(metres=0.2), spent, 0, 1, 2)
    assert (metres, radians) == pytest.approx((0.0, 0.4))
    # Where both are one budget, both are scaled.
    both = ANYTHING._replace(effort=0.25 + (0.3 + 0.4 / np.pi) / 2)
    *_, metres, radians = kernel(table, terms, both, spent, 0, 1, 2)
    assert (metres, radians) == pytest.approx((0.15, 0.2))


@pytest.mark.parametrize("action", ["slot", "displacement", "continuous"])
def test_a_step_reaches_what_its_action_reaches(action):
    env = game(action=action)
    env.reset(seed=1)
    view, terms = env.view, terms_of(env.view.scene, action, 0.25)
    truth, believed = view.truth, view.believed
    table = two()._replace(
        position=truth.position,
        yaw=truth.yaw,
        label_position=believed.position,
        label_yaw=believed.yaw,
    )
    same = [
        (i, j)
        for i in view.movable
        for j in view.movable
        if i != j and truth.category[i] == truth.category[j]
    ]
    for (i, j), share in itertools.product(same, range(len(SHARES))):
        x, z, yaw, _, _ = plan_steps.target(table, terms, ANYTHING, np.zeros(2), i, j, share)
        move = possible(env, move_of(view, Step(i, j, float(SHARES[share]))))
        assert (x, z) == pytest.approx(truth.position[i] + move.displacement)
        assert yaw == pytest.approx(truth.yaw[i] + move.turn)


def test_the_plan_is_the_best_of_all_where_there_are_few():
    """Against all sets of two steps, weighed by the players' own foresight."""
    env = game(action="slot", moves=2)
    for seed in range(3):
        env.reset(seed=seed)
        view = env.view
        code = view.truth.category_code
        steps = [
            Step(i, j, share)
            for i in view.movable
            for j in view.movable
            if view.in_view[i] and i != j and code[i] == code[j]
            for share in SHARES.tolist()
        ]
        most = 0.0
        for plan in itertools.chain.from_iterable(itertools.combinations(steps, n) for n in (1, 2)):
            if len({step.mover for step in plan}) == len(plan):
                most = max(most, gain(env, plan))
        found = best_plan(env, 2000)
        assert gain(env, found) <= most + 1e-9
        # The search takes clear ways only; where nothing is in the way of the best it must find one as good.
        if gain(env, found) < most - 1e-9:
            assert not clear_of_all(env, most, steps)


@pytest.mark.parametrize("action", ["slot", "displacement"])
def test_a_step_that_could_come_first_is_worth_what_can_still_be_had_after_it(action):
    """Against all second steps, in this order."""
    env, checked = game(action=action, moves=2, jitter="easy"), 0
    for seed in range(4):
        env.reset(seed=seed)
        m, terms = len(env.view.truth), terms_of(env.view.scene, action, env.config.effort_weight)
        budget, eye = env.budget.most, eyes_of(env.view.camera)
        allowed = Allowance(budget.metres, budget.radians, np.inf, env.view.scene.diagonal, 2)
        steps, worth = np.zeros((2, 3), dtype=np.int64), np.empty((m, m, len(SHARES)))
        beam_search.search(_table(env), eye, terms, allowed, 2000, steps, worth)
        for i, j, share in np.argwhere(worth > worth.max() - beam_search.SLACK):
            first = Step(int(i), int(j), float(SHARES[share]))
            second = [
                Step(int(k), int(n), float(part))
                for k, n in itertools.product(env.view.movable, repeat=2)
                for part in SHARES
                if k != i and env.view.truth.category[k] == env.view.truth.category[n] and n != k
            ]
            most = max(
                gain(env, plan)
                for plan in ([first], *([first, s] for s in second))
                if clear_in_order(env, plan)
            )
            assert worth[i, j, share] <= most + 1e-6
            checked += 1
    assert checked > 8


@pytest.mark.parametrize("kernel", [beam_search._can_begin, beam_search._can_begin.py_func])
def test_a_step_whose_way_another_must_clear_is_not_said_to_come_first(terms, kernel):
    position = np.array([[0.1, 0.1], [0.4, 0.1], [0.8, 0.1], [1.0, 0.6]])
    table = two()._replace(
        position=position,
        yaw=np.zeros(4),
        label_position=np.vstack([position[:3], [[0.4, 0.45]]]),
        label_yaw=np.zeros(4),
        size=np.full((4, 3), 0.1),
    )
    # Object 1 stands in the way of object 0 to label 2's place, not in that of object 2 to label 3's.
    away, through, aside = (1, 3, 2), (0, 2, 0), (2, 3, 0)
    assert not kernel(table, terms, ANYTHING, np.array([away, through]), 1)
    assert kernel(table, terms, ANYTHING, np.array([away, through]), 0)
    assert kernel(table, terms, ANYTHING, np.array([away, aside]), 1)
    # Where the budget falls short, it falls short of the last.
    assert not kernel(table, terms, ANYTHING._replace(metres=0.6), np.array([away, aside]), 1)


def clear_in_order(env, plan):
    """Whether the steps of a plan can be taken one after the other."""
    view, terms = env.view, terms_of(env.view.scene, str(env.config.action), env.config.effort_weight)
    position, yaw = view.truth.position.copy(), view.truth.yaw.copy()
    table = two()._replace(size=view.truth.size)
    for move in env.budget.fitted([possible(env, move_of(view, step)) for step in plan]):
        end, heading = position[move.index] + move.displacement, yaw[move.index] + move.turn
        if not plan_steps.is_clear(table, terms, position, yaw, move.index, *end, heading):
            return False
        position[move.index], yaw[move.index] = end, heading
    return True


def gain(env, plan):
    moves = env.budget.fitted([possible(env, move_of(env.view, step)) for step in plan])
    position, yaw = placed(env.view, moves)
    wrong = int(look_ahead(env, position[None], yaw[None]).wrong[0])
    return wrong - env.config.effort_weight * effort_of(env.view, moves)


def clear_of_all(env, most, steps):
    """Whether a pair of steps with the highest gain can be taken in one order or the other."""
    view, terms = env.view, terms_of(env.view.scene, "slot", env.config.effort_weight)
    truth = view.truth
    for plan in itertools.permutations(steps, 2):
        if plan[0].mover == plan[1].mover or gain(env, plan) < most - 1e-9:
            continue
        position, yaw, fine = truth.position.copy(), truth.yaw.copy(), True
        table = two()._replace(size=truth.size)
        for move in env.budget.fitted([move_of(view, step) for step in plan]):
            i = move.index
            end = position[i] + move.displacement
            heading = yaw[i] + move.turn
            fine &= plan_steps.is_clear(table, terms, position, yaw, i, *end, heading)
            position[i], yaw[i] = end, heading
        if fine:
            return True
    return False


def test_plain_python_plans_the_same(monkeypatch):
    env = game(action="slot", moves=3)
    env.reset(seed=2)
    allowed = Allowance(0.6, 1.5, np.inf, env.view.scene.diagonal, 3)
    terms, eye = terms_of(env.view.scene, "slot", 0.25), eyes_of(env.view.camera)
    m, found = len(env.view.truth), []
    for kernel in (beam_search.search, beam_search.search.py_func):
        if kernel is not beam_search.search:
            for name in ("_no_steps", "_go_on", "_look_ahead", "_longer"):
                monkeypatch.setattr(beam_search, name, getattr(beam_search, name).py_func)
        steps, worth = np.zeros((3, 3), dtype=np.int64), np.empty((m, m, len(SHARES)))
        with np.errstate(over="ignore"):  # sums of keys may wrap around
            count = kernel(_table(env), eye, terms, allowed, 2, steps, worth)
        assert count > 0
        found.append((steps[:count].tolist(), worth.tolist()))
    assert found[0] == found[1]
    # No step that could come first is worth more than the best plan, and the first of that is worth it.
    (i, j, share), *_ = found[0][0]
    assert worth[i, j, share] == worth.max()


@pytest.mark.parametrize("kernel", [beam_search._judge, beam_search._judge.py_func])
def test_two_that_changed_places_are_both_wrong_and_one_that_is_not_seen_stays_as_it_was(terms, kernel):
    table = two()
    swapped, both = table.position[::-1].copy(), np.array([True, True])
    wrong, doubt = kernel(0, table, terms, both, swapped, table.yaw)
    assert wrong == 2
    # To be told right, both would have to go 30 cm the other way; no margin of 0.3.
    assert doubt == pytest.approx(max(0.0, 1 - 2 * 0.3 * terms.metre / 0.3))
    wrong, _ = kernel(0, table._replace(wrong=both), terms, ~both, swapped, table.yaw)
    assert wrong == 2
    assert kernel(0, table._replace(wrong=both), terms, both, table.position, table.yaw)[0] == 0


@pytest.mark.parametrize("kernel", [plan_steps._possible, plan_steps._possible.py_func])
def test_a_wish_becomes_the_level_nearest_to_it(kernel):
    assert kernel(0.17, 0.3, 0) == 0.17
    assert kernel(0.5, 0.3, 0) == 0.3
    assert [kernel(v, 0.3, 7) for v in (0.17, -0.14, 0.5, 0.0)] == pytest.approx([0.2, -0.1, 0.3, 0.0])
