"""Compiled kernels of `LikelihoodReid`: the average over motion models, and the decision."""

from __future__ import annotations

import math

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.kernels import compiled
from farm_ar.reid.assignment import assign, find_margins
from farm_ar.reid.likelihood.densities import (
    heading_density,
    look,
    translation_density,
    view_probability,
)
from farm_ar.reid.likelihood.records import Answer, Eyes, Found, Known, Reach, Ways
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

MISFIT, DOUBTED = 1e-3, 0.5
"""Predictive p-value below which an answer is doubted; power to which probabilities are then taken."""

LEAST_TAIL = 1e-12
"""The least probability of a larger shift, or turn: what has gone anywhere must not decide alone."""

LEAST_UNSEEN = 1e-9
"""Least probability that a label is not seen."""

_compile = compiled(error_model="numpy")


@_compile
def weigh(known: Known, reach: Reach, like: FloatArray, ways: Ways) -> None:
    """Fill in weights, as those of `association_marginals`, and the probabilities of being unseen.

    Args:
        known: the labels and models.
        reach: where the labels may be found.
        like: (N, M) how likely the detections' looks are.
        ways: weight, unseen and log_unseen are filled.
    """
    # Arrays are taken out of their records once: each time, their users would be counted.
    shares, part, detect, fixed = (
        known.models.share,
        known.models.part,
        known.models.detect_rate,
        known.labels.fixed,
    )
    place, heading, in_view = reach.place, reach.heading, reach.inside
    n, m = like.shape
    stay = 1.0 - known.detecting.gone_rate
    for k in range(len(detect)):
        rate, total = stay * detect[k], 1.0
        ways.log_unseen[k] = 0.0
        weight, unseen = ways.weight[k], ways.unseen[k]
        for j in range(m):
            inside = 0.0
            for p in range(shares.shape[1]):
                inside += shares[k, p] * in_view[0 if fixed[j] else part[k, p, 0], j]
            unseen[j] = max(1.0 - rate * inside, LEAST_UNSEEN)
            total *= unseen[j]
            if total < 1e-200:
                ways.log_unseen[k] += math.log(total)
                total = 1.0
        ways.log_unseen[k] += math.log(total)
        for p in range(shares.shape[1]):
            share = shares[k, p] * rate
            if p > 0 and share == 0.0:
                continue
            here, turned = place[part[k, p, 0]], heading[part[k, p, 1]]
            for i in range(n):
                for j in range(m):
                    before = weight[i, j] if p > 0 else 0.0
                    weight[i, j] = before + share * here[i, j] * turned[i, j]
        for j in range(m):
            over = 1.0 / unseen[j]
            for i in range(n):
                weight[i, j] *= like[i, j] * over


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
def models_that_count(known: Known, eyes: Eyes, found: Found, b: int, ways: Ways) -> None:
    """Evidence of every model for snapshot b, and the marginals under those that may count.

    A model's evidence is at most the product of its rows' sums, which is quickly had: models are tried in
    falling order of that bound, until it falls short of the best evidence found by `CUT`.

    Args:
        known: what is known of the labels, models and cameras.
        eyes: where the cameras were.
        found: the detections.
        b: the snapshot.
        ways: filled.
    """
    labels, models = known.labels, known.models
    n, m, count = found.number[b], len(labels.yaw), len(models.log_prior)
    like, nothing = np.empty((n, m)), np.empty(n)
    look(known, found, b, like, nothing)
    scales, turns = len(models.translation_sd), len(models.heading)
    reach = Reach(np.empty((scales, n, m)), np.empty((turns, n, m)), np.empty((scales, m)))
    view_probability(known, labels, eyes, found, b, b + 1, reach.inside)
    translation_density(known, labels, found, b, reach.place)
    heading_density(models, labels, found, b, reach.heading)
    weigh(known, reach, like, ways)
    bound, scaled, false = np.empty(count), np.empty(count), found.false[b]
    for k in range(count):
        none, rate = ways.none[k], max(models.none_rate[k], LEAST_NONE)
        for i in range(n):
            none[i] = max(nothing[i] * (rate + false[i]), 1e-290)
        scaled[k] = models.log_prior[k] + ways.log_unseen[k] + scale_rows(ways.weight[k], none)
        bound[k] = scaled[k]
        for i in range(n):
            row = none[i]
            for j in range(m):
                row += ways.weight[k, i, j]
            bound[k] += math.log(row)
    best: float = -np.inf
    posterior = ways.posterior
    to_row = np.empty((n, m))
    order = np.empty(count, dtype=np.int64)
    falling(bound, order)
    posterior[:] = -np.inf
    for rank in range(count):
        k = int(order[rank])
        if bound[k] < best - CUT:
            break
        if n <= CHEAP:
            posterior[k] = scaled[k] + math.log(exact_marginals(ways.weight[k], ways.none[k], ways.each[k]))
        else:
            to_row[:] = 1.0
            posterior[k] = scaled[k] + propagate(ways.weight[k], ways.none[k], ways.each[k], to_row, 50, 1e-3)
        best = max(best, posterior[k])
    total = 0.0
    for k in range(count):
        posterior[k] = math.exp(posterior[k] - best)
        total += posterior[k]
    for k in range(count):
        posterior[k] /= total


