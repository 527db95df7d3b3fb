"""The cost of accuracy in soft-tissue simulation: published methods and their rivals on the same scenes."""
