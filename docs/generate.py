"""Writes the parts of the pages that code and results decide.

Such a part stands between two HTML comments, `generated: NAME` and `end`: the
ports of systems, the keys of scenarios, and results.

    python docs/generate.py

writes them all anew; tests/docs/test_generated.py fails where one is out of
date.
"""

import re
from collections.abc import Callable
from pathlib import Path

from generate_keys import make_keys
from generate_ports import make_ports, make_signals, make_systems
from generate_results import (
    make_headline,
    make_homing,
    make_placement,
    make_result,
)

DOCS = Path(__file__).resolve().parent
PAGES = [DOCS.parent / "README.md", *sorted(DOCS.glob("*.md"))]

MAKERS: dict[str, Callable[[str], str]] = {
    "keys": make_keys,
    "ports": make_ports,
    "signals": make_signals,
    "systems": make_systems,
    "headline": make_headline,
    "homing_results": make_homing,
    "placement_results": make_placement,
    "result": make_result,
}
"""What writes a part, by the first word of its name; the rest is passed on."""

_PART = re.compile(
    r"(<!-- generated: (\w+)(?: ([^\n]+))? -->\n).*?(<!-- end -->)", re.DOTALL
)


def main() -> None:
    """Rewrites every page."""
    for page in PAGES:
        page.write_text(fill(page.read_text(encoding="utf-8")), "utf-8")


def fill(text: str) -> str:
    """The text of a page with its generated parts written anew."""

    def write(part: re.Match[str]) -> str:
        begin, kind, subject, end = part.groups()
        return f"{begin}\n{MAKERS[kind](subject or '').strip()}\n\n{end}"

    return _PART.sub(write, text)


if __name__ == "__main__":
    main()
