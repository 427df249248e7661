"""Who may ask: addresses that are none, and tokens that are guessed."""

import pytest

from farm_ar.service.access import GUESSES_S, MOST_ADDRESSES, MOST_GUESSES, Access, Guesses
from farm_ar.service.refusals import RefusedError


@pytest.mark.parametrize(
    ("headers", "field"), [({"host": "["}, "Host"), ({"host": "127.0.0.1", "origin": "http://["}, "Origin")]
)
def test_an_address_that_is_none_is_refused(headers, field):
    with pytest.raises(RefusedError, match=f"{field}: must be an address") as caught:
        Access().check(headers, {})
    assert caught.value.status == 403


RIGHT = {"authorization": "Bearer open-sesame-please"}


def guarded(now: list[float]) -> Access:
    return Access("open-sesame-please", guesses=Guesses(lambda: now[0]))


def guess(access: Access, address: str | None, token: str = "another") -> int:
    with pytest.raises(RefusedError) as caught:
        access.check({"authorization": f"Bearer {token}"}, {}, address)
    return caught.value.status


def test_who_guesses_tokens_is_not_heard_for_a_while_not_even_with_the_right_one():
    now = [100.0]
    access = guarded(now)
    assert [guess(access, "10.0.0.7", f"try-{k}") for k in range(MOST_GUESSES)] == [401] * MOST_GUESSES
    now[0] += GUESSES_S / 2
    with pytest.raises(RefusedError, match="must not be guessed: come again in 30 s") as caught:
        access.check(RIGHT, {}, "10.0.0.7")
    assert (caught.value.status, caught.value.again_s) == (429, 30)
    with pytest.raises(RefusedError, match="must not be guessed"):
        access.check({}, {"token": "open-sesame-please"}, "10.0.0.7")
    access.check(RIGHT, {}, "10.0.0.8")  # others are
    now[0] += GUESSES_S / 2 - 0.001
    assert guess(access, "10.0.0.7") == 429
    now[0] += 0.001
    access.check(RIGHT, {}, "10.0.0.7")
    assert guess(access, "10.0.0.7") == 401


def test_few_wrong_tokens_and_no_token_at_all_keep_nobody_out():
    now = [0.0]
    access = guarded(now)
    for _ in range(3):
        for _ in range(MOST_GUESSES - 1):
            assert guess(access, "10.0.0.7") == 401
        for _ in range(2 * MOST_GUESSES):
            assert guess(access, "10.0.0.7", "") == 401
        access.check(RIGHT, {}, "10.0.0.7")
        now[0] += GUESSES_S


def test_addresses_that_guess_are_remembered_up_to_a_number():
    access = guarded([0.0])
    for k in range(MOST_GUESSES):
        guess(access, "10.0.0.7", f"try-{k}")
    for k in range(MOST_ADDRESSES - 1):
        assert guess(access, f"10.1.{k // 256}.{k % 256}") == 401
    assert guess(access, "10.0.0.7") == 429
    assert guess(access, "10.2.0.0") == 401
    assert guess(access, "10.0.0.7") == 401
    assert len(access.guesses._wrong) == MOST_ADDRESSES
