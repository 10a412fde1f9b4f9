"""Protocols of objects of a user, checked by their attributes."""

import inspect


def implements(value: object, protocol: type) -> bool:
    """Return whether an object has the public methods and attributes of a protocol.

    `isinstance` of Python 3.12 and later ignores attributes that `__getattr__` supplies.

    >>> from robsim.features import Points
    >>> from robsim.features.feature import Feature
    >>> class Proxy:
    ...     def __getattr__(self, name):
    ...         return getattr(Points(), name)
    >>> implements(Proxy(), Feature), implements(Points, Feature), implements(3, Feature)
    (True, False, False)
    """
    if isinstance(value, type):
        return False
    return all(hasattr(value, name) for name in list_members(protocol))


def list_members(protocol: type) -> list[str]:
    """Return the names of the public methods and attributes of a protocol, as it declares them."""
    return [
        name
        for base in protocol.__mro__
        if getattr(base, "_is_protocol", False)
        for name in vars(base)
        if not name.startswith("_")
    ]


def describe_protocol(protocol: type) -> str:
    """Return a phrase with the public members of a protocol.

    >>> from robsim.features.feature import Feature
    >>> describe_protocol(Feature)
    'an object with unit, tolerance and measure(seen)'
    """
    members = [_format_member(name, getattr(protocol, name)) for name in list_members(protocol)]
    if not members:
        return "an object of a class of your own"
    *most, last = members
    return f"an object with {', '.join(most)} and {last}" if most else f"an object with {last}"


def _format_member(name: str, member: object) -> str:
    """Return a name, and the parameters if the member is a method."""
    if not inspect.isfunction(member):
        return name
    return f"{name}({', '.join(list(inspect.signature(member).parameters)[1:])})"
