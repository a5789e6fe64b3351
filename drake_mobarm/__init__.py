"""A mobile arm that does a whole job, as Drake systems."""

from drake_mobarm.runtime.scenarios import load_scenario
from drake_mobarm.runtime.simulation import Result, run

__all__ = ["Result", "load_scenario", "run"]
