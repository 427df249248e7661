"""Packages that only some players and attacks need."""

import pytest

from farm_ar.agents.packages import package
from farm_ar.errors import MissingPackageError


def test_a_package_that_is_there_is_given():
    assert package("json.decoder").__name__ == "json.decoder"


def test_a_missing_package_says_what_to_install():
    with pytest.raises(
        MissingPackageError, match=r"this needs no_such_thing: install the extra train .*'\.\[train\]'"
    ):
        package("no_such_thing.inside")
