"""Collision of deforming triangle meshes: exact tests, bounding volume trees, and intersection-free contact.

``triangle_pairs_intersect``, ``crossing_segments``, ``triangle_pairs_distance`` and ``triangle_pairs_contact`` compare
triangles pair by pair; a ``Tree`` holds the triangles of one body, and ``crossing_pairs`` finds those that intersect.
``triangle_contacts`` adds place, direction, depth and relative velocity; ``stopped_contacts`` takes all these from the
volumes of a ``StoppedTree``, less exactly and sooner.
"""

from palpate.collision.contact_points import ContactPoints, stopped_contacts, triangle_contacts
from palpate.collision.trees.tree import Tree
from palpate.collision.trees.tree_query import StoppedTree, crossing_pairs
from palpate.collision.triangles.distance import triangle_pairs_contact, triangle_pairs_distance
from palpate.collision.triangles.intersection import crossing_segments, triangle_pairs_intersect

__all__ = [
    "ContactPoints",
    "StoppedTree",
    "Tree",
    "crossing_pairs",
    "crossing_segments",
    "stopped_contacts",
    "triangle_contacts",
    "triangle_pairs_contact",
    "triangle_pairs_distance",
    "triangle_pairs_intersect",
]
