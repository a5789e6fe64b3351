"""The results as Markdown, from the files in docs/results."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from generate_markdown import table

RESULTS = Path(__file__).resolve().parent / "results"

_FIGURES = (
    ("success [%]:", "success_percent", 0),
    ("time [s]:", "mean_time_to_target_s", 1),
    ("net velocity [m/s]:", "mean_net_velocity_m_per_s", 2),
    ("goal position error [m]:", "mean_goal_position_error_m", 3),
    ("final position error [m]:", "mean_final_position_error_m", 3),
    ("path efficiency:", "mean_path_efficiency", 2),
)


def make_result(file: str) -> str:
    """A file of results in Markdown, its headings two levels lower."""
    text = (RESULTS / file).read_text(encoding="utf-8")
    lines = text.splitlines()
    return "\n".join(f"##{x}" if x.startswith("#") else x for x in lines)


def make_headline(_: str) -> str:
    """The figures that the README shows."""
    heads = ["what", "this library", "beside it"]
    return table(heads, [*_homing_rows(), *_placement_rows()])


def make_homing(_: str) -> str:
    """Tables 2.3 and 2.4, and the speed of a run, in short."""
    open_space = _load("table-2.3/table.json")
    rows = []
    for label in ("dissertation", "hybrid", "filter"):
        given = label == "dissertation"
        for noise, numbers in (("1 to 4", "1234"), ("5", "5")):
            cases = [
                row["dissertation"] if given else row
                for row in open_space["rows"]
                if row["case"].startswith("hybrid" if given else label)
                and row["case"][-1] in numbers
            ]
            case = f"{label}, configuration {noise}"
            rows.append([case, *_spans(cases, given)])
    heads = [head for head, _, _ in _FIGURES]
    trials = open_space["trials"]
    parts = [
        f"Table 2.3, open space, {trials} targets a case, seed "
        f"{open_space['seed']}:",
        table([" ", *heads], rows),
    ]
    houses = [_load(f"table-2.4{end}/table.json") for end in ("", "-seed1")]
    theirs = houses[0]["rows"][0]["dissertation"]
    rows = [["dissertation", *_spans([theirs], given=True), ""]]
    for house in houses:
        for row in house["rows"]:
            contacts, trials = row["contacts"], row["trials_with_contact"]
            rows.append(
                [
                    f"{row['case']}, seed {house['seed']}",
                    *_spans([row]),
                    f"{contacts:.0f} in {trials} trials",
                ]
            )
    parts += [
        "Table 2.4, small house, configuration 5, "
        f"{houses[0]['trials']} trials a case:",
        table([" ", *heads, "contacts:"], rows),
        "Speed:",
        table(["what", "this library", "beside it"], _speed_rows()),
    ]
    return "\n\n".join(parts)


def make_placement(_: str) -> str:
    """The arm, the map, the grid and the best stand, in short."""
    parts = [table(["what", "this library", "beside it"], _placement_rows())]
    coverage = [
        [
            f"`{row['world']}`",
            f"{row['size_m']:.2f}",
            *(
                f"{100 * row[f'{kind}_coverage']:.1f}"
                for kind in ("plain", "heights", "optimised")
            ),
        ]
        for row in _load("grid_coverage.json")
    ]
    parts += [
        "Free area that the squares cover [%]: a plain grid, one whose columns "
        "have their best heights, and one that is optimised altogether:",
        table(
            ["world", "size [m]:", "plain:", "heights:", "optimised:"], coverage
        ),
        "The best stand beside a dense search of places 1 cm apart:",
        table(
            [
                "arm",
                "targets:",
                "within 1 % [%]:",
                "worst ratio:",
                "ratio to the best square, median:",
                "missed:",
                "time, median [ms]:",
                "dense search, median [ms]:",
            ],
            [
                [
                    kind,
                    all_["targets"],
                    f"{100 * all_['within_1_percent']:.1f}",
                    f"{all_['worst_over_dense']:.3f}",
                    f"{all_['median_over_map']:.2f}",
                    all_["missed"],
                    f"{1e3 * all_['median_ours_s']:.0f}",
                    f"{1e3 * all_['median_dense_s']:.0f}",
                ]
                for kind, all_ in _stands().items()
            ],
        ),
    ]
    return "\n\n".join(parts)


def _homing_rows() -> list[list[str]]:
    rows = []
    for label, file, case in (
        (
            "homing in open space (Table 2.3), strongest noise",
            "table-2.3",
            "filter, configuration 5",
        ),
        (
            "homing in the small house (Table 2.4), strongest noise",
            "table-2.4",
            "filter",
        ),
    ):
        content = _load(f"{file}/table.json")
        (row,) = (r for r in content["rows"] if r["case"] == case)
        ours, theirs = (
            f"{figures['success_percent']:.0f} % of {trials} arrive, after "
            f"{figures['mean_time_to_target_s']:.1f} s, estimate off by "
            f"{round(figures['mean_goal_position_error_m'], 3):g} m"
            for figures, trials in (
                (row, row["trials"]),
                (row["dissertation"], "its trials"),
            )
        )
        if row["contacts"]:
            ours += f", contacts in {row['trials_with_contact']} trials"
        rows.append([label, ours, f"dissertation: {theirs}"])
    return rows + _speed_rows()


def _speed_rows() -> list[list[str]]:
    speed = _load("homing_speed.json")
    run = speed["runs"]["homing, start to arrival"]["best"]
    plant = speed["runs"]["plant alone"]["best"]
    return [
        [
            "the shipped run of homing, one core",
            f"{1000 / run:.0f} times real time",
            f"the plant alone: {1000 / plant:.0f} times, so that the whole "
            f"loop costs {speed['ratio']['best']:.1f} times the plant",
        ]
    ]


def _placement_rows() -> list[list[str]]:
    solvers = {
        row["name"]: row["best_us"]
        for row in _load("inverse_kinematics.json")["regular"]
    }
    maps = _load("objective_map.json")["ours"][0]
    (grid,) = (
        row
        for row in _load("grid_coverage.json")
        if row["world"] == "small_house" and row["size_m"] == 0.3
    )
    alone = _stands()["kinematics alone"]
    return [
        [
            "inverse kinematics in a batch, all eight solutions",
            f"{solvers['ours, batch, with limits']:.1f} us a pose",
            f"EAIK: {solvers['EAIK, batch, solver alone']:.1f} us; Drake's "
            "InverseKinematics, one solution: "
            f"{solvers['Drake InverseKinematics, SNOPT'] / 1e3:.1f} ms",
        ],
        [
            "inverse kinematics, one pose a call, in Python",
            f"{solvers['ours, pose by pose, with limits']:.0f} us",
            "EAIK, compiled: "
            f"{solvers['EAIK, pose by pose, solver alone']:.1f} us",
        ],
        [
            f"map of the objective, {maps['places']} places",
            f"{maps['best_ms']:.1f} ms",
            "with Drake's InverseKinematics: "
            f"{maps['drake_extrapolated_ms'] / 1e3:.1f} s, extrapolated",
        ],
        [
            "free floor of the small house covered by squares of 0.3 m",
            f"{100 * grid['optimised_coverage']:.1f} %",
            f"plain grid: {100 * grid['plain_coverage']:.1f} %",
        ],
        [
            f"best stand for {alone['targets']} targets",
            f"within 1 % of a dense search or better for "
            f"{100 * alone['within_1_percent']:.0f} %, "
            f"{1e3 * alone['median_ours_s']:.0f} ms",
            f"dense search: {1e3 * alone['median_dense_s']:.0f} ms",
        ],
    ]


def _stands() -> dict[str, Any]:
    summaries = _load("best_stand.json")["summaries"]
    return {kind: worlds["all"] for kind, worlds in summaries.items()}


def _spans(cases: Sequence[dict[str, float]], given: bool = False) -> list[str]:
    """Each figure, from the least to the largest of some cases.

    Figures of the dissertation are `given`: they get no further digits.
    """
    spans = []
    for _, name, digits in _FIGURES:
        values = sorted(case[name] for case in cases)
        ends = [
            f"{round(value, digits):g}" if given else f"{value:.{digits}f}"
            for value in (values[0], values[-1])
        ]
        spans.append(" to ".join(dict.fromkeys(ends)))
    return spans


def _load(file: str) -> Any:
    return json.loads((RESULTS / file).read_text(encoding="utf-8"))
