"""Meshes: reading, parts, sizes, what is refused; the models that come along."""

import io

import numpy as np
import pytest
import trimesh

from farm_ar.rendering import MODELS, Mesh, MeshError, model, read_mesh, with_open_gate
from farm_ar.rendering.modelling import BUILDERS, write
from farm_ar.rendering.shapes import box, mesh_of


def outwards(mesh):
    """(F,) how far each face's normal points away from the middle of its part."""
    first, second = mesh.corners[:, 1] - mesh.corners[:, 0], mesh.corners[:, 2] - mesh.corners[:, 1]
    return np.einsum(
        "fi,fi->f", np.cross(second, first), mesh.corners.mean(axis=1) - mesh.corners.mean(axis=(0, 1))
    )


def test_the_files_are_what_the_shapes_give(tmp_path):
    assert set(MODELS) == set(BUILDERS)
    for name, build in BUILDERS.items():
        built, read = build(), model(name)
        assert read.parts == built.parts
        np.testing.assert_allclose(read.corners, built.corners, atol=1e-6)
        np.testing.assert_allclose(read.colour, built.colour, atol=0.5)
        assert (read.part == built.part).all()


@pytest.mark.parametrize(
    ("name", "size"),
    [("coop", (0.10, 0.08, 0.09)), ("hutch", (0.09, 0.07, 0.07)), ("shed", (0.20, 0.14, 0.16))],
)
def test_buildings_fill_their_boxes_and_stand_on_the_ground(name, size):
    low, high = model(name).bounds
    np.testing.assert_allclose(high - low, size, atol=0.0015)
    assert low[1] == pytest.approx(0, abs=1e-9)
    fitted = model(name).fitted(0.3, 0.2, 0.1)
    np.testing.assert_allclose(fitted.bounds, [[-0.15, 0, -0.05], [0.15, 0.2, 0.05]], atol=1e-12)


def test_parts_come_off_and_turn():
    coop = model("coop")
    bare = coop.without("stairs", "ramp")
    assert (
        len(bare) == len(coop) - (np.isin(coop.part, [coop.parts.index(p) for p in ("stairs", "ramp")])).sum()
    )
    assert len(coop.only("door")) + len(coop.without("door")) == len(coop)
    with pytest.raises(MeshError, match="part"):
        coop.only("chimney")
    shed = model("shed")
    opened = shed.turned("gate-right", np.array([0.0355, 0, 0.076]), np.pi / 2)
    still = shed.part != shed.parts.index("gate-right")
    assert (opened.corners[still] == shed.corners[still]).all()
    # Clockwise seen from above: what was to the left of the hinge is ahead of it.
    assert opened.only("gate-right").bounds[1, 2] > 0.105


def test_both_leaves_of_a_gate_swing_out_about_their_outer_edges():
    shed = model("shed").fitted(0.2, 0.14, 0.16)
    opened = with_open_gate(shed, 90 / 110)
    for part, edge in (("gate-left", 0), ("gate-right", 1)):
        closed, open_ = shed.only(part).bounds, opened.only(part).bounds
        width, thick = np.ptp(closed[:, 0]), np.ptp(closed[:, 2])
        assert np.ptp(open_[:, 2]) == pytest.approx(width)
        assert np.ptp(open_[:, 0]) == pytest.approx(thick)
        assert open_[edge, 0] == pytest.approx(closed[edge, 0], abs=2 * thick)
        assert open_[0, 2] == pytest.approx(closed[0, 2])
        assert (open_[:, 1] == closed[:, 1]).all()
    assert with_open_gate(shed, 0.0) is shed
    assert with_open_gate(model("coop"), 1.0) is model("coop")


def test_a_box_from_another_program_keeps_sides_and_orientation(tmp_path):
    solid = trimesh.creation.box((1.0, 2.0, 3.0))
    solid.visual.face_colors = [10, 20, 30, 255]
    solid.apply_translation([0.25, 1.0, 0.5])
    for suffix in ("glb", "obj", "ply", "stl", "off"):
        path = tmp_path / f"box.{suffix}"
        solid.export(path)
        mesh = read_mesh(path)
        # Right is -x of glTF's right-handed frame.
        np.testing.assert_allclose(mesh.bounds, [[-0.75, 0, -1.0], [0.25, 2, 2.0]], atol=1e-6)
        assert (outwards(mesh) > 0).all(), suffix
    assert read_mesh(tmp_path / "box.glb").colour[0].tolist() == [10, 20, 30]


