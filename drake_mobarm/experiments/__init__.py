"""The dissertation's tables, run anew."""
