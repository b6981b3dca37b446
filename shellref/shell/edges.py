"""Held edges that move by few unknowns: rigid ones that slide or turn, and flat ones whose section may deform. NumPy.

The nodes x_i with directors d_i of an edge at a clamp with point p and frame F = (t_x, t_y, t_z), e = t_x:

    rigid:  x_i = p + sum_j q_j b_j + R(theta) F X_i ,  d_i = R(theta) F D_i ,  R(theta): turn about e
    free:   x_i = p + sum_j q_j b_j + F (xi_i, eta_i, 0) ,  d_i = F (sin a_i, cos a_i, 0) ,  v = 0: x = p + ..., d = t_y
    point:  sum_i w_i x_i = p + ... , all else free
    pivot:  x_i = p + sum_j q_j b_j + R v_i a ,  d_i = R d ,  R: any rotation

X_i, D_i: the edge at rest in the clamp's axes. Slides b_j are orthonormal and fixed in space. First derivatives by q_j
are b_j, by theta e x (x_i - c) and e x d_i with c the held point, by a_i  t_z x d_i up to its sign; second ones by
theta e x (e x (x_i - c)) and e x (e x d_i), by a_i  -d_i, all others zero (docs/theory.md, eq. (7.15)). Of a pivot
R = exp(w) R_0 with w along the edge's own axes (a, d, a x d), which are the principal ones of its inertia: first
derivatives w x (x_i - c) and w x d_i, second ones, times the forces f_i and g_i of positions and directors,

    S - tr(S) I ,   S = sym sum_i [ f_i (x_i - c)^T + g_i d_i^T ]

which is not diagonal: `coupling` has the rest (docs/theory.md, eq. (7.24)).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shellref.shell.clamps import Control, PosePath, rotation
from shellref.shell.director import tangent_bases


def _affine(arms: np.ndarray) -> np.ndarray:
    """Weights (m,) with sum 1 and weighted mean 0 of the arms (m, 3): the held point from the nodes."""
    rows = np.vstack([np.ones(len(arms)), arms.T / max(float(np.abs(arms).max()), 1e-300)])
    return np.linalg.lstsq(rows, np.array([1.0, 0.0, 0.0, 0.0]), rcond=1e-12)[0]


def _slid(point: np.ndarray, from_point: np.ndarray, slides: np.ndarray) -> np.ndarray:
    """`from_point` moved along the slides (k, 3) to where it is nearest to `point`."""
    return from_point + slides.T @ (slides @ (point - from_point))


@dataclass(frozen=True)
class RigidEdge:
    """Keeps its shape, slides along `slides` (k, 3), turns about `axis` (3,) where it is not None.

    arms, directors (m, 3): X_i and D_i. The axis is t_x of the clamp wherever its path leads.
    """

    name: str
    nodes: np.ndarray
    arms: np.ndarray
    directors: np.ndarray
    path: PosePath
    slides: np.ndarray
    axis: np.ndarray | None = None

    @property
    def unknowns(self) -> int:
        """One for each slide, one for the turn."""
        return len(self.slides) + (self.axis is not None)

    @property
    def columns(self) -> np.ndarray:
        """All unknowns move all nodes."""
        return np.tile(np.arange(self.unknowns), (len(self.nodes), 1))

    def point(self, state: np.ndarray) -> np.ndarray:
        """The held point (3,)."""
        return np.asarray(_affine(self.arms) @ state[self.nodes, :3])

    def placed(self, state: np.ndarray, control: Control) -> np.ndarray:
        """Least squares in the angle (directors and arms), then in the slides."""
        position, frame = self.path.at(control.move, int(control.leg))
        at = _slid(self.point(state), position, self.slides)
        if self.axis is not None:
            frame = rotation(self._angle(state, frame) * self.axis) @ frame
        return np.hstack([at + self.arms @ frame.T, self.directors @ frame.T])

    def _angle(self, state: np.ndarray, frame: np.ndarray) -> float:
        """By how much the edge has turned from the frame about the axis."""
        assert self.axis is not None
        rest = np.vstack([self.arms, self.directors]) @ frame.T
        here = state[self.nodes]
        now = np.vstack([here[:, :3] - self.point(state), here[:, 3:]])
        rest, now = (x - np.outer(x @ self.axis, self.axis) for x in (rest, now))
        return float(np.arctan2(np.sum(np.cross(rest, now) @ self.axis), np.sum(rest * now)))

    def tangents(self, state: np.ndarray, control: Control) -> np.ndarray:
        """(m, 6, unknowns): b_j, and e x of arms and directors."""
        out = np.zeros((len(self.nodes), 6, self.unknowns))
        out[:, :3, : len(self.slides)] = self.slides.T
        if self.axis is not None:
            here = state[self.nodes]
            out[:, :3, -1] = np.cross(self.axis, here[:, :3] - self.point(state))
            out[:, 3:, -1] = np.cross(self.axis, here[:, 3:])
        return out

    def curvature(self, state: np.ndarray, force: np.ndarray, control: Control) -> np.ndarray:
        """e x (e x .) of arms and directors times the force, for the turn."""
        out = np.zeros(self.unknowns)
        if self.axis is not None:
            turned = self.tangents(state, control)[:, :, -1]
            f = force[self.nodes]
            for part in (slice(0, 3), slice(3, 6)):
                out[-1] += float(np.sum(np.cross(self.axis, turned[:, part]) * f[:, part]))
        return out

    def coupling(self, state: np.ndarray, force: np.ndarray, control: Control) -> None:
        """None: mixed second derivatives vanish."""

    def masses(self, translation: np.ndarray, turn: np.ndarray, state: np.ndarray) -> np.ndarray:
        """Mass of the nodes; moment of inertia about the axis."""
        mass, rotary = translation[self.nodes], turn[self.nodes]
        out = np.full(self.unknowns, float(mass.sum()))
        if self.axis is not None:
            turned = self.tangents(state, Control())[:, :, -1]
            out[-1] = float(mass @ np.sum(turned[:, :3] ** 2, axis=1) + rotary @ np.sum(turned[:, 3:] ** 2, axis=1))
        return out


@dataclass(frozen=True)
class PivotEdge:
    """A straight rigid edge that turns freely about its held point, and slides along `slides` (k, 3), three: anywhere.

    across (m,): v_i from the held point, not all of them zero.
    """

    name: str
    nodes: np.ndarray
    across: np.ndarray
    path: PosePath
    slides: np.ndarray

    @property
    def unknowns(self) -> int:
        """One for each slide, three for the turn."""
        return len(self.slides) + 3

    @property
    def columns(self) -> np.ndarray:
        """All unknowns move all nodes."""
        return np.tile(np.arange(self.unknowns), (len(self.nodes), 1))

    def point(self, state: np.ndarray) -> np.ndarray:
        """The held point (3,)."""
        arms = np.outer(self.across, [1.0, 0.0, 0.0])
        return np.asarray(_affine(arms) @ state[self.nodes, :3])

    def axes(self, state: np.ndarray) -> np.ndarray:
        """The edge's frame (3, 3), columns a, d, a x d: nearest to its nodes and directors (Kabsch 1976)."""
        here = state[self.nodes]
        arms = (self.across @ (here[:, :3] - self.point(state))) / float(self.across @ self.across)
        seen = np.outer(arms, [1.0, 0.0, 0.0]) + np.outer(here[:, 3:].mean(axis=0), [0.0, 1.0, 0.0])
        left, _, right = np.linalg.svd(seen)
        flip = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
        return np.asarray(left @ flip @ right)

    def placed(self, state: np.ndarray, control: Control) -> np.ndarray:
        """Least squares in the rotation, then in the slides."""
        position, _ = self.path.at(control.move, int(control.leg))
        at, axes = _slid(self.point(state), position, self.slides), self.axes(state)
        return np.hstack([at + np.outer(self.across, axes[:, 0]), np.tile(axes[:, 1], (len(self.nodes), 1))])

    def tangents(self, state: np.ndarray, control: Control) -> np.ndarray:
        """(m, 6, unknowns): b_j, and the three axes x arms and directors."""
        out = np.zeros((len(self.nodes), 6, self.unknowns))
        k = len(self.slides)
        out[:, :3, :k] = self.slides.T
        here, centre = state[self.nodes], self.point(state)
        for column, axis in enumerate(self.axes(state).T):
            out[:, :3, k + column] = np.cross(axis, here[:, :3] - centre)
            out[:, 3:, k + column] = np.cross(axis, here[:, 3:])
        return out

    def curvature(self, state: np.ndarray, force: np.ndarray, control: Control) -> np.ndarray:
        """The diagonal of S - tr(S) I on the turns."""
        return np.append(np.zeros(len(self.slides)), np.diag(self._second(state, force)))

    def coupling(self, state: np.ndarray, force: np.ndarray, control: Control) -> np.ndarray:
        """S - tr(S) I (unknowns, unknowns) without its diagonal."""
        out = np.zeros((self.unknowns, self.unknowns))
        second = self._second(state, force)
        out[len(self.slides) :, len(self.slides) :] = second - np.diag(np.diag(second))
        return out

    def _second(self, state: np.ndarray, force: np.ndarray) -> np.ndarray:
        here, axes, f = state[self.nodes], self.axes(state), force[self.nodes]
        arms = here[:, :3] - self.point(state)
        s = axes.T @ (f[:, :3].T @ arms + f[:, 3:].T @ here[:, 3:]) @ axes
        return np.asarray(0.5 * (s + s.T) - np.trace(s) * np.eye(3))

    def masses(self, translation: np.ndarray, turn: np.ndarray, state: np.ndarray) -> np.ndarray:
        """Mass of the nodes; their moments of inertia about the three axes."""
        mass, rotary = translation[self.nodes], turn[self.nodes]
        turned = self.tangents(state, Control())[:, :, len(self.slides) :]
        about = mass @ np.sum(turned[:, :3] ** 2, axis=1) + rotary @ np.sum(turned[:, 3:] ** 2, axis=1)
        return np.append(np.full(len(self.slides), float(mass.sum())), about)


