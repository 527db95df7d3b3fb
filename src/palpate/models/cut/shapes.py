"""Answer with shape matching on a cut level: clusters that the cut severs are split.

How far goals follow the particles is fitted to the displacement of quadratic elements before the cut, and one factor of
the hooks' forces to theirs.
"""

from collections.abc import Sequence

import numpy as np

from palpate.benchmark.cut_truth import Pulled
from palpate.benchmark.load import Refused
from palpate.bodies.cutting.cut import Cut
from palpate.bodies.cutting.ways import VIRTUAL_NODES, Parted, whole
from palpate.bodies.particles import particles_of
from palpate.effects.shape_matching import Clusters, ShapeMatching, make_clusters
from palpate.errors import NotConverged
from palpate.models.cut.opened import CutCase, Opened, opened, skin_of
from palpate.models.cut.springs import before_cut
from palpate.models.shape_matching import LEFT, cubes
from palpate.models.touch.pushing import SHARES
from palpate.models.touch.shape_matching import BETAS


class CutShapes:
    """Shapes that are given so many ``steps`` to settle at each stop of the hooks."""

    def __init__(self, case: CutCase, level: int, mode: str, clusters: str, steps: int, way: str = VIRTUAL_NODES):
        self.case, self._level, self._way, self._steps, self._mode = case, level, way, steps, mode
        if case.body.regions is not None:
            raise Refused(f"shape matching has one stiffness, and {case.body.name} several")
        self._skin, before = skin_of(case, self._level), whole(case.body, self._level, 0)
        self._clusters = make_clusters(
            particles_of(before.body, 0, surface=False), cubes(before.mesh).but(kind=clusters)
        )
        right, forces = before_cut(case, self._level)
        uncut, tried = Opened(case, self._level, self._skin, before, ()), []
        for self._beta in BETAS:
            self._ready(uncut, self._clusters)
            x, force = self._settled()
            tried.append((float(np.linalg.norm(x - uncut.rest - right)), self._beta, uncut.answer(x, force).force))
        _, self._beta, own = min(tried, key=lambda each: each[0])
        self._factor = float(own @ forces / (own @ own))

    def cut(self, cuts: Sequence[Cut]) -> None:
        cut = opened(self.case, self._level, self._skin, cuts, self._way)
        self._ready(cut, split(self._clusters, cut.parted, cuts))

    def _ready(self, cut: Opened, clusters: Clusters) -> None:
        particles = particles_of(cut.parted.body, 0, surface=False)
        self._opened, self._masses, self._still = cut, particles.masses[:, None], cut.held | cut.moved
        self._matching = ShapeMatching(particles, clusters, self._mode, 1.0, self._beta)

    def pull(self) -> Pulled:
        x, force = self._settled()
        return self._opened.answer(x, self._factor * force)

    def _settled(self) -> tuple[np.ndarray, np.ndarray]:
        """Return positions (n, 3) [m], and what pulls particles to their goals, (n, 3) [kg m] as no step is long."""
        cut, keep = self._opened, LEFT ** (2.0 / self._steps)
        x, goals = cut.rest.copy(), np.empty_like(cut.rest)
        for share in SHARES:
            x[cut.moved] = (cut.rest + share * cut.shifts)[cut.moved]
            w = np.zeros_like(x)
            for _ in range(self._steps):
                self._matching.goals(x, goals)
                w = keep * w + (goals - x)
                w[self._still] = 0.0
                x += w
        self._matching.goals(x, goals)
        if not np.isfinite(goals).all():
            raise NotConverged("shapes left the finite numbers", [float("nan")])
        return x, self._masses * (goals - x)


def split(clusters: Clusters, parted: Parted, cuts: Sequence[Cut]) -> Clusters:
    """Return the clusters of a whole mesh on its ``parted`` one, in parts that see each other.

    A cluster has all copies of its nodes. Those on the other side of a cut than its middle are another part if the cut
    is between (Steinemann, Otaduy and Gross 2006), or has doubled them.
    """
    copies = np.bincount(parted.origin, minlength=len(parted.whole.nodes))
    first = np.cumsum(copies) - copies
    owner = np.repeat(np.arange(len(clusters.starts) - 1), np.diff(clusters.starts))
    middles = (
        np.add.reduceat(parted.whole.nodes[clusters.members], clusters.starts[:-1]) / np.diff(clusters.starts)[:, None]
    )
    each = copies[clusters.members]
    number = np.arange(each.sum()) - np.repeat(np.cumsum(each) - each, each)
    nodes = np.argsort(parted.origin, kind="stable")[np.repeat(first[clusters.members], each) + number]
    owner, rest, part = np.repeat(owner, each), parted.mesh.nodes, np.zeros(each.sum(), dtype=np.int64)
    corners = parted.mesh.tetrahedra
    for c, cut in enumerate(cuts):
        total = np.bincount(corners.ravel(), np.repeat(parted.sides[:, c], 4), minlength=len(rest))
        side = np.where(total == 0.0, cut.across(rest), total) >= 0.0
        other = side[nodes] != (cut.across(middles) >= 0.0)[owner]
        part = 2 * part + (other & (cut.severs(middles[owner], rest[nodes]) | (copies[parted.origin[nodes]] > 1)))
    order = np.lexsort((nodes, part, owner))
    new = np.flatnonzero(np.diff(owner[order]) + np.abs(np.diff(part[order]))) + 1
    return Clusters(nodes[order], np.concatenate([[0], new, [len(nodes)]]))
