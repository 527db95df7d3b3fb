"""Functions that the rules of workflow/rules/collision.smk call; palpate.studies.jobs says how."""

from palpate.run.job import powers


def measure_collision(params, say):
    from palpate.studies.collision.compare_trees import installed, measure

    for package in installed()[1]:
        say(f"{package} is not installed, so its rows are left out")
    table = measure(**params.settings, seed=params.seed, report=lambda scene: say(f"{scene} is done"))
    for row in table.itertuples():
        say(
            f"{row.scene} {row.structure} {row.depths}: frame {row.frame_ms:.3f} ms, query {row.query_ms:.3f} ms, "
            f"{row.missed_pairs} pairs missed, {row.extra_pairs} made up"
        )
    return table


def measure_collision_scaling(params, say):
    from palpate.studies.collision.compare_trees import exponents, measure_growth

    table = measure_growth(params.triangles, params.depths, lambda number: say(f"{number} triangles are done"))
    for row in exponents(table).itertuples():
        said = powers({"build": row.build_ms, "refit": row.refit_ms, "query": row.query_ms})
        say(f"{row.structure} {row.depths}: {said}")
    return table


def measure_collision_precision(params, say):
    from palpate.studies.collision import apart_bodies, stopped_precision

    size, more = {"refinements": params.refinements}, {"depths": params.depths, "seed": params.seed}
    stopped = stopped_precision.measure(**params.stopped, **size, report=lambda scene: say(f"{scene} is done"))
    apart = apart_bodies.measure(**params.apart, **size, **more, report=lambda pair: say(f"{pair} apart is done"))
    return {"precision": stopped, "apart": apart}
