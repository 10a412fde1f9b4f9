"""Random requests to the session of a studio and to a teach pendant, valid and damaged."""

import json
import warnings
from functools import cache

import numpy as np
from attack.harness import Wrong
from studio.page_model import PageModel

from robsim import Experiment, examples, load_scenario, robots
from robsim.geometry.pose import Pose
from robsim.studio.live_explanation import explain_live_run
from robsim.studio.pendant.pendant_session import PendantSession
from robsim.studio.scenario_shelf import ScenarioShelf
from robsim.studio.session import Session
from robsim.studio.web.app import UnavailableDownload
from robsim.studio.web.page_messages import BadMessage, parse_page_message
from robsim.studio.workbench import Workbench

NAME, PATIENCE = "studio requests", 900.0
LARGEST, REQUESTS, PAUSES = 65_536, 40, 8  # bytes; requests of a case; shares of steps
ODD = [None, True, "", "x" * 3000, "nonsense", -1, 0, 1e308, -1e308, 2**53, 1e-320, 0.5]
ODD += [[], {}, [[]], [None, None], {"": None}, {"task.gain": [1]}, ["task.gain"], "\ud83e", "0/0"]
FILES = ["experiment.toml", "experiment.py", "run.nc", "run.html", "no.file", "../x"]
ARMS = ["planar_2r", "panda", "ur5e", "pan_tilt", "scara", "gantry", "mobile_arm", "car"]


class Page(PageModel):
    """A page that does not accept messages outside of the promises of a studio."""

    def __init__(self, messages=()):
        self.controls = {}
        super().__init__(messages)

    def _apply(self, message):
        kind = super()._apply(message)
        if kind in ("controls", "values"):
            if kind == "controls" and not message["from"]:
                self.controls = {}
            self.controls |= {each["path"]: each for each in message["controls"]}
        return kind

    def hear(self, messages):
        """Check and apply messages."""
        told = list(messages)
        for text in told:
            check_message(text)
        return super().hear(told)


def check_message(text):
    """Raise Wrong if a message is too large, or has a number that is not finite."""
    size = len(text.encode())
    message = json.loads(text, parse_constant=refuse_constant)
    if size > LARGEST:
        raise Wrong(f"{message['type']} of {size} bytes")


def refuse_constant(name):
    raise Wrong(f"{name} in a message")


@cache
def names():
    return sorted(examples.names())


@cache
def shelf():
    return ScenarioShelf.shipped()


def pick(rng, among):
    among = list(among)
    return among[int(rng.integers(len(among)))] if among else None


