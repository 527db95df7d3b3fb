"""Mass density of tissue from CT numbers, by a published calibration curve."""

import numpy as np

# Segments of the curve: the CT number [HU] up to which each holds, density at 0 HU [kg/m³], slope [kg/m³ per HU].
# Air to fat is interpolated between air at -1000 HU and the start of the next segment.
_AIR_HU, _AIR, _FAT_HU = -1000.0, 1.21, -98.0
_LINES = [
    (14.0, 1018.0, 0.893),  # fat to connective tissue, equation 21
    (23.0, 1030.0, 0.0),
    (100.0, 1003.0, 1.169),  # soft tissue, equation 23
    (np.inf, 1017.0, 0.592),  # bone, equation 19
]


def density(hu: np.ndarray | float) -> np.ndarray:
    """Compute the density [kg/m³] at CT numbers [HU], any shape; below -1000 HU it is that of air.

    W. Schneider, Bortfeld, Schlegel, "Correlation between CT numbers and tissue parameters needed for Monte Carlo
    simulations of clinical dose distributions", Phys. Med. Biol. 45 (2000) 459–478, equations 19, 21 and 23.
    Trap: contrast agent raises CT numbers but hardly the density, so that an enhanced liver comes out a few per cent
    too heavy; and the curve drops by 4 % at 100 HU, where soft tissue ends and bone begins.
    """
    hu = np.asarray(hu, dtype=np.float64)
    fat = _LINES[0][1] + _LINES[0][2] * _FAT_HU
    below = np.interp(hu, [_AIR_HU, _FAT_HU], [_AIR, fat])
    return np.select(
        [hu < _FAT_HU, *(hu <= end for end, _, _ in _LINES)],
        [below, *(at_0 + slope * hu for _, at_0, slope in _LINES)],
        default=np.nan,
    )
