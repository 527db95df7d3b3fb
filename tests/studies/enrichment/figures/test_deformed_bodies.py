"""Deformed bodies are drawn with the errors of their predictions."""

import numpy as np
from fixtures.drawn import texts

from palpate.report import style
from palpate.studies.enrichment.figures import bodies


def test_deformed_bodies_shows_different_contacts_and_true_errors(body, database, predictions_file, tmp_path):
    found = bodies.read(predictions_file, "paper", "samples", bodies.DEFORMED_BY)
    figure = bodies.draw_deformed_bodies(body, database, found, rows=2)
    pictures = [axis for axis in figure.axes if axis.images]
    assert len(pictures) == 2 * 6
    shown = [int(t.split(":")[0].split()[1]) for t in texts(figure) if t.startswith("sample")]
    assert len(set(database.contact[shown])) == 2
    assert (np.diff(database.peaks[shown]) >= 0).all()
    i = shown[0]
    rms = np.sqrt(np.mean(np.sum(database.fine[i] ** 2, axis=1)))
    wrong = 100 * 0.3 * (1 + i / 10) * rms / database.peaks[i]
    assert f"error {wrong:.2g} % of peak" in texts(figure)
    style.save(figure, tmp_path / "deformed")
