"""Surface files as exporters write them are read, cut ones are refused, and units are guessed from sizes."""

import struct

import numpy as np
import pytest
from fixtures.organs import volume

from palpate.bodies.mesh_file import choose_scale, guess_scale, read
from palpate.errors import InputError

CORNERS = [[i & 1, i >> 1 & 1, i >> 2] for i in range(8)]
QUADS = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
TRIANGLES = [t for q in QUADS for t in (q[:3], [q[0], *q[2:]])]
V = "".join("v {:.6f} {:.6f} {:.6f}\n".format(*p) for p in CORNERS)
VN = "".join(f"vn {k} 0 0\n" for k in range(6))
VT = "".join(f"vt {k / 24} 0\n" for k in range(24))


def faces(pattern, elements=QUADS):
    """Write one line a face; i: the corner from 1, n: from the end, t: the texture place, k: the face."""
    return "".join(
        "f " + " ".join(pattern.format(i=c + 1, n=c - 8, t=len(q) * k + j + 1, k=k + 1) for j, c in enumerate(q)) + "\n"
        for k, q in enumerate(elements)
    )


OBJ = {
    "blender": f"# Blender\nmtllib a.mtl\no Cube\n{V}{VN}{VT}s 0\nusemtl M\n" + faces("{i}/{t}/{k}"),
    "normals": V + VN + faces("{i}//{k}"),
    "textures": V + VT + faces("{i}/{t}"),
    "relative": V + faces("{n}"),
    "relative_between": "".join(
        "".join("v {} {} {}\n".format(*CORNERS[c]) for c in t) + "f -3 -2 -1\n" for t in TRIANGLES
    ),
    "continued": (V + faces("{i}")).replace(" 1", " \\\n1"),
    "groups": V + "g a b\nusemtl x\n" + faces("{i}", TRIANGLES[:6]) + "g c\ns 1\n" + faces("{i}", TRIANGLES[6:]),
    "colours": V.replace("\n", " 0.5 0.5 0.5\n") + faces("{i}"),
    "crlf": (V + faces("{i}")).replace("\n", "\r\n"),
    "no_last_line_end": (V + faces("{i}")).rstrip(),
}


def stl(head=b"x", count=12, more=b""):
    records = b"".join(struct.pack("<12fH", 0, 0, 0, *np.ravel([CORNERS[c] for c in t]).tolist(), 0) for t in TRIANGLES)
    return head.ljust(80) + struct.pack("<I", count) + records + more


ASCII_STL = "".join(
    "facet normal 0 0 0\nouter loop\n"
    + "".join("vertex {} {} {}\n".format(*CORNERS[c]) for c in t)
    + "endloop\nendfacet\n"
    for t in TRIANGLES
)
ASCII_STL = f"solid a cube\n{ASCII_STL}endsolid a cube\n"


def ply(order="<", index="int", name="vertex_indices", elements=QUADS):
    kind = "ascii" if order == "" else f"binary_{'little' if order == '<' else 'big'}_endian"
    head = f"ply\nformat {kind} 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
    head += f"element face {len(elements)}\nproperty list uchar {index} {name}\nend_header\n"
    if not order:
        rows = [*CORNERS, *([len(e), *e] for e in elements)]
        return (head + "\n".join(" ".join(map(str, row)) for row in rows) + "\n").encode()
    body = b"".join(struct.pack(order + "3f", *p) for p in CORNERS)
    letter = {"int": "i", "ushort": "H"}[index]
    return head.encode() + body + b"".join(struct.pack(f"{order}B{len(e)}{letter}", len(e), *e) for e in elements)


CUBES = {f"{name}.obj": text.encode() for name, text in OBJ.items()} | {
    "binary.stl": stl(),
    "solid.stl": stl(b"solid exported\nfacet normal"),
    "longer.stl": stl(more=b"\0" * 20),
    "uncounted.stl": stl(count=0),
    "ascii.stl": ASCII_STL.encode(),
    "capitals.stl": ASCII_STL.upper().encode(),
    "little.ply": ply(),
    "big.ply": ply(">"),
    "text.ply": ply("", name="vertex_index"),
    "short.ply": ply(index="ushort", elements=TRIANGLES),
}
OFF_FACES = "".join("4 {} {} {} {}\n".format(*q) for q in QUADS)
CUBES["a.off"] = "OFF\n8 6 0\n{}{}".format(V.replace("v ", ""), OFF_FACES).encode()


@pytest.mark.parametrize("name", CUBES)
def test_a_cube_as_exporters_write_it(tmp_path, name):
    (tmp_path / name).write_bytes(CUBES[name])
    raw = read(tmp_path / name)
    assert len(raw.sheets["triangle"]) == 12
    assert volume(raw.points, raw.sheets["triangle"]) == pytest.approx(1)


CUT = {
    "binary.stl": stl()[:-120],
    "solid.stl": stl(b"solid")[:-100],
    "head.stl": stl(b"x\0")[:60],
    "ascii.stl": ASCII_STL[:-300].encode(),
    "little.ply": ply()[:-40],
    "points.ply": ply()[:-180],
    "text.ply": ply("")[:-3],
    "head.ply": ply()[:90],
    "line.obj": (V + faces("{i}"))[:-6].encode(),
    "points.obj": V.encode(),
    "a.off": CUBES["a.off"][:-12],
    "a.vtu": b"<VTKFile><UnstructuredGrid>",
}


@pytest.mark.parametrize("name", CUT)
def test_a_cut_file_is_said_to_be_cut(tmp_path, name):
    (tmp_path / name).write_bytes(CUT[name])
    with pytest.raises(InputError, match=f"{name}: it is cut off: "):
        read(tmp_path / name)


def box(size):
    return np.array([[0, 0, 0], [size, size / 2, size / 3]])


@pytest.mark.parametrize(
    ("size", "scale"), [(200, 1e-3), (35, 1e-3), (12, 1e-2), (0.2, 1.0), (2e5, 1e-6), (1.0, None), (5000, None)]
)
def test_the_unit_is_one_that_makes_an_organ(size, scale):
    guess = guess_scale(size)
    assert (guess[1] if guess else None) == scale


@pytest.mark.parametrize(
    ("size", "given", "message"),
    [
        (1, None, r"is 1 units, .*give scale_m, .* \(0\.2 makes it 20 cm long\)\.$"),
        (82, 1, r"scale_m 1 makes a body 82 m long; if its unit is the millimetre, give scale_m: 0\.001\.$"),
        (0.08, 1e-3, r"makes a body 0\.08 mm long; if its unit is the metre, give scale_m: 1\.$"),
        (1, 0, r"scale_m is 0; give the length"),
        (1, 100, r"makes a body 100 m long; check scale_m\.$"),
    ],
)
def test_an_impossible_scale_is_refused_with_the_likely_one(size, given, message):
    with pytest.raises(InputError, match=message):
        choose_scale("a", box(size), given)


def test_a_guess_and_an_unlikely_scale_are_said(recwarn):
    assert choose_scale("a", box(1), 1.0) == 1.0 and not recwarn.list
    with pytest.warns(UserWarning, match=r"^a: scale_m is not given; .* for the millimetre, .* 82 mm long"):
        assert choose_scale("a", box(82), None) == 1e-3
    with pytest.warns(UserWarning, match="makes a body 2 m long, which no organ is"):
        choose_scale("a", box(1), 2.0)
