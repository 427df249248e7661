"""Unity's scene files: hierarchies, prefab instances, sizes, paths; what is refused."""

import os
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from farm_ar.cli import app
from farm_ar.errors import SceneError
from farm_ar.scenes import load_scene
from farm_ar.scenes.unity_files import UnityGroups, load_sizes, load_unity_scene

UNITY = Path(os.environ.get("FARM_AR_PAPER_SCENES", "nowhere")).parent / "unity" / "L1.unity"
HEAD = "%YAML 1.1\n%TAG !u! tag:unity3d.com,2011:\n"


def thing(number, name, father=0, position=(0, 0, 0), yaw=0.0, scale=(1, 1, 1), box=None, quaternion=None):
    """A game object with its transform, and a box collider."""
    q = Rotation.from_euler("y", yaw, degrees=True).as_quat() if quaternion is None else quaternion
    vector = "{{x: {}, y: {}, z: {}}}".format
    text = f"--- !u!1 &{number}\nGameObject:\n  m_Name: {name}\n"
    text += f"--- !u!4 &{number + 1}\nTransform:\n  m_GameObject: {{fileID: {number}}}\n"
    text += "  m_LocalRotation: {{x: {}, y: {}, z: {}, w: {}}}\n".format(*q)
    text += f"  m_LocalPosition: {vector(*position)}\n  m_LocalScale: {vector(*scale)}\n"
    text += f"  m_Father: {{fileID: {father}}}\n"
    if box is not None:
        text += f"--- !u!65 &{number + 2}\nBoxCollider:\n  m_GameObject: {{fileID: {number}}}\n"
        text += f"  m_Size: {vector(*box)}\n"
    return text


def prefab(number, parent, guid, **changes):
    """An instance of a prefab, by what is changed of it."""
    text = f"--- !u!1001 &{number}\nPrefabInstance:\n  m_Modification:\n"
    text += f"    m_TransformParent: {{fileID: {parent}}}\n"
    text += "    m_Modifications:\n"
    for path, value in changes.items():
        text += f"    - target: {{fileID: 7, guid: {guid},\n        type: 3}}\n"
        text += f"      propertyPath: {path.replace('__', '.')}\n      value: {value}\n"
        text += "      objectReference: {fileID: 0}\n"
    return text + f"--- !u!4 &{number + 1} stripped\nTransform:\n  m_PrefabInstance: {{fileID: {number}}}\n"


def written(tmp_path, *parts):
    path = tmp_path / "room.unity"
    path.write_text(HEAD + "".join(parts), encoding="utf-8")
    return path


@pytest.mark.skipif(not UNITY.exists(), reason="FARM_AR_PAPER_SCENES has no Unity scene beside it")
def test_the_authors_file_comes_to_the_scene_that_was_read_off_it(tmp_path):
    scene = load_unity_scene(UNITY)
    known = load_scene(UNITY.parents[1] / "paper_scenes" / "L1.json")
    assert scene.layout.labels == known.layout.labels
    assert scene.layout.category == known.layout.category
    np.testing.assert_allclose(scene.layout.position, known.layout.position, atol=1e-5)
    np.testing.assert_allclose(np.sin((scene.layout.yaw - known.layout.yaw) / 2), 0, atol=1e-5)
    np.testing.assert_allclose(scene.layout.size, known.layout.size, atol=1e-5)
    np.testing.assert_allclose(scene.site_positions, known.site_positions, atol=1e-5)
    np.testing.assert_allclose(scene.camera_path.points, known.camera_path.points, atol=1e-5)
    assert scene.size == known.size
    assert scene.cost_weights.translation == pytest.approx(known.cost_weights.translation)
    out = tmp_path / "L1.json"
    done = CliRunner().invoke(app, ["scenes", "import-unity", str(UNITY), "--out", str(out)])
    assert done.exit_code == 0, done.output
    assert load_scene(out).layout.labels == known.layout.labels