@dataclass(frozen=True)
class FreeEdge:
    """A free edge of which a point is held, p = sum_i w_i x_i: the node with the largest weight follows from the rest.

    weights (m,): those of `middle_weights`, with sum 1.
    """

    name: str
    nodes: np.ndarray
    weights: np.ndarray
    path: PosePath

    @property
    def unknowns(self) -> int:
        """The positions of all nodes but one, and two of each director."""
        return 5 * len(self.nodes) - 3

    @property
    def follows(self) -> int:
        """Place in `nodes` of the one that follows."""
        return int(np.argmax(np.abs(self.weights)))

    @property
    def columns(self) -> np.ndarray:
        """(m, 3 (m - 1) + 2): positions of its own, of the one that follows all others'; the director's two last."""
        m = len(self.nodes)
        out = np.full((m, 3 * (m - 1) + 2), -1)
        own = np.delete(np.arange(m), self.follows)
        out[own, :3] = np.arange(3 * (m - 1)).reshape(-1, 3)
        out[self.follows, :-2] = np.arange(3 * (m - 1))
        out[:, -2:] = 3 * (m - 1) + np.arange(2 * m).reshape(-1, 2)
        return out

    def point(self, state: np.ndarray) -> np.ndarray:
        """The held point (3,)."""
        return np.asarray(self.weights @ state[self.nodes, :3])

    def placed(self, state: np.ndarray, control: Control) -> np.ndarray:
        """The nodes where they are, but for the one that follows."""
        out = state[self.nodes].copy()
        gap = self.path.at(control.move, int(control.leg))[0] - self.point(state)
        out[self.follows, :3] += gap / self.weights[self.follows]
        return out

    def tangents(self, state: np.ndarray, control: Control) -> np.ndarray:
        """(m, 6, 3 (m - 1) + 2): unit vectors, -w_i / w of the one that follows, tangents of the directors."""
        m, follows = len(self.nodes), self.follows
        out = np.zeros((m, 6, 3 * (m - 1) + 2))
        own = np.delete(np.arange(m), follows)
        out[own, :3, :3] = np.eye(3)
        ratio = -self.weights[own] / self.weights[follows]
        out[follows, :3, :-2] = (ratio[None, :, None] * np.eye(3)[:, None, :]).reshape(3, -1)
        out[:, 3:, -2:] = tangent_bases(state[self.nodes, 3:])
        return out

    def curvature(self, state: np.ndarray, force: np.ndarray, control: Control) -> np.ndarray:
        """-d . f for the directors."""
        along = np.einsum("mi,mi->m", state[self.nodes, 3:], force[self.nodes, 3:])
        return np.append(np.zeros(3 * (len(self.nodes) - 1)), np.repeat(-along, 2))

    def coupling(self, state: np.ndarray, force: np.ndarray, control: Control) -> None:
        """None: mixed second derivatives vanish."""

    def masses(self, translation: np.ndarray, turn: np.ndarray, state: np.ndarray) -> np.ndarray:
        """Those of the nodes; the one that follows has none of its own (`lumped`)."""
        own = np.delete(translation[self.nodes], self.follows)
        return np.append(np.repeat(own, 3), np.repeat(turn[self.nodes], 2))

    def lumped(self, translation: np.ndarray) -> np.ndarray:
        """Masses of all nodes (n,) with that of the one that follows on its neighbours."""
        out, k = translation.copy(), self.follows
        beside = self.nodes[[k - 1, k + 1] if 0 < k < len(self.nodes) - 1 else [1 if k == 0 else k - 1]]
        out[beside] += translation[self.nodes[k]] / len(beside)
        out[self.nodes[k]] = 0.0
        return out


