"""A title is drawn as the user wrote it, dollars and all; labels of ticks keep their formulas."""

from __future__ import annotations

import pytest
from matplotlib.figure import Figure

from compare.page.drawing import save


def drawn(path, title):
    figure = Figure(figsize=(3.0, 2.0))
    axes = figure.add_subplot()
    axes.loglog([1e-3, 10.0], [1e-5, 1.0])
    axes.set_title(title)
    save(figure, path, 60)
    return figure


@pytest.mark.parametrize("title", [r"$\frac{$", "costs $5 and $6", r"\$", "$"])
def test_a_title_is_no_formula(title, tmp_path):
    figure = drawn(tmp_path / "a.png", title)
    (axes,) = figure.axes
    assert axes.title.get_parse_math() is False
    ticks = [label for label in axes.xaxis.get_ticklabels() if label.get_text()]
    assert all(label.get_parse_math() for label in ticks)


def test_a_sum_is_drawn_as_two_letters_more(tmp_path):
    """As a formula "$a$" would be as wide as "a"."""
    widths = [drawn(tmp_path / f"{k}.png", title).axes[0].title for k, title in enumerate(("a", "$a$"))]
    few, many = (title.get_window_extent().width for title in widths)
    assert many > 2.0 * few
