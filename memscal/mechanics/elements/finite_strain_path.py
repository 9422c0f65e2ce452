"""Along a loading at finite strain, in steps as long as Newton's method can take."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from memscal.mechanics.elements.finite_strain_contact import Goal, NewtonError, Pressed, Pressing
from memscal.mechanics.elements.finite_strain_faces import RodFace

__all__ = ["Step", "follow"]

# The first step of a rod, as a share of its radius in depth; those of a sphere to the first goal,
# for the sake of the work; and what the next may grow by.
_FIRST = 0.05
_FIRST_STEPS = 5
_GROWTH = 1.4
# A step that takes more iterations than this is not followed by a longer one.
_EASY = 9
# A step is halved at most so many times.
_HALVINGS = 8


@dataclass(frozen=True, eq=False)
class Step:
    """A state on the way, how many steps led there, and the work on the way in mJ."""

    pressed: Pressed
    count: int
    work: float


def follow(pressing: Pressing, start: Pressed, goals: list[Goal]) -> Iterator[Step]:
    """Yield the states at the goals, in their order.

    Raises
    ------
    NewtonError
        If a goal is out of reach, however short the steps; ``last`` is the last step.
    """
    path = _Path(pressing, start)
    for goal in goals:
        try:
            path.reach(goal)
        except NewtonError as problem:
            problem.last = path.step if path.states else None
            raise
        yield path.step


class _Path:
    """The state reached, the one before it, and the length of the next step."""

    def __init__(self, pressing: Pressing, start: Pressed) -> None:
        self.pressing, self.start = pressing, start
        self.states: list[Pressed] = []
        # Stepping is by load or by depth, whatever the goals are given in.
        self.length = np.inf

    @property
    def step(self) -> Step:
        return Step(self.states[-1], len(self.states), self._work())

    def _work(self) -> float:
        """Return the integral of load over depth, by splines through four points or more."""
        from scipy.interpolate import CubicSpline

        depths = np.array([0.0] + [state.depth for state in self.states])
        loads = np.array([0.0] + [state.load for state in self.states])
        # Over the number of the step, so that a path may turn back.
        number = np.arange(depths.size)
        if number.size < 4:
            return float(np.sum(np.diff(depths) * (loads[1:] + loads[:-1]) / 2))
        depth, load = CubicSpline(number, depths), CubicSpline(number, loads)
        t, weights = np.polynomial.legendre.leggauss(4)
        places = (number[:-1, None] + (t + 1) / 2).ravel()
        return float(np.tile(weights / 2, number.size - 1) @ (load(places) * depth(places, 1)))

    def reach(self, goal: Goal) -> None:
        """Go to a goal."""
        begin = self._value(goal)
        if not self.states:
            self.length = self._first(goal)
        halvings = 0
        while begin != goal.value:
            left = goal.value - begin
            pieces = max(1.0, np.ceil(abs(left) / self.length - 1e-9))
            ahead = goal.value if pieces == 1 else begin + left / pieces
            try:
                state = self.pressing.press(
                    self._guess(Goal(ahead, goal.is_load)), Goal(ahead, goal.is_load)
                )
            except NewtonError:
                self.length = abs(ahead - begin) / 2
                halvings += 1
                if halvings > _HALVINGS:
                    raise
                continue
            halvings = max(0, halvings - 1)
            if state.iterations <= _EASY:
                self.length = max(abs(ahead - begin), self.length) * _GROWTH
            self.states.append(state)
            begin = ahead

    def _first(self, goal: Goal) -> float:
        """Return the length of the first step."""
        face = self.pressing.face
        if not isinstance(face, RodFace):
            return goal.value / _FIRST_STEPS
        stiffness = 8 * self.pressing.elements.material.shear_modulus * face.radius
        return _FIRST * face.radius * (stiffness if goal.is_load else 1.0)

    def _value(self, goal: Goal) -> float:
        if not self.states:
            return 0.0
        return self.states[-1].load if goal.is_load else self.states[-1].depth

    def _guess(self, goal: Goal) -> Pressed:
        """Return the last state, carried on as it came."""
        if not self.states:
            return self.start
        if len(self.states) == 1:
            return self.states[-1]
        before, last = self.states[-2:]
        old, new = (s.load if goal.is_load else s.depth for s in (before, last))
        if new == old:
            return last
        ahead = (goal.value - new) / (new - old)
        place = last.place.copy()
        if not self.pressing.sticking:
            was, now = (
                np.isin(before.touching, last.touching),
                np.isin(last.touching, before.touching),
            )
            place[now] += ahead * (place[now] - before.place[was])
        return replace(
            last,
            x=last.x + ahead * (last.x - before.x),
            depth=last.depth + ahead * (last.depth - before.depth),
            place=place,
        )
