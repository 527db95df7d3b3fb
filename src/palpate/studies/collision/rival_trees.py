"""Bounding trees of python-fcl and coal on deforming triangles, and their crossing pairs."""

from importlib.util import find_spec

import numpy as np

EVERY = 10**9
"""Upper limit of pairs, never reached: by default both packages stop after a few pairs."""


def installed() -> tuple[dict[str, type], list[str]]:
    """Return the rivals that can be imported, by the name of their structure, and the packages that cannot."""
    packages: dict[str, dict[str, type]] = {
        "fcl": {"obb_rss_fcl": Fcl},
        "coal": {"obb_coal": Coal, "obb_coal_refit": CoalRefit},
    }
    missing = [package for package in packages if find_spec(package) is None]
    found = [kinds for package, kinds in packages.items() if package not in missing]
    return {name: kind for kinds in found for name, kind in kinds.items()}, missing


class Fcl:
    """Trees of python-fcl: OBB-RSS, without refit, rebuilt in every frame.

    As in ``Coal``, contact points (``enable_contact``) are not computed: they cost time and are not needed here.
    """

    refits = False

    def __init__(self, triangles: list[np.ndarray], points: list[np.ndarray]):
        import fcl

        self._fcl, self._triangles = fcl, triangles
        self.update(points)

    def update(self, points: list[np.ndarray]) -> None:
        """Build the trees of both bodies at their new ``points``, (n, 3) [m] each."""
        self._objects = []
        for moved, triangles in zip(points, self._triangles, strict=True):
            model = self._fcl.BVHModel()
            model.beginModel(len(triangles), len(moved))
            model.addSubModel(moved, triangles)
            model.endModel()
            self._objects.append(self._fcl.CollisionObject(model, self._fcl.Transform()))

    def query(self) -> np.ndarray:
        """Return the crossing pairs, (k, 2) int64, unsorted."""
        asked, found = self._fcl.CollisionRequest(num_max_contacts=EVERY), self._fcl.CollisionResult()
        self._fcl.collide(*self._objects, asked, found)
        return np.array([(contact.b1, contact.b2) for contact in found.contacts], dtype=np.int64).reshape(-1, 2)


class Coal:
    """Trees of coal: OBB (its OBB-RSS take longer to build and to query), rebuilt in every frame."""

    refits = False

    def __init__(self, triangles: list[np.ndarray], points: list[np.ndarray]):
        import coal

        self._coal, self._triangles, self._here = coal, triangles, coal.Transform3s()
        self._asked = coal.CollisionRequest()
        self._asked.num_max_contacts, self._asked.enable_contact = EVERY, False
        self._found = coal.CollisionResult()
        self._build(points)

    def _build(self, points: list[np.ndarray]) -> None:
        self._models = []
        for moved, triangles in zip(points, self._triangles, strict=True):
            model = self._coal.BVHModelOBB()
            model.beginModel(len(triangles), len(moved))
            model.addVertices(moved)
            model.addTriangles(triangles)
            model.endModel()
            self._models.append(model)

    update = _build

    def query(self) -> np.ndarray:
        """Return the crossing pairs, (k, 2) int64, unsorted."""
        self._found.clear()
        one, other = self._models
        self._coal.collide(one, self._here, other, self._here, self._asked, self._found)
        pairs = [(contact.b1, contact.b2) for contact in self._found.getContacts()]
        return np.array(pairs, dtype=np.int64).reshape(-1, 2)


class CoalRefit(Coal):
    """Trees of coal, refitted bottom-up, which takes a fifth of the time of its top-down refit."""

    refits = True

    def __init__(self, triangles: list[np.ndarray], points: list[np.ndarray]):
        super().__init__(triangles, points)
        self._filled = []
        for moved in points:
            # passing points one by one costs more than the refit, so the same points are passed in every frame
            # and the new ones are written into the model's own array
            self._filled.append(self._coal.StdVec_Vec3s())
            self._filled[-1].extend(list(moved))

    def update(self, points: list[np.ndarray]) -> None:
        """Refit the trees of both bodies to their new ``points``, (n, 3) [m] each."""
        for model, filled, moved in zip(self._models, self._filled, points, strict=True):
            model.beginReplaceModel()
            model.replaceSubModel(filled)
            model.vertices()[:] = moved
            model.endReplaceModel(True, True)
