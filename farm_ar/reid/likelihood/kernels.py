"""Compiled kernels of `LikelihoodReid`: the average over motion models, and the decision."""

from __future__ import annotations

import math

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.kernels import compiled
from farm_ar.reid.assignment import assign, find_margins
from farm_ar.reid.likelihood.densities import (
    heading_density,
    likeness,
    translation_density,
    view_probability,
)
from farm_ar.reid.likelihood.records import Answer, Detecting, Eyes, Found, Labels, Models, View
from farm_ar.reid.marginals import (
    components,
    exact_marginals,
    largest_component,
    marginals_by_component,
    propagate,
    scale_rows,
)
from farm_ar.scenes import UNKNOWN

CHEAP = 5
"""Detections up to which the exact sum is as quick as belief propagation."""

CUT = 10.0
"""By how much, in logarithms, a model may fall short of the best one and still count."""

COVER = 0.99
"""Share of the models' probability for which marginals are made exact."""

WORK = 2e6
"""Additions after which no further model is made exact."""

LEAST_NONE = 1e-12
"""Expected detections of what has no label, where none are expected: so that every snapshot has an answer."""

_compile = compiled(error_model="numpy")


@_compile
def weigh(
    labels: Labels,
    models: Models,
    detecting: Detecting,
    k: int,
    place: FloatArray,
    heading: FloatArray,
    like: FloatArray,
    view: FloatArray,
    weight: FloatArray,
    unseen: FloatArray,
) -> float:
    """Fill in (N, M) weights and (M,) probabilities of being unseen under model k; returns their log sum.

    Weights are those of `association_marginals`.
    """
    n, m = like.shape
    total = 1.0
    log_total = 0.0
    stay = 1.0 - detecting.gone_rate
    detect = models.detect_rate[k]
    parts = models.share.shape[1]
    for j in range(m):
        inside = 0.0
        for p in range(parts):
            a = 0 if labels.fixed[j] else models.part[k, p, 0]
            inside += models.share[k, p] * view[a, j]
        unseen[j] = max(detecting.gone_rate + stay * (1.0 - detect * inside), 1e-9)
        total *= unseen[j]
        if total < 1e-200:
            log_total += math.log(total)
            total = 1.0
    weight[:] = 0.0
    for p in range(parts):
        share = models.share[k, p] * stay * detect
        if share > 0.0:
            here, turned = place[models.part[k, p, 0]], heading[models.part[k, p, 1]]
            for i in range(n):
                for j in range(m):
                    weight[i, j] += share * here[i, j] * turned[i, j]
    for j in range(m):
        over = 1.0 / unseen[j]
        for i in range(n):
            weight[i, j] *= like[i, j] * over
    return log_total + math.log(total)


@_compile
def falling(value: FloatArray, order: IntArray) -> None:
    """Fill in the order of the values from the greatest down."""
    for k in range(len(value)):
        place = k
        while place > 0 and value[order[place - 1]] < value[k]:
            order[place] = order[place - 1]
            place -= 1
        order[place] = k


@_compile
def models_that_count(
    labels: Labels,
    models: Models,
    detecting: Detecting,
    view: View,
    eyes: Eyes,
    found: Found,
    b: int,
    weight: FloatArray,
    none: FloatArray,
    unseen: FloatArray,
    each: FloatArray,
    posterior: FloatArray,
) -> None:
    """Weigh the labels of snapshot b under every model, and find the marginals under those that may count.

    A model's evidence is at most the product of its rows' sums, which is quickly had: models are tried in
    falling order of that bound, until it falls short of the best evidence found by `CUT`.

    Args:
        labels: what is known of the labels.
        models: the models.
        detecting: the detector.
        view: what the camera sees.
        eyes: where it was.
        found: the detections.
        b: the snapshot.
        weight: (K, N, M) filled, each row divided by its largest.
        none: (K, N) filled, likewise.
        unseen: (K, M) filled with the probability that each label is not seen.
        each: (K, N, M + 1) filled with the marginals under each model that counts.
        posterior: (K,) filled with the probability of each model.
    """
    n, m, count = found.number[b], len(labels.yaw), len(models.log_prior)
    inside = np.empty((len(models.translation_sd), m))
    view_probability(labels, models, view, eyes, found, b, inside)
    like, nothing = np.empty((n, m)), np.empty(n)
    for i in range(n):
        likeness(labels, detecting, found.category[b, i], found.sides[b, i], like[i])
        # What has no label is like some label's object, anywhere in view and turned anyhow.
        nothing[i] = like[i].mean() / (view.area * 2 * math.pi)
    place = np.empty((len(models.translation_sd), n, m))
    translation_density(labels, models, detecting, found.position[b], place)
    turned = np.empty((len(models.heading), n, m))
    heading_density(labels, models, found.yaw[b, :n], turned)
    bound, scaled = np.empty(count), np.empty(count)
    for k in range(count):
        scaled[k] = models.log_prior[k] + weigh(
            labels, models, detecting, k, place, turned, like, inside, weight[k], unseen[k]
        )
        for i in range(n):
            none[k, i] = max(nothing[i] * max(models.none_rate[k], LEAST_NONE), 1e-290)
        scaled[k] += scale_rows(weight[k], none[k])
        bound[k] = scaled[k]
        for i in range(n):
            reach = none[k, i]
            for j in range(m):
                reach += weight[k, i, j]
            bound[k] += math.log(reach)
    best: float = -np.inf
    to_row = np.empty((n, m))
    order = np.empty(count, dtype=np.int64)
    falling(bound, order)
    posterior[:] = -np.inf
    for rank in range(count):
        k = int(order[rank])
        if bound[k] < best - CUT:
            break
        if n <= CHEAP:
            posterior[k] = scaled[k] + math.log(exact_marginals(weight[k], none[k], each[k]))
        else:
            to_row[:] = 1.0
            posterior[k] = scaled[k] + propagate(weight[k], none[k], each[k], to_row, 50, 1e-3)
        best = max(best, posterior[k])
    total = 0.0
    for k in range(count):
        posterior[k] = math.exp(posterior[k] - best)
        total += posterior[k]
    for k in range(count):
        posterior[k] /= total


