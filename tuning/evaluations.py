"""Every figure of every candidate on every scenario, as a tuning job collects them."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Evaluations:
    """W candidates in the order in which they were asked for, on S common scenarios. Row 0 is the default constants."""

    parameters: tuple[str, ...]  # D
    values: np.ndarray  # [W, D] float64, the constants themselves
    generation: np.ndarray  # [W] int32, which call of the method asked for it; 0: the default
    columns: dict[str, np.ndarray]  # every figure by name, [W, S] each; `outcome` is among them
    done: np.ndarray  # [W, S] bool; a candidate that was dropped early has not seen all scenarios

    @property
    def complete(self) -> np.ndarray:
        """[W] bool: has seen all scenarios."""
        return np.asarray(self.done.all(axis=1))

    def rows(self, which: np.ndarray) -> "Evaluations":
        """Some candidates only; which: [W] bool or indices."""
        columns = {name: values[which] for name, values in self.columns.items()}
        return Evaluations(self.parameters, self.values[which], self.generation[which], columns, self.done[which])
