"""Public names that are imported when they are first used, so that `import implicit` stays quick.

Several verbs share their name with the file they live in (`implicit.polygonize.polygonize`). Python binds a
submodule to its package when it is imported, which would hide the verb behind the file; a `LazyPackage` never
lets a submodule take a public name.
"""

import sys
from collections.abc import Mapping
from importlib import import_module
from types import ModuleType


class LazyPackage(ModuleType):
    """A package whose public names are found, on first use, in the files that define them."""

    homes: Mapping[str, str]

    def __getattr__(self, name: str) -> object:
        """The public `name`, imported from its file and kept."""
        homes: Mapping[str, str] = self.__dict__["homes"]
        if name not in homes:
            raise AttributeError(f"package {self.__name__!r} has no public name {name!r}")
        value = getattr(import_module(f"{self.__name__}.{homes[name]}"), name)
        self.__dict__[name] = value
        return value

    def __setattr__(self, name: str, value: object) -> None:
        """Bind `name`, unless a submodule would take the place of a public name."""
        if not (isinstance(value, ModuleType) and name in self.__dict__.get("homes", ())):
            super().__setattr__(name, value)

    def __dir__(self) -> list[str]:
        """Every name bound so far and every public name."""
        return sorted({*self.__dict__, *self.__dict__["homes"]})


def make_lazy(package: str, homes: Mapping[str, str]) -> None:
    """Let `package` find each public name of `homes` in the file named beside it."""
    module = sys.modules[package]
    module.__class__ = LazyPackage
    module.__dict__["homes"] = dict(homes)
    module.__dict__["__all__"] = sorted(homes)
