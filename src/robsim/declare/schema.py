"""A JSON Schema of declared classes, by which editors complete and check TOML files."""

from __future__ import annotations

from typing import Any

from robsim.declare.fields import Field, fields_of
from robsim.declare.tables import form_of

DRAFT = "http://json-schema.org/draft-07/schema#"


def json_schema(kind: type[Any], **more: Any) -> dict[str, Any]:
    """Return the JSON Schema of the table of a class, with `more` properties."""
    definitions: dict[str, Any] = {}

    def define(each: type[Any], name: str = "") -> dict[str, Any]:
        key = f"{each.__name__}_{name}" if name else each.__name__
        if key not in definitions:
            definitions[key] = {}  # for tables within tables of the same kind
            definitions[key] |= _table(each, name, define)
        return {"$ref": f"#/definitions/{key}"}

    top = _table(kind, "", define)
    top["properties"] = {**more, **top["properties"]}
    return {"$schema": DRAFT, **top, "definitions": definitions}


def _table(kind: type[Any], name: str, define: Any) -> dict[str, Any]:
    properties: dict[str, Any] = {"kind": {"const": name}} if name else {}
    for each in fields_of(form_of(kind)):
        for key, schema in each.spec.properties(each.name, define).items():
            properties[key] = _described(each, schema)
    needed = [each.name for each in fields_of(form_of(kind)) if each.required]
    needed = [key for key in needed if key in properties]
    about = (kind.__doc__ or "").split("\n")[0]
    made = {"type": "object", "description": about, "properties": properties}
    return {**made, "required": needed, "additionalProperties": False}


def _described(each: Field, schema: dict[str, Any]) -> dict[str, Any]:
    """Return a schema with the meaning of its field; beside a reference nothing may stand."""
    if not each.meaning or "$ref" in schema:
        return schema
    return {**schema, "description": each.meaning}
