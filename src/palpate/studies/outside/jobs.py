"""What the rule of the study calls."""


def compare_with_published(input, params):
    from palpate.files import read_yaml
    from palpate.studies.outside.compare import compare
    from palpate.studies.outside.hanging_bar import read_displacements

    return compare(params.cells, read_yaml(input.published), read_displacements(input.displacements))
