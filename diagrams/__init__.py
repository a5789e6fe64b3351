"""Block diagrams: what is connected to what."""
