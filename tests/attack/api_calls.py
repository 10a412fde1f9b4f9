"""Every public call with right, swapped and odd arguments; observations and states of odd sizes."""

import inspect
import warnings

import numpy as np
from attack.doors.odd import odd
from attack.doors.right import FEATURES, OBJECTS, OWN, RIGHT, made, observed, state
from attack.harness import Wrong

import robsim as rs
from robsim import classic

NAME = "api calls"
DOORS = ("classic", "examples", "robots", "testing", "trajectory", "units")  # with functions of own
BUILT = ("declare", "plot")  # specs of fields, and figures
INNER = (  # of the kernels' layout, or of files: not for users
    "stages", "is_own", "of_last", "blind", "repeated", "some", "image_of", "points_of",
    "of_runs", "facts", "wrap", "count", "text_check", "bind", "bound_law", "select_velocities",
    "columns", "bind_features", "shaping", "sights", "warn_of_wheels", "with_inner", "loop",
    "dataset", "checked", "simulated", "change_attachments", "constants", "fits", "source_limits",
    "limits", "following", "with_prefix", "bounds", "check", "scaled", "concerns", "periods",
    "drift", "guard",
)  # fmt: skip
SLOW = (
    "explain", "equilibria", "sample_workspace", "compare", "clearance", "run", "ik", "simulate",
    "replay", "bench",
)  # fmt: skip
RESULTS = ("HomographyMotions", "PoseEstimate", "Triangulation", "IKResult", "ClosedFormIK")


def _is_call(value):
    ours = getattr(value, "__module__", "").startswith("robsim")
    return ours and callable(value) and not (inspect.isclass(value) and _is_no_value(value))


def _is_no_value(kind):
    return issubclass(kind, BaseException | int) or getattr(kind, "_is_protocol", False)


def _calls():
    """Return the public calls: names with functions of no argument that return the callable."""
    found = {}
    modules = {name: getattr(rs, name) for name in dir(rs) if inspect.ismodule(getattr(rs, name))}
    modules["classic"] = classic  # a module that is imported by itself
    for name in DOORS:
        found |= _functions(name, modules[name])
    found |= _functions("curves", rs.shapes.curves)
    words = [rs, *(module for name, module in modules.items() if name not in (*DOORS, *BUILT))]
    for name, value in ((name, getattr(each, name)) for each in words for name in dir(each)):
        if not name.startswith("_") and _is_call(value):
            found[name] = lambda value=value: value
            found |= _methods(name, value)
    return found


def _functions(name, module):
    """Return the calls that a module defines."""
    parts = {part: value for part, value in vars(module).items() if not part.startswith("_")}
    own = {part: value for part, value in parts.items() if _is_call(value)}
    return {
        f"{name}:{part}": lambda call=call: call
        for part, call in own.items()
        if call.__module__ == module.__name__
    }


def _methods(name, kind):
    """Return the methods of a class that is made by `OBJECTS`, or those that make one."""
    found = {}
    for part, method in inspect.getmembers(kind) if inspect.isclass(kind) else ():
        if part.startswith("_") or part in INNER or not callable(method):
            continue
        if inspect.ismethod(method):
            found[f"{name}.{part}"] = lambda method=method: method
        elif name in OBJECTS:
            found[f"{name}.{part}"] = lambda part=part: getattr(OBJECTS[name](), part)
    return found


CALLS = _calls()
NAMES = sorted(CALLS)


def case(seed):
    """Try one call."""
    rng = np.random.default_rng(seed)
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        try:
            return (_sizes if rng.random() < 0.4 else _call)(rng)
        except rs.RobSimError as error:
            if "\n" in str(error) and len(str(error)) > 2000:
                raise Wrong(f"a message of {len(str(error))} characters") from None
            return False


def _call(rng):
    name = NAMES[rng.integers(len(NAMES))]
    if name.split(".")[-1] in SLOW and rng.random() < 0.9:
        name = NAMES[rng.integers(len(NAMES))]
    call = CALLS[name]()
    try:
        parameters = inspect.signature(call).parameters.values()
    except ValueError:
        return True
    kinds = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
    parameters = [each for each in parameters if each.kind not in kinds]
    given = {p.name: _right(name, p, rng) for p in parameters if _wanted(p, rng)}
    _spoil(given, rng)
    args = [given.pop(p.name) for p in parameters if p.name in given and p.kind < p.KEYWORD_ONLY
            and p.default is p.empty]  # fmt: skip
    finite = all(map(_is_finite, [*args, *given.values()]))
    found = _performed(name, call, args, given)
    text = f"{inspect.getdoc(call)} {inspect.getdoc(type(found))}"
    if finite and not inspect.isclass(call) and not _is_finite(found) and "NaN" not in text:
        raise Wrong(f"{name}: NaN or infinity from {_shown(args, given)}")
    return True


def _wanted(parameter, rng):
    return parameter.default is parameter.empty or rng.random() < 0.3


def _right(name, parameter, rng):
    short = name.rpartition(":")[2]
    known = OWN.get(f"{short}.{parameter.name}", RIGHT.get(parameter.name, odd))
    return odd(rng) if known is odd else made(known)


