"""Identities of stored results do not change with the names of settings."""

from scissorcal.identity import digest
from scissorcal.recipe import as_first_named, builtin_recipe
from scissorcal.workday.steps import BY_NAME


def test_stored_fits_stay_current() -> None:
    """The identity of settings is that of the version that called the key ``rung``."""
    settings = BY_NAME["fit friction"].settings(builtin_recipe("paper-80gsm"))
    assert digest(as_first_named(settings)) == (
        "434e6cdb2461d0db3e90fa43482ef7afc4a1fe39e11d832c3f11b203e87681a1"
    )
