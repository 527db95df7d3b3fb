"""Collision of deforming triangle meshes: exact tests, bounding volume trees, and intersection-free contact.

A ``Tree`` holds the triangles of one body; ``crossing_pairs`` finds those that intersect, ``crossing_segments`` where.
``contact_points`` adds place, direction, depth and relative velocity, exactly or, less exactly and sooner, from the
volumes of a ``StoppedTree``.
"""

from palpate.collision.trees.tree import Tree
from palpate.collision.trees.tree_query import crossing_pairs
from palpate.collision.triangles.intersection import crossing_segments

__all__ = ["Tree", "crossing_pairs", "crossing_segments"]
