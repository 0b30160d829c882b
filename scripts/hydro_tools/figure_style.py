"""Style of the figures: text stays text, and the same numbers give the same file."""

#: For `matplotlib.rcParams` or `rc_context`.
STYLE = {
    "svg.hashsalt": "hydro",
    "svg.fonttype": "none",
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.3,
}
