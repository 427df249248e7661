"""The paper's method as its authors' public program has it, where that differs from their text."""

from __future__ import annotations

import time
from functools import partial
from itertools import combinations, permutations

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.errors import OptionError, SceneError, known_name
from farm_ar.geometry import world_box
from farm_ar.reid.answers import Identification
from farm_ar.reid.assignment import solve_lsap
from farm_ar.reid.base import Reidentifier
from farm_ar.reid.categories import require_places
from farm_ar.reid.costs import rotation_cost, total_cost
from farm_ar.reid.spatial_costs import TERMS, Term, assurance_of, template_boxes
from farm_ar.scenes import Detections, Scene, Snapshot

_PAIRINGS = np.array(list(permutations(range(3))))


class SpatialUnityReid(Reidentifier):
    """The published program, for one scene.

    It differs from section 3.2 of the paper in this:

    - A site's distance is that to a border (`BorderDistances`), not to its centre, and its probability the
      softmax of 1 / distance over all sites. Sites join in falling probability while the sum, in single
      precision, is below the threshold: 0 keeps none, and 1 may leave out the last.
    - The distance between poses counts heights.
    - Sizes are those of boxes along the world's axes, against one template a category; axes are paired so
      that the sum of their ratios is least. In a scene with a single template sizes do not count.
    - Categories are not kept apart. Where fewer labels are left than detections, none is given.

    What the program keeps from frame to frame is not in here.

    Args:
        scene: the reference layout and its place; borders of cells end at the box around its bounds, or
            around all that is known where there are none.
        threshold: of the sites' cumulative probability, 0 to 1.
        terms: the cost terms that count, as in the ablation of the paper's Table 2.
        rng: with it, equally good assignments are chosen among at random.

    Raises:
        SceneError: the scene has no labels.
        OptionError: the threshold is out of its limits, or a term is not known.
    """

    def __init__(
        self,
        scene: Scene,
        threshold: float = 1.0,
        terms: tuple[Term, ...] = TERMS,
        rng: np.random.Generator | None = None,
    ) -> None:
        if not len(scene.layout):
            raise SceneError("objects", "must be at least one", len(scene.layout))
        if not 0 <= threshold <= 1:
            raise OptionError("threshold", "must be from 0 to 1", threshold)
        for term in terms:
            known_name("terms", term, TERMS)
        self.scene, self.threshold, self._rng = scene, float(threshold), rng
        weights = scene.cost_weights
        self._translation_weight = weights.translation if "translation" in terms else 0.0
        self._rotation_weight = weights.rotation if "rotation" in terms else 0.0
        self._places = _in_space(scene.layout.position, scene.layout.elevation)
        single = len(scene.layout.categories) == 1
        self._template = None if single or "dimension" not in terms else template_boxes(scene)
        self._borders = (
            BorderDistances(scene.site_positions, *_limits(scene)) if len(scene.sites) > 1 else None
        )

    def identify(self, snapshot: Snapshot) -> Identification:
        """The label of each detection; none at all where fewer labels are left than detections.

        Raises:
            SnapshotError: a position is not known.
        """
        require_places(snapshot.detections)
        seen, names = snapshot.detections, self.scene.layout.labels
        offered, sites = self._offered(snapshot.camera.position)
        if self._rng is not None:
            offered = self._rng.permutation(offered)
        labels = tuple(names[j] for j in offered.tolist())
        if len(offered) < len(seen):
            return Identification((None,) * len(seen), candidates=labels, sites=sites)
        cost = self.cost_matrix(seen)[:, offered]
        begin = time.perf_counter()
        column = solve_lsap(cost)
        solve_time = time.perf_counter() - begin
        return Identification(
            tuple(labels[j] for j in column.tolist()),
            cost[np.arange(len(seen)), column],
            labels,
            sites,
            solve_time=solve_time,
            assurance=partial(assurance_of, cost, column, labels),
        )

    def problem(self, snapshot: Snapshot) -> tuple[FloatArray, tuple[str | None, ...]]:
        """(N, K) costs of the labels of the sites that are kept, and their names."""
        offered, _ = self._offered(snapshot.camera.position)
        names = self.scene.layout.labels
        return self.cost_matrix(snapshot.detections)[:, offered], tuple(names[j] for j in offered.tolist())

    def cost_matrix(self, seen: Detections) -> FloatArray:
        """(N, M) cost of each label for each detection."""
        layout = self.scene.layout
        apart = _in_space(seen.position, seen.elevation)[:, None] - self._places
        distance = np.linalg.norm(apart, axis=-1) / self.scene.diagonal
        turn = rotation_cost(seen.yaw, layout.yaw)
        return total_cost(
            distance, turn, self._dimension(seen), self._translation_weight, self._rotation_weight
        )

    def _dimension(self, seen: Detections) -> FloatArray:
        if self._template is None:
            return np.ones((1, 1))
        box = world_box(seen.size, seen.yaw)
        paired = box[:, None, None] / self._template[:, _PAIRINGS]  # (N, M, 6, 3)
        ratio = np.maximum(paired, 1 / paired)
        best = ratio.sum(axis=-1).argmin(axis=-1)
        product = np.take_along_axis(ratio.prod(axis=-1), best[..., None], axis=-1)[..., 0]
        return np.where(np.isnan(product), 1.0, product)

    def site_probability(self, camera: FloatArray) -> FloatArray:
        """(K,) probabilities of the scene's sites at a camera (2,), metres, in single precision."""
        count = len(self.scene.sites)
        if self._borders is None:
            return np.ones(count, dtype=np.float32)
        return border_probability(self._borders(camera))

    def _offered(self, camera: FloatArray) -> tuple[IntArray, tuple[str, ...]]:
        """Indices of the labels of the sites that the threshold keeps, and those sites."""
        every = np.arange(len(self.scene.layout))
        if self._borders is None:
            return every, ()
        order = sites_kept(self.site_probability(camera), self.threshold)
        names = tuple(self.scene.sites[s].name for s in order.tolist())
        return every[np.isin(self.scene.object_site, order)], names


