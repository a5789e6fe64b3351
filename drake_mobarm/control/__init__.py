"""The station's drivers (chapter 7): laws and systems."""