def test_positions_headings_and_sizes_go_through_all_parents(tmp_path):
    path = written(
        tmp_path,
        thing(10, "World", position=(1, 0, 2), yaw=90),
        thing(20, "OriginalObjects", father=11, position=(0, 0.5, 1), scale=(2, 1, 2)),
        thing(
            30, "chair_a", father=21, position=(0.25, 0.1, 0.5), yaw=30, scale=(1, 3, 1), box=(0.1, 0.2, 0.3)
        ),
        thing(40, "table (2)", father=21, position=(0, 0, 0), box=(1, 1, 1)),
    )
    scene = load_unity_scene(path)
    assert scene.layout.labels == ("a", "2")
    assert scene.layout.category == ("chair", "table")
    # Right of the parent is ahead of it turned back: yaw 90 takes z to x and x to -z.
    inner = np.array([0.0, 1.0]) + 2 * np.array([0.25, 0.5])
    np.testing.assert_allclose(scene.layout.position[0], [1 + inner[1], 2 - inner[0]], atol=1e-9)
    assert scene.layout.elevation[0] == pytest.approx(0.6)
    assert np.rad2deg(scene.layout.yaw[0]) == pytest.approx(120)
    np.testing.assert_allclose(scene.layout.size[0], [0.2, 0.6, 0.6])
    assert scene.bounds is None


def test_prefabs_have_what_the_file_changes_and_sizes_from_a_table(tmp_path):
    changes = {
        "m_Name": "lamp_x",
        "m_LocalPosition__x": 1.5,
        "m_LocalPosition__z": -2,
        "m_LocalRotation__y": 1,
    }
    path = written(
        tmp_path,
        thing(10, "Things"),
        prefab(50, 11, "abc123", **changes, m_LocalRotation__w=0, m_RootOrder=3),
    )
    groups = UnityGroups(objects="Things")
    with pytest.raises(SceneError, match="abc123"):
        load_unity_scene(path, groups=groups)
    table = tmp_path / "sizes.csv"
    table.write_text("name,w,h,d\nabc123,0.2,1.5,0.3\n")
    scene = load_unity_scene(path, (4, 5), load_sizes(table), groups)
    np.testing.assert_allclose(scene.layout.position, [[1.5, -2.0]])
    assert abs(np.rad2deg(scene.layout.yaw[0])) == pytest.approx(180)
    np.testing.assert_allclose(scene.layout.size, [[0.2, 1.5, 0.3]])
    assert scene.size == (4.0, 5.0)


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ("no scene", "file"),
        (HEAD, "objects"),
        (HEAD + thing(10, "OriginalObjects"), "objects"),
        (HEAD + thing(10, "OriginalObjects") + thing(20, "chair", father=11, box=(1, 1, 1)), "m_Name"),
        (
            HEAD + thing(10, "OriginalObjects") + thing(20, "chair_1", father=11),
            "objects['chair_1'].size_whd",
        ),
        (
            HEAD + thing(10, "OriginalObjects", father=21) + thing(20, "chair_1", father=11, box=(1, 1, 1)),
            "m_Father",
        ),
        (HEAD + thing(10, "OriginalObjects").replace("{x: 1", "{x: one"), "m_LocalScale"),
    ],
)
def test_what_cannot_be_used_is_named(tmp_path, text, field):
    path = tmp_path / "bad.unity"
    path.write_text(text)
    with pytest.raises(SceneError) as caught:
        load_unity_scene(path)
    assert caught.value.field == field
    done = CliRunner().invoke(app, ["scenes", "import-unity", str(path)])
    assert done.exit_code == 2 or isinstance(done.exception, SceneError)


@pytest.mark.parametrize(
    ("right", "wrong", "field"),
    [
        ("x: 1.5, y", "x: 1.2.3, y", "m_LocalPosition"),
        ("x: 1.5, y", "x: 1e400, y", "m_LocalPosition"),
        ("x: 1.5, y", "x: -1e200, y", "m_LocalPosition"),
        ("w: 1.0}", "w: 0}", "m_LocalRotation"),
    ],
)
def test_a_number_or_a_rotation_that_is_none_is_named_and_other_line_ends_are_read(
    tmp_path, right, wrong, field
):
    chair = thing(20, "chair_a", father=11, position=(1.5, 0, 0), box=(1, 1, 1))
    path = written(tmp_path, thing(10, "OriginalObjects"), chair)
    text = path.read_text()
    path.write_bytes(text.replace("\n", "\r\n").encode())
    assert load_unity_scene(path).layout.position.tolist() == [[1.5, 0.0]]
    assert right in text
    path.write_text(text.replace(right, wrong))
    with pytest.raises(SceneError) as caught:
        load_unity_scene(path)
    assert caught.value.field == field


@pytest.mark.parametrize(("text", "field"), [("a,b\n", "columns"), ("name,w,h,d\nx,1,0,1\n", "line 2, h")])
def test_a_wrong_table_of_sizes_is_refused(tmp_path, text, field):
    path = tmp_path / "sizes.csv"
    path.write_text(text)
    with pytest.raises(SceneError) as caught:
        load_sizes(path)
    assert caught.value.field == field
