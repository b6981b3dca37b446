"""Geometrically nonlinear shell benchmarks of Sze, Liu and Lo (2004): problem data and reference tables.

K.Y. Sze, X.H. Liu, S.H. Lo, "Popular benchmark problems for geometric nonlinear analysis of shells", Finite Elements
in Analysis and Design 40 (2004) 1551-1569, doi:10.1016/j.finel.2003.11.001. Their numbers are Abaqus S4R results (four
nodes, finite membrane strains, transverse shear) on the finer of the meshes named here; section numbers are theirs.

Units are consistent in each problem and not named here; `young` of `SEMICYLINDER` is the one that fits the lengths,
see there. Every load is a dead load. Displacements carry the sign of the column name, which is the paper's: a column
``-W_A`` holds minus the displacement of point A along z, so that every column is mostly positive. Row 0 is the unloaded
shell. `p_max` is the load on the whole structure (`SLIT_ANNULUS`: per length); `load_share` is the part of it that
acts on the part which `modelled` describes, when the load point lies on its symmetry planes.

Provenance. The paper itself was not at hand; the figures were read from codes that copied its tables: MBDyn's
``tests/plates/sze2004`` (all tables; "MBDyn" below), an isogeometric MATLAB code by V.P. Nguyen, the FEniCS-shells demo
and its copies, PENGoLINS. Each table's comment says how many copies agree. They were then compared to a solver that
shares nothing with `shellref`: Kirchhoff-Love, cubic B-splines for the displacement on the exact midsurface, arc length
("spline check", maximum over the rows; test_sze2004.py keeps the part that is cheap: elastica and closed form).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def _rows(text: str) -> FloatArray:
    """One row per line, read-only."""
    table = np.array([[float(word) for word in line.split()] for line in text.strip().splitlines()])
    table.setflags(write=False)
    return table


@dataclass(frozen=True)
class Benchmark:
    """Data every problem has. `table`: load fraction, then displacements, as named by `columns`."""

    young: float
    poisson: float
    thickness: float
    p_max: float
    #: part of `p_max` that acts on the modelled part
    load_share: float
    #: meshes of the paper, finer one last (elements along the directions said in `modelled`); empty where unconfirmed
    meshes: tuple[tuple[int, int], ...]
    #: the part modelled and what is held on each of its edges
    modelled: str
    columns: tuple[str, ...]
    table: FloatArray

    def column(self, name: str) -> FloatArray:
        """The column of that name."""
        return self.table[:, self.columns.index(name)]


@dataclass(frozen=True)
class Strip(Benchmark):
    """A rectangle 0 <= x <= length, 0 <= y <= width, normal along z."""

    length: float
    width: float


@dataclass(frozen=True)
class Annulus(Benchmark):
    """A flat annulus in the plane z = 0, slit along one radius."""

    inner_radius: float
    outer_radius: float


@dataclass(frozen=True)
class Cylinder(Benchmark):
    """Part of a cylinder about the y-axis, z upwards: (radius sin phi, y, radius cos phi), |phi| <= half_angle."""

    radius: float
    #: full length along y
    length: float
    half_angle: float


# 3.1. Confirmed by two independent copies (MBDyn, Nguyen; all 20 rows the same) and by the inextensible elastica: U
# within 3.5e-3, W within 2.7e-3 of it (3.5e-4 and 2.7e-4 of the length).
END_SHEAR = Strip(
    length=10.0,
    width=1.0,
    thickness=0.1,
    young=1.2e6,
    poisson=0.0,
    p_max=4.0,
    load_share=1.0,
    meshes=((8, 1), (16, 1)),
    modelled=(
        "All of it, mesh along x by along y. Edge x = 0 clamped (displacement and rotation), the edges y = 0 and y = "
        "width free. The edge x = length carries the dead force p_max along +z, spread evenly: p_max / width per "
        "length. With E I = 100, p_max = 4 E I / length^2. U, W: displacements of the loaded edge along x and z."
    ),
    columns=("P/Pmax", "-U_tip", "W_tip"),
    table=_rows(
        """
        0.00 0.000 0.000
        0.05 0.026 0.663
        0.10 0.103 1.309
        0.15 0.224 1.922
        0.20 0.381 2.493
        0.25 0.563 3.015
        0.30 0.763 3.488
        0.35 0.971 3.912
        0.40 1.184 4.292
        0.45 1.396 4.631
        0.50 1.604 4.933
        0.55 1.807 5.202
        0.60 2.002 5.444
        0.65 2.190 5.660
        0.70 2.370 5.855
        0.75 2.541 6.031
        0.80 2.705 6.190
        0.85 2.861 6.335
        0.90 3.010 6.467
        0.95 3.151 6.588
        1.00 3.286 6.698
        """
    ),
)

# 3.2. One copy (MBDyn) of both the S4R and the analytic columns; the analytic ones are the closed form of
# `end_moment_tip` to the three digits given, S4R is within 0.013 of it. A planar arc: nu = 0.
END_MOMENT = Strip(
    length=12.0,
    width=1.0,
    thickness=0.1,
    young=1.2e6,
    poisson=0.0,
    p_max=50 * pi / 3,
    load_share=1.0,
    meshes=((8, 1), (16, 1)),
    modelled=(
        "All of it, mesh along x by along y. Edge x = 0 clamped, the edges y = 0 and y = width free. The edge x = "
        "length carries the moment p_max (on the whole edge, p_max / width per length) about -y: it lifts the tip and "
        "rolls the strip up into a full circle at p_max = 2 pi E I / length, E I = 100. U, W: displacements of that "
        "edge along x and z."
    ),
    columns=("P/Pmax", "-U_tip", "-U_tip exact", "W_tip", "W_tip exact"),
    table=_rows(
        """
        0.00  0.000  0.000 0.000 0.000
        0.05  0.196  0.196 1.870 1.870
        0.10  0.773  0.774 3.648 3.648
        0.15  1.698  1.699 5.249 5.248
        0.20  2.916  2.918 6.600 6.598
        0.25  4.357  4.361 7.643 7.639
        0.30  5.942  5.945 8.338 8.333
        0.35  7.582  7.585 8.671 8.664
        0.40  9.191  9.194 8.646 8.637
        0.45 10.687 10.688 8.291 8.281
        0.50 12.000 12.000 7.652 7.639
        0.55 13.075 13.073 6.788 6.775
        0.60 13.875 13.871 5.772 5.758
        0.65 14.384 14.377 4.678 4.665
        0.70 14.603 14.595 3.583 3.571
        0.75 14.556 14.546 2.556 2.546
        0.80 14.280 14.270 1.656 1.650
        0.85 13.826 13.818 0.931 0.926
        0.90 13.254 13.247 0.407 0.405
        0.95 12.625 12.621 0.099 0.098
        1.00 12.000 12.000 0.000 0.000
        """
    ),
)

# 3.3. Confirmed by two independent copies (MBDyn; FEniCS-shells and a dolfinx copy of it), all rows the same.
# Spline check, 8 x 48: W_A and W_B 0.065 lower at the full load, 0.027 in the median (0.5 %).
SLIT_ANNULUS = Annulus(
    inner_radius=6.0,
    outer_radius=10.0,
    thickness=0.03,
    young=21e6,
    poisson=0.0,
    p_max=0.8,
    load_share=1.0,
    meshes=((6, 30), (10, 80)),
    modelled=(
        "All of it, mesh along the radius by around. One face of the slit clamped (displacement and rotation), both "
        "circles free, the other face carries a dead line force along +z: p_max is per length (3.2 in all). A and B: "
        "ends of the loaded face at the inner and the outer radius; W along z."
    ),
    columns=("P/Pmax", "W_A", "W_B"),
    table=_rows(
        """
        0.000  0.000  0.000
        0.025  1.305  1.789
        0.050  2.455  3.370
        0.075  3.435  4.720
        0.100  4.277  5.876
        0.125  5.007  6.872
        0.150  5.649  7.736
        0.200  6.725  9.160
        0.250  7.602 10.288
        0.300  8.340 11.213
        0.350  8.974 11.992
        0.400  9.529 12.661
        0.450 10.023 13.247
        0.500 10.468 13.768
        0.550 10.876 14.240
        0.600 11.257 14.674
        0.650 11.620 15.081
        0.700 11.970 15.469
        0.750 12.310 15.842
        0.800 12.642 16.202
        0.850 12.966 16.550
        0.900 13.282 16.886
        0.950 13.590 17.212
        1.000 13.891 17.528
        """
    ),
)

# 3.5. W_A confirmed by two independent copies (MBDyn, Nguyen); U_B, U_C one copy (MBDyn).
# Spline check, 16 x 16: U_B within 0.7 %, U_C within 0.5 %; W_A lower, by 0.3 % in the first row and 3 % (0.089) in the
# last: it has no transverse shear under the point force. MBDyn's own run, 24 x 36: all within 0.6 % at 0.05, 0.25, 1.
OPEN_CYLINDER = Cylinder(
    radius=4.953,
    length=10.35,
    half_angle=pi,
    thickness=0.094,
    young=10.5e6,
    poisson=0.3125,
    p_max=40e3,
    load_share=0.25,
    meshes=((16, 24), (24, 36)),
    modelled=(
        "One eighth, 0 <= phi <= pi/2, 0 <= y <= length/2, mesh along y by around; y = 0 is mid-length. Two opposite "
        "radial point forces p_max pull outwards at mid-length, phi = 0 and pi. Edge phi = 0: u_x = 0, no rotation "
        "about y and z. Edge phi = pi/2: u_z = 0, no rotation about x and y. Edge y = 0: u_y = 0, no rotation about "
        "x and z. Edge y = length/2 free. Force p_max / 4 along +z at A. A: y = 0, phi = 0. B: y = 0, phi = pi/2. C: "
        "free edge, phi = pi/2. W along z (A moves outwards), U along x (B and C inwards)."
    ),
    columns=("P/Pmax", "W_A", "-U_B", "-U_C"),
    table=_rows(
        """
        0.000 0.000 0.000 0.000
        0.025 0.819 0.864 0.872
        0.050 1.260 1.471 1.493
        0.075 1.527 1.901 1.946
        0.100 1.707 2.217 2.293
        0.150 1.936 2.641 2.792
        0.200 2.079 2.904 3.106
        0.250 2.180 3.087 3.310
        0.300 2.257 3.227 3.452
        0.350 2.321 3.342 3.556
        0.400 2.376 3.443 3.632
        0.450 2.425 3.539 3.688
        0.500 2.473 3.653 3.718
        0.525 2.543 4.061 3.580
        0.550 2.577 4.171 3.518
        0.600 2.618 4.274 3.452
        0.650 2.648 4.338 3.410
        0.700 2.672 4.385 3.378
        0.750 2.692 4.423 3.353
        0.800 2.710 4.455 3.332
        0.850 2.726 4.483 3.313
        0.900 2.741 4.508 3.297
        0.950 2.755 4.530 3.283
        1.000 2.768 4.551 3.269
        """
    ),
)

# 3.6. One copy (MBDyn). MBDyn's own run, 48 x 48, by prescribed displacement: W_A within 0.5 % at 0.05 and 0.1, 0.9 %
# at 1. Spline check, 24 x 24, coarse for the creases: W_A within 1 %, U_B within 4 % up to 0.1; near 0.15 the load
# turns back several times where the table jumps; beyond, W_A 2 % and U_B 7 % lower at 0.9.
PINCHED_CYLINDER = Cylinder(
    radius=100.0,
    length=200.0,
    half_angle=pi,
    thickness=1.0,
    young=30e3,
    poisson=0.3,
    p_max=12e3,
    load_share=0.25,
    meshes=((40, 40), (48, 48)),
    modelled=(
        "One eighth, 0 <= phi <= pi/2, 0 <= y <= length/2, mesh along y by around; y = 0 is mid-length. Two opposite "
        "radial point forces p_max push inwards at mid-length, phi = 0 and pi. Edge phi = 0: u_x = 0, no rotation "
        "about y and z. Edge phi = pi/2: u_z = 0, no rotation about x and y. Edge y = 0: u_y = 0, no rotation about "
        "x and z. Edge y = length/2, the rigid diaphragm: u_x = u_z = 0, u_y and the rotation about the edge's "
        "tangent free. Force p_max / 4 along -z at A. A: y = 0, phi = 0. B: y = 0, phi = pi/2. W along z, U along x."
    ),
    columns=("P/Pmax", "-W_A", "U_B"),
    table=_rows(
        """
        0.000  0.000  0.000
        0.050  9.561 -0.233
        0.075 15.648 -0.922
        0.100 23.164 -2.391
        0.125 29.375 -3.872
        0.150 36.208 -2.154
        0.175 51.499  6.792
        0.200 56.373 10.448
        0.250 61.877 14.905
        0.300 65.498 17.979
        0.350 68.229 20.365
        0.400 70.424 22.321
        0.450 72.204 23.916
        0.500 73.790 25.381
        0.550 75.139 26.631
        0.600 76.331 27.735
        0.650 77.472 28.843
        0.700 78.451 29.772
        0.750 79.339 30.604
        0.800 80.218 31.471
        0.850 81.045 32.299
        0.900 81.766 32.989
        0.950 82.435 33.619
        1.000 83.102 34.272
        """
    ),
)

# 3.7, isotropic. Confirmed by two independent copies (MBDyn; FEniCS-shells and copies of it), all rows the same.
# Spline check, 20 x 30: within 0.75 (0.44 % of the last row), 0.24 in the median.
SEMICYLINDER = Cylinder(
    radius=101.6,
    length=304.8,
    half_angle=pi / 2,
    thickness=3.0,
    #: copies name 2.0685e7 with radius 1.016, length 3.048, thickness 0.03 and the same load; scaled to these lengths
    young=2068.5,
    poisson=0.3,
    p_max=2000.0,
    load_share=0.5,
    meshes=((40, 40),),
    modelled=(
        "Half of the semicylinder, 0 <= phi <= pi/2, 0 <= y <= length. Edge y = length clamped (displacement and "
        "rotation). Edge phi = pi/2, the lower one: u_z = 0 and no rotation about y (u_x and u_y free), which is what "
        "a symmetry plane z = 0 asks. Edge phi = 0: u_x = 0, no rotation about y and z. Edge y = 0 free. The point "
        "force p_max along -z acts on the whole semicylinder at A, y = 0, phi = 0: half of it on the modelled half. W "
        "along z."
    ),
    columns=("P/Pmax", "-W_A"),
    table=_rows(
        """
        0.000   0.000
        0.050   5.421
        0.100  16.100
        0.125  22.195
        0.150  27.657
        0.175  32.700
        0.200  37.582
        0.225  42.633
        0.250  48.537
        0.275  56.355
        0.300  66.410
        0.325  79.810
        0.350  94.669
        0.400 113.704
        0.450 124.751
        0.500 132.653
        0.550 138.920
        0.600 144.185
        0.650 148.770
        0.700 152.863
        0.750 156.584
        0.800 160.015
        0.850 163.211
        0.900 166.200
        0.950 168.973
        1.000 171.505
        """
    ),
)

_ROOF = (
    "One quarter, 0 <= phi <= half_angle, 0 <= y <= length/2; y = 0 is mid-length. Edge phi = half_angle, straight: "
    "hinged and immovable, u = 0, rotations free. Edge y = length/2, curved: free. Edge phi = 0: u_x = 0, no rotation "
    "about y and z. Edge y = 0: u_y = 0, no rotation about x and z. Point force p_max / 4 along -z at C, y = 0, phi = "
    "0. W along z. Rows follow the equilibrium path through the limit points."
)

# 3.8, isotropic. Rows 1 to 9 (up to load 0.7412) confirmed by two independent copies (MBDyn, PENGoLINS), the others one
# copy (MBDyn). Spline check, 16 x 16: the whole path, distance at most 0.6 % of the ranges of load and displacement.
HINGED_ROOF_THICK = Cylinder(
    radius=2540.0,
    length=508.0,
    half_angle=0.1,
    thickness=12.7,
    young=3102.75,
    poisson=0.3,
    p_max=3000.0,
    load_share=0.25,
    meshes=(),
    modelled=_ROOF,
    columns=("P/Pmax", "-W_C"),
    table=_rows(
        """
        0.0000  0.000
        0.0877  0.693
        0.1980  1.638
        0.3473  3.087
        0.4686  4.477
        0.5647  5.802
        0.6381  7.057
        0.6908  8.237
        0.7246  9.339
        0.7412 10.358
        0.7421 11.293
        0.7286 12.141
        0.7023 12.903
        0.6649 13.583
        0.6182 14.188
        0.5643 14.728
        0.5055 15.217
        0.4442 15.676
        0.3830 16.125
        0.3245 16.590
        0.2717 17.094
        0.2272 17.657
        0.1940 18.299
        0.1750 19.028
        0.1729 19.852
        0.1905 20.771
        0.2303 21.780
        0.2950 22.875
        0.3871 24.049
        0.4443 24.663
        0.5093 25.293
        0.5826 25.940
        0.6644 26.601
        0.7551 27.276
        0.8549 27.964
        0.9643 28.663
        1.0835 29.374
        """
    ),
)

# 3.8, isotropic, half the thickness: load and displacement both turn back. One copy (MBDyn). Spline check, 24 x 24:
# the whole path, distance at most 0.8 % of the ranges.
HINGED_ROOF_THIN = Cylinder(
    radius=2540.0,
    length=508.0,
    half_angle=0.1,
    thickness=6.35,
    young=3102.75,
    poisson=0.3,
    p_max=3000.0,
    load_share=0.25,
    meshes=(),
    modelled=_ROOF,
    columns=("P/Pmax", "-W_C"),
    table=_rows(
        """
         0.0000  0.000
         0.0517  1.846
         0.1182  5.271
         0.1583  8.257
         0.1837 10.799
         0.1914 11.904
         0.1953 12.892
         0.1950 13.752
         0.1901 14.472
         0.1806 15.050
         0.1671 15.501
         0.1323 16.145
         0.0923 16.602
         0.0504 16.915
         0.0083 17.008
        -0.0312 16.697
        -0.0622 15.780
        -0.0739 15.206
        -0.0861 14.767
        -0.1001 14.520
        -0.1142 14.451
        -0.1247 14.862
        -0.1288 15.778
        -0.1271 16.961
        -0.1196 18.320
        -0.1055 19.817
        -0.0825 21.420
        -0.0484 23.100
        -0.0006 24.824
         0.0626 26.565
         0.1427 28.302
         0.2403 30.023
         0.3559 31.720
         0.4898 33.388
         0.6417 35.024
         0.8114 36.626
         1.0313 38.450
        """
    ),
)

#: (load fraction, W) where the load turns back, first maximum, then minimum: not from the paper, which has only the
#: rows above, but by the spline check (22 or 24 elements a side on a quarter; 16 differ by less than 2e-4 in the load).
LIMIT_POINTS_THICK: FloatArray = np.array([[0.7418, 10.72], [0.1703, 19.50]])
LIMIT_POINTS_THIN: FloatArray = np.array([[0.1950, 13.17], [-0.1288, 15.99]])


def end_moment_tip(fraction: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Exact (-U_tip, W_tip) of `END_MOMENT`: an arc of END_MOMENT.length that turns by 2 pi fraction."""
    turn = 2 * pi * np.asarray(fraction, dtype=float)
    length = END_MOMENT.length
    # sin(t) / t and (1 - cos t) / t without a division by zero
    along = np.sinc(turn / pi)
    across = np.sin(turn / 2) * np.sinc(turn / (2 * pi))
    return length * (1 - along), length * across
