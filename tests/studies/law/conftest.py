"""The table of the study, made up."""

from fixtures.studies import law_table  # noqa: F401
