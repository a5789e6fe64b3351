"""A mobile arm that does a whole job, as Drake systems."""

from importlib.metadata import version

import lazy_loader

# Names are imported when they are first used: a law must not load pydrake.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

__version__ = version("drake_mobarm")
