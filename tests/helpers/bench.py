"""A simulated bench: a stage and a voltmeter that answer the commands of the real ones."""

import re
from collections.abc import Callable

import numpy as np
from pymeasure.adapters import Adapter

import memscal


class Answers(Adapter):
    """A connection whose other end is a function of commands."""

    def __init__(self, does: Callable[[str], str | None]):
        super().__init__()
        self.does = does

    def _write(self, command, **_):
        self.answer = self.does(command)

    def _read(self, **_):
        return self.answer


class Bench:
    """A rod over a simulated sensor: readings lie on a scan, with noise (V), where it rests."""

    def __init__(self, scan: memscal.Scan, *, noise: float, seed: int):
        self.scan = scan
        self.noise = noise
        self.random = np.random.default_rng(seed)
        self.position = {"1": 0.0, "2": 1.0}  # mm, across and up
        self.enabled = set()
        self.readings = self.dragged = 0
        self.stage = Answers(self.move)
        self.voltmeter = Answers(self.read)

    def move(self, command: str) -> str | None:
        """Newport ESP 300: MO and MF enable and disable, PA moves, TP and MD? answer."""
        axis, name, number = re.fullmatch(r"(\d)([A-Z]{2}\??)(-?[\d.]*)", command).groups()
        if name in ("MO", "MF"):
            self.enabled ^= {axis}
        if name == "PA":
            assert axis in self.enabled
            self.dragged += axis == "1" and self.position["2"] <= 0
            self.position[axis] = float(number)
        return {"MD?": "1", "TP": f"{self.position[axis]}"}.get(name)

    def read(self, command: str) -> str | None:
        """Keithley 2000: a reading in V."""
        if command != ":READ?":
            return None
        self.readings += 1
        x = 1e-3 * self.position["1"]
        resting = self.position["2"] <= 0
        volts = np.interp(x, self.scan.x, self.scan.u_zz) if resting else 0.0
        return f"{volts + self.noise * self.random.standard_normal():.9e}"
