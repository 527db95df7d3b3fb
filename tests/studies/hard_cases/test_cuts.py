"""Every hard case of the family cuts ends as it was declared to, and its bound fails wrong answers."""

from fixtures.hard_cases import cases_of

test_hard_case = cases_of("cuts")
