"""Every mesh is drawn with its counts."""

from fixtures.drawn import texts

from palpate.studies.enrichment.figures import bodies


def test_mesh_levels_counts(body):
    written = "\n".join(texts(bodies.draw_mesh_levels([body])))
    for mesh in body.levels:
        assert f"surface: {len(mesh.surface):,} nodes, {len(mesh.triangles):,} triangles" in written
        assert f"volume: {len(mesh.nodes):,} nodes, {len(mesh.tetrahedra):,} tetrahedra" in written
