"""Names in law.csv: what is changed in a body, and the meshes whose errors stand beside that."""

OWN, LAW, POISSON, REGIONS = "nothing", "law", "poisson", "regions"
"""What differs from the body as it is described."""
MESHES = ("linear", "quadratic", "finest")
"""Whose errors are measured: linear elements on the finest level, quadratic ones with the same nodes, and on it."""
