"""A digest of each shipped job's trace: what a change of code has to keep.

    python benchmarks/trace_digests.py

Homing in every world with either estimator, and placement in two. The same
scenario and seed give the same trace to the bit on one machine, so that two
versions behave alike where their digests are the same. Other machines and
other versions of Drake or numpy give other digests.
"""

import hashlib

from drake_mobarm import load_scenario, run

SEED = 3
HOMING = {
    "empty": ("start=[0, 0, 0]", "beacon=[5, 3]", "avoidance=none"),
    "small_house": (),
    "bookstore": ("start=[4, 0, 3.14]", "beacon=[-6, 5]"),
    "cafe": ("start=[0, 0, 0]", "beacon=[2.5, -7]"),
}
PLACEMENT = {
    "small_house": (),
    "cafe": (
        "start=[0, 0, 0]",
        "target=[0.5, -1.22, 0.84]",
        "approach=[0, -0.96, -0.28]",
    ),
}


def digest(name: str, overrides: list[str]) -> str:
    """The run's SHA-256, over every signal's name and bytes, and its end."""
    result = run(load_scenario(name, overrides), seed=SEED)
    hashed = hashlib.sha256()
    for signal, values in sorted(result.trace.items()):
        hashed.update(signal.encode())
        hashed.update(values.tobytes())
    return f"{hashed.hexdigest()[:32]}  {result.simulated_s:6.2f} s"


def main() -> None:
    """Prints a line a scenario."""
    for world, places in HOMING.items():
        for estimator in ("hybrid", "filter"):
            overrides = [f"world={world}", f"estimator={estimator}", *places]
            found = digest("homing", overrides)
            print(f"homing {world} {estimator}: {found}", flush=True)
    for world, places in PLACEMENT.items():
        found = digest("placement", [f"world={world}", *places])
        print(f"placement {world}: {found}", flush=True)


if __name__ == "__main__":
    main()
