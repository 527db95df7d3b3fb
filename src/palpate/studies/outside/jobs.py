"""What the rule of the study calls."""

CELLS = 4
"""Elements along a side of the coarsest of three meshes, of which each halves the last."""


def compare_with_published(input):
    from palpate.files import read_yaml
    from palpate.studies.outside.compare import compare
    from palpate.studies.outside.hanging_bar import read_displacements

    return compare(CELLS, read_yaml(input.published), read_displacements(input.displacements))