def _spoil(given, rng):
    """Let odd values stand for one or two of the right ones, or swap two."""
    names = list(given)
    for _ in range(rng.integers(0, 3)) if names else ():
        name = names[rng.integers(len(names))]
        if rng.random() < 0.2:
            other = names[rng.integers(len(names))]
            given[name], given[other] = given[other], given[name]
        else:
            given[name] = odd(rng)


def _performed(name, call, args, given):
    """Return the result of a call; a TypeError that Python raises as it binds is fine."""
    try:
        return call(*args, **given)
    except rs.RobSimError:
        raise
    except Exception as error:
        if isinstance(error, TypeError) and error.__traceback__.tb_next is None:
            return None
        raise type(error)(f"{name}({_shown(args, given)}): {str(error)[:80]}"[:300]) from error


def _shown(args, given):
    parts = [*map(_short, args), *(f"{key}={_short(value)}" for key, value in given.items())]
    return ", ".join(parts)


def _short(value):
    try:
        return repr(value)[:50].replace("\n", " ")
    except ValueError:
        return "10**400"


def _is_finite(value):
    """Return whether a value contains no NaN and no infinite number."""
    if isinstance(value, list | tuple | set):
        return all(map(_is_finite, value))
    if isinstance(value, rs.Pose):
        value = value.matrix
    if type(value).__name__ in RESULTS:
        return all(map(_is_finite, vars(value).values()))
    if not isinstance(value, float | np.ndarray | np.floating):
        return True
    array = np.asarray(value)
    return array.dtype.kind != "f" or bool(np.isfinite(array).all())


def _sizes(rng):
    """Call features and laws with arrays of odd sizes."""
    act = (_feature, _observation, _law, _state)[rng.integers(4)]
    return act(rng)


def _feature(rng):
    """Call a feature with an observation that it may not be made for."""
    N, B = int(rng.integers(1, 9)), int(rng.integers(1, 4))
    feature = getattr(rs.features, FEATURES[rng.integers(len(FEATURES))])()
    if hasattr(feature, "towards") and rng.random() < 0.6:
        feature = feature.towards(observed(int(rng.integers(1, 9)), int(rng.integers(1, 3))))
    seen = observed(N, B, pair=rng.random() < 0.3)
    return _measured(feature, seen if rng.random() < 0.9 else odd(rng))


def _measured(feature, seen):
    s, L = feature.measure(seen), feature.interaction(seen)
    if s.ndim != 2 or L.shape != (*s.shape, 6):
        raise Wrong(f"{type(feature).__name__}: shapes {s.shape} and {L.shape}")
    return True


def _array(rng, *shape):
    """Return an array of a shape, or of one nearby, or something odd."""
    if rng.random() < 0.05:
        return odd(rng)
    sizes = [n if rng.random() < 0.85 else int(rng.integers(0, 6)) for n in shape]
    if rng.random() < 0.08:
        sizes = sizes[:-1] if rng.random() < 0.5 else [*sizes, 2]
    array = rng.normal(size=sizes)
    if array.size and rng.random() < 0.05:
        array.flat[0] = rng.choice([np.nan, np.inf, 1e300])
    return np.asfortranarray(array) if rng.random() < 0.2 else array


def _observation(rng):
    """Make an observation of arrays of any shape, and let a feature measure it."""
    N, B = int(rng.integers(1, 9)), int(rng.integers(1, 4))
    camera = rs.Camera(np.eye(3)) if rng.random() < 0.95 else odd(rng)
    feature = getattr(rs.features, FEATURES[rng.integers(len(FEATURES))])()
    if rng.random() < 0.5:
        seen = rs.features.Observation.of(_array(rng, B, N, 2), _array(rng, B, N), camera)
    else:
        image = _array(rng, N, 2, B)
        model = None if rng.random() < 0.5 else _array(rng, N, 3)
        guess = None if rng.random() < 0.5 else _array(rng, 3, 4, B)
        seen = rs.features.Observation(image, image, _array(rng, N, B), camera, model, guess)
    return _measured(feature, seen)


def _law(rng):
    """Call a law in a state of any size."""
    k, n, B = int(rng.integers(1, 12)), int(rng.integers(1, 9)), int(rng.integers(1, 4))
    law = (rs.laws.JointLaw(), rs.laws.CameraLaw(), rs.laws.PartitionedLaw())[rng.integers(3)]
    law.command(state(k, n, B) if rng.random() < 0.9 else odd(rng))
    return True


def _state(rng):
    """Call a law in a state of arrays of any shape."""
    k, n, B = int(rng.integers(1, 12)), int(rng.integers(1, 9)), int(rng.integers(1, 4))
    shapes = (k, B), (k, 6, B), (6, n, B), (k, n, B)
    arrays = [_array(rng, *shape) for shape in shapes]
    more = [1.0 if rng.random() < 0.8 else odd(rng), rs.laws.PseudoInverse()]
    asked = rs.laws.ControlState(*arrays, *more, *(_array(rng, m, B) for m in (k, n)))
    law = (rs.laws.JointLaw(), rs.laws.CameraLaw(), rs.laws.PartitionedLaw())[rng.integers(3)]
    law.command(asked)
    return True
