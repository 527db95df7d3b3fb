"""Name the forms of paper 1's regressor: what it compares, and how it weighs."""

FEATURES = ("unordered", "ordered", "framed")
"""Kinds of feature vectors, which ``feature_vectors.kinds`` makes."""
WEIGHTS = ("signed", "nonnegative_a", "nonnegative_b", "clipped")
"""Kinds of weights, which ``blend_weights.BlendWeights`` explains."""
