"""Search methods, one a file, whose function has the file's name and whose `Settings` say what a job file may set."""

from importlib import import_module
from typing import cast

from pydantic import BaseModel

from tuning.methods.method import Method

METHODS = ("sweep", "sobol", "nsga3", "cmaes", "gradient")
CUT_ANYWHERE = ("sobol", "nsga3", "cmaes")
"""Those that lose nothing if they are ended anywhere: a race may leave budget for more candidates."""


def method_named(name: str) -> Method:
    """The search, imported when it is asked for: some bring much with them."""
    return cast(Method, getattr(import_module(f"tuning.methods.{name}"), name))


def settings_of(name: str) -> type[BaseModel]:
    """The model of a method's settings."""
    return import_module(f"tuning.methods.{name}").Settings
