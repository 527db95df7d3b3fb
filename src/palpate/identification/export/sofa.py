"""Identified numbers as a Python scene of SOFA: corotational linear elements, held nodes, Rayleigh damping.

Components and data are those of SOFA 23.12 and later (sofa-framework.github.io/doc); earlier ones call
FixedProjectiveConstraint FixedConstraint. SOFA is no package of Python's, so that no test here runs the scene.
"""

from palpate.identification.export.numbers import EngineMesh

LAW = "corotational"
MASS_1_S = 0.1
"""Damping by mass, which lets an organ in the air come to rest; it is not identified."""


def scene(mesh: EngineMesh, mesh_file: str) -> str:
    """Return the text of a scene whose mesh is ``mesh_file``, beside it."""
    material = mesh.corrected.material
    held = ", ".join(map(str, mesh.body.anchors[mesh.level].tolist()))
    return f'''"""{mesh.comment}

    runSofa {mesh.numbers.name}_sofa.py
"""

import os

YOUNG_PA, POISSON, DENSITY_KG_M3 = {material.young_pa!r}, {material.poisson!r}, {material.density_kg_m3!r}
RAYLEIGH_MASS_1_S, RAYLEIGH_STIFFNESS_S = {MASS_1_S!r}, {mesh.numbers.damping_s!r}
HELD = [{held}]
MESH = os.path.join(os.path.dirname(os.path.abspath(__file__)), {mesh_file!r})


def createScene(root):
    root.gravity = [0.0, 0.0, 0.0]  # presses are counted from rest under weight; give [0, 0, -9.81] for weight, too
    root.dt = 0.01
    for part in (
        "AnimationLoop", "Constraint.Projective", "IO.Mesh", "LinearSolver.Direct", "Mass", "ODESolver.Backward",
        "SolidMechanics.FEM.Elastic", "StateContainer", "Topology.Container.Dynamic", "Visual",
    ):
        root.addObject("RequiredPlugin", name="Sofa.Component." + part)
    root.addObject("DefaultAnimationLoop")
    root.addObject("VisualStyle", displayFlags="showForceFields")
    organ = root.addChild({mesh.numbers.name!r})
    organ.addObject(
        "EulerImplicitSolver", rayleighMass=RAYLEIGH_MASS_1_S, rayleighStiffness=RAYLEIGH_STIFFNESS_S
    )
    organ.addObject("SparseLDLSolver", template="CompressedRowSparseMatrixMat3x3d")
    organ.addObject("MeshGmshLoader", name="mesh", filename=MESH)
    organ.addObject("TetrahedronSetTopologyContainer", name="topology", src="@mesh")
    organ.addObject("TetrahedronSetGeometryAlgorithms", template="Vec3d")
    organ.addObject("MechanicalObject", name="state", template="Vec3d")
    organ.addObject("MeshMatrixMass", massDensity=DENSITY_KG_M3, lumping=True)
    organ.addObject(
        "TetrahedronFEMForceField", method="polar", youngModulus=YOUNG_PA, poissonRatio=POISSON
    )
    organ.addObject("FixedProjectiveConstraint", indices=HELD)
    return root
'''
