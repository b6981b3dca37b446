"""An equilibrium of a curve-angle rod: its shape between vertices, strains, forces and moments.

Lengths in l, strains in 1/l, forces in D w / l^2, moments in D w / l.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, Slerp

from ribbon.rods.curve_angle import CurveAngle
from ribbon.rods.rod import FloatArray, Rod, rotation
from ribbon.rods.solve import Found


@dataclass(frozen=True)
class RodShape:
    """A rod where a solve stopped, as functions of s.

    origin: place (3,) that the positions of `found` are seen from. Forces are third differences of positions, so that a
    rod is solved beside what holds it, wherever that is: 3 l away rounding hid them.
    """

    found: Found
    origin: FloatArray = field(default_factory=lambda: np.zeros(3))

    @property
    def problem(self) -> CurveAngle:
        """Its problem, anchored there."""
        return self.found.problem

    @property
    def rod(self) -> Rod:
        """The rod."""
        return self.problem.rod

    @property
    def iterations(self) -> int:
        """Of the minimiser and of Newton."""
        return self.found.iterations

    # -- shape -------------------------------------------------------------------------------------------------------

    @cached_property
    def vertices(self) -> FloatArray:
        """Positions (n + 1, 3), seen from `origin`."""
        return self.problem.positions(self.found.y)

    @cached_property
    def edges(self) -> FloatArray:
        """Material frames (n, 3, 3) of the edges."""
        return self.problem.frames(self.found.y)

    @cached_property
    def strains(self) -> FloatArray:
        """kappa_1, kappa_2, tau (n + 1, 3) in the cells; of an end that nothing turns those of the dead moment."""
        cells = self.rod.cells
        found = self.problem.evaluated(self.found.y).strain / cells[:, None]
        rest, stiffness = self.rod.at_rest(self.rod.middles), np.array(self.rod.stiffness)
        if self.rod.start.frame is None:
            found[0] = rest[0]
        if self.rod.end.frame is None:
            found[-1] = rest[-1] + self.edges[-1].T @ self.rod.moment / stiffness
        return found

    @cached_property
    def ends(self) -> tuple[FloatArray, FloatArray]:
        """Material frames (3, 3) at s = 0 and s = 1: as held, else half an edge beyond the last one's middle."""
        start, end, cells = self.rod.start.frame, self.rod.end.frame, self.rod.cells
        if start is None:
            start = self.edges[0] @ rotation(-cells[0] * self.strains[0])
        if end is None:
            end = self.edges[-1] @ rotation(cells[-1] * self.strains[-1])
        return start, end

    @cached_property
    def _line(self) -> CubicSpline:
        tangents = self.ends[0][:, 2], self.ends[1][:, 2]
        return CubicSpline(self.rod.vertices, self.vertices, bc_type=((1, tangents[0]), (1, tangents[1])))

    @cached_property
    def _turn(self) -> Slerp:
        s = self.rod.vertices
        middles = 0.5 * (s[1:] + s[:-1])
        frames = np.concatenate([self.ends[0][None], self.edges, self.ends[1][None]])
        return Slerp(np.concatenate([[0.0], middles, [s[-1]]]), Rotation.from_matrix(frames))

    def centreline(self, s: FloatArray, seen_from: FloatArray | None = None) -> FloatArray:
        """Positions (k, 3), seen from a place (3,) if one is given: a cubic spline through the vertices."""
        return np.asarray((self.origin if seen_from is None else self.origin - seen_from) + self._line(s))

    def frames(self, s: FloatArray) -> FloatArray:
        """Material frames (k, 3, 3), turned evenly between the edges' middles."""
        return np.asarray(self._turn(np.clip(s, 0.0, self.rod.vertices[-1])).as_matrix())

    def strain(self, s: FloatArray) -> FloatArray:
        """kappa_1, kappa_2, tau (k, 3), linear between the cells."""
        at = self.rod.middles
        return np.column_stack([np.interp(s, at, values) for values in self.strains.T])

    # -- energy ------------------------------------------------------------------------------------------------------

    @cached_property
    def parts(self) -> FloatArray:
        """Energies (3,) of kappa_1, kappa_2 and tau against their rest values, D w / l."""
        away = self.strains - self.rod.at_rest(self.rod.middles)
        held = np.ones(self.rod.edges + 1)
        held[0] *= self.rod.start.frame is not None
        held[-1] *= self.rod.end.frame is not None
        return np.asarray(0.5 * np.array(self.rod.stiffness) * ((held * self.rod.cells) @ away**2))

    @property
    def weight(self) -> float:
        """Energy of the weight against the origin."""
        return float(self.rod.cells @ ((self.origin + self.vertices) @ self.rod.weight))

    @property
    def tip(self) -> float:
        """Energy of the dead force at s = 1 against the origin."""
        return -float(self.rod.force @ (self.origin + self.vertices[-1]))

    # -- forces ------------------------------------------------------------------------------------------------------

    @cached_property
    def _nodal(self) -> FloatArray:
        """What strains and tension pull back with at the vertices (n + 1, 3): loads and reactions."""
        y = self.found.y
        elastic = self.problem.evaluated(y).gradient
        tension = self.found.rows[: self.rod.edges] / self.rod.lengths
        pull = np.concatenate([elastic, [0.0]]).reshape(-1, 4)[:, :3].copy()
        along = tension[:, None] * np.diff(self.vertices, axis=0)
        pull[1:] += along
        pull[:-1] -= along
        return pull - self._dead_moment()

    def _dead_moment(self) -> FloatArray:
        """The pair of forces (n + 1, 3) on the last edge by which the dead moment turns it."""
        forces = np.zeros((self.rod.edges + 1, 3))
        edge = self.vertices[-1] - self.vertices[-2]
        pull = np.cross(self.rod.moment, edge) / float(edge @ edge)
        forces[-1], forces[-2] = pull, -pull
        return forces

    @cached_property
    def forces(self) -> FloatArray:
        """Force (n, 3) that what is behind an edge exerts on what is before it."""
        return -np.cumsum(self._nodal, axis=0)[:-1]

    @cached_property
    def moments(self) -> FloatArray:
        """Moment (n + 1, 3) at the vertices, likewise: the derivative of a cell's energy by a turn of what is behind
        it; at a free end the dead moment."""
        ends = self.problem.evaluated(self.found.y).ends
        tangents = np.concatenate([self.edges[:, :, 2], self.ends[1][None, :, 2]])
        found = np.cross(tangents, ends[:, 4:7]) + ends[:, 7:8] * tangents
        if self.rod.end.frame is None:
            found[-1] = self.rod.moment
        return np.asarray(found)

    @property
    def reactions(self) -> tuple[tuple[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]:
        """Force and moment (3,) that what holds s = 0 and s = 1 exerts on the rod."""
        loads, moments, nodal = self.problem.loads, self.moments, self._nodal
        end = np.zeros(3) if self.rod.end.frame is None else moments[-1]
        return (nodal[0] - loads[0], -moments[0]), (nodal[-1] - loads[-1], end)
