"""Hypothesis without deadlines: a busy machine must not fail a test."""

from hypothesis import Phase, settings

settings.register_profile("patient", deadline=None)
settings.load_profile("patient")
# For mutation testing: the same examples for every mutant, and no search for
# a smaller one, as it asks only whether a test fails.
settings.register_profile(
    "mutation",
    database=None,
    derandomize=True,
    max_examples=50,
    phases=[Phase.explicit, Phase.generate],
)
