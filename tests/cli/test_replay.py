"""`farm-ar replay`: an episode from its file, played again."""

import json

import pytest

from farm_ar.envs import FarmToTableEnv, save_trace


@pytest.fixture(scope="module")
def trace():
    """An episode of three steps and three visits."""
    env = FarmToTableEnv(control="layout", visits=3, play_seconds=0.2)
    env.reset(seed=3)
    env.action_space.seed(3)
    for _ in range(3):
        env.step(env.action_space.sample())
    return env.trace()


@pytest.fixture
def saved(tmp_path):
    """Writes a trace to a file."""

    def saved(trace):
        save_trace(trace, tmp_path / "trace.json")
        return tmp_path / "trace.json"

    return saved


def test_an_episode_that_plays_again_as_it_was_is_bit_exact(run, saved, trace):
    result = run("replay", saved(trace))
    assert (result.exit_code, result.stdout) == (0, "3 steps, bit-exact\n")


def test_a_trace_that_was_dumped_by_hand_is_read_too(run, trace, tmp_path):
    with (tmp_path / "mine.json").open("w") as file:
        json.dump(trace, file)
    assert run("replay", "mine.json").exit_code == 0


def test_the_first_step_that_differs_is_named(run, saved, trace):
    actions = [trace["actions"][0], [0.0] * len(trace["actions"][1]), trace["actions"][2]]
    result = run("replay", saved(trace | {"actions": actions}))
    assert (result.exit_code, result.stdout) == (1, "differs from step 2 on (of 3)\n")


def test_another_beginning_differs_from_step_0_on(run, saved, trace):
    arguments = trace["arguments"] | {"jitter": "hard"}
    result = run("replay", saved(trace | {"arguments": arguments}))
    assert (result.exit_code, result.stdout) == (1, "differs from step 0 on (of 3)\n")


def test_one_step_is_not_called_steps(run, saved, trace):
    short = trace | {"actions": trace["actions"][:1], "hashes": trace["hashes"][:2]}
    assert run("replay", saved(short)).stdout == "1 step, bit-exact\n"


def test_a_file_that_is_no_trace_is_one_line(mistake, saved, trace, tmp_path):
    assert mistake("replay", "nowhere.json").startswith("TraceError: nowhere.json: file: must be a readable")
    (tmp_path / "half.json").write_text('{"actions": [')
    assert mistake("replay", "half.json").startswith("TraceError: half.json: file: must be JSON")
    del (parts := dict(trace))["generator"]
    assert mistake("replay", saved(parts)).startswith("TraceError: trace.json: generator: must be")


def test_an_argument_that_there_is_not_is_one_line(mistake, saved, trace):
    wrong = trace | {"arguments": trace["arguments"] | {"jitter": "wild"}}
    assert mistake("replay", saved(wrong)).startswith("OptionError: jitter: must be one of")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"arguments": {"speed": 3}}, "arguments: must be among scene, control,"),
        ({"arguments": 3}, "arguments: must be a JSON object, got 3"),
        ({"generator": {"bit_generator": "PCG64"}}, "generator.state: must be a JSON object, got nothing"),
        ({"generator": {"bit_generator": "MT19937"}}, "generator.bit_generator: must be one of PCG64"),
        ({"generator": None}, "generator: must be a JSON object, got None"),
        ({"hash": 7}, "hash: must be a non-empty string, got 7"),
        ({"hashes": ["a", None]}, "hashes[1]: must be a non-empty string, got None"),
        ({"options": {"layout": {"position": [[0, 1e9]]}}}, "options.layout.position[0]: must be [x, z]"),
        ({"options": {"camera": {"position": [0, 0], "yaw": 1e300}}}, "options.camera.yaw: must be a number"),
        ({"options": 3}, "options: must be a JSON object, got 3"),
        ({"actions": [[0.0], [0.0], [0.0]]}, "actions: must be actions of an episode with these arguments"),
        ({"actions": ["left", {}, None]}, "actions[0]: must be a number or a list of numbers, got 'left'"),
    ],
    ids=str,
)
def test_a_trace_whose_values_cannot_be_played_is_one_line(mistake, saved, trace, change, message):
    assert mistake("replay", saved(trace | change)).startswith(f"TraceError: trace.json: {message}")


def test_more_actions_than_the_episode_has_are_one_line(mistake, saved, trace):
    longer = {"actions": trace["actions"] * 2, "hashes": trace["hashes"] + trace["hashes"][1:]}
    assert "actions: must be actions of an episode" in mistake("replay", saved(trace | longer))
