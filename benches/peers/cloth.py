"""The contender's side of src/protocol.rs in Python."""

import json
import os
import sys
import time

# Engines print to standard output; answers need a separate descriptor.
_answers = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)


class Cloth:
    """The cloth of src/cloth.rs from the command line, and the number of threads."""

    def __init__(self):
        threads, side, *numbers = sys.argv[1:]
        self.threads, self.side = int(threads), int(side)
        self.spacing, self.node_mass, self.stiffness, self.gravity, self.step = map(float, numbers)

    def positions(self):
        """An array of side x side x 3, row by row; the first row is pinned."""
        import numpy as np

        along = np.arange(self.side, dtype=np.float32) * np.float32(self.spacing)
        x, z = np.meshgrid(along, along)
        return np.stack([x, np.zeros_like(x), z], axis=-1)

    def shape(self, positions):
        """The mean and the largest stretch of the springs, and the mean height."""
        import numpy as np

        p = positions.astype(np.float64)
        pairs = [
            (p[:, 1:] - p[:, :-1], 1.0),
            (p[1:] - p[:-1], 1.0),
            (p[1:, 1:] - p[:-1, :-1], 2.0**0.5),
            (p[1:, :-1] - p[:-1, 1:], 2.0**0.5),
        ]
        stretch = [np.linalg.norm(d, axis=-1).ravel() / (length * self.spacing) - 1.0 for d, length in pairs]
        stretch = np.concatenate(stretch)
        return float(stretch.mean()), float(stretch.max()), float(p[..., 1].mean())


def refuse(reason):
    """Reports the reason that this engine cannot be measured, and exits."""
    _send({"refused": reason})
    sys.exit()


def memory(name):
    """The value of a line of /proc/self/status, in bytes; None on other systems."""
    try:
        with open("/proc/self/status") as status:
            return next(int(line.split()[1]) * 1024 for line in status if line.startswith(name))
    except (OSError, StopIteration):
        return None


def serve(cloth, version, before, step, positions):
    """Answers until the input ends. `before` is the resident size before the cloth was built [bytes]."""
    _send({"version": version})
    for line in sys.stdin:
        if line.startswith("steps "):
            milliseconds = []
            for _ in range(int(line.split()[1])):
                start = time.perf_counter()
                step()
                milliseconds.append((time.perf_counter() - start) * 1e3)
            _send({"milliseconds": milliseconds})
        else:
            resident, peak = memory("VmRSS:"), memory("VmHWM:")
            mean, largest, height = cloth.shape(positions())
            answer = {"body_bytes": before and resident - before, "peak_bytes": peak}
            if mean - mean == 0.0:
                answer |= {"mean_stretch": mean, "max_stretch": largest, "mean_height": height}
            _send(answer)


def _send(answer):
    print(json.dumps(answer), file=_answers, flush=True)
