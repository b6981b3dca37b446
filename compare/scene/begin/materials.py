"""Typical values of materials that strips are made of, for a first scene; what matters is measured on one's own strip.

The values are round ones inside the ranges that handbooks of materials and makers' data sheets give; the range stands
beside each in the template, so that nobody takes them for a measurement.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Material:
    """Young's modulus in Pa, density in kg/m^3, Poisson's ratio; `words`: what it is; `spread`: the usual range of
    Young's modulus; thickness: that of a sheet which one would cut a strip from, in m."""

    young: float
    density: float
    poisson: float
    words: str
    spread: str
    thickness: float = 1e-4


MATERIALS: Mapping[str, Material] = {
    "steel": Material(2.1e11, 7850.0, 0.3, "spring steel", "200 to 215 GPa"),
    "aluminium": Material(7e10, 2700.0, 0.33, "aluminium", "68 to 72 GPa"),
    "brass": Material(1.05e11, 8500.0, 0.34, "brass", "95 to 115 GPa"),
    "pet": Material(4e9, 1390.0, 0.38, "PET film", "3.5 to 5 GPa"),
    "polycarbonate": Material(2.4e9, 1200.0, 0.37, "polycarbonate", "2.2 to 2.5 GPa"),
    "paper": Material(3e9, 800.0, 0.3, "office paper", "2 to 6 GPa, stiffer along the machine's direction"),
    "silicone": Material(2e6, 1100.0, 0.49, "silicone rubber", "0.5 to 5 MPa", 1.5e-3),
}