def middle_weights(across: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """(m,) weights w_i = (a + b v_i^2) s_i with sum w_i = 1, sum w_i v_i^2 = 0: of an edge that is a cubic in v they
    give the middle v = 0, and their force is spread over the edge smoothly (docs/theory.md, eq. (7.24)).

    across (m,): v_i, symmetric; shares (m,): lengths s_i of the edge at its nodes.
    """
    x = across / np.abs(across).max()
    moments = [float(shares @ x**k) for k in (0, 2, 4)]
    a, b = np.linalg.solve([moments[:2], moments[1:]], [1.0, 0.0])
    return np.asarray((a + b * x**2) * shares)


@dataclass(frozen=True)
class FlatEdge:
    """Stays in the plane across the clamp's tangent with free section; its node `middle` (place in `nodes`) is held."""

    name: str
    nodes: np.ndarray
    middle: int
    path: PosePath
    slides: np.ndarray

    @property
    def unknowns(self) -> int:
        """Two in the plane and an angle for all nodes but the middle one, and the slides."""
        return 3 * (len(self.nodes) - 1) + len(self.slides)

    @property
    def columns(self) -> np.ndarray:
        """(m, 3 + slides)."""
        own = np.full((len(self.nodes), 3), -1)
        free = np.arange(len(self.nodes)) != self.middle
        own[free] = np.arange(3 * (len(self.nodes) - 1)).reshape(-1, 3)
        shared = 3 * (len(self.nodes) - 1) + np.arange(len(self.slides))
        return np.hstack([own, np.tile(shared, (len(self.nodes), 1))])

    def point(self, state: np.ndarray) -> np.ndarray:
        """The held point (3,)."""
        return np.array(state[self.nodes[self.middle], :3])

    def placed(self, state: np.ndarray, control: Control) -> np.ndarray:
        """Projected onto the plane, which passes through the held point."""
        position, frame = self.path.at(control.move, int(control.leg))
        normal = frame[:, 2]
        at = _slid(self.point(state), position, self.slides)
        here = state[self.nodes]
        arms = here[:, :3] - at
        directors = here[:, 3:] - np.outer(here[:, 3:] @ normal, normal)
        out = np.hstack([at + arms - np.outer(arms @ normal, normal), directors])
        out[:, 3:] /= np.linalg.norm(out[:, 3:], axis=1)[:, None]
        out[self.middle] = np.hstack([at, frame[:, 1]])
        return out

    def tangents(self, state: np.ndarray, control: Control) -> np.ndarray:
        """(m, 6, 3 + slides): t_x, t_y, t_z x d, b_j."""
        _, frame = self.path.at(control.move, int(control.leg))
        out = np.zeros((len(self.nodes), 6, 3 + len(self.slides)))
        out[:, :3, 0], out[:, :3, 1] = frame[:, 0], frame[:, 1]
        out[:, 3:, 2] = np.cross(frame[:, 2], state[self.nodes, 3:])
        out[:, :3, 3:] = self.slides.T
        return out

    def curvature(self, state: np.ndarray, force: np.ndarray, control: Control) -> np.ndarray:
        """-d . f for the angles."""
        out, columns = np.zeros(self.unknowns), self.columns[:, 2]
        free = columns >= 0
        along = np.einsum("mi,mi->m", state[self.nodes, 3:], force[self.nodes, 3:])
        out[columns[free]] = -along[free]
        return out

    def coupling(self, state: np.ndarray, force: np.ndarray, control: Control) -> None:
        """None: mixed second derivatives vanish."""

    def masses(self, translation: np.ndarray, turn: np.ndarray, state: np.ndarray) -> np.ndarray:
        """Those of the nodes; all of them for a slide."""
        own = np.stack([translation[self.nodes]] * 2 + [turn[self.nodes]], axis=1)
        own = np.delete(own, self.middle, axis=0).ravel()
        return np.append(own, [float(translation[self.nodes].sum())] * len(self.slides))
