"""Quasi-random search: points spread evenly over the whole space, whatever their scores. The baseline of the others."""

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, field_validator
from scipy.stats import qmc

from tuning.methods.method import Problem, Search


class Settings(BaseModel):
    """Of this method."""

    model_config = ConfigDict(extra="forbid", strict=True)

    generation: int = Field(64, ge=1, le=4096)
    """Candidates that are judged together; a power of two, over which the points balance."""

    @field_validator("generation")
    @classmethod
    def _power_of_two(cls, value: int) -> int:
        if value & (value - 1):
            raise ValueError(f"{value}; must be a power of two; try 64")
        return value


def sobol(problem: Problem) -> Search:
    """As many points of a scrambled Sobol sequence (Sobol 1967; Owen 1998) as the budget pays for."""
    size = Settings.model_validate(problem.settings).generation
    points = sobol_points(len(problem.space.parameters), problem.candidates, problem.seed)
    for start in range(0, len(points), size):
        yield points[start : start + size]


def sobol_points(dimensions: int, count: int, seed: int) -> np.ndarray:
    """[count, dimensions] float64 in the unit cube; a longer sequence begins with the shorter one."""
    sequence = qmc.Sobol(dimensions, scramble=True, rng=np.random.default_rng(seed))
    return sequence.random_base2(max(count - 1, 0).bit_length())[:count]
