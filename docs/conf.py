"""Builds the pages as a site: `sphinx-build -W docs docs/_build`."""

import re
from importlib.metadata import version as installed_version
from typing import Any

project = "drake_mobarm"
copyright = "2026, the drake_mobarm maintainers"
author = "The drake_mobarm maintainers"
version = release = installed_version("drake_mobarm")

extensions = ["myst_parser"]
exclude_patterns = ["_build", "results"]
html_theme = "furo"
html_title = "drake_mobarm"
myst_heading_anchors = 3


def add_contents(app: Any, page: str, source: list[str]) -> None:
    """Makes the site's contents of the list of pages in index.md.

    A list reads well on a code forge, where a toctree would not.
    """
    if page == "index":
        pages = "\n".join(
            re.findall(r"^- \[.*?\]\((\w+)\.md\)", source[0], re.M)
        )
        source[0] += f"\n```{{toctree}}\n:hidden:\n\n{pages}\n```\n"


def setup(app: Any) -> None:
    """Connects `add_contents`."""
    app.connect("source-read", add_contents)
