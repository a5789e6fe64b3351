"""Colours and matplotlib settings that all pictures share."""

from typing import Any

BLUE, ORANGE, GREEN, GREY = "#1f5fbf", "#e8710a", "#188038", "#80868b"
STYLE: dict[Any, Any] = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#5f6368",
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "figure.dpi": 200,
    "legend.frameon": False,
}
