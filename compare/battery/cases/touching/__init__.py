"""Strips that touch themselves (folds, coils), each other, edges and corners, and that rub.

Judged by surfaces, virtual work, statics and Coulomb's law stated again (`compare.battery.judge.touching`,
`compare.measure`), which share nothing with the solvers."""

from compare.battery.case import Case
from compare.battery.cases.touching import coils, edges, itself, rubbing, sliding, strips

CASES: tuple[Case, ...] = (*itself.CASES, *coils.CASES, *sliding.CASES, *strips.CASES, *edges.CASES, *rubbing.CASES)
