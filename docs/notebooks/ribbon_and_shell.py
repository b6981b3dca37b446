# %% [markdown]
# # The ribbon against a shell
#
# The ribbon cannot stretch; a shell can. How far apart are they for a naturally curved strip that hangs from a clamp
# (section 4.3 of the thesis), and does the distance fall as the strip gets thinner, as it should? First what the
# ribbon alone says of that, then the shell, on a mesh that is coarse so that this page takes seconds.

# %%
import importlib.util
from itertools import pairwise

import matplotlib.pyplot as plt
import numpy as np

from compare.scene import load
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from compare.studies.compare import compare
from compare.studies.limits import Thresholds, quick

ratios = [20, 60, 180]  # w/h
scene = load("curl_4_3").replace({"shell.width_to_thickness": ratios, "shell.elements": [24, 2]})
estimates = quick(scene, Thresholds())
for found in estimates:
    print(f"w/h = {found.width_to_thickness:3.0f}: {found.level}, {100 * found.estimate.distance:.2f} % of the length")

# %% [markdown]
# ## The shell
#
# A Naghdi shell in FEniCSx, which shares no mechanics and no numerics with the ribbon. Each distance has two errors
# beside it, that of the ribbon and that of the shell; only what exceeds both is claimed as a difference of the models,
# and a mesh as coarse as this one cannot claim the smallest. (Where dolfinx is not installed the shell is left out, and
# the page says so.)

# %%
has_shell = importlib.util.find_spec("dolfinx") is not None
rows = ()
if has_shell:
    compared = compare(scene, CaseStore("shells"), Reporter(quiet=True), bare=True)
    rows = compared.rows
    for row in rows:
        print(
            f"w/h = {row.width_to_thickness:3.0f}: {row.status}, E = {100 * row.hausdorff:.2f} %, ribbon's error "
            f"{100 * row.ribbon_error:.3f} %, shell's {100 * row.shell_error:.2f} %, claimed: {row.claimed}"
        )
    assert compared.ok
else:
    print("dolfinx is not installed here: no shell")

# %% [markdown]
# Distance and estimate over the thickness. A slope of one says that the distance goes with h/w, of two with its
# square.

# %% mystnb={"image": {"alt": "Distance between ribbon and shell against h/w, with the estimate from the ribbon alone"}}
thin = 1.0 / np.array(ratios)
figure, axes = plt.subplots(figsize=(5, 3.4))
axes.loglog(thin, [found.estimate.distance for found in estimates], "s--", label="estimate, from the ribbon alone")
if rows:
    apart = np.array([row.hausdorff for row in rows])
    unsure = np.array([row.ribbon_error + row.shell_error for row in rows])
    axes.errorbar(thin, apart, yerr=np.minimum(unsure, 0.99 * apart), fmt="o-", capsize=3, label="shell, both errors")
    slope = np.polyfit(np.log(thin), np.log(apart), 1)[0]
    print(f"slope {slope:.2f}")
    assert all(first > second for first, second in pairwise(apart))
axes.set(xlabel="h / w", ylabel="distance / l")
_ = axes.legend()

# %% [markdown]
# ## Where the energy is
#
# The thick shell stretches, the thin one bends: its share of membrane energy falls.

# %%
for row in rows:
    print(
        f"w/h = {row.width_to_thickness:3.0f}: " + ", ".join(f"{name} {part:.4f}" for name, part in row.share.items())
    )

# %% mystnb={"image": {"alt": "Centrelines of the ribbon and of the thickest and the thinnest shell in space"}}
axes = plt.figure(figsize=(5, 4)).add_subplot(projection="3d")
if rows:
    line = np.linspace(0.0, 1.0, 200)
    axes.plot(*compared.fast.shape.centreline(line).T, label="ribbon", linewidth=3, alpha=0.5)
    for row, shell in ((rows[0], compared.shells[0]), (rows[-1], compared.shells[-1])):
        axes.plot(*shell.shape.centreline(line).T, label=f"shell, w/h = {row.width_to_thickness:.0f}")
    axes.legend()

# %% [markdown]
# On a fine mesh, with a report to turn in space: [compare](../commands/compare.md); where the ribbon stops being
# true: [limits](../commands/limits.md); what was measured: [results](../../results/README.md).
