"""Each kind of file is declared once: what its JSON Schema allows is what its reader takes."""

import json
import random
from typing import Any

import jsonschema
import numpy as np
import pytest
from hypothesis import settings

from farm_ar.agents.stress.failures import REPORT
from farm_ar.benchmark.suite import ANSWERS, SUITE
from farm_ar.cli.scenes import KINDS
from farm_ar.envs.trace import TRACE
from farm_ar.errors import InputError
from farm_ar.scenes import BUILTIN, builtin_scene, scene_from_dict, scene_to_dict, snapshot_from_dict
from farm_ar.scenes.declarations import CAMERA
from farm_ar.scenes.json_files import SCENE, SNAPSHOT
from farm_ar.scenes.kinds import MismatchError, is_text
from farm_ar.showcases.script import SCRIPT
from farm_ar.vision.photos import image_camera_from_dict

DECLARED = {
    "scene": SCENE,
    "snapshot": SNAPSHOT,
    "camera": CAMERA,
    "trace": TRACE,
    "script": SCRIPT,
    "failures": REPORT,
    "suite": SUITE,
    "answers": ANSWERS,
}
MUTANTS = 10 * settings().max_examples

BESIDE_OTHERS = (
    *("must not repeat an earlier", "must not stand where an earlier", "must be a category of the objects"),
    *("must be named after a category", "must be 4, 7, 10", "must not all be the same point"),
    *("must be given, as other objects have", "must be the corners of a polygon", "must not be the corner"),
    *("must not be there beside units", "must not be there: in frame", "must be a number from -1e6 to 1e6"),
    *("must be a unit quaternion", "must be rigid", "must be a rotation", "must be 4 rows, the last"),
    *("must be 3 positive numbers in metres", "must be finite, from -1e6", "must be positive metres"),
    "must be a positive number, from 1e-6 to 1e6 metres a second",
    *("must be the height of the eye", "must be above the plane", "must be at least 1 pixel each"),
)
"""What may be wrong with values that are right one by one, which no schema says; limits in metres, too, of
what may be in other units."""


def test_there_is_a_schema_of_every_kind():
    elsewhere = ["session"]  # tests/reid/session/test_files.py
    assert [kind for kind in KINDS if kind not in elsewhere] == list(DECLARED)


@pytest.mark.parametrize("kind", DECLARED)
def test_a_schema_is_one_and_allows_a_whole_document(run, documents, kind):
    schema = json.loads(run("schema", kind).stdout)
    assert schema == DECLARED[kind].schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(documents[kind], schema, jsonschema.Draft202012Validator)
    DECLARED[kind].read(documents[kind])


def test_the_older_command_for_the_schema_of_scenes_says_the_same(run):
    assert run("scenes", "schema").stdout == run("schema", "scene").stdout


def test_a_kind_that_there_is_not_is_one_line(mistake):
    known = "answers, camera, failures, scene, script, session, snapshot, suite, trace"
    assert mistake("schema", "picture") == f"OptionError: KIND: must be one of {known}, got 'picture'"


@pytest.mark.parametrize("name", BUILTIN)
def test_every_built_in_scene_fits_the_schema(name):
    jsonschema.validate(scene_to_dict(builtin_scene(name)), SCENE.schema(), jsonschema.Draft202012Validator)


@pytest.mark.parametrize("kind", DECLARED)
def test_the_reader_takes_what_the_schema_allows_and_nothing_else(documents, mutate, kind):
    validator = jsonschema.Draft202012Validator(DECLARED[kind].schema())
    rng, taken = random.Random(0), 0
    for _ in range(MUTANTS):
        document = mutate(documents[kind], rng)
        if beyond_json(document):
            continue
        try:
            DECLARED[kind].top.check(document)
            right, conflict = True, False
        except MismatchError as problem:
            right, conflict = False, problem.conflict
        assert conflict or validator.is_valid(document) is right, document
        taken += right
    assert 0.05 * MUTANTS < taken < 0.8 * MUTANTS  # both kinds were tried


@pytest.mark.parametrize(
    ("kind", "read"),
    [("scene", scene_from_dict), ("snapshot", snapshot_from_dict), ("camera", image_camera_from_dict)],
)
def test_a_record_is_made_of_whatever_the_schema_allows_but_for_values_beside_others(
    documents, mutate, kind, read
):
    validator = jsonschema.Draft202012Validator(DECLARED[kind].schema())
    rng = random.Random(1)
    for _ in range(MUTANTS):
        document = mutate(documents[kind], rng)
        if beyond_json(document):
            continue
        wrong = None
        try:
            read(document)
        except InputError as problem:
            wrong = problem.expected
        if validator.is_valid(document):
            assert wrong is None or wrong.startswith(BESIDE_OTHERS), document
        else:
            assert wrong is not None, document


def beyond_json(value: Any) -> bool:
    """Whether there is a number or a text in a value that JSON in UTF-8 does not have."""
    if isinstance(value, dict):
        return any(beyond_json(item) or not is_text(name) for name, item in value.items())
    if isinstance(value, list):
        return any(map(beyond_json, value))
    return (isinstance(value, float) and not np.isfinite(value)) or (
        isinstance(value, str) and bool(value) and not is_text(value)
    )
