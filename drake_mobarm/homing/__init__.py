"""Finding a beacon and driving to it (chapter 2): laws and systems."""
