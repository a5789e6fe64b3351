"""Driving through a furnished building to a target (chapter 3)."""

import lazy_loader

# Names are imported when they are first used: a law must not load pydrake.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
