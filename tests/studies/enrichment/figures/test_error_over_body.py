"""The best, median and worst samples are those of each method by itself."""

from fixtures.drawn import texts

from palpate.studies.enrichment.figures import bodies


def test_error_over_body_ranks_each_method(body, database, predictions_file):
    found = bodies.read(predictions_file, "paper", "samples", bodies.JUDGED)
    figure = bodies.draw_error_over_body(body, database, {"paper protocol, samples held out": found})
    samples = [int(t.split(":")[0].split()[1]) for t in texts(figure) if t.startswith("sample")]
    assert samples == [0, 4, 7] * 3  # conftest: the later the sample the worse
