"""JSON Schema of declared classes, for completion and checks of TOML files in editors."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from robsim.declare.fields import DeclaredField, fields_of
from robsim.declare.tables import get_text_form

DRAFT = "http://json-schema.org/draft-07/schema#"
Properties = dict[str, Any]


@dataclass(frozen=True)
class SchemaDefinitions:
    """The schemas of declared classes, each created at the first reference to it.

    With `partial` no key is required, for tables that change other tables.
    """

    schemas: dict[str, Any] = field(default_factory=dict)
    partial: bool = False

    def __call__(self, kind: type, name: str = "", **more: Any) -> dict[str, Any]:
        """Return the reference to the table of a class, with its kind `name` in a family."""
        key = "_".join(filter(None, [kind.__name__, name, "changes" if self.partial else ""]))
        if key not in self.schemas:
            self.schemas[key] = {}  # for tables within tables of the same kind
            own = {"kind": {"const": name}} if name else {}
            self.schemas[key] |= self.table(kind, {**own, **more}, list(own))
        return {"$ref": f"#/definitions/{key}"}

    @property
    def changes(self) -> SchemaDefinitions:
        """The same schemas without required keys, for tables that change others."""
        return SchemaDefinitions(self.schemas, True)

    def table(self, kind: type, more: Properties, needed: list[str]) -> dict[str, Any]:
        """Return the schema of the table of a class, with `more` properties."""
        properties = dict(more)
        for each in fields_of(get_text_form(kind)):
            for key, schema in each.spec.properties(each.name, self).items():
                properties[key] = _add_description(each, schema)
        needed = [*needed, *(each.name for each in fields_of(get_text_form(kind)) if each.required)]
        needed = [] if self.partial else [key for key in needed if key in properties]
        about = (kind.__doc__ or "").split("\n")[0]
        schema_of_table = {"type": "object", "description": about, "properties": properties}
        return {**schema_of_table, "required": needed, "additionalProperties": False}


def json_schema(kind: type, **more: Any) -> dict[str, Any]:
    """Return the JSON Schema of the table of a class, with `more` required properties."""
    define = SchemaDefinitions()
    top = define.table(kind, more, list(more))
    return {"$schema": DRAFT, **top, "definitions": define.schemas}


def _add_description(each: DeclaredField, schema: dict[str, Any]) -> dict[str, Any]:
    """Return a schema with the meaning of its field; a reference allows no other keys."""
    if not each.meaning or "$ref" in schema or "description" in schema:
        return schema
    return {**schema, "description": each.meaning}
