"""Name the forms of paper 1's regressor: what it compares, and how it weighs."""

FEATURES = ("unordered", "ordered", "framed")
"""Kinds of feature vectors, which ``feature_vectors.kinds`` makes."""
WEIGHTS = ("signed", "nonnegative_a", "nonnegative_b", "clipped")
"""Kinds of weights, which ``blend_weights.BlendWeights`` explains."""
LITERAL = "literal"
"""Equation (4) of the paper word for word: w sums to 1 and not A w, with A as in nonnegative_a. Only the study of the
premises asks for it: a training sample does not reproduce itself."""
