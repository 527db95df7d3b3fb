"""Cuts of a body at rest: their surface, meshes that conform to it, and nodes doubled along it."""
