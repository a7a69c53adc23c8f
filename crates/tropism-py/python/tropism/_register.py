"""Registers the environments as soon as Gymnasium is imported, so that `import tropism` need not import it."""

import importlib.util
import sys
from collections.abc import Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType

#: Name, entry point and most steps of an episode.
ENVIRONMENTS = {
    "tropism/TipModel-v0": "TipModel",
    "tropism/Bean-v0": "Bean",
    "tropism/Tent-v0": "Tent",
    "tropism/Stem-v0": "Stem",
    "tropism/Obstacles-v0": "Obstacles",
    "tropism/Space-v0": "Space",
}


def register() -> None:
    """Registers all environments with Gymnasium. A second call does nothing."""
    import gymnasium

    for name, entry in ENVIRONMENTS.items():
        if name in gymnasium.registry:
            continue
        vector = None if entry == "Tent" else f"tropism.envs:{entry}Vector"
        gymnasium.register(id=name, entry_point=f"tropism.envs:{entry}Env", vector_entry_point=vector)


class _AfterGymnasium(MetaPathFinder, Loader):
    """Finds Gymnasium as the other finders do, and registers after it is executed."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if fullname != "gymnasium":
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec("gymnasium")
        if spec is None or spec.loader is None:
            return spec
        self.loader, spec.loader = spec.loader, self
        return spec

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        return self.loader.create_module(spec)

    def exec_module(self, module: ModuleType) -> None:
        if module.__spec__ is not None:
            module.__spec__.loader = self.loader
        module.__loader__ = self.loader
        self.loader.exec_module(module)
        register()


def when_gymnasium_is_imported() -> None:
    """Registers now if Gymnasium is there already, else after its import."""
    if "gymnasium" in sys.modules:
        register()
    elif not any(isinstance(finder, _AfterGymnasium) for finder in sys.meta_path):
        sys.meta_path.insert(0, _AfterGymnasium())
