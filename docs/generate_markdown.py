"""Words and tables in Markdown, for the generated parts of the pages."""

from collections.abc import Sequence


def table(heads: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """A Markdown table; a head that ends with ':' is of a right column."""
    rules = ["---:" if head.endswith(":") else "---" for head in heads]
    lines = [[head.rstrip(":") for head in heads], rules, *rows]
    return "\n".join(
        f"| {' | '.join(str(c).replace('|', chr(92) + '|') for c in line)} |"
        for line in lines
    )


def one_line(text: str) -> str:
    """The text without line breaks."""
    return " ".join(text.split())
