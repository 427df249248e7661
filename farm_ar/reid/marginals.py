"""How probable each label is for each detection, over all the ways of giving labels out (T6).

A way gives each detection a label of its own or none. Its weight is the product of what it gives:
`weight[i, j]` for label j to detection i, `none[i]` for no label, both relative to a label that is not seen,
which counts 1. The sum over all ways is the evidence; the share of those that give j to i is the marginal
probability.

Exact by a dynamic programme over subsets of the detections, O(M N 2^N); beyond that by belief propagation
(Williams and Lau 2014), which always converges, is mostly within .02 and may be poor where nearly all labels
are seen.
"""

from __future__ import annotations

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.kernels import compiled

MOST_EXACT = 12
"""Detections, of one component, up to which marginals are exact."""

NEGLIGIBLE = 1e-12
"""Share of a detection's largest weight below which a label is as good as impossible."""

_compile = compiled(error_model="numpy")


def association_marginals(
    weight: FloatArray, none: FloatArray, most_exact: int = MOST_EXACT
) -> tuple[FloatArray, float, bool]:
    """Marginal probabilities and the evidence.

    Up to `most_exact` detections all weights count, and probabilities are right to 1e-9. With more, a label
    below `NEGLIGIBLE` of a detection's largest weight counts as impossible, which splits the detections into
    components; that may cost more than 1e-9 where labels can be given out in unlikely ways only.

    Args:
        weight: (N, M) not negative: of each label for each detection, relative to the label not being seen.
        none: (N,) not negative: of the detection being none of the labels. Where a detection has no weight
            at all it is none of them.
        most_exact: detections of one component up to which the sum is exact. Detections that could be one
            label are of one component.

    Returns:
        (N, M + 1) probabilities, the last column that of none; the log of the evidence, minus infinite where
        there is no way; whether all of it is exact.
    """
    n, m = weight.shape
    probability = np.zeros((n, m + 1))
    if n == 0:
        return probability, 0.0, True
    if n <= most_exact:
        largest = np.maximum(none, weight.max(axis=1, initial=0.0))
        lost = largest <= 0  # with no weight at all
        divisor = np.where(lost, 1.0, largest)
        rest = np.where(lost, 1.0, none / divisor)
        total = exact_marginals(np.ascontiguousarray(weight / divisor[:, None]), rest, probability)
        with np.errstate(divide="ignore"):
            log_evidence = -np.inf if lost.any() else float(np.log(divisor).sum() + np.log(total))
        return probability, log_evidence, True
    log_evidence, exact = marginals_by_component(
        np.ascontiguousarray(weight, dtype=np.float64),
        np.ascontiguousarray(none, dtype=np.float64),
        most_exact,
        probability,
    )
    return probability, float(log_evidence), bool(exact)


@_compile
def scale_rows(weight: FloatArray, none: FloatArray) -> float:
    """Divide each row by its largest entry, drop what is negligible; returns the sum of the divisors' logs.

    A row without any entry gets `none` = 1 and makes the sum minus infinite.
    """
    n, m = weight.shape
    total = 0.0
    for i in range(n):
        largest = none[i]
        for j in range(m):
            largest = max(largest, weight[i, j])
        if largest > 0.0:
            total += np.log(largest)
            none[i] /= largest
            for j in range(m):
                weight[i, j] /= largest
                if weight[i, j] < NEGLIGIBLE:
                    weight[i, j] = 0.0
        else:
            total = -np.inf
            none[i] = 1.0
    return total


@_compile
def components(weight: FloatArray, component: IntArray) -> int:
    """Number the rows so that rows with a common column are of one component; returns how many there are.

    Args:
        weight: (N, M) not negative.
        component: (N,) filled with numbers from 0.
    """
    n, m = weight.shape
    component[:] = -1
    waiting = np.empty(n, dtype=np.int64)
    number = 0
    for start in range(n):
        if component[start] >= 0:
            continue
        component[start] = number
        waiting[0] = start
        top = 1
        while top > 0:
            top -= 1
            i = waiting[top]
            for j in range(m):
                if weight[i, j] > 0.0:
                    for k in range(n):
                        if component[k] < 0 and weight[k, j] > 0.0:
                            component[k] = number
                            waiting[top] = k
                            top += 1
        number += 1
    return number


@_compile
def largest_component(component: IntArray, number: int) -> int:
    """How many rows the largest of `number` components has."""
    size = np.zeros(number, dtype=np.int64)
    largest = 0
    for c in component:
        size[c] += 1
        largest = max(largest, int(size[c]))
    return largest


@_compile
def _shared(old: FloatArray, backward: FloatArray, half: int) -> float:
    """Sum over the subsets without a detection of `old` and, with it, `backward`; `half` is its bit."""
    first, second, third, fourth = 0.0, 0.0, 0.0, 0.0
    if half < 4:
        for block in range(0, len(old), 2 * half):
            for s in range(block, block + half):
                first += old[s] * backward[s + half]
        return first
    for block in range(0, len(old), 2 * half):
        for s in range(block, block + half, 4):  # sums that do not wait for one another
            first += old[s] * backward[s + half]
            second += old[s + 1] * backward[s + half + 1]
            third += old[s + 2] * backward[s + half + 2]
            fourth += old[s + 3] * backward[s + half + 3]
    return (first + second) + (third + fourth)


