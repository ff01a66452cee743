"""The player's side of src/players/serve.rs in Python."""

import os
import sys
import time

import numpy as np

# Engines print to standard output; answers need a separate descriptor.
_answers = os.fdopen(os.dup(1), "w", buffering=1)
os.dup2(2, 1)


# Numbers per line of each section.
WIDTHS = {"nodes": 4, "pinned": 1, "tetrahedra": 4, "springs": 2, "triangles": 3, "ball": 5}


class Model:
    """The model of src/precision/model.rs."""

    def __init__(self, path):
        self.ball = []
        words = iter(open(path).read().split())
        for name in words:
            value = float(next(words))
            if name in WIDTHS:
                width = WIDTHS[name]
                table = np.array([float(next(words)) for _ in range(int(value) * width)]).reshape(-1, width)
                setattr(self, name, table if name in ("nodes", "ball") else table.astype(np.int64))
            else:
                setattr(self, name, value)
        self.frames = int(self.frames)
        self.positions, self.masses = self.nodes[:, :3].copy(), self.nodes[:, 3].copy()
        self.pinned = self.pinned[:, 0]
        self.mu = self.young / (2 * (1 + self.poisson))
        self.lame_lambda = self.young * self.poisson / ((1 + self.poisson) * (1 - 2 * self.poisson))

    def rest_lengths(self):
        ends = self.positions[self.springs]
        return np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)


model = Model(sys.argv[1])
settings = dict(setting.split("=", 1) for setting in sys.argv[3:])
substeps = int(settings.get("substeps", 1))


def say(word, text):
    print(word, text, file=_answers)


def refuse(reason):
    say("refused", reason)
    sys.exit(0)


def serve(version, frame, positions, warm_up=None):
    """Calls `frame` for each frame and then `positions`, which returns an array with one row per node."""
    if warm_up:
        warm_up()
    say("version", version)
    spent = 0.0
    with open(sys.argv[2], "wb") as file:
        for _ in range(model.frames):
            start = time.process_time()
            frame()
            spent += time.process_time() - start
            file.write(np.ascontiguousarray(positions(), dtype="<f8").tobytes())
            file.flush()
            say("frame", repr(spent))
