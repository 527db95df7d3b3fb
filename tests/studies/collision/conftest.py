"""The tables of the study, as figures and the report have them."""

from fixtures.results import collision_results  # noqa: F401