@_compile
def exact_marginals(weight: FloatArray, none: FloatArray, probability: FloatArray) -> float:
    """Marginals by the dynamic programme; returns the evidence, 0 where there is no way.

    `forward[j, s]` sums over the ways of serving the detections of subset s with none or the first j labels;
    `backward[s]` those of serving all others with the labels that come later. Both are indexed alike, so
    the inner loops run over contiguous memory.

    Args:
        weight: (N, M) of each label.
        none: (N,) of no label.
        probability: (N, M + 1) filled.
    """
    n, m = weight.shape
    subsets = 1 << n
    forward = np.empty((m + 1, subsets))
    forward[0, 0] = 1.0
    for i in range(n):
        half = 1 << i
        for s in range(half):
            forward[0, half + s] = forward[0, s] * none[i]
    for j in range(m):
        old, new = forward[j], forward[j + 1]
        for s in range(subsets):
            new[s] = old[s]
        for i in range(n):
            w, half = weight[i, j], 1 << i
            if w > 0.0:
                for block in range(0, subsets, 2 * half):
                    for s in range(block, block + half):
                        new[s + half] += w * old[s]
    total = float(forward[m, subsets - 1])
    probability[:] = 0.0
    if not total > 0.0:
        return 0.0
    backward = np.zeros(subsets)
    backward[subsets - 1] = 1.0
    earlier = np.zeros(subsets)
    earlier[subsets - 1] = 1.0
    for j in range(m - 1, -1, -1):
        old = forward[j]
        for i in range(n):
            w, half = weight[i, j], 1 << i
            if w > 0.0:
                for block in range(0, subsets, 2 * half):
                    for s in range(block, block + half):
                        earlier[s] += w * backward[s + half]
                probability[i, j] = w * _shared(old, backward, half) / total
        for s in range(subsets):
            backward[s] = earlier[s]
    for i in range(n):
        rest = 1.0
        for j in range(m):
            rest -= probability[i, j]
        probability[i, m] = max(0.0, rest)
    return total


@_compile
def propagate(
    weight: FloatArray,
    none: FloatArray,
    probability: FloatArray,
    to_row: FloatArray,
    most_rounds: int,
    tolerance: float,
) -> float:
    """Marginals by belief propagation; returns the log of Bethe's approximation of the evidence.

    Args:
        weight: (N, M) of each label.
        none: (N,) of no label.
        probability: (N, M + 1) filled.
        to_row: (N, M) the labels' messages: how free each is of the other detections. Where to start from
            (1 knows nothing), and filled with where it ended.
        most_rounds: after which it stops in any case.
        tolerance: change of a message below which it has converged.
    """
    n, m = weight.shape
    to_column = np.empty((n, m))
    crowd = np.empty(m)
    for _ in range(most_rounds):
        crowd[:] = 1.0
        for i in range(n):
            reach = none[i]
            for j in range(m):
                reach += weight[i, j] * to_row[i, j]
            for j in range(m):
                rest = max(reach - weight[i, j] * to_row[i, j], 1e-15 * reach, 1e-300)
                to_column[i, j] = weight[i, j] / rest
                crowd[j] += to_column[i, j]
        change = 0.0
        for i in range(n):
            for j in range(m):
                message = 1.0 / max(crowd[j] - to_column[i, j], 1.0)
                change = max(change, abs(message - to_row[i, j]))
                to_row[i, j] = message
        if change < tolerance:
            break
    evidence = 0.0
    for j in range(m):
        evidence += np.log(crowd[j])
    for i in range(n):
        reach = none[i]
        for j in range(m):
            reach += weight[i, j] * to_row[i, j]
        evidence += np.log(reach)
        probability[i, m] = none[i] / reach
        product = 1.0
        for j in range(m):
            probability[i, j] = weight[i, j] * to_row[i, j] / reach
            product *= 1.0 + to_column[i, j] * to_row[i, j]
            if product > 1e200:
                evidence -= np.log(product)
                product = 1.0
        evidence -= np.log(product)
    return evidence


@_compile
def marginals_by_component(
    weight: FloatArray, none: FloatArray, most_exact: int, probability: FloatArray
) -> tuple[float, bool]:
    """Fill in (N, M + 1) marginals as `association_marginals` does; returns log evidence, whether exact."""
    n, m = weight.shape
    weight, none = weight.copy(), none.copy()
    log_evidence = scale_rows(weight, none)
    component = np.empty(n, dtype=np.int64)
    number = components(weight, component)
    probability[:] = 0.0
    exact = True
    rows, columns = np.empty(n, dtype=np.int64), np.empty(m, dtype=np.int64)
    for c in range(number):
        height, width = _part(weight, component, c, rows, columns)
        part, rest = np.empty((height, width)), np.empty(height)
        for a in range(height):
            rest[a] = none[rows[a]]
            for b in range(width):
                part[a, b] = weight[rows[a], columns[b]]
        found = np.zeros((height, width + 1))
        if height <= most_exact:
            total = exact_marginals(part, rest, found)
            log_evidence += np.log(total) if total > 0.0 else -np.inf
        else:
            exact = False
            log_evidence += propagate(part, rest, found, np.ones((height, width)), 200, 1e-9)
        for a in range(height):
            probability[rows[a], m] = found[a, width]
            for b in range(width):
                probability[rows[a], columns[b]] = found[a, b]
    return log_evidence, exact


@_compile
def _part(
    weight: FloatArray, component: IntArray, number: int, rows: IntArray, columns: IntArray
) -> tuple[int, int]:
    """Fill in the rows of a component and the columns they have a weight for; returns how many of each."""
    height, width = 0, 0
    for i in range(len(component)):
        if component[i] == number:
            rows[height] = i
            height += 1
    for j in range(weight.shape[1]):
        used = False
        for a in range(height):
            used = used or weight[rows[a], j] > 0.0
        if used:
            columns[width] = j
            width += 1
    return height, width
