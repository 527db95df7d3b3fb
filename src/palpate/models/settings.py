"""Settings that methods which learn from samples share."""

from palpate.setting_types import Block, Count, Positive, Whole, key


class Widths(Block):
    min: Positive = key("Smallest width", 0.01)
    max: Positive = key("Largest width", 100)
    count: Whole = key("Number of widths", 25, ge=2)


class Regression(Block):
    neighbours: Count = key("Coarse nodes in a contact-ordered feature (the paper's l)", 10)
    sigma_relative: Widths = key("Kernel widths tried, over the median distance of training features", {})
    folds: Whole = key("Parts of the cross-validation that chooses widths and ridges", 5, ge=2)
