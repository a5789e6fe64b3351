"""The results as Markdown, from the files in docs/results."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from generate_markdown import table

RESULTS = Path(__file__).resolve().parent / "results"

_THEIRS = "dissertation"

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
    return table(
        heads, [*_homing_rows(), *_navigation_rows(), *_placement_rows()]
    )


def make_homing(_: str) -> str:
    """Tables 2.3 and 2.4, and the speed of a run, in short."""
    heads = [head for head, _, _ in _FIGURES]
    full, half = (_load(f"table-2.3{x}/table.json") for x in ("", "-half-turn"))
    rows = [
        [f"{label}, configuration {noise}", *_spans(cases, label == _THEIRS)]
        for label, table_, names in (
            (_THEIRS, full, "hybrid"),
            ("hybrid", full, "hybrid"),
            ("filter", full, "filter"),
            ("hybrid, half-turn antenna", half, "hybrid"),
            ("filter, half-turn antenna", half, "filter"),
        )
        for noise, numbers in (("1 to 4", "1234"), ("5", "5"))
        for cases in (_cases(table_, names, numbers, label == _THEIRS),)
    ]
    parts = [
        f"Table 2.3, open space, {full['trials']} targets a case, seed "
        f"{full['seed']}:",
        table([" ", *heads], rows),
    ]
    house, half = (
        _load(f"table-2.4{x}/table.json") for x in ("", "-half-turn")
    )
    seeds = [
        house,
        *(_load(f"table-2.4-map-seed{n}/table.json") for n in range(1, 5)),
    ]
    theirs = house["rows"][0]["dissertation"]
    rows = [[_THEIRS, "", *_spans([theirs], given=True), ""]]
    rows += [
        [row["case"], str(row["trials"]), *_spans([row]), _contacts([row])]
        for row in house["rows"]
    ]
    for case in ("hybrid, map", "filter, map"):
        pooled = [r for t in seeds for r in t["rows"] if r["case"] == case]
        rows.append(
            [
                f"{case}, seeds 0 to 4",
                str(sum(row["trials"] for row in pooled)),
                *_spans([_pooled(pooled)]),
                _contacts(pooled),
            ]
        )
    rows += [
        [
            f"{row['case']}, half-turn antenna",
            str(row["trials"]),
            *_spans([row]),
            _contacts([row]),
        ]
        for row in half["rows"]
    ]
    parts += [
        f"Table 2.4, small house, configuration 5, seed {house['seed']} where "
        "no other is told:",
        table([" ", "trials:", *heads, "contacts:"], rows),
        "The filter's goal position error [m] in open space, by the noise that "
        "there is and the noise that it is told, with the share that arrives "
        "where that is not 100 %:",
        _told(_load("table-told/table.json")),
        "Speed:",
        table(["what", "this library", "beside it"], _speed_rows()),
    ]
    return "\n\n".join(parts)


def _cases(
    content: dict[str, Any], name: str, numbers: str, given: bool
) -> list[dict[str, float]]:
    """The rows of Table 2.3 of some configurations."""
    return [
        row["dissertation"] if given else row
        for row in content["rows"]
        if row["case"].startswith(name) and row["case"][-1] in numbers
    ]


def _pooled(rows: Sequence[dict[str, Any]]) -> dict[str, float]:
    """The means over the trials of several tables."""
    successes = [row["trials"] * row["success_percent"] / 100 for row in rows]
    pooled = {
        name: sum(
            count * row[name]
            for count, row in zip(successes, rows, strict=True)
        )
        / sum(successes)
        for _, name, _ in _FIGURES[1:]
    }
    trials = sum(row["trials"] for row in rows)
    return pooled | {"success_percent": 100 * sum(successes) / trials}


def _contacts(rows: Sequence[dict[str, Any]]) -> str:
    contacts, trials = (
        sum(row[name] for row in rows)
        for name in ("contacts", "trials_with_contact")
    )
    return f"{contacts:.0f} in {trials} trials"


def _told(content: dict[str, Any]) -> str:
    """The filter's error by the noise that there is and that it is told."""
    cells: dict[str, dict[str, str]] = {}
    for row in content["rows"]:
        true, told = row["case"].removeprefix("configuration ").split(", told ")
        cell = f"{row['mean_goal_position_error_m']:.3f}"
        if row["success_percent"] < 100:
            cell += f" ({row['success_percent']:.0f} %)"
        cells.setdefault(true, {})[told] = cell
    told = list(cells["1"])
    return table(
        ["configuration", *(f"told {name}:" for name in told)],
        [[true, *(row[name] for name in told)] for true, row in cells.items()],
    )


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
            "filter, map",
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


def _navigation_rows() -> list[list[str]]:
    rows = []
    for world, name in (
        ("small house", "3.2"),
        ("bookstore", "3.3"),
        ("café", "3.4"),
    ):
        content = _load(f"table-{name}/table.json")
        (row,) = (r for r in content["rows"] if r["case"] == "ours")
        ours, theirs = (
            f"{round(figures['success_percent'], 1):g} % of {trials} arrive, "
            f"after {figures['mean_time_s']:.1f} s, path efficiency "
            f"{figures['mean_path_efficiency']:.2f}"
            for figures, trials in (
                (row, row["trials"]),
                (row["dissertation"], "its trials"),
            )
        )
        if row["contacts"]:
            ours += f", contacts in {row['trials_with_contact']} trials"
        rows.append(
            [
                f"navigation in the {world} (Table {name})",
                ours,
                f"dissertation: {theirs}",
            ]
        )
    return rows


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
