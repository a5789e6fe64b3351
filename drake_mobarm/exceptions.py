"""The errors that the library raises on purpose, one clear line each."""

from dataclasses import FrozenInstanceError


class MobarmError(Exception):
    """Base of every error that this library raises on purpose."""


class ParameterError(MobarmError, ValueError):
    """A parameter is out of its range."""


class ScenarioError(MobarmError, ValueError):
    """A scenario cannot be read or does not make sense."""


class WorldError(MobarmError, ValueError):
    """A world is unknown, or its file holds what a world cannot have."""


class MapError(MobarmError, ValueError):
    """The files of a map cannot be read, or hold what no map can have."""


class OutputError(MobarmError, RuntimeError):
    """A result cannot be written where it was asked for."""


class BlockError(MobarmError, ValueError):
    """A block given for a diagram does not fit in."""


class SimulationError(MobarmError, RuntimeError):
    """A simulation cannot go on, mostly for values that make no machine."""


class FrozenError(MobarmError, FrozenInstanceError):
    """A value was set on an object that cannot be changed."""


class VersionWarning(UserWarning):
    """A file was written by another version of this library."""


class ReportWarning(UserWarning):
    """A part of a result could not be shown; the result is kept."""