class BorderDistances:
    """How far a camera is from each site of a Voronoi diagram, by its borders.

    The site in whose cell the camera is: the least distance to its borders, times how far its centre is, as a
    share of how far the centre beyond that border is. A neighbour of that site: the distance to the border
    between them. Any other site: the least distance to its own borders. Borders end at the limits.

    Args:
        sites: (K, 2) centres, distinct, metres; at least two.
        low: (2,) least x and z, metres.
        high: (2,) largest x and z, metres.
    """

    def __init__(self, sites: FloatArray, low: FloatArray, high: FloatArray) -> None:
        self.sites = sites
        self.borders: dict[tuple[int, int], FloatArray] = {}
        """(2, 2) ends of the border between two sites, the smaller index first."""
        for a, b in combinations(range(len(sites)), 2):
            border = _border(sites, a, b, low, high)
            if border is not None:
                self.borders[a, b] = border

    def __call__(self, camera: FloatArray) -> FloatArray:
        """(K,) distances from a camera (2,), metres; infinite for a site without borders."""
        count = len(self.sites)
        to_centre = np.linalg.norm(self.sites - camera, axis=1)
        own = int(to_centre.argmin())
        found, between = np.full(count, np.inf), np.full(count, np.inf)
        for (a, b), border in self.borders.items():
            away = _to_segment(camera, *border)
            found[[a, b]] = np.minimum(found[[a, b]], away)
            if own in (a, b):
                between[b if a == own else a] = away
        neighbour = np.isfinite(between)
        found[neighbour] = between[neighbour]
        if neighbour.any():
            beyond = int(between.argmin())
            found[own] = to_centre[own] / to_centre[beyond] * between[beyond]
        return found


def border_probability(distance: FloatArray) -> FloatArray:
    """(K,) probabilities of sites at distances (K,), metres: the softmax of 1 / distance; 0 is certain."""
    with np.errstate(divide="ignore"):
        closeness = np.minimum(1 / distance, 1e300)
    weight = np.exp(closeness - closeness.max())
    probability: FloatArray = (weight / weight.sum()).astype(np.float32)
    return probability


def sites_kept(probability: FloatArray, threshold: float) -> IntArray:
    """Indices of the sites that a threshold keeps, the likeliest first.

    Args:
        probability: (K,) of the sites, in single precision.
        threshold: 0 to 1.
    """
    order = np.argsort(-probability, kind="stable")
    kept, total = 0, np.float32(0)
    while kept < len(order) and total < np.float32(threshold):
        total = np.float32(total + probability[order[kept]])
        kept += 1
    return order[:kept]


def _limits(scene: Scene) -> tuple[FloatArray, FloatArray]:
    """(2,) least and (2,) largest x and z of a scene's bounds, or of what is known of it, metres."""
    known = [scene.layout.position, scene.site_positions] if scene.bounds is None else [scene.bounds.corners]
    points = np.concatenate(known)
    return points.min(axis=0), points.max(axis=0)


def _border(sites: FloatArray, a: int, b: int, lowest: FloatArray, highest: FloatArray) -> FloatArray | None:
    """(2, 2) ends of the border between two cells within limits; None where they share none."""
    middle, way = (sites[a] + sites[b]) / 2, sites[b] - sites[a]
    along = np.array([-way[1], way[0]])
    # Nearer to site a than to another: 2 (c - a) . x <= c . c - a . a. Limits likewise.
    others = np.delete(sites, [a, b], axis=0)
    normal = np.vstack([2 * (others - sites[a]), [[-1.0, 0.0], [0.0, -1.0], [1.0, 0.0], [0.0, 1.0]]])
    limit = np.concatenate([(others**2).sum(axis=1) - (sites[a] ** 2).sum(), -lowest, highest])
    slope, room = normal @ along, limit - normal @ middle
    if (room[slope == 0] < 0).any():
        return None
    share = room / np.where(slope == 0, 1.0, slope)
    low, high = share[slope < 0].max(initial=-np.inf), share[slope > 0].min(initial=np.inf)
    return None if not low < high else np.stack([middle + low * along, middle + high * along])


def _to_segment(point: FloatArray, begin: FloatArray, end: FloatArray) -> float:
    way = end - begin
    share = np.clip((point - begin) @ way / (way @ way), 0.0, 1.0)
    return float(np.linalg.norm(begin + share * way - point))


def _in_space(position: FloatArray, elevation: FloatArray) -> FloatArray:
    """(N, 3) places with heights, metres."""
    return np.column_stack([position, elevation])
