import sys
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from farm_ar.scenes import Camera, Layout, Scene, Site, SnapshotBatch, Template

MakeScene = Callable[..., Scene]
MakeBatch = Callable[..., SnapshotBatch]


@pytest.fixture
def plain() -> Iterator[None]:
    """All kernels of re-identification in plain Python."""
    modules = [module for name, module in sys.modules.items() if name.startswith("farm_ar.reid.")]
    with pytest.MonkeyPatch.context() as patch:
        for module in modules:
            for name, value in list(vars(module).items()):
                if isinstance(getattr(value, "py_func", None), Callable):
                    patch.setattr(module, name, value.py_func)
        yield


@pytest.fixture(scope="session")
def make_scene() -> MakeScene:
    """A function that makes a random scene; objects of one category share a size."""

    def make(
        rng: np.random.Generator,
        objects: int = 12,
        categories: int = 2,
        sites: int = 4,
        templates: bool = False,
    ) -> Scene:
        sizes = rng.uniform(0.2, 1.0, (categories, 3))
        code = rng.integers(categories, size=objects)
        layout = Layout(
            labels=tuple(f"object {i}" for i in range(objects)),
            category=tuple(f"category {c}" for c in code),
            position=rng.uniform(0, [6, 4], (objects, 2)),
            yaw=rng.uniform(-np.pi, np.pi, objects),
            size=sizes[code],
        )
        return Scene(
            name="random",
            size=(6.0, 4.0),
            layout=layout,
            sites=tuple(Site(f"S{s}", *rng.uniform(-1, 7, 2)) for s in range(sites)),
            templates=tuple(
                Template(f"category {c}", rng.uniform(-3, 3), tuple(sizes[c])) for c in range(categories)
            )
            if templates
            else (),
        )

    return make


@pytest.fixture(scope="session")
def make_batch() -> MakeBatch:
    """A function that makes random snapshots of a scene's kinds of objects, from 0 to `most` in each."""

    def make(
        rng: np.random.Generator, scene: Scene, snapshots: int = 6, most: int = 8, unknown: float = 0.2
    ) -> SnapshotBatch:
        shape = (snapshots, most)
        like = rng.integers(len(scene.layout), size=shape)
        category = np.where(rng.random(shape) < unknown, -1, scene.layout.category_code[like])
        return SnapshotBatch(
            camera=Camera(rng.uniform(-1, 7, (snapshots, 2)), rng.uniform(-3, 3, snapshots)),
            count=np.array([0, most, *rng.integers(0, most + 1, snapshots - 2)]),
            categories=scene.layout.categories,
            category=category,
            position=scene.layout.position[like] + rng.normal(0, 0.5, (*shape, 2)),
            yaw=scene.layout.yaw[like] + rng.normal(0, 0.7, shape),
            size=scene.layout.size[like] * rng.uniform(0.8, 1.2, (*shape, 3)),
            elevation=np.zeros(shape),
        )

    return make
