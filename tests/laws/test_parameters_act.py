"""Every declared field of every kind acts: another value changes the results, or is refused.

No kind or field is excused by a list. Fields that only people read are declared so (`Role`);
a field of figures, of files or of the controller changes these instead.
"""

from copy import deepcopy

import pytest
from acting import results, same
from recipes import recipes

import robsim as rs
from robsim.declare import Role, families, fields_of
from robsim.declare.schema import SchemaDefinitions
from robsim.declare.tables import get_text_form
from robsim.run.experiment_text import ExperimentTable
from robsim.servo.feature_block import FeatureBlock
from robsim.studies.study_text import StudyTable

LABELS = ("title", "about", "sources", "color", "name")


class Met(SchemaDefinitions):
    """The definitions of a schema, which note the classes that they meet."""

    def table(self, kind, more, needed):
        self.schemas.setdefault("", []).append(get_text_form(kind))
        return super().table(kind, more, needed)

    @property
    def changes(self):
        return self


def declared():
    """{label: class} of all declared classes: kinds by family and name, others by their name."""
    found = {
        f"{noun} {name}": get_text_form(kind)
        for noun, family in families().items()
        for name, kind in family.kinds.items()
        if kind.__module__.startswith("robsim.")
    }
    met = Met()
    for kind in (ExperimentTable, StudyTable):
        met(kind)
    kinds = [*met.schemas[""], FeatureBlock]
    found |= {kind.__name__: kind for kind in kinds if kind not in set(found.values())}
    return {label: kind for label, kind in found.items() if fields_of(kind)}


KINDS = declared()
SLOW = ("start", "sampler")  # studies
# kinds that need the extra `vision`: tests/peers/test_vision_parameters.py
NEED_VISION = tuple(f"mark detector {name}" for name in ("keypoints", "tags", "tag_tracker"))
EACH = [
    pytest.param(x, marks=[pytest.mark.full] * x.startswith(SLOW))
    for x in sorted(set(KINDS) - set(NEED_VISION))
]


FEW = ("points", "segments", "points_3d", "theta_u")  # with depth and without
DEEP = [
    pytest.param(x, marks=[pytest.mark.full] * (x not in FEW)) for x in families()["feature"].names
]


def effects(label):
    """{field: effect} of a class, the best of all its recipes, and the changes tried in vain."""
    cases, found, dead = recipes(label), {}, {}
    for each in fields_of(KINDS[label]):
        if each.role is Role.LABEL:
            continue
        found[each.name] = "dead"
        for case in cases:
            effect, tried = case.effect(each)
            if effect == "acts":
                found[each.name] = effect
                break
            if effect == "refused":
                found[each.name] = effect
            elif found[each.name] == "dead":
                dead[each.name] = tried
        if found[each.name] != "dead":
            dead.pop(each.name, None)
    return found, dead


@pytest.mark.filterwarnings("ignore::robsim.errors.RankWarning")
@pytest.mark.parametrize("label", EACH)
@pytest.mark.few(14)
def test_each_field_of_a_kind_acts_or_is_refused(label):
    _, dead = effects(label)
    assert not dead, f"{label}: without effect: {dead}"


def test_only_labels_are_excused(capsys):
    """Titles, descriptions, sources, colours and the names of phases; their number is printed."""
    excused = {
        f"{label}.{each.name}"
        for label, kind in KINDS.items()
        for each in fields_of(kind)
        if each.role is Role.LABEL
    }
    assert {name.rpartition(".")[2] for name in excused} == {*LABELS}
    with capsys.disabled():
        print(f"\n{len(excused)} labels of {sum(len(fields_of(k)) for k in KINDS.values())} fields")


@pytest.mark.filterwarnings("ignore::robsim.errors.RankWarning")
@pytest.mark.parametrize("name", DEEP)
def test_a_depth_acts_on_the_features_that_are_made_with_it_and_others_refuse_it(name):
    (case, *_) = recipes(f"feature {name}")
    tables = deepcopy(case.tables)
    tables["task"]["depth_scale"] = 1.5
    if getattr(families()["feature"].find(name), "uses_depth", True):
        assert not same(results(tables), results(case.tables))
    else:
        with pytest.raises(rs.errors.InputError, match="use no depth: leave depth"):
            results(tables)
