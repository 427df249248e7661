"""Re-identification of identical objects from one egocentric snapshot, and a game that tests it.

Importing this package registers its environments with Gymnasium; so does
`gym.make("farm_ar:FarmToTable-v0")`.
"""

import json
from pathlib import Path

from gymnasium.envs.registration import register

from farm_ar.moved import find_moved

__version__ = "0.1.0"

_ENVIRONMENTS: dict[str, dict[str, str | bool | float | None]] = {
    "FarmToTable-v0": {"control": "move"},
    "FarmToTableHand-v0": {"control": "hand"},
    "FarmToTableHandLift-v0": {"control": "hand", "carry": "lift"},
    "FarmToTableLayout-v0": {"control": "layout"},
    "SceneLayout-v0": {"control": "layout", "game": False, "scene": "L1", "budget": 0.4},
}

_VARIANTS: dict[str, dict[str, str]] = {
    "": {},
    "Discrete": {"action": "discrete", "observation": "flat"},
    "BlackBox": {"knowledge": "black-box"},
    "Shaped": {"reward": "shaped"},
}

_REFERENCES = json.loads(
    (Path(__file__).parent / "envs" / "reference_returns.json").read_text(encoding="utf-8")
)["ids"]

for _name, _arguments in _ENVIRONMENTS.items():
    for _variant, _others in _VARIANTS.items():
        _id = _name.replace("-", f"{_variant}-")
        # What a variant shows changes no return; one with a reward of its own has no threshold.
        _scored = _name if _variant == "BlackBox" else _id
        register(
            _id,
            entry_point="farm_ar.envs:make_farm_to_table",
            vector_entry_point="farm_ar.envs.batched:make_vector_env",
            kwargs=_arguments | _others,
            reward_threshold=_REFERENCES.get(_scored, {}).get("reward_threshold"),
        )
register("DeliverToChair-v0", entry_point="farm_ar.envs:make_deliver_to_chair")

find_moved()
