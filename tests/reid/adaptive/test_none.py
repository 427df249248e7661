"""None of these needs evidence: a detection gets a label unless being none is likelier than not."""

import numpy as np

from farm_ar.reid.adaptive import AdaptiveReid
from farm_ar.scenes import Camera, Detections, FieldOfView, Layout, Scene, Snapshot


def test_where_nothing_can_be_told_the_likeliest_labels_are_named() -> None:
    rng, undecided = np.random.default_rng(3), 0
    for _ in range(6):
        m = 24
        sizes = np.tile([0.5, 1.0, 1.0], (m, 1))
        names = [f"sheep {i}" for i in range(m)]
        before = rng.uniform(0, 80, (m, 2))
        layout = Layout(names, ["sheep"] * m, before, rng.uniform(-3, 3, m), sizes)
        seen = rng.permutation(m)[:19]
        after = before[seen] + rng.normal(0, 15, (19, 2)) + [6.0, -4.0]
        detections = Detections(("sheep",) * 19, after, rng.uniform(-3, 3, 19), sizes[:19])
        camera = Camera(np.array([40.0, 40.0]), np.array(0.0), FieldOfView(np.pi, np.pi, 200.0))
        scene, snapshot = Scene("meadow", layout=layout), Snapshot(camera, detections)
        reid = AdaptiveReid(scene)
        found = reid.identify(snapshot)
        assert found.probability is not None
        none = found.probability[:, -1]
        for k, label in enumerate(found.labels):
            likeliest = found.probability[k, :-1].max()
            undecided += none[k] > likeliest and none[k] < 0.5
            if label is None:
                assert none[k] >= 0.5
        costs, columns = reid.problem(snapshot)
        assert sum(label is None for label in columns) == 19
        np.testing.assert_allclose(np.diag(costs[:, m:]), np.where(none < 0.5, 1.0, 1 - none))
    assert undecided > 5
