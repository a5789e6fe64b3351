"""The machine on paper."""
