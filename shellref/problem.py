"""What is asked of the shell: the problem and the options of the solver, validated before dolfinx is touched."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

FRAME_TOLERANCE = 1e-9
CLAMPS = ("edge",)
NATURAL_PATHS = ("exact", "stepped")
ITERATIONS = ("mixed", "plain")

Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]


class ShellInputError(ValueError):
    """A request that cannot be solved as stated.

    Attributes: `key` (the field at fault), `value` (what was given), `remedy` (what would be right).
    """

    def __init__(self, key: str, value: object, remedy: str):
        self.key, self.value, self.remedy = key, value, remedy
        super().__init__(f"{key} = {value!r}: {remedy}")


def _number(key: str, value: Any, remedy: str = "must be a finite number") -> float:
    """`value` as a finite float."""
    if isinstance(value, (bool, str)):
        raise ShellInputError(key, value, remedy)
    try:
        number = float(value)
    except (TypeError, ValueError) as error:
        raise ShellInputError(key, value, remedy) from error
    if not math.isfinite(number):
        raise ShellInputError(key, value, remedy)
    return number


def _positive(key: str, value: Any) -> float:
    """`value` as a finite float > 0."""
    number = _number(key, value, "must be a finite number above 0")
    if number <= 0:
        raise ShellInputError(key, value, "must be above 0")
    return number


def _integer(key: str, value: Any, least: int) -> int:
    """`value` as an int >= least; floats, booleans and strings are refused."""
    whole = hasattr(value, "__index__") and not isinstance(value, bool)
    if not whole or int(value) < least:
        raise ShellInputError(key, value, f"must be a whole number, {least} or more")
    return int(value)


def _numbers(key: str, value: Any, count: int) -> tuple[float, ...]:
    """`value` as a tuple of `count` finite floats."""
    remedy = f"must be {count} finite numbers"
    if isinstance(value, (str, bytes, Mapping)):
        raise ShellInputError(key, value, remedy)
    try:
        items = list(value)
    except TypeError as error:
        raise ShellInputError(key, value, remedy) from error
    if len(items) != count:
        raise ShellInputError(key, value, remedy)
    return tuple(_number(key, item, remedy) for item in items)


def _choice(key: str, value: Any, known: tuple[str, ...]) -> str:
    if value not in known:
        raise ShellInputError(key, value, f"must be one of {', '.join(known)}")
    return str(value)


def _frame(key: str, value: Any) -> Matrix:
    """`value` as a right-handed orthonormal 3x3 matrix (rows of tuples; columns t_x, t_y, t_z)."""
    try:
        items = list(value)
    except TypeError as error:
        raise ShellInputError(key, value, "must be a 3x3 matrix with columns t_x, t_y, t_z") from error
    if len(items) != 3:
        raise ShellInputError(key, value, "must be a 3x3 matrix with columns t_x, t_y, t_z")
    m = [_numbers(key, row, 3) for row in items]
    for i in range(3):
        for j in range(3):
            product = sum(m[k][i] * m[k][j] for k in range(3))
            if abs(product - (i == j)) > FRAME_TOLERANCE:
                raise ShellInputError(key, value, "its columns t_x, t_y, t_z must be orthonormal to 1e-9")
    determinant = (
        m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1])
        - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
        + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
    )
    if determinant < 0:
        raise ShellInputError(key, value, "is left-handed: t_x must be t_y x t_z")
    return (m[0], m[1], m[2])  # type: ignore[return-value]


@dataclass(frozen=True)
class ShellProblem:
    """A strip of length 1 held at its edge S = 0, with natural curvature and weight.

    width, thickness: over the length, > 0. poisson: in (-1, 0.5].
    natural_curvature (2,): K l at S = 0 and S = 1, linear between; k_nat = K e_S (x) e_S. Positive curvature turns the
    tangent towards -t_y (t_z' = -K t_y).
    gamma: rho h g l^3 / D, weight against bending stiffness; `up` (3,): unit vector against gravity, None = weightless.
    clamp_position (3,), clamp_frame (3, 3) with columns t_x (across), t_y (normal), t_z (tangent).
    elements: (along, across), biquadratic. grading: size of the first element at the clamp, and of the elements at the
    two long edges, over the size of the even ones in the middle, in (0, 1]; 1 is an even mesh.
    """

    width: float
    thickness: float
    poisson: float
    natural_curvature: tuple[float, float] = (0.0, 0.0)
    gamma: float = 0.0
    up: Vector | None = None
    clamp_position: Vector = (0.0, 0.0, 0.0)
    clamp_frame: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    clamp: str = "edge"
    elements: tuple[int, int] = (100, 4)
    grading: tuple[float, float] = (0.2, 1.0)

    def __post_init__(self) -> None:
        def put(name: str, value: object) -> None:
            object.__setattr__(self, name, value)

        put("width", _positive("width", self.width))
        put("thickness", _positive("thickness", self.thickness))
        put("poisson", _number("poisson", self.poisson))
        if not -1.0 < self.poisson <= 0.5:
            raise ShellInputError("poisson", self.poisson, "must lie above -1 and not above 0.5")
        put("natural_curvature", _numbers("natural_curvature", self.natural_curvature, 2))
        put("gamma", _number("gamma", self.gamma))
        if self.gamma < 0:
            raise ShellInputError("gamma", self.gamma, "must not be negative: turn `up` round instead")
        if self.up is not None:
            put("up", _numbers("up", self.up, 3))
            if abs(math.hypot(*self.up) - 1.0) > FRAME_TOLERANCE:
                raise ShellInputError("up", self.up, "must be a unit vector (to 1e-9)")
        elif self.gamma > 0:
            raise ShellInputError("up", None, "a unit vector is needed when gamma is above 0")
        put("clamp_position", _numbers("clamp_position", self.clamp_position, 3))
        put("clamp_frame", _frame("clamp_frame", self.clamp_frame))
        put("clamp", _choice("clamp", self.clamp, CLAMPS))
        if isinstance(self.elements, (str, bytes)) or not hasattr(self.elements, "__len__") or len(self.elements) != 2:
            raise ShellInputError("elements", self.elements, "must be two whole numbers (along, across)")
        put("elements", tuple(_integer("elements", n, 1) for n in self.elements))
        put("grading", _numbers("grading", self.grading, 2))
        if not all(0 < g <= 1 for g in self.grading):
            raise ShellInputError("grading", self.grading, "must be two numbers above 0 and at most 1")

    @property
    def loaded(self) -> bool:
        """True when the strip weighs something."""
        return self.up is not None and self.gamma > 0

    def to_dict(self) -> dict[str, Any]:
        """The fields as plain numbers, strings and lists (for JSON)."""
        return _plain(asdict(self))

    @classmethod
    def from_dict(cls, data: Any) -> ShellProblem:
        """A problem from a mapping of its fields; an unknown or a missing key is an error."""
        return _build(cls, "problem", data, required=("width", "thickness", "poisson"))


@dataclass(frozen=True)
class ShellOptions:
    """How the shell is solved; every default is justified by a measurement in docs/shell.md.

    tolerance: largest component of the last Newton correction (positions in l, director in radians).
    max_newton: iterations allowed in one load step. first_step, min_step, max_step: fractions of the full load.
    growth: factor on the step after an easy solve; cut: factor after a failed one.
    stabilisation: c in alpha = c (h / h_e)^2, the fraction of membrane and shear energy taken on the full 3x3 rule.
    natural_path: "exact" starts from the natural planar curve, "stepped" rolls the flat strip up.
    iteration: "mixed" (geometric stiffness from the stress linearised at the previous iterate) or "plain" Newton.
    predict: extrapolate the last two states to start the next step.
    stability: check the inertia of the tangent at every converged load step. kick: leave unstable states (else the
    status is `unstable`).
    """

    tolerance: float = 1e-8
    max_newton: int = 15
    first_step: float = 0.1
    min_step: float = 1e-4
    max_step: float = 0.25
    growth: float = 1.5
    cut: float = 0.4
    stabilisation: float = 0.01
    natural_path: str = "exact"
    iteration: str = "mixed"
    predict: bool = True
    stability: bool = True
    kick: bool = True

    def __post_init__(self) -> None:
        def put(name: str, value: object) -> None:
            object.__setattr__(self, name, value)

        for name in ("tolerance", "first_step", "min_step", "max_step"):
            put(name, _positive(name, getattr(self, name)))
        put("max_newton", _integer("max_newton", self.max_newton, 1))
        for name in ("first_step", "min_step", "max_step"):
            if getattr(self, name) > 1:
                raise ShellInputError(name, getattr(self, name), "is a fraction of the full load: at most 1")
        put("growth", _number("growth", self.growth))
        if self.growth < 1:
            raise ShellInputError("growth", self.growth, "must be 1 or more")
        put("cut", _number("cut", self.cut))
        if not 0 < self.cut < 1:
            raise ShellInputError("cut", self.cut, "must lie between 0 and 1")
        put("stabilisation", _number("stabilisation", self.stabilisation))
        if self.stabilisation < 0:
            raise ShellInputError("stabilisation", self.stabilisation, "must not be negative")
        put("natural_path", _choice("natural_path", self.natural_path, NATURAL_PATHS))
        put("iteration", _choice("iteration", self.iteration, ITERATIONS))
        for name in ("predict", "stability", "kick"):
            if not isinstance(getattr(self, name), bool):
                raise ShellInputError(name, getattr(self, name), "must be true or false")

    def to_dict(self) -> dict[str, Any]:
        """The options as plain numbers and strings (for JSON)."""
        return _plain({f.name: getattr(self, f.name) for f in fields(self)})

    @classmethod
    def from_dict(cls, data: Any) -> ShellOptions:
        """Options from a mapping; an unknown key is an error."""
        return _build(cls, "options", data)


def _build(cls: Any, section: str, data: Any, required: tuple[str, ...] = ()) -> Any:
    """The dataclass `cls` from the mapping `data`, strictly."""
    if not isinstance(data, Mapping):
        raise ShellInputError(section, data, "must be a table of keys and values")
    known = [f.name for f in fields(cls)]
    for key in data:
        if key not in known:
            raise ShellInputError(f"{section}.{key}", data[key], f"unknown key; known: {', '.join(known)}")
    for key in required:
        if key not in data:
            raise ShellInputError(f"{section}.{key}", None, "is needed")
    return cls(**data)


def _plain(value: Any) -> Any:
    """Tuples to lists, recursively."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (tuple, list)):
        return [_plain(item) for item in value]
    return value
