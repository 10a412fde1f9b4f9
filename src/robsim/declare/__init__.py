"""Declarations of fields, and the checks, texts, schemas and documents that follow from them.

A frozen dataclass declares a field by its annotation, `Annotated[float, Length(above=0), "Radius of
the sphere."]`, and `register("feature", "my_feature")` gives the class a name. RobSim derives from
the declaration the checks of values, the keys in TOML files, the dotted names, the JSON Schema and
the documentation.
"""

from robsim.declare.choices import KindOf as KindOf
from robsim.declare.fields import DeclaredValue as DeclaredValue
from robsim.declare.fields import PerRun as PerRun
from robsim.declare.fields import Role as Role
from robsim.declare.fields import check_fields as check_fields
from robsim.declare.fields import fields_of as fields_of
from robsim.declare.kind_families import families as families
from robsim.declare.kind_families import family as family
from robsim.declare.kind_families import register as register
from robsim.declare.lists import ListOf as ListOf
from robsim.declare.parameter_docs import described as described
from robsim.declare.quantities import Angle as Angle
from robsim.declare.quantities import Length as Length
from robsim.declare.quantities import Quantity as Quantity
from robsim.declare.quantities import Time as Time
from robsim.declare.quantities import Vector as Vector
from robsim.declare.scalars import Flag as Flag
from robsim.declare.scalars import Integer as Integer
from robsim.declare.scalars import Number as Number
from robsim.declare.tables import Table as Table
from robsim.declare.texts import Name as Name
from robsim.declare.texts import Text as Text
from robsim.declare.texts import Word as Word
from robsim.declare.union import OneOf as OneOf