def test_a_texture_is_kept(tmp_path):
    from PIL import Image

    picture = np.zeros((4, 4, 3), np.uint8)
    picture[:2] = (200, 10, 20)
    flat = trimesh.Trimesh(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]], process=False
    )
    material = trimesh.visual.material.PBRMaterial(baseColorTexture=Image.fromarray(picture))
    flat.visual = trimesh.visual.TextureVisuals(uv=[[0, 0], [1, 0], [1, 1], [0, 1]], material=material)
    flat.export(tmp_path / "flat.glb")
    mesh = read_mesh(tmp_path / "flat.glb")
    assert mesh.texture is not None
    assert mesh.texture[0, 0].tolist() == [200, 10, 20]
    top = mesh.uv[mesh.corners[..., 1] > 0.5]
    assert top[:, 1].max() < 0.01  # the picture's upper edge is at the top


@pytest.mark.parametrize(
    ("name", "content", "field"),
    [
        ("a.txt", b"x", "file"),
        ("a.obj", b"", "f"),
        ("a.glb", b"glTF broken", "file"),
        ("a.stl", b"\0" * 84, "f"),
        ("a.ply", b"ply\nformat ascii 1.0\nend_header\n", "f"),
        ("a.obj", b"v 0 0 0\nv 100 0 0\nv 0 90 0\nf 1 2 3\n", "size"),
        ("a.obj", b"v 0 0 0\nv 1e-5 0 0\nv 0 1e-5 0\nf 1 2 3\n", "size"),
        ("a.obj", b"v 0 0 0\nv nan 0 0\nv 0 90 0\nf 1 2 3\n", "f"),
        ("a.obj", b"v 0 0 0\nv 1e300 0 0\nv 0 90 0\nf 1 2 3\n", "corners"),
    ],
)
def test_a_wrong_file_is_refused_in_a_line(tmp_path, name, content, field):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(MeshError) as caught:
        read_mesh(path)
    assert caught.value.field.startswith(field)
    assert "\n" not in str(caught.value)
    assert name in str(caught.value)


def test_a_missing_file_is_refused():
    with pytest.raises(MeshError, match=r"none\.glb"):
        read_mesh("none.glb")


def test_other_units_are_said(tmp_path):
    solid = trimesh.creation.box((100.0, 80.0, 90.0))
    solid.export(tmp_path / "mm.obj")
    with pytest.raises(MeshError, match="millimetres"):
        read_mesh(tmp_path / "mm.obj")
    assert np.ptp(read_mesh(tmp_path / "mm.obj", unit=0.001).bounds, axis=0) == pytest.approx(
        [0.1, 0.08, 0.09]
    )


@pytest.mark.parametrize(
    ("values", "field"),
    [
        ({"corners": np.zeros((0, 3, 3))}, "faces"),
        ({"corners": np.full((1, 3, 3), np.nan)}, "corners[0, 0, 0]"),
        ({"colour": np.zeros((2, 3))}, "colour"),
        ({"part": np.array([3])}, "part"),
        ({"uv": np.zeros((1, 2, 2))}, "uv"),
    ],
)
def test_wrong_arrays_are_refused(values, field):
    good = {"corners": np.ones((1, 3, 3)), "colour": np.zeros((1, 3)), "part": np.zeros(1, int)}
    with pytest.raises(MeshError) as caught:
        Mesh(**(good | values))
    assert caught.value.field == field


def test_writing_and_reading_gives_the_same(tmp_path):
    mesh = mesh_of(box((0, 0, 0), (0.1, 0.2, 0.3), (1, 2, 3)))
    write(mesh, tmp_path / "b.glb")
    np.testing.assert_allclose(read_mesh(tmp_path / "b.glb").corners, mesh.corners, atol=1e-7)
    assert io.BytesIO((tmp_path / "b.glb").read_bytes()).read(4) == b"glTF"
