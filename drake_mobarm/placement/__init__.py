"""Where to stand: sections 4.3.1 to 4.3.3."""
