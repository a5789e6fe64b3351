"""The robot as a user meets it: its plant and its two drivers (chapter 7)."""
