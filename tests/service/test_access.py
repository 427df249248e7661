"""Addresses that are none are refused like strange ones."""

import pytest

from farm_ar.service.access import Access
from farm_ar.service.refusals import RefusedError


@pytest.mark.parametrize(
    ("headers", "field"), [({"host": "["}, "Host"), ({"host": "127.0.0.1", "origin": "http://["}, "Origin")]
)
def test_an_address_that_is_none_is_refused(headers, field):
    with pytest.raises(RefusedError, match=f"{field}: must be an address") as caught:
        Access().check(headers, {})
    assert caught.value.status == 403
