"""Messages between two processes: a line of JSON, then the numbers of some arrays, over a pipe."""

from __future__ import annotations

import json
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def send(stream: IO[bytes], head: dict[str, Any], *arrays: FloatArray) -> None:
    """Write `head` (what JSON knows) and arrays of float64."""
    whole = [np.ascontiguousarray(array, dtype=np.float64) for array in arrays]
    line = json.dumps({"head": head, "shapes": [array.shape for array in whole]})
    stream.write(line.encode() + b"\n")
    for array in whole:
        stream.write(array.tobytes())
    stream.flush()


def receive(stream: IO[bytes]) -> tuple[dict[str, Any], list[FloatArray]]:
    """What `send` wrote. EOFError where the other process is gone."""
    line = stream.readline()
    if not line.endswith(b"\n"):
        raise EOFError("the other process has closed its end")
    found = json.loads(line)
    arrays = []
    for shape in found["shapes"]:
        count = 8 * int(np.prod(shape, dtype=np.int64))
        data = stream.read(count)
        if len(data) < count:
            raise EOFError("the other process has closed its end")
        arrays.append(np.frombuffer(data, dtype=np.float64).reshape(shape).copy())
    return found["head"], arrays
