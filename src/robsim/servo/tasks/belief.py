"""The belief of a servo task about the scene, in a text."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, ClassVar

from robsim.base.errors import InputError, said
from robsim.declare.spec import Context, Raw, Spec, Unsayable
from robsim.declare.tables import difference, write_table
from robsim.world.scene import Scene


@dataclass(frozen=True)
class Belief(Spec):
    """A scene; in a text the differences from the true scene, or a `complete` scene.

    A task that says nothing has the belief of the whole experiment.
    """

    form: ClassVar[str] = "table"

    def check(self, value: Any, what: str) -> Scene:
        if not isinstance(value, Scene):
            raise InputError(f"{what}: expected a Scene, got {said(value)}")
        return value

    def read(self, raw: Raw, c: Context) -> Scene:
        scene: Scene = c.facts["believed"](raw, c)
        return scene

    def write(self, value: Any, c: Context) -> dict[str, Raw]:
        if c.facts.get("brief"):
            with suppress(Unsayable):
                return difference(c.facts["scene"], value, c)
        return {"complete": True, **write_table(value, c.knowing(scene=value))}

    def pick(self, table: Mapping[str, Raw], name: str, c: Context) -> Any:
        if name in table or c.facts.get("belief") is None:
            return super().pick(table, name, c)
        return c.facts["belief"]

    def put(self, table: dict[str, Raw], name: str, value: Any, c: Context) -> None:
        if value is not None and c.facts.get("apart"):
            table[name] = self.saved(value, c.at(name))

    def words(self) -> str:
        return "what differs from the true scene, as in [[belief.cameras]]"

    def accepts(self) -> str:
        return "a Scene"

    def schema(self, define: Any) -> dict[str, Any]:
        reference: dict[str, Any] = define.changes(Scene, complete={"type": "boolean"})
        return reference