@_compile
def make_exact(
    weight: FloatArray, none: FloatArray, most_exact: int, posterior: FloatArray, each: FloatArray
) -> bool:
    """Replace what belief propagation found by the exact marginals, for the models that matter most.

    Returns whether the marginals of the most probable model are exact.
    """
    count, n, m = weight.shape
    if n <= CHEAP:
        return True
    component, order = np.empty(n, dtype=np.int64), np.empty(count, dtype=np.int64)
    falling(posterior, order)
    covered, work, exact = 0.0, 0.0, False
    for rank in range(count):
        k = int(order[rank])
        if covered >= COVER or (covered > 0.0 and work > WORK):
            break
        number = components(weight[k], component)
        largest = largest_component(component, number)
        if largest <= most_exact:
            marginals_by_component(weight[k], none[k], most_exact, each[k])
            exact = exact or covered == 0.0
        work += m * largest * 2.0**largest
        covered += posterior[k]
    return exact


@_compile
def decide(probability: FloatArray, least: float, answer: Answer, b: int) -> None:
    """Fill in the answer to snapshot b: labels, each given once, of which most are right on average.

    Args:
        probability: (N, M + 1) of each label and of none.
        least: a label less probable than this is not given.
        answer: filled.
        b: the snapshot.
    """
    n, m = len(probability), probability.shape[1] - 1
    # A column for each label, and one for each detection's being none of them.
    cost = np.full((n, m + n), 2.0)
    for i in range(n):
        for j in range(m):
            cost[i, j] = 1.0 - probability[i, j]
        cost[i, m + i] = 1.0 - probability[i, m] - 1e-9
    column = np.empty(n, dtype=np.int64)
    assign(cost, column, np.empty(n), np.empty(m + n))
    margin, other = find_margins(cost, column)
    for i in range(n):
        j = column[i]
        given = j < m and probability[i, j] >= least
        answer.label[b, i] = j if given else UNKNOWN
        answer.cost[b, i] = cost[i, j] if given else np.nan
        answer.margin[b, i] = margin[i] if given else np.nan
        answer.runner_up[b, i] = other[i] if 0 <= other[i] < m else UNKNOWN
        if j < m and not given:
            answer.runner_up[b, i] = j
        answer.confidence[b, i] = min(probability[i, j if given else m], 1.0)


@_compile
def identify_batch(
    labels: Labels,
    models: Models,
    detecting: Detecting,
    view: View,
    eyes: Eyes,
    found: Found,
    least: float,
    most_exact: int,
    answer: Answer,
) -> None:
    """Identify B snapshots; fills in the answer, which comes filled with nothing."""
    count, m = len(models.log_prior), len(labels.yaw)
    for b in range(len(found.number)):
        n = found.number[b]
        weight, none, unseen = np.empty((count, n, m)), np.empty((count, n)), np.empty((count, m))
        each, posterior = np.zeros((count, n, m + 1)), np.empty(count)
        models_that_count(
            labels, models, detecting, view, eyes, found, b, weight, none, unseen, each, posterior
        )
        answer.exact[b] = make_exact(weight, none, most_exact, posterior, each)
        probability = np.zeros((n, m + 1))
        for k in range(count):
            if posterior[k] > 0.0:
                for i in range(n):
                    for j in range(m + 1):
                        probability[i, j] += posterior[k] * each[k, i, j]
        decide(probability, least, answer, b)
        if len(answer.probability):
            for j in range(m + 1):
                for i in range(n):
                    answer.probability[b, i, j] = probability[i, j]
            for k in range(count):
                answer.posterior[b, k] = posterior[k]
                for j in range(m):
                    absent = 1.0
                    for i in range(n):
                        absent -= each[k, i, j]
                    answer.gone[b, j] += posterior[k] * absent * detecting.gone_rate / unseen[k, j]
