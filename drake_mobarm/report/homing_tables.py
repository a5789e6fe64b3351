"""Figures of the homing tables, after Figures 2.2, 2.6, 2.7 and A.1 to A.3."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any


def draw_figures(name: str, rows: Sequence[dict[str, Any]], paths: Sequence[list[list[float]]], folder: Path) -> None:
    """x."""
