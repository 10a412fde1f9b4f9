"""Where bodies that drive or fly are, from the messages of /tf."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from typing import Any, NamedTuple

from robsim.logs.called import names_called
from robsim.logs.joints import Named
from robsim.logs.roaming import roamers
from robsim.logs.transforms import Transforms
from robsim.world.scene import Scene

WORLD = "world"


class Moved(NamedTuple):
    """Coordinates of a body, and the time in nanoseconds of the transform; zero if it says none."""

    time: int
    joints: Named


class Places:
    """The bodies of a scene that drive or fly, and the frames that say where they are.

    called  {coordinate of the scene: its name in the messages}, where they differ
    frames  {"world" or "ROBOT.LINK": frame in the messages}, likewise

    InputError: a frame that does not move so.
    """

    def __init__(self, scene: Scene, called: Mapping[str, str], frames: Any) -> None:
        own = roamers(scene, called)
        framed = _frames_called(frames, [each.frame for each in own])
        self.transforms = Transforms()
        self._root = framed.get(WORLD, WORLD)
        self._bodies = [(framed.get(each.frame, each.frame), each) for each in own]
        self._last: dict[str, list[float]] = {}

    def __bool__(self) -> bool:
        return bool(self._bodies)

    def leave_out(self, told: Collection[str]) -> None:
        """Leave out the bodies of which joints have told a coordinate."""
        self._bodies = [each for each in self._bodies if not set(told) & set(each[1].names)]

    def of(self, name: str) -> str | None:
        """Return the link in the scene that a coordinate moves; None if that is none of these."""
        return next((body.frame for _, body in self._bodies if name in body.names), None)

    def still(self, what: str, transforms: Iterable[Any]) -> None:
        """Take transforms that do not change. FileError: one is no pose."""
        self.transforms.take(what, transforms, moving=False)

    def take(self, what: str, transforms: Iterable[Any]) -> Iterator[Moved]:
        """Take transforms, and yield the coordinates of each body that they move.

        Those of other frames on the way to the world count as they were last, and move nothing.
        FileError: one is no pose.
        """
        times = self.transforms.take(what, transforms)
        for frame, body in self._bodies:
            moved = self.transforms.moves_with(frame, self._root)
            T = self.transforms.pose(frame, self._root)
            if moved in times and T is not None:
                self._last[frame] = body.coordinates(what, T, self._last.get(frame, ()))
                yield Moved(times[moved], Named(body.names, position=self._last[frame]))


def _frames_called(frames: Any, links: list[str]) -> Mapping[str, str]:
    """Return what a bag calls the world and the links of bodies. InputError: there is no such."""
    form, known = "{frame: frame in the bag}", [WORLD, *links]
    called = names_called(frames, "frames", form, known, "no {} that roams", "frames")
    return {name: own.removeprefix("/") for name, own in called.items()}
