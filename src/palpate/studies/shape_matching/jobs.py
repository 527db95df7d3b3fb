"""Functions that the rules of workflow/rules/shape_matching.smk call; palpate.studies.jobs says how."""


def measure_experiments(params):
    from palpate.studies.shape_matching import body_springs_poke, integrator_stability
    from palpate.studies.shape_matching.clusters import cluster_goals, clustered_column, deformation_modes

    return {
        "integrator_stability": integrator_stability.measure(**params.integrator_stability),
        "clusters": clustered_column(**params.clusters),
        "cluster_goals": cluster_goals(**params.clusters),
        "deformation_modes": deformation_modes(),
        "body_springs": body_springs_poke.measure(**params.body_springs),
    }


def tabulate_maxwell_creep(input, params):
    from palpate.scenes.motion import load
    from palpate.scenes.scene import load_particles, scene_of
    from palpate.studies.shape_matching.maxwell_creep import measure

    scene = scene_of(params.name, params.entry)
    return measure(scene, load_particles(scene, input.bodies), load(input.motion))


def time_shape_matching(params, say):
    from palpate.studies.shape_matching.shape_matching_timing import exponents, headline, measure, rotation_speedup

    table = measure(**params.settings)
    fits = ", ".join(f"{row.mode} {row.clusters}: {row.exponent:.3f}" for row in exponents(table).itertuples())
    say(f"100 objects of 100 particles in 8 quadratic clusters: {headline(table):.3f} ms a step")
    say(f"exponents of the cost in particles: {fits}")
    say(f"rotations are found {rotation_speedup():.1f} times faster than by numpy.linalg.svd")
    return table
