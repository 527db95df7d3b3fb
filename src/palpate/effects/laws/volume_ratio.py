"""The measure of volume of the neo-Hookean laws, the ratio of volumes J = s₁ s₂ s₃."""


def measure(s, slopes, curvatures):
    """Return θ = J, and write its derivatives."""
    for i in range(3):
        slopes[i] = s[(i + 1) % 3] * s[(i + 2) % 3]
        for j in range(3):
            curvatures[i, j] = 0.0 if i == j else s[3 - i - j]
    return s[0] * s[1] * s[2]