def case(seed):
    """Send requests to a session, or to a pendant; return whether one was accepted."""
    rng = np.random.default_rng(seed)
    place = seed % (len(names()) + 1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return attack_pendant(rng) if place == len(names()) else attack_session(rng, names()[place])


def attack_session(rng, name):
    """Send random requests to a session; then undo all, and compare with the start."""
    session = Session(Workbench(load_scenario(examples.path(name))), shelf())
    mission = session.bench.pair is None
    page, taken, sent = Page(), 0, []
    session.broadcast = lambda text: page.hear([text])
    session.send_news()
    try:
        for _ in range(6 if mission else REQUESTS):
            request = draw_request(rng, session.bench)
            sent.append(request)
            taken += handle_request(rng, session, request)
            check_page(session, page)
        check_files(rng, session)
        undo_all(session)
        check_page(session, Page(session.hello()))
    except Exception as error:
        text = json.dumps(sent[-3:])
        raise Wrong(f"{name}: {type(error).__name__}: {error}; after {text}"[:1500]) from error
    return taken > 0


def handle_request(rng, session, request):
    """Handle a request as the thread of a session does; return whether it was accepted."""
    session._handle_requests(receive(request))
    if "internal error" in session.note:
        raise Wrong(session.note)
    if session.bench.pair is not None:
        for _ in range(int(rng.integers(PAUSES)) ** 2):
            session.bench.step()
        if session.bench.idle and rng.random() < 0.2:
            live = session.bench.pair.live
            session.bench.explain(explain_live_run(session.bench.experiment, live, trials=False))
    session.send_news()
    return not session.note


def receive(request):
    """Return the request as the server hands it on; none if it is no message."""
    try:
        return [parse_page_message(json.dumps(request).encode())]
    except BadMessage:
        return []


def draw_request(rng, bench):
    """Return a valid request, or one that is damaged."""
    request = pick(rng, REQUESTS_OF_A_HAND)(rng, bench)
    return damage(rng, request) if rng.random() < 0.2 else request


def damage(rng, request):
    """Return a request with one odd part."""
    name, value = next(iter(request.items()))
    way = int(rng.integers(5))
    if way == 0:
        return {pick(rng, ["", "sett", "open", "run", "step", "speed", "play"]): value}
    if way == 1 or not isinstance(value, list | dict) or not value:
        return {name: pick(rng, ODD)}
    if isinstance(value, dict):
        return {name: {**value, pick(rng, [*value, "task.nothing"]): pick(rng, ODD)}}
    changed, i = list(value), int(rng.integers(len(value)))
    if way == 2:
        del changed[i]
    elif way == 3 and isinstance(changed[i], list) and changed[i]:
        changed[i] = list(changed[i])
        changed[i][int(rng.integers(len(changed[i])))] = pick(rng, ODD)
    else:
        changed[i] = pick(rng, ODD)
    return {name: changed}


def draw_value(rng, control):
    """Return a value for a control, mostly within its bounds."""
    if control.form == "flag":
        return bool(rng.integers(2))
    if control.form == "choice":
        return pick(rng, control.options)
    if control.form == "list":  # the items that are kept, and a kind to add
        kept = [i for i in range(len(control.value)) if rng.random() < 0.7]
        return kept if kept and rng.random() < 0.5 else [*kept, pick(rng, control.options)]
    low, high = (np.array(each, dtype=float) for each in (control.low, control.high))
    share = pick(rng, [rng.random(low.shape), np.round(rng.random(low.shape)), 1.2])
    near = np.array(control.value, dtype=float) + 0.05 * (high - low) * rng.normal(size=low.shape)
    value = pick(rng, [low + (high - low) * share, near, near])
    if control.form == "whole":
        return int(np.nan_to_num(value, posinf=9, neginf=0))
    return np.nan_to_num(value, nan=0.0).tolist()


def draw_setting(rng, bench):
    control = bench.controls[pick(rng, sorted(bench.controls))]
    return control.path, draw_value(rng, control)


def drag_handle(rng, bench):
    handle = pick(rng, bench.handles)
    if handle is None:
        return {"drag": ["goal", [0.0] * 7]}
    far = pick(rng, [0.005, 0.03, 0.3])
    pose = Pose.from_quaternion(handle.pose[:3], handle.pose[3:])
    moved = Pose.at(*rng.normal(0.0, far, 3)) @ pose @ Pose.at(rotvec=rng.normal(0.0, far, 3))
    return {"drag": [handle.name, [*moved.position.tolist(), *moved.quaternion.tolist()]]}


def compare_scheme(rng, bench):
    return {"second": pick(rng, [None, list(draw_setting(rng, bench))])}


def ask_matrix(rng, bench):
    count = len(bench.pair.live.instants) if bench.pair else 3
    return {"interaction": int(rng.integers(count + 1))}


REQUESTS_OF_A_HAND = [
    *[lambda rng, bench: {"set": list(draw_setting(rng, bench))}] * 4,
    *[drag_handle] * 3,
    *[lambda rng, bench: {"undo": True}] * 2,
    lambda rng, bench: {"redo": True},
    compare_scheme,
    ask_matrix,
    lambda rng, bench: {"change": dict(draw_setting(rng, bench) for _ in range(2))},
    lambda rng, bench: {"show_goal": pick(rng, ["anew", "here"])},
    lambda rng, bench: {"reset": True},
    lambda rng, bench: {"original": True},
    lambda rng, bench: {pick(rng, ["step", "play", "speed"]): pick(rng, [1, True, 0.5, 30])},
]


def check_page(session, page):
    """Raise Wrong if a page does not show the values and the poses in effect."""
    bench = session.bench
    for path, control in bench.controls.items():
        shown = page.controls.get(path, {}).get("value")
        if control.form == "number" and not np.isfinite(control.value):
            continue  # null
        if shown != control.value and not isinstance(control.value, list | tuple):
            raise Wrong(f"{path} is {control.value}, shown {shown}")
    if page.controls.keys() != bench.controls.keys():
        raise Wrong(f"controls: {page.controls.keys() ^ bench.controls.keys()}")
    if bench.pair is not None:
        times = [each.time for each in bench.pair.live.instants]
        if not np.allclose(page.arrays["time"], times, rtol=1e-6, atol=1e-6):
            raise Wrong("the page has other instants than the run")
        true = [each["group"] == "true" for each in page.header["frames"]]
        shown = page.arrays["poses"][-1, :, :][: len(true)][np.flatnonzero(true)]
        if not np.isfinite(shown).all():
            raise Wrong("a frame of the scene has no pose")


def check_files(rng, session):
    """Raise Wrong if a file of the session is another experiment."""
    with_text = session.bench.saved_experiment()
    try:
        stored = Experiment.from_text(session.download("experiment.toml")[1].decode())
    except UnavailableDownload:
        return
    if stored != with_text:
        raise Wrong("the saved file is another experiment")
    try:
        session.download(pick(rng, FILES))
    except UnavailableDownload as error:
        if not str(error):
            raise Wrong("a file is refused without a reason") from None


def undo_all(session):
    """Undo every edit; raise Wrong unless the experiment is the original."""
    bench = session.bench
    while bench.history.before is not None:
        note = session.do({"undo": True})
        if note:
            raise Wrong(f"undo: {note}")
    if bench.edited or bench.differences or bench.second:
        raise Wrong(f"after all is undone: {bench.differences}, {dict(bench.second)}")
    session.send_news()


@cache
def arm(name):
    return getattr(robots, name)()


def attack_pendant(rng):
    """Send random requests to a teach pendant; then undo all, and compare with the start."""
    session, sent = PendantSession(arm(pick(rng, ARMS))), []
    session.broadcast = check_message
    session.start()
    session.close()
    start, taken = session.pendant.q.copy(), 0
    try:
        for _ in range(REQUESTS):
            request = draw_pendant_request(rng, session.pendant)
            request = damage(rng, request) if rng.random() < 0.2 else request
            sent.append(request)
            session.note = "".join(session.do(each) for each in receive(request))
            if "internal error" in session.note:
                raise Wrong(session.note)
            session._send_news()
            taken += not session.note
        while session.pendant.can_undo:
            session.pendant.undo()
        if not np.array_equal(session.pendant.q, start):
            raise Wrong("after all is undone the arm is elsewhere")
    except Exception as error:
        text = json.dumps(sent[-3:])
        raise Wrong(f"{type(error).__name__}: {error}; after {text}"[:1500]) from error
    return taken > 0


def draw_pendant_request(rng, pendant):
    """Return a request of the page of a pendant."""
    stroke, count = int(rng.integers(5)), len(pendant.fields)
    joint = int(rng.integers(count))
    tool = pendant.base @ pendant.tool
    moved = Pose.at(*rng.normal(0.0, 0.1, 3)) @ tool @ Pose.at(rotvec=rng.normal(0.0, 0.2, 3))
    pose = [*moved.position.tolist(), *moved.quaternion.tolist()]
    index = int(rng.integers(4))
    return pick(
        rng,
        [
            {"joint": [joint, float(rng.normal(0, 90)), stroke]},
            {"drag": [pose, stroke]},
            {"drag": [pose, stroke]},
            {"tool": [int(rng.integers(6)), float(rng.normal(0, 50))]},
            {"link": pick(rng, [link.name for link in pendant.robot.links])},
            {"lead": pick(rng, ["position", "pose", "pointing"])},
            {"record": True},
            {"record": True},
            {"go": index},
            {"remove": index},
            {"rename": [index, f"p{stroke}"]},
            {"reorder": [index, stroke]},
            {"pace": [float(rng.random()), pick(rng, [None, 1.0, 20.0])]},
            {"replay": True},
            {"load": pick(rng, ["name,a\np,1", "", "name;x", "\0"])},
            {pick(rng, ["undo", "redo", "home"]): True},
        ],
    )
