"""A small liver that is pressed in a browser by the coarse mesh's answer, and by the same answer over http."""

from contextlib import contextmanager
from dataclasses import replace

import pytest
from fixtures.bodies import LIVER
from press.page.press_stage import READY
from press.portable.conftest import made_up, touched  # noqa: F401
from report import browser as chromium

from palpate.bodies.make_body import make_body
from palpate.press.coarse_rival import coarse_answer, packed
from palpate.press.page.page import Known, PressModel, press_document
from palpate.studies.press.measure import place_of

RADIUS_M, PEAK_M = 0.03, 0.02
INFO = {"peak_m": PEAK_M, "hardest_n": 1.0}


@pytest.fixture(scope="session")
def liver():
    """The liver of the smoke run, 554 surface nodes."""
    return make_body("liver", LIVER.but(refinements=1))


@pytest.fixture(scope="session")
def answer(liver):
    """The coarse mesh's answer for the liver, and its model of a page."""
    made = coarse_answer(liver, RADIUS_M)
    return made, PressModel("coarse", "coarse mesh", packed(made), info=INFO, kind="coarse")


@pytest.fixture(scope="session")
def model(liver, answer):
    """The model of a page, with one press whose truth is a tenth larger than the answer."""
    place = place_of(liver, 30)
    force = -0.5 * liver.fine.normals[30]
    moved = answer[0].respond([place | {"force": force}]).displacement
    truth = Known(30, place, force, 1.1 * moved, 0.001)
    return replace(answer[1], advice="Fast.", truths=[truth])


@pytest.fixture(scope="session")
def doubtful(answer):
    """The same answer from a server of the address /answer, in the words of a page."""
    mesh = {name: answer[0].arrays[name] for name in ("nodes", "triangles")}
    info = INFO | {"radius_m": RADIUS_M, "body": "liver"}
    return PressModel("server", "from a server", url="answer", info=info, **mesh)


@pytest.fixture
def opened(browser, tmp_path):
    """A function that opens the page of some models; it must not complain, nor fetch anything."""

    @contextmanager
    def visit(models, device=chromium.DESKTOP, held=(), **options):
        file = tmp_path / "press.html"
        file.write_text(press_document(models, held=held), encoding="utf-8")
        with chromium.visit(browser, file, device, reduced_motion="reduce", **options) as visited:
            chromium.until(visited.page, READY)
            yield visited.page
            assert visited.complaints == []
            assert [url for url in visited.asked if not url.startswith(("file:", "data:"))] == []

    return visit


@pytest.fixture
def page(opened, model):
    with opened([model]) as shown:
        yield shown
