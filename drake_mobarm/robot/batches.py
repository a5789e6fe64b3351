"""Arrays of any batch size: checked, flattened, cut into chunks."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_mobarm.exceptions import ParameterError
from drake_mobarm.geometry import Array

CHUNK = 2048
"""Items a batch is cut into: its arrays then stay in a core's cache."""

OVERFLOW_IS_FAR = np.errstate(over="ignore", invalid="ignore")
"""Squares that overflow need no warning: they are refused or out of reach."""

# How far a rotation or a unit vector may be from an exact one.
_UNIT_TOLERANCE = 1e-6
_LAST_ROW = np.array([0.0, 0.0, 0.0, 1.0])


def flatten(
    values: ArrayLike, shape: tuple[int, ...], name: str
) -> tuple[tuple[int, ...], Array]:
    """The shape of a batch, (...), and its n items, (n, *shape).

    Args:
        values: the batch, (..., *shape).
        shape: of an item.
        name: what an error calls the values.

    Raises:
        ParameterError: the values are not numbers, or not of that shape.
    """
    array = numbers(values, shape, name)
    return array.shape[: -len(shape)], array.reshape(-1, *shape)


def numbers(values: ArrayLike, shape: tuple[int, ...], name: str) -> Array:
    """The values as an array of floats, (..., *shape).

    Args:
        values: the batch, (..., *shape).
        shape: of an item.
        name: what an error calls the values.

    Raises:
        ParameterError: the values are not numbers, or not of that shape.
    """
    try:
        array = np.asarray(values, dtype=float)
        if array.shape[-len(shape) :] == shape:
            return array
        what = f"has shape {array.shape}"
    except (TypeError, ValueError):
        what = "is not an array of numbers"
    wanted = ", ".join(map(str, shape))
    raise ParameterError(f"{name} {what}: valid is (..., {wanted})")


def chunks(n: int) -> list[slice]:
    """Slices that cut n items into chunks."""
    return [slice(i, min(i + CHUNK, n)) for i in range(0, n, CHUNK)]


def lone(items: Array) -> list[float] | None:
    """The numbers of a batch's only item, where they are finite.

    Args:
        items: as `flatten` gives them, (n, ...).

    Returns:
        The numbers row after row, or None where a batch has to be solved.
    """
    if len(items) != 1:
        return None
    values: list[float] = items.ravel().tolist()
    return values if math.isfinite(sum(values)) else None


def cross(a: Array, b: Array) -> Array:
    """Cross product along the first axis, ten times as fast as np.cross."""
    return np.stack(
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    )


@OVERFLOW_IS_FAR
def check_directions(directions: Array, name: str) -> None:
    """Refuses rows (n, 3) that are not unit vectors.

    Raises:
        ParameterError: naming the first such row.
    """
    length = np.linalg.norm(directions, axis=1)
    bad = ~(np.abs(length - 1) <= _UNIT_TOLERANCE)
    valid = "a unit vector"
    if bad.any():
        first = int(np.argmax(bad))
        if 0 < length[first] < np.inf:
            unit = np.round(directions[first] / length[first], 9)
            valid += f", here {unit.tolist()}"
    refuse(bad, directions, name, valid)


def is_direction(direction: list[float]) -> bool:
    """Whether three finite numbers pass `check_directions`."""
    x, y, z = direction
    length = math.sqrt(x * x + y * y + z * z)
    return abs(length - 1) <= _UNIT_TOLERANCE


@OVERFLOW_IS_FAR
def check_poses(poses: Array) -> None:
    """Refuses matrices (n, 4, 4) that are not poses.

    Raises:
        ParameterError: naming the first of them.
    """
    x, y, z = (np.ascontiguousarray(poses[:, :3, i].T) for i in range(3))
    deviation = np.abs(cross(x, y) - z).max(axis=0)
    for a, b, product in ((x, x, 1), (y, y, 1), (x, y, 0)):
        off = np.abs((a * b).sum(axis=0) - product)
        deviation = np.maximum(deviation, off)
    last_row = np.abs(poses[:, 3] - _LAST_ROW).max(axis=1)
    deviation = np.maximum(deviation, last_row)
    refuse(
        ~(deviation <= _UNIT_TOLERANCE) | ~np.isfinite(poses[:, :3, 3]).all(1),
        poses,
        "X_BT",
        "a right-handed rotation, a finite position, last row 0, 0, 0, 1",
    )


def is_pose(pose: list[float]) -> bool:
    """Whether 16 finite numbers, row after row, pass `check_poses`."""
    x1, y1, z1, _, x2, y2, z2, _, x3, y3, z3, _, *last_row = pose
    deviations = (
        x2 * y3 - x3 * y2 - z1,
        x3 * y1 - x1 * y3 - z2,
        x1 * y2 - x2 * y1 - z3,
        x1 * x1 + x2 * x2 + x3 * x3 - 1,
        y1 * y1 + y2 * y2 + y3 * y3 - 1,
        x1 * y1 + x2 * y2 + x3 * y3,
        *last_row[:3],
        last_row[3] - 1,
    )
    # A NaN, of an overflow, is not the largest: every one is compared.
    return all(-_UNIT_TOLERANCE <= x <= _UNIT_TOLERANCE for x in deviations)


def refuse(
    bad: NDArray[np.bool_], values: Array, name: str, valid: str
) -> None:
    """Raises a ParameterError that names the first bad value, if any.

    Args:
        bad: which values are, (n,).
        values: (n, ...).
        name: what the error calls them.
        valid: what it says is valid.
    """
    if bad.any():
        first = int(np.argmax(bad))
        where = f"{name}[{first}]" if len(values) > 1 else name
        raise ParameterError(
            f"{where} is {values[first].tolist()}: valid is {valid}"
        )