@_compile
def make_exact(ways: Ways, most_exact: int) -> bool:
    """Replace what belief propagation found by the exact marginals, for the models that matter most.

    Returns whether the marginals of the most probable model are exact.
    """
    count, n, m = ways.weight.shape
    if n <= CHEAP:
        return True
    component, order = np.empty(n, dtype=np.int64), np.empty(count, dtype=np.int64)
    falling(ways.posterior, order)
    covered, work, exact = 0.0, 0.0, False
    for rank in range(count):
        k = int(order[rank])
        if covered >= COVER or (covered > 0.0 and work > WORK):
            break
        number = components(ways.weight[k], component)
        largest = largest_component(component, number)
        if largest <= most_exact:
            marginals_by_component(ways.weight[k], ways.none[k], most_exact, ways.each[k])
            exact = exact or covered == 0.0
        work += m * largest * 2.0**largest
        covered += ways.posterior[k]
    return exact


@_compile
def decide(probability: FloatArray, least: float, least_none: float, answer: Answer, b: int) -> None:
    """Fill in the answer to snapshot b: labels, each given once, of which most are right on average.

    Args:
        probability: (N, M + 1) of each label and of none.
        least: a label less probable than this is not given.
        least_none: a detection that is none less probably than this is given a label if one is left.
        answer: filled.
        b: the snapshot.
    """
    n, m = len(probability), probability.shape[1] - 1
    # A column for each label, and one for each detection's being none of them.
    cost = np.full((n, m + n), 2.0)
    for i in range(n):
        for j in range(m):
            cost[i, j] = 1.0 - probability[i, j]
        none = probability[i, m]
        cost[i, m + i] = 1.0 - none - 1e-9 if none >= least_none else 1.0
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
def chance_of_more(log_product: float, count: int) -> float:
    """How often the product of so many even random numbers from 0 to 1 is smaller (Fisher's method)."""
    term = total = 1.0
    for i in range(1, count):
        term *= -log_product / i
        total += term
    return min(math.exp(log_product) * total, 1.0)


@_compile
def tail_of_turn(
    share: float, turn: float, period: float, table: FloatArray, sd: float, more: float
) -> float:
    """A share times how often a turn is larger: by the table of an SD, unless its variance is larger."""
    angle = abs(turn - period * round(turn / period))
    if more > 0.0:
        wide = math.sqrt(sd * sd + more)
        even = 1.0 - angle / (period / 2)
        return share * (math.erfc(angle / (wide * math.sqrt(2.0))) if wide < period / 4 else even)
    first = min(int(angle / (period / 2) * (len(table) - 1)), len(table) - 1)
    return float(share * table[first:].sum() / table.sum())


