"""Answer a folder of `palpate ask` with scikit-fem: linear or quadratic tetrahedra, Newton's method.

    pip install scikit-fem numpy scipy
    python scikit_fem.py FOLDER [answers.npz] [--settings 0:1 0:2 1:1]      (level:order of the elements)

The law is the folder's corotational one with its exact tangent; the traction is integrated anew, for either order.
"""

import argparse
import json
import platform
import time
from pathlib import Path

import numpy as np
import skfem
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu


def corotational(gradient: np.ndarray, mu: np.ndarray, lame: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stress P (e, q, 3, 3) and tangent dP/dF (e, q, 3, 3, 3, 3) of F (e, q, 3, 3); mu, lame (e, 1)."""
    u, s, vt = np.linalg.svd(gradient)
    sign = np.where(np.linalg.det(u @ vt) < 0, -1, 1)  # of the least stretch, negative in an inverted element
    u[..., 2], s[..., 2] = u[..., 2] * sign[..., None], s[..., 2] * sign
    rotation, trace, one = u @ vt, s.sum(-1), np.eye(3)
    stretch = np.einsum("...ki,...k,...kj->...ij", vt, s, vt)
    mu, lame, pull = (np.broadcast_to(x, trace.shape)[..., None, None] for x in (mu, lame, lame * (trace - 3)))
    stress = 2 * mu * (gradient - rotation) + pull * rotation
    # dR = R W, W x = w × x, (tr S − S) w = −ε : (Rᵀ dF), the axial vector of Rᵀ dF − dFᵀ R
    cross = np.cross(one[:, None], one)  # Levi-Civita's symbol
    axial = -np.einsum("amn,...km->...akn", cross, rotation)
    spin = np.linalg.solve(trace[..., None, None] * one - stretch, axial.reshape(*axial.shape[:-2], 9))
    turn = np.einsum("...im,maj,...akl->...ijkl", rotation, cross, spin.reshape(axial.shape))
    mu, lame, pull = mu[..., None, None], lame[..., None, None], pull[..., None, None]
    tangent = 2 * mu * np.einsum("ik,jl->ijkl", one, one) + (pull - 2 * mu) * turn
    return stress, tangent + lame * np.einsum("...ij,...kl->...ijkl", rotation, rotation)


class Body:  # one level with elements of one order
    def __init__(self, folder: Path, level: int, order: int, materials: list[dict]) -> None:
        data = np.load(folder / f"level_{level}.npz")
        begin = time.perf_counter()
        mesh = skfem.MeshTet(data["nodes_m"].T.copy(), data["tetrahedra"].T.copy())
        element = skfem.ElementVector(skfem.ElementTetP1() if order == 1 else skfem.ElementTetP2())
        self.basis = skfem.Basis(mesh, element, intorder=2 * (order - 1) or 1)
        self.surface = skfem.FacetBasis(mesh, element, intorder=12)  # many points, for the edge of the disc
        young, poisson = np.array([(m["young_pa"], m["poisson"]) for m in materials])[data["region"]].T[..., None]
        self.mu, self.lame = young / (2 * (1 + poisson)), young * poisson / ((1 + poisson) * (1 - 2 * poisson))
        slopes = np.array([np.broadcast_to(each[0].grad, (3, 3, *self.basis.dx.shape)) for each in self.basis.basis])
        self.slopes = np.ascontiguousarray(slopes.reshape(len(slopes), 9, *self.basis.dx.shape).transpose(2, 3, 0, 1))
        self.numbers, self.dx = self.basis.element_dofs.T, self.basis.dx
        self.weighted = self.slopes * self.dx[..., None, None]
        # also middles of edges, on facets with three held corners
        held = self.basis.get_dofs(np.flatnonzero(np.isin(mesh.facets, data["held"]).all(0))).all()
        self.free = np.setdiff1d(np.arange(self.basis.N), np.append(held, self.basis.nodal_dofs[:, data["held"]]))
        # nodes, corners before middles of edges, which is the order of a mesh that is split once
        of_nodes = np.hstack([self.basis.nodal_dofs, self.basis.edge_dofs] if order == 2 else [self.basis.nodal_dofs])
        shown = mesh.refined() if order == 2 else mesh
        self.dofs, self.nodes_m, self.triangles = of_nodes.T, shown.p.T, shown.facets[:, shown.boundary_facets()].T
        self.preparation_s = time.perf_counter() - begin

    def traction(self, load: dict) -> np.ndarray:
        """Consistent nodal forces [N] of a load, its total set right."""
        far = np.linalg.norm(self.surface.global_coordinates().value - np.reshape(load["place_m"], (3, 1, 1)), axis=0)
        facing = np.einsum("i,i...->...", load["normal"], np.asarray(self.surface.normals)) > 0
        weight = np.where(facing, np.maximum(1 - (far / load["radius_m"]) ** 2, 0), 0)
        force = np.reshape(load["force_n"], (3, 1, 1)) / (weight * self.surface.dx).sum()
        return skfem.LinearForm(lambda v, w: np.einsum("i...,i...->...", v, force * weight)).assemble(self.surface)

    def press(self, load: dict, parts: int = 1, most: int = 20) -> np.ndarray:
        """Displacements of the nodes, the load put on in parts if need be; NaN if Newton's method does not converge."""
        outer, u = self.traction(load), self.basis.zeros()
        for part in np.linspace(1 / parts, 1, parts):
            for _ in range(most):
                gradient = np.einsum("eqaf,ea->eqf", self.slopes, u[self.numbers]) + np.eye(3).ravel()
                stress, tangent = corotational(gradient.reshape(*self.dx.shape, 3, 3), self.mu, self.lame)
                inner = np.einsum("eqaf,eqf->ea", self.weighted, stress.reshape(*self.dx.shape, 9))
                residual = part * outer - np.bincount(self.numbers.ravel(), inner.ravel(), len(u))
                if np.linalg.norm(residual[self.free]) < 1e-8 * np.linalg.norm(outer):
                    break
                blocks = (self.weighted @ tangent.reshape(*self.dx.shape, 9, 9) @ self.slopes.swapaxes(2, 3)).sum(1)
                rows, columns = np.broadcast_arrays(self.numbers[:, :, None], self.numbers[:, None])
                matrix = coo_matrix((blocks.ravel(), (rows.ravel(), columns.ravel())), (len(u), len(u))).tocsc()
                u[self.free] += splu(matrix[self.free][:, self.free]).solve(residual[self.free])
            else:
                return self.press(load, 8) if parts == 1 else np.full_like(self.nodes_m, np.nan)
        return u[self.dofs]


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("answers", nargs="?", default="answers_scikit_fem.npz")
    parser.add_argument("--settings", nargs="+", default=["0:1", "0:2", "1:1"])
    arguments = parser.parse_args()
    asked = json.loads((arguments.folder / "questions.json").read_text())
    if (asked["kind"], asked["law"]) != ("press", "corotational"):
        what = f"{asked['scene']} asks for a {asked['kind']} with the law {asked['law']}"
        raise SystemExit(f"{what}; this script answers presses with the corotational law only")
    settings = [tuple(map(int, each.split(":"))) for each in arguments.settings]
    answers = {"digest": asked["digest"], "engine": "scikit-fem", "version": skfem.__version__, "law": "corotational"}
    answers |= {"hardware": f"{platform.machine()} processor, 1 thread", "converged": [True] * len(settings)}
    answers |= {"settings": [f"level {level}, {'linear' if order == 1 else 'quadratic'}" for level, order in settings]}
    for i, (level, order) in enumerate(settings):
        body, found, seconds = Body(arguments.folder, level, order, asked["materials"]), [], []
        for load in asked["loads"]:
            begin = time.perf_counter()
            found.append(body.press(load))
            seconds.append(time.perf_counter() - begin)
        failed = ~np.isfinite(found).all(axis=(1, 2))
        print(answers["settings"][i], f"{np.median(seconds):.3g} s, {failed.sum()} failed", flush=True)
        setting = {"displacement_m": found, "failed": failed, "nodes_m": body.nodes_m, "triangles": body.triangles}
        setting |= {"seconds": np.where(failed, np.nan, seconds), "preparation_s": body.preparation_s}
        answers |= {f"setting_{i}/{name}": value for name, value in setting.items()}
    np.savez_compressed(arguments.answers, **answers)


if __name__ == "__main__":
    main()
