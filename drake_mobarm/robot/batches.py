"""Arrays of any batch size: checked, laid in a row, cut into chunks."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_mobarm.exceptions import ParameterError
from drake_mobarm.geometry import Array

CHUNK = 2048
"""Items a batch is cut into: its arrays then stay in a core's cache."""

# What counts as a rotation or a unit vector.
_UNIT_TOLERANCE = 1e-6
_LAST_ROW = np.array([0.0, 0.0, 0.0, 1.0])


def flatten(
    values: ArrayLike, shape: tuple[int, ...], name: str
) -> tuple[tuple[int, ...], Array]:
    """The batch's shape, and its items in a row.

    Raises:
        ParameterError: the values are no array that ends in `shape`.
    """
    array = numbers(values, shape, name)
    return array.shape[: -len(shape)], array.reshape(-1, *shape)


def numbers(values: ArrayLike, shape: tuple[int, ...], name: str) -> Array:
    """The values as an array that ends in a shape.

    Raises:
        ParameterError: they are none.
    """
    wanted = ", ".join(map(str, shape))
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise ParameterError(
            f"{name} is not an array of numbers: valid is (..., {wanted})"
        ) from None
    if array.shape[-len(shape) :] != shape:
        raise ParameterError(
            f"{name} has shape {array.shape}: valid is (..., {wanted})"
        )
    return array


def chunks(n: int) -> list[slice]:
    """Parts of n items."""
    return [slice(i, min(i + CHUNK, n)) for i in range(0, n, CHUNK)]


def cross(a: Array, b: Array) -> Array:
    """Cross product along the first axis; np.cross takes ten times as long."""
    return np.stack(
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    )


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


def refuse(
    bad: NDArray[np.bool_], values: Array, name: str, valid: str
) -> None:
    """Raises a ParameterError that names the first bad value, if any."""
    if bad.any():
        first = int(np.argmax(bad))
        where = f"{name}[{first}]" if len(values) > 1 else name
        raise ParameterError(
            f"{where} is {values[first].tolist()}: valid is {valid}"
        )
