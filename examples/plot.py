"""Plot curves into small PNG files, for the other examples."""

import matplotlib.pyplot as plt
from draw import shrink


def curves(picture, panels) -> None:
    """Plot ``panels`` side by side, each (label of x, label of y, curves (x, y) by name), to the file ``picture``."""
    figure, axes = plt.subplots(1, len(panels), figsize=(7.0, 2.8), layout="constrained", squeeze=False)
    for axis, (across, upward, named) in zip(axes[0], panels, strict=True):
        for (name, (x, y)), style in zip(named.items(), ("k--", "C0", "C1", "C2"), strict=False):
            axis.plot(x, y, style, label=name)
        axis.set(xlabel=across, ylabel=upward)
        axis.legend()
    figure.savefig(picture)
    plt.close(figure)
    shrink(picture)


def dots(picture, across, values) -> None:
    """Draw a dot for each of ``values``, by name, with its number, to the file ``picture``."""
    figure, axis = plt.subplots(figsize=(6.4, 2.4), layout="constrained")
    axis.plot(list(values.values()), list(values), "o")
    for name, value in values.items():
        axis.annotate(f"{value:.2g}", (value, name), (8, -3), textcoords="offset points")
    axis.set(xlabel=across, xscale="log")
    axis.margins(x=0.15, y=0.12)
    axis.grid(axis="x", which="both", color="#e6e6e6")
    axis.invert_yaxis()
    figure.savefig(picture)
    plt.close(figure)
    shrink(picture)
