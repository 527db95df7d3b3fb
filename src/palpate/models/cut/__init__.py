"""Models of a body that is cut and whose lips hooks pull apart."""
