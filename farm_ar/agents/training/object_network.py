"""A network that looks at objects, not at a list of numbers: number them otherwise, and so is its answer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn.functional import linear

HEADS = 4
"""How many kinds of neighbour an object may look for at once."""

PARTS = (0.55, 1.0)
"""Parts of its way to a label's place up to which an object's features say how much room there is."""

FAR = 0.5
"""Room, as a share of half the table, from which on more makes no difference."""

NOWHERE = -1e9
"""Score of what must not be chosen."""

Observation = dict[str, Tensor]


class ObjectNetwork(nn.Module):
    """Scores what may be done with each object, from a state observation.

    Each object is described by its own numbers and by those that concern all (camera, budget). Then each
    looks at all others, and at the places of their labels, by attention with a bias for the pair (Brody et
    al. 2022, "How attentive are graph attention networks?"). All objects share one set of weights.

    Args:
        numbers: how many kinds there are, numbers that an object has, and numbers that concern all.
        levels: how many levels each of the ordered choices has that complete an action.
        width: of what is known of an object.
        pair_width: of what is known of a pair.
        rounds: how often the objects look at one another.
    """

    def __init__(
        self,
        numbers: tuple[int, int, int],
        levels: Sequence[int],
        width: int = 64,
        pair_width: int = 32,
        rounds: int = 2,
    ) -> None:
        super().__init__()
        kinds, own, common = numbers
        self._kinds, self._lengths = kinds, tuple(levels)
        self._enter = nn.Sequential(nn.Linear(own + common, width), nn.ReLU(), nn.Linear(width, width))
        self._rounds = nn.ModuleList(_Look(width, pair_width) for _ in range(rounds))
        self._pairs = _Pairs(width, pair_width)
        self._affinity = nn.Linear(pair_width, 1)
        self._levels = nn.Sequential(
            nn.Linear(width + pair_width, width), nn.ReLU(), nn.Linear(width, sum(levels) + 2 * len(levels))
        )
        self._which = nn.Sequential(nn.Linear(width, width), nn.ReLU(), nn.Linear(width, 1))
        self._whole = nn.Sequential(nn.Linear(2 * width + common, width), nn.ReLU())
        self._leave = nn.Linear(width, 1)
        self._value = nn.Linear(width, 1)
        for last in (self._levels[-1], self._which[-1], self._leave, self._affinity):
            assert isinstance(last, nn.Linear)
            nn.init.orthogonal_(last.weight, 0.01)
            nn.init.zeros_(last.bias)

    def forward(self, observation: Observation, apart: bool = False) -> Scores:
        """The scores of B moments with M objects, from the observations that `StateObservation` gives.

        Args:
            observation: the parts by their names.
            apart: whether what is learnt of values changes nothing that choices depend on.
        """
        own, common, kind = _numbers(observation, self._kinds)
        pairs, same = _pairs(observation, kind)
        all_common = common[:, None].expand(-1, own.shape[1], -1)
        known = self._enter(torch.cat([own, all_common], dim=-1))
        for look in self._rounds:
            known = look(known, pairs)
        whole = self._whole(torch.cat([known.mean(dim=1), known.amax(dim=1), common], dim=-1))
        which = self._which(known).squeeze(-1)
        value = self._value(whole.detach() if apart else whole)
        return Scores(which, self._leave(whole), value, known, pairs, same)

    def given(self, scores: Scores, which: Tensor) -> tuple[Tensor, list[Tensor]]:
        """What is to be done with an object, once it has been chosen.

        A level's logit is a free number plus a parabola over the levels, so that what is learnt of one level
        says something about its neighbours.

        Args:
            scores: of the moments.
            which: (B,) the objects.

        Returns:
            (B, M) logits of the labels that it may be taken for, and for each ordered choice (B, M, its
            levels) logits given the label.
        """
        batch, objects = which.shape[0], scores.same.shape[1]
        rows = torch.arange(batch, device=which.device)
        own = (rows * objects + which).repeat_interleave(objects)
        label = torch.arange(batch * objects, device=which.device)
        affinity, levels = self._choices(scores, own, label, scores.pairs[rows, which].flatten(0, 1))
        same = scores.same[rows, which]
        label_logits = affinity.view_as(same).masked_fill(~same, NOWHERE)
        return label_logits, [part.view(*same.shape, -1) for part in levels]

    def given_any(self, scores: Scores) -> tuple[Tensor, list[Tensor]]:
        """`given` for all objects at once: (B, M, M) logits and (B, M, M, levels) each.

        Only pairs of one kind are worked out, and put in their places.
        """
        same, objects = scores.same, scores.same.shape[1]
        pair = same.flatten().nonzero().squeeze(-1)
        own, label = pair // objects, pair // objects**2 * objects + pair % objects
        affinity, levels = self._choices(scores, own, label, scores.pairs.flatten(0, 2)[pair])
        label_logits = affinity.new_full((same.numel(),), NOWHERE).index_copy(0, pair, affinity)
        return label_logits.view_as(same), [
            part.new_zeros(same.numel(), part.shape[-1]).index_copy(0, pair, part).view(*same.shape, -1)
            for part in levels
        ]

    def _choices(
        self, scores: Scores, own: Tensor, label: Tensor, pairs: Tensor
    ) -> tuple[Tensor, list[Tensor]]:
        """(P,) logits of labels and (P, levels) logits for each ordered choice, of P pairs.

        Args:
            scores: of the moments.
            own: (P,) the object of each pair, counted through all moments.
            label: (P,) the other, whose label it is.
            pairs: (P, features).
        """
        known = scores.known.flatten(0, 1)
        seen = self._pairs.of(known, own, label, pairs)
        first, _, last = self._levels
        assert isinstance(first, nn.Linear)
        # The first layer is taken apart, so that what it makes of an object is not worked out for each pair.
        of_own, of_pair = first.weight[:, : known.shape[-1]], first.weight[:, known.shape[-1] :]
        both = linear(seen, of_pair).add_(linear(known, of_own, first.bias).index_select(0, own))
        free, *bends = last(torch.relu_(both)).split([sum(self._lengths)] + [2] * len(self._lengths), dim=-1)
        levels = []
        for part, bend in zip(free.split(self._lengths, dim=-1), bends, strict=True):
            level = torch.linspace(-1.0, 1.0, part.shape[-1], device=part.device)
            levels.append(part + 2 * bend[..., :1] * level + 2 * bend[..., 1:] * level.square())
        return self._affinity(seen).squeeze(-1), levels


@dataclass(frozen=True)
class Scores:
    """What a network says of B moments with M objects.

    Args:
        which: (B, M) logits of the objects.
        leave: (B, 1) logit of ending the turn.
        value: (B, 1) of the moment.
        known: (B, M, width) of the objects.
        pairs: (B, M, M, features) of an object and the label of another.
        same: (B, M, M) whether they are of one kind.
    """

    which: Tensor
    leave: Tensor
    value: Tensor
    known: Tensor
    pairs: Tensor
    same: Tensor


class _Pairs(nn.Module):
    """What is known of each pair of objects."""

    FEATURES = 11 + len(PARTS)

    def __init__(self, width: int, pair_width: int) -> None:
        super().__init__()
        self._first = nn.Linear(width, pair_width)
        self._second = nn.Linear(width, pair_width, bias=False)
        self._pair = nn.Linear(self.FEATURES, pair_width, bias=False)

    def forward(self, known: Tensor, pairs: Tensor) -> Tensor:
        """(B, M, M, pair_width)."""
        both: Tensor = self._pair(pairs)  # a large array, changed in place
        both = both.add_(self._first(known)[:, :, None]).add_(self._second(known)[:, None])
        return torch.relu_(both)

    def of(self, known: Tensor, own: Tensor, label: Tensor, pairs: Tensor) -> Tensor:
        """(P, pair_width) of P pairs, of whose objects (N, width) `known` is known."""
        both: Tensor = self._pair(pairs)
        both = both.add_(self._first(known).index_select(0, own))
        return torch.relu_(both.add_(self._second(known).index_select(0, label)))


class _Look(nn.Module):
    """Each object looks at all, and remembers what it saw."""

    def __init__(self, width: int, pair_width: int) -> None:
        super().__init__()
        self._pairs = _Pairs(width, pair_width)
        self._score = nn.Linear(pair_width, HEADS)
        self._think = nn.Sequential(
            nn.Linear(2 * width + HEADS * pair_width, width), nn.ReLU(), nn.Linear(width, width)
        )
        self._scale = nn.LayerNorm(width)

    def forward(self, known: Tensor, pairs: Tensor) -> Tensor:
        """(B, M, width) what is known afterwards."""
        seen = self._pairs(known, pairs)
        weight = torch.softmax(self._score(seen), dim=2)
        told = torch.einsum("bijh,bijp->bihp", weight, seen).flatten(2)
        overall = known.mean(dim=1, keepdim=True).expand_as(known)
        result: Tensor = self._scale(known + self._think(torch.cat([known, told, overall], dim=-1)))
        return result


def sizes(shapes: dict[str, int], objects: int) -> tuple[int, int, int]:
    """How many kinds, own numbers and common numbers an observation has.

    Args:
        shapes: length of each part of the observation.
        objects: how many objects there are.
    """
    own = sum(shapes[name] // objects for name in OWN if name in shapes)
    return shapes["category"] // objects, own, sum(shapes[name] for name in COMMON if name in shapes)


OWN = (
    "position",
    "heading",
    "category",
    "in_view",
    "fixed",
    "margin",
    "believed_position",
    "believed_heading",
    "difference",
)
COMMON = ("camera", "budget", "hand")


def _numbers(observation: Observation, kinds: int) -> tuple[Tensor, Tensor, Tensor]:
    """(B, M, own), (B, common) and (B, M, kinds) the kinds, one-hot."""
    batch, objects = observation["in_view"].shape
    parts = {name: observation[name].reshape(batch, objects, -1) for name in OWN if name in observation}
    common = torch.cat([observation[name] for name in COMMON if name in observation], dim=-1)
    return torch.cat(list(parts.values()), dim=-1), common, parts["category"]


def _pairs(observation: Observation, kind: Tensor) -> tuple[Tensor, Tensor]:
    """(B, M, M, features) of pairs of an object and a label, (B, M, M) whether they are of one kind."""
    batch, objects = observation["in_view"].shape
    shape = (batch, objects, 2)
    place, heading = observation["position"].reshape(shape), observation["heading"].reshape(shape)
    home = observation.get("believed_position", observation["position"]).reshape(shape)
    facing = observation.get("believed_heading", observation["heading"]).reshape(shape)
    sine, cosine = heading[:, :, None].unbind(-1)
    to_sine, to_cosine = facing[:, None].unbind(-1)
    turn = torch.stack([to_sine * cosine - to_cosine * sine, to_cosine * cosine + to_sine * sine], dim=-1)
    way = torch.cat([home[:, None] - place[:, :, None], turn], dim=-1)
    apart = place[:, None] - place[:, :, None]
    same = torch.einsum("bik,bjk->bij", kind, kind)
    eye = torch.eye(objects, device=place.device).expand(batch, -1, -1)
    distance = apart.square().sum(-1)
    cost = _costs(observation, same)
    rest = torch.stack([distance, same, eye, cost, cost.transpose(1, 2)], dim=-1)
    return torch.cat([way, apart, rest, _room(apart, home[:, None] - place[:, :, None])], dim=-1), same > 0


def _room(apart: Tensor, way: Tensor) -> Tensor:
    """(B, M, M, parts) how near an object would come to any other on its way to a label's place.

    Args:
        apart: (B, M, M, 2) from each object to the others.
        way: (B, M, M, 2) from each object to the places of the labels.
    """
    length = way.square().sum(-1, keepdim=True)
    along = way @ apart.transpose(-1, -2)
    nearest = along / length.clamp(min=1e-9)
    away = apart.square().sum(-1)[:, :, None] + 4 * torch.eye(apart.shape[1], device=apart.device)[:, None]
    rooms = []
    for part in PARTS:
        share = nearest.clamp(0.0, part)
        square = (away + share * (share * length - 2 * along)).amin(dim=-1)
        rooms.append(square.clamp(min=0.0).sqrt().clamp(max=FAR))
    return torch.stack(rooms, dim=-1)


def ranks(same: Tensor) -> Tensor:
    """(B, M) the place of each object among those of its kind.

    Args:
        same: (B, M, M) 1 for objects of one kind, else 0.
    """
    return torch.tril(same, diagonal=-1).sum(dim=-1).long()


def _costs(observation: Observation, same: Tensor) -> Tensor:
    """(B, M, M) cost to each object of each label of its kind, 0 across kinds."""
    if "cost" not in observation:
        return torch.zeros_like(same)
    batch, objects, _ = same.shape
    cost = observation["cost"].reshape(batch, objects, -1)
    place = ranks(same)[:, None].expand(-1, objects, -1).clamp(max=cost.shape[-1] - 1)
    return torch.gather(cost, 2, place) * same
