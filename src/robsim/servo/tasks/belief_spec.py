"""The belief of a servo task about the scene, in a text."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, ClassVar

from robsim.base.errors import InputError, format_value
from robsim.declare import Table
from robsim.declare.context import MISSING, Context, Raw, UnwritableChange
from robsim.declare.spec import make_expected_error
from robsim.world.scene import Scene


@dataclass(frozen=True)
class BeliefSpec(Table):
    """A scene; in a text the differences from the true scene, or a `complete` scene.

    A task without its own belief uses the belief of the experiment.
    """

    kind: type[Any] = Scene
    phrase: ClassVar[str] = "the differences from the true scene, as in [[belief.cameras]]"
    python_phrase: ClassVar[str] = "a Scene"

    def read(self, raw: Raw, c: Context) -> Scene:
        if not isinstance(raw, Mapping):
            raise InputError(f"must be a table, as in [[belief.cameras]], got {format_value(raw)}")
        complete = raw.get("complete", False)
        if not isinstance(complete, bool):
            c.at("complete").report(str(make_expected_error("a valid boolean", complete)))
        rest = {key: part for key, part in raw.items() if key != "complete"}
        before = c.facts["scene"] if c.over in (MISSING, None) else c.over
        over = MISSING if complete is True else before
        scene: Scene = super().read(rest, c.with_old_value(over))
        return scene

    def build_table(self, value: Any, c: Context, key: str | None = None) -> dict[str, Raw]:
        if c.facts.get("short"):
            with suppress(UnwritableChange):
                return super().build_table(value, c.with_old_value(c.facts["scene"]))
        whole = super().build_table(value, c.with_old_value(MISSING).with_facts(scene=value))
        return {"complete": True, **whole}

    def pick(self, table: Mapping[str, Raw], name: str, c: Context) -> Any:
        if name in table or c.facts.get("belief") is None:
            return super().pick(table, name, c)
        return c.facts["belief"]

    def put(self, table: dict[str, Raw], name: str, value: Any, c: Context) -> None:
        if c.facts.get("apart"):
            super().put(table, name, value, c)

    def controls(self, value: Any, place: Any) -> Iterable[Any]:
        """Return the controls of a belief of its own; a common belief has them once."""
        return super().controls(value, place) if place.c.facts["apart"] else ()

    def schema(self, define: Any) -> dict[str, Any]:
        reference: dict[str, Any] = define.changes(Scene, complete={"type": "boolean"})
        return reference