@_compile
def predictive_p_value(known: Known, found: Found, b: int, answer: Answer, k: int) -> float:
    """How often shifts and turns as large as those of an answer, or larger, come about under model k.

    The probability of a larger shift, or turn, than each is even from 0 to 1 if the model is right; those of
    shifts and those of turns are combined by Fisher's method, and the lesser value is doubled. Walls, which
    only shorten shifts, are left out.
    """
    labels, models = known.labels, known.models
    shifts, turns, count, turned = 0.0, 0.0, 0, 0
    for i in range(found.number[b]):
        j = answer.label[b, i]
        if j == UNKNOWN or labels.fixed[j]:
            continue
        x = found.position[b, i, 0] - labels.position[j, 0]
        z = found.position[b, i, 1] - labels.position[j, 1]
        noise = max(known.detecting.position_sd, found.spread[b, i, 0], found.spread[b, i, 1])
        period, turn = labels.period[j], found.yaw[b, i] - labels.yaw[j]
        more = max(found.spread[b, i, 2] ** 2 - models.turn_sd[0] ** 2, 0.0)
        weight, other = found.rival_weight[b, i], found.rival[b, i] - labels.yaw[j]
        tells = period > 0.0 and not math.isnan(turn)
        farther, wider = 0.0, 0.0
        for p in range(models.share.shape[1]):
            share = models.share[k, p]
            if share == 0.0:
                continue
            sd = models.translation_sd[models.part[k, p, 0]]
            farther += share * math.exp(-0.5 * (x * x + z * z) / (sd * sd + noise * noise))
            if tells:
                scale = models.part[k, p, 1]
                table, sd = models.heading[scale, labels.table[j]], models.turn_sd[scale]
                tail = tail_of_turn(share, turn, period, table, sd, more)
                if weight > 0.0:
                    tail += weight * (tail_of_turn(share, other, period, table, sd, more) - tail)
                wider += tail
        shifts += math.log(max(farther, LEAST_TAIL))
        count += 1
        if tells:
            turns += math.log(max(wider, LEAST_TAIL))
            turned += 1
    if count == 0:
        return 1.0
    value = chance_of_more(shifts, count)
    return min(1.0, 2.0 * min(value, chance_of_more(turns, turned))) if turned > 0 else value


@_compile
def doubt(probability: FloatArray) -> None:
    """Make (N, M + 1) probabilities say the same less surely."""
    for row in probability:
        total = 0.0
        for j in range(len(row)):
            row[j] = row[j] ** DOUBTED
            total += row[j]
        row /= total


@_compile
def identify_batch(
    known: Known,
    eyes: Eyes,
    found: Found,
    least: float,
    most_exact: int,
    answer: Answer,
    p_value: FloatArray,
) -> None:
    """Identify B snapshots; fills in the answer, which comes filled with nothing, and (B,) p-values."""
    count, m = len(known.models.log_prior), len(known.labels.yaw)
    for b in range(len(found.number)):
        n = found.number[b]
        ways = Ways(
            np.empty((count, n, m)),
            np.empty((count, n)),
            np.empty((count, m)),
            np.empty(count),
            np.zeros((count, n, m + 1)),
            np.empty(count),
        )
        models_that_count(known, eyes, found, b, ways)
        answer.exact[b] = make_exact(ways, most_exact)
        probability = np.zeros((n, m + 1))
        for k in range(count):
            if ways.posterior[k] > 0.0:
                for i in range(n):
                    for j in range(m + 1):
                        probability[i, j] += ways.posterior[k] * ways.each[k, i, j]
        decide(probability, 0.0, 0.0, answer, b)
        p_value[b] = predictive_p_value(known, found, b, answer, int(np.argmax(ways.posterior)))
        if p_value[b] < MISFIT:
            doubt(probability)
        if p_value[b] < MISFIT or least > 0.0:
            decide(probability, least, 0.0, answer, b)
        if len(answer.probability):
            for j in range(m + 1):
                for i in range(n):
                    answer.probability[b, i, j] = probability[i, j]
            for k in range(count):
                answer.posterior[b, k] = ways.posterior[k]
                for j in range(m):
                    absent = 1.0
                    for i in range(n):
                        absent -= ways.each[k, i, j]
                    share = ways.posterior[k] * known.detecting.gone_rate
                    answer.gone[b, j] += share * absent / ways.unseen[k, j]
