"""Tasks that are made of whole runs."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

from robsim.world.scene import Scene


@runtime_checkable
class Staged(Protocol):
    """What stands in an experiment like a task, but simulates itself: a mission."""

    def simulated(self, scene: Scene, q0: Any = None, **settings: Any) -> Any:
        """Return what happened from q0; `settings` are those of `simulate`."""

    def checked(
        self, scene: Scene, q0: Any = None, *, must_see: bool = False, **settings: Any
    ) -> None:
        """InputError for what can be known to be wrong before; `must_see` is that of `check`."""
