"""Answer with a reduced model for each contact, made of linear, second-order and pressed shapes of quadratic elements.

Contacts are prepared by presses that the model simulates itself: it needs no sample. What several presses need is the
union of their contacts' shapes.
"""

from weakref import WeakKeyDictionary

import numpy as np

from palpate.benchmark.load import Answer, Doubted, Load
from palpate.benchmark.model import Case, Setting
from palpate.errors import InputError, NotConverged
from palpate.models.contact_modes.contact_workshop import Workshop, reduced_level
from palpate.models.contact_modes.prepared_contacts import RESIDUAL, Prepared, prepare_contacts, spent
from palpate.models.found_forces import forces_for
from palpate.models.memory import held_mb

PREPARED, REDUCES, LAW = True, "p2", "the body's"
WORDS = {"modes": ("columns", "snapshots", "finer"), "target": ("operator", "limit")}
GUARD, FAR, HARD = 0.68, 2.0, 1.05
"""Smallest det F of the cells of an answer, its largest energy norm over that of the farthest snapshot, and its
hardest inward force over the one that finer elements are known to bear; beyond any, the model says that it does not
know."""

TINY = 1e-9
"""Linear answers that are this much smaller than the farthest snapshot are the answer; rounding hides the rest."""

OWN = 1e-3
"""RMSE over peak that an answer as far as the farthest snapshot says of itself; bounds find the factor to it."""

_kept: WeakKeyDictionary = WeakKeyDictionary()
"""Workshops by body, and there by radius and size: what one setting has made serves the others."""


def settings(case: Case) -> list[Setting]:
    """List columns alone, snapshots with fewer rings, with all thinned more and less, and pressed finer, by target.

    There is something finer to press if a level above the one that is reduced is the body's own.
    """
    grid = case.grid["contact_modes"]
    *fewer, rings = grid["rings"]
    *_, finest = tolerances = grid["tolerances"]
    kinds: list[Setting] = [{"modes": "columns", "rings": rings, "thinned": finest}]
    kinds += [{"modes": "snapshots", "rings": r, "thinned": finest} for r in fewer]
    kinds += [{"modes": "snapshots", "rings": rings, "thinned": t} for t in tolerances]
    if reduced_level(case.body, grid["nodes"]) < len(case.body.levels) - 1:
        kinds += [{"modes": "finer", "rings": rings, "thinned": finest}]
    return [kind | {"target": target} for kind in kinds for target in grid["targets"]]


def prepare(case: Case, setting: Setting) -> "ContactModes":
    """Set up the elements; each contact is prepared when it is asked for first, and charged then.

    InputError for words that it does not know.
    """
    for name, known in WORDS.items():
        if setting[name] not in known:
            raise InputError(f"contact_modes: {name} is {setting[name]}; take one of {', '.join(known)}.")
    return ContactModes(case, setting)


class ContactModes:
    """Reduced models of contacts; a contact that is not prepared is, when it is asked for.

    prepared : what answers, by the nodes that are pressed at once
    """

    def __init__(self, case: Case, setting: Setting):
        most = case.grid["contact_modes"]["nodes"]
        kept = _kept.setdefault(case.body, {})
        key = case.radius_m, most
        if key not in kept:
            kept[key] = Workshop(case.body, *key)
        self._shop, self._case, self._setting = kept[key], case, setting
        self.prepared: dict[tuple[int, ...], Prepared] = {}
        self._seconds = 0.0
        self._shop.elements(self._shop.level), self._shop.up(self._shop.level)

    @property
    def shop(self) -> Workshop:
        """The workshop of its contacts, for those who need more of them than answers."""
        return self._shop

    @property
    def memory_mb(self) -> float:
        """The memory [MB] that the prepared contacts hold; what prepares others can be dropped."""
        return held_mb(self.prepared)

    def precede(self, load: Load) -> None:
        """Prepare the contacts of ``load``; not timed, but charged."""
        self.prepare_contact(*(press.node for press in load.presses))

    def prepare_contact(self, *nodes: int) -> Prepared:
        """Return what answers presses at fine surface ``nodes`` at once, made at its first use.

        InputError for a node that is held or not of the surface.
        """
        if nodes not in self.prepared:
            self.prepared[nodes] = prepare_contacts(self._shop, self._case, self._setting, nodes)
            self._seconds += self.seconds_of(*nodes)
            self._case.charge("contacts", self._seconds)
        return self.prepared[nodes]

    def seconds_of(self, *nodes: int) -> float:
        """Return the time [s] that preparing these contacts takes, what other settings have made included."""
        return spent(self._shop, self._setting, nodes)

    def respond(self, load: Load) -> Answer:
        """Return the displacement (n_surface, 3) [m] under ``load``, and the forces found if a disc is pushed.

        Its own estimate of its error grows with how far the answer goes. NotConverged beyond the guard.
        """
        model = self.prepare_contact(*(press.node for press in load.presses))
        given = [press.force for press in load.presses if press.force is not None]
        force = np.concatenate(given) if len(given) == len(load.presses) else _found(model, load)
        q, why, residual = _at_rest(model, force)
        moved = model.columns @ force + model.rest @ model.beyond(q, force).astype(np.float32)
        found = None if len(given) == len(load.presses) else force.reshape(-1, 3)
        answer = Answer(moved.reshape(-1, 3), found, OWN * float(np.linalg.norm(q)) / model.reach)
        if why:
            raise Doubted(why, [residual], answer)
        return answer


def _found(model: Prepared, load: Load) -> np.ndarray:
    """Return the forces (3 k,) [N] of all presses, those of pushed discs found."""
    unknown = np.repeat([press.force is None for press in load.presses], 3)
    given = np.concatenate([press.moved if press.force is None else press.force for press in load.presses])
    linear, rest = model.discs

    def moved(force: np.ndarray) -> np.ndarray:
        return linear @ force + rest @ model.beyond(_settled(model, force), force)

    return forces_for(moved, given, np.where(unknown, 0.0, given), unknown, linear)


def _settled(model: Prepared, force: np.ndarray) -> np.ndarray:
    """Return the coordinates (r,) under ``force`` (3 k,) [N]; NotConverged where they are not to be believed."""
    q, why, residual = _at_rest(model, force)
    if why:
        raise NotConverged(why, [residual])
    return q


def _at_rest(model: Prepared, force: np.ndarray) -> tuple[np.ndarray, str, float]:
    """Return the coordinates (r,) under ``force`` (3 k,) [N], why they are not to be believed or "", the residual.

    NotConverged where there are none.
    """
    linear = model.reduced.loads @ force
    if float(np.linalg.norm(linear)) <= TINY * model.reach:
        return linear, "", 0.0
    q, residual, least = model.reduced.at_rest(force, RESIDUAL)
    far = float(np.linalg.norm(q)) / model.reach
    inward = np.maximum((model.bearing * force.reshape(-1, 3)).sum(axis=1), 0.0)
    hard = float((model.together @ inward).max())
    why = ""
    if not least >= GUARD:
        why = f"cells are squeezed to det F = {least:.2f}, beyond what the contact's model was made for"
    elif not far <= FAR:
        why = f"this goes {far:.1f} times as far as what the contact's model is made of"
    elif not hard <= HARD:
        why = f"this presses {hard:.2f} times as hard as finer elements are known to bear"
    return q, why, residual
