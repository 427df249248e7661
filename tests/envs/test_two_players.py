"""An adversary and a helper at one table: PettingZoo's own tests, whose turn it is, who is paid."""

import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from pettingzoo.test import api_test, seed_test

from farm_ar.envs.two_players import AdversaryAndHelperEnv, env
from farm_ar.errors import OptionError

QUICK = {"play_seconds": 0.0, "animals_a_second": 0.0}


def test_it_passes_pettingzoos_own_tests(capsys):
    api_test(env(rounds=2, moves=2, **QUICK), num_cycles=60)
    seed_test(lambda: env(moves=2, **QUICK), num_cycles=20)


def play(table, seed, choose):
    """Who played each step, and what both were paid in it."""
    table.reset(seed=seed)
    rows = []
    while not any(table.terminations.values()):
        agent = table.agent_selection
        table.step(choose(agent, table.infos[agent]["action_mask"]))
        rows.append((agent, dict(table.rewards), table.infos[agent]))
    return rows


def test_the_helper_plays_a_visit_after_the_adversarys():
    table, end = env(rounds=2, moves=3, **QUICK), 150
    by = [agent for agent, *_ in play(table, 0, lambda agent, mask: int(np.flatnonzero(mask)[0]))]
    assert by == 3 * ["adversary_0"] + 3 * ["helper_0"] + 3 * ["adversary_0"] + 3 * ["helper_0"]
    assert [agent for agent, *_ in play(table, 0, lambda agent, mask: end)] == 2 * ["adversary_0", "helper_0"]


def test_harm_is_a_gain_and_a_loss_and_effort_is_its_own():
    rng = np.random.default_rng(0)
    harmed = 0.0
    for seed in range(6):
        rows = play(env(**QUICK), seed, lambda agent, mask: int(rng.choice(np.flatnonzero(mask))))
        for agent, rewards, info in rows:
            other = "helper_0" if agent == "adversary_0" else "adversary_0"
            harm = info["reward/identity"]
            assert rewards[other] == (harm if other == "adversary_0" else -harm)
            sign = 1 if agent == "adversary_0" else -1
            assert rewards[agent] == pytest.approx(sign * harm - 0.25 * info["effort"])
            harmed += abs(harm)
    assert harmed > 0


def test_only_whose_turn_it_is_has_choices():
    table = env(**QUICK)
    table.reset(seed=0)
    assert table.infos["adversary_0"]["action_mask"].any()
    assert not table.infos["helper_0"]["action_mask"].any()
    table.step(150)
    assert table.agent_selection == "helper_0"
    assert table.infos["helper_0"]["action_mask"].any()
    assert not table.infos["adversary_0"]["action_mask"].any()


@pytest.mark.parametrize(("name", "value"), [("rounds", 0), ("rounds", 1.5), ("sign", -1), ("visits", 2)])
def test_what_two_players_cannot_have_is_refused(name, value):
    with pytest.raises(OptionError, match=f"^{name}: must be"):
        AdversaryAndHelperEnv(**{name: value})


def test_there_is_nothing_before_a_reset_or_after_the_end():
    table = env(**QUICK)
    for use in (lambda: table.step(0), lambda: table.observe("helper_0")):
        with pytest.raises(ResetNeeded):
            use()
    with pytest.raises(OptionError, match="options: must be a mapping"):
        table.reset(options=5)
    table.reset(seed=0)
    while table.agents:
        table.step(None if table.terminations[table.agent_selection] else 150)
    with pytest.raises(ResetNeeded):
        table.step(0)
