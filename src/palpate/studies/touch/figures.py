"""Draw."""

from matplotlib.figure import Figure

from palpate.report import style


@style.figure("touch_precision", tables=("touch", "touch_truth"))
def draw_touch_precision(touch, touch_truth, *, scene: str) -> Figure:
    """Draw."""
    return Figure()
