"""Thesis 7.2, the hysteresis: sentences of the page."""

from __future__ import annotations

SETUP = """\
`shift_7_2`, nu = 0.3, weightless, clamps 0.5 l apart, both edges held, one clamp shifted from 0.01 l to 0.6 l. U: the
upright arch, to where it is lost to a side; US: tilted, from there down to S; S: its middle at the height of the
clamps, lost where the shift falls. Pseudo-arclength (`ribbonbench branches`) with the inertia of the exact second
variation, every special point on three meshes; limit and error by `compare.measure.mesh_limit`. All shifts over l.
Pieces are kept in out/validate/shift_branches."""
WHAT = """\
Where U is lost, and on the way back S, US leaves to the stable side, without a jump that is wider than {ripple:g} l.
The jumps are between two folds further along US: on the way out the tilted strip, still high, jumps at fold 1; on the
way back the low one at fold 2, to the arch itself where fold 2 lies below the shift at which U is lost. They come
together as the strip gets wider, between w/l = 1/10 and 1/6. The sweeps of [7.2](shift/README.md), 0.355 to 0.400 for
Wunderlich's strip of w/l = 1/20, saw these folds. Those of thin shells are the same ones, at nearly the same heights,
nearer to each other. What finer meshes do not have ([before](branches_shell.md)) are the folds at the pitchfork on
40 x 4 elements, not this pair."""
NARROW = """\
At w/l = 1/40 US leaves U steeply: its middle comes down by 0.004 l and the passages of zero curvature beside the
clamps, 0.001 to 0.004 l from them, move by as much as their own distance while the shift changes by 0.001 l. Elements
of 0.001 l there hold a passage until it leaps: the branch turns back at every step and does not get on. On elements of
0.0002 l, reached over longer ones, it goes on to S; where it leaves U, growing faster with the distance, they hold the
fork, whose place is that of U's own. Where U of this ribbon is unstable it turns back too, between two folds."""
WITHOUT = """\
Wunderlich's equations of equilibrium as a system of first order, by multiple shooting
(tests/reference/wunderlich_shooting.py): no elements, no minimum. With p, the moment conjugate to the ruling, beside
the moments M, the density's derivatives are solved for its own variables: where the curvature passes zero the right
side is continuous, eta' w / 2 is 1 there by itself, and the integrator's steps go through. US is begun at one state of
the ribbon of w/l = 1/20, taken over to the other widths by the equations, and followed from U to S, U from a state of
US made its own image; a fold is where the equations at a given shift are singular, U is lost and S where US comes to
them, U stable again at the last shift where its equations are singular and another branch leaves. Errors: from twice as
many intervals with a tenth of the tolerance; for U and S from the distances at which they are approached; for U stable
again from the last two steps, and no less than {floor:.0e} l, a floor set by hand and not derived: U lost, found by the
same search and with the same floor, lies {searched}. Whether a state is stable is not asked by the shooting: that U is
so again beyond its last fork is the inertia's on elements. The equations' first integral changes by {integral:.0e} of
its size along the strip.
Where U of w/l = 1/40 is lost and stable again, and where S is lost, does not settle on elements and is known by this.
US has as many folds as on elements at every width, at w/l = 1/6 none. Of what settles on elements {within} are
apart by no more than both errors."""
OTHERS = """\
`sadowsky` has no value here: where the curvature passes zero its density is infinite with any twist, and U and US are
twisted there. `finite` (w/h = 50, 50 equal elements, halved) is not followed beyond U, and at w/l = 1/10 not along it:
the layer at its clamps is lost first ([7.2](shift/README.md)), on each mesh at another shift."""
CROSSED = """\
What does not settle in `finite` is where the layer at its clamps gives way. eta = kappa tau / (kappa^2 + 1 / zeta^2)
is greatest at |kappa| = 1 / zeta, where the derivative of x = w eta' / 2 by kappa' passes zero: nothing resists a
change of kappa' there. From a shift of about 0.304 on the clamp's curvature is below 1 / zeta, and beside it kappa
crosses that value as steeply as elements let it: those that are not short at the crossing hold it, and U goes on (on
elements graded to the clamps alone it is lost at 0.3192, 0.3167, 0.3147, halved: 7.2). With a joint on every crossing,
ever shorter elements there, placed anew at every state, the last stable state that is found of U is at {ends}, soon
behind the first crossing. What it becomes beyond, a curvature that may leap from kappa to 1 / (zeta^2 kappa) at one
eta, continuous curvatures do not hold: so U again, US and S have no number."""
THIN = """\
On 90 x 9 elements the fork of the thinnest shell is not yet in its place: US leaves to the unstable side and has folds
of its own beside U, which the finer meshes have not; the pair of folds further along hardly moves from one mesh to the
next. Not measured here: shells of other widths (where U is lost: [7.2](shift/README.md)), strips with weight."""
