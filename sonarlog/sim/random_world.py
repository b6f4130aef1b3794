"""Places nobody has drawn: a number makes one, for judging what was tuned elsewhere.

Ways of 1.2 to 4 m width with bends of any angle, rooms off them, halls with pillars, ways round a block; niches, doors,
and glass that hardly answers. Same number, same place, on every machine. Must not know: robots, sonar.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

from slam import dmath
from sonarlog.sim.outline import Edge, Leg, Outline, Stretch, from_edge, is_simple, laid, ring, room, strip
from sonarlog.sim.random_fittings import glaze, let_in, materials, pillars
from sonarlog.sim.random_place import WALL_M, Dice, Place, clear, replaced
from sonarlog.sim.random_tour import Tour, Visit
from sonarlog.sim.world import RANDOM, Pole, Wall, World

_TRIES = 200
_CAP_M = 1.3  # behind the robot, at the start


def random_world(number: int) -> World:
    """The place of that number; its remainder by 5 says what kind of place: rooms, ways, a loop, a hall, ways again."""
    dice = Dice(number)
    make = _KINDS[number % len(_KINDS)]
    for _ in range(_TRIES):
        place = make(dice)
        if place is not None and clear(place, place.edges()):
            break
    else:
        raise AssertionError(f"no place {number}")  # none of the first hundred thousand numbers comes to this
    of = materials(dice)
    let_in(dice, place)
    glaze(dice, place)
    if dice.chance(0.5):
        place = _mirrored(place)
    walls = [Wall(*edge.start, *edge.end, of[edge.material]) for edge in place.edges()]
    poles = [Pole(x, y, radius, of["post"]) for x, y, radius in place.poles]
    return World(f"{RANDOM}{number}", place.about, place.tour.text, tuple(walls), tuple(poles))


def _ways(dice: Dice) -> Place | None:
    """Two to four legs; between two a bend, or, now and then, another width."""
    width, legs = _width(dice), list[Leg]()
    narrowest = widest = width
    for _ in range(dice.whole(2, 4)):
        length = dice.between(4.0, 8.0)
        if dice.chance(0.75):
            legs.append(Leg(length, width / 2, width / 2, dice.side() * dice.whole(15, 110)))
        else:
            legs.append(Leg(length, width / 2, width / 2))
            width = _width(dice)
            narrowest, widest = min(narrowest, width), max(widest, width)
    legs[-1] = replace(legs[-1], turn=0.0)
    if dmath.ordered_sum(leg.length for leg in legs) > 24.0:
        return None
    stretches = laid(legs, _CAP_M)
    about = f"{len(legs)} ways of {narrowest:g} to {widest:g} m width, bends of {_angles(legs)}"
    return _place(about, stretches, [() for _ in legs])


def _rooms(dice: Dice) -> Place | None:
    """A straight way with two or three rooms off it, which the tour goes into."""
    width = dice.between(1.5, 2.2)
    (stretch,) = laid([Leg(dice.between(9.0, 13.0), width / 2, width / 2)], _CAP_M)
    outline = strip([stretch], "plaster")
    visits: list[Visit] = []
    along = dice.between(2.5, 3.5)
    while along < stretch.leg.length - 1.8 and len(visits) < 3:
        visit = _add_room(dice, outline, stretch, along, dice.side())
        if visit is not None:
            visits.append(visit)
        along += dice.between(3.2, 4.4)
    if len(visits) < 2:
        return None
    place = _place(f"way of {width:g} m width, {len(visits)} rooms off it", [stretch], [tuple(visits)])
    # Between two rooms the way is found by its walls: they have to be heard.
    return place and replace(place, outlines=[outline], glass=("narrow",))


def _loop(dice: Dice) -> Place | None:
    """Round a block with four or six corners, opposite ones alike, and some metres more."""
    width = dice.between(1.4, 2.6)
    corners = dice.whole(2, 3)
    turns = [dice.whole(65, 115)] if corners == 2 else [dice.whole(45, 75), dice.whole(45, 75)]
    turns.append(180 - sum(turns))
    half = [Leg(dice.between(5.0, 9.0), width / 2, width / 2, turn) for turn in turns]
    stretches = laid([*half, *half], 2.0)
    without, within = ring(stretches, "plaster")
    if min(edge.length for edge in within) < 1.5 or not is_simple(within, 1.0):
        return None
    tour = Tour()
    for i, stretch in enumerate(stretches):
        tour.along(stretch, 2.0 if i == 0 else 0.0, stretch.leg.length)
        tour.turn(stretch.leg.turn)
    tour.along(stretches[0], 0.0, 3.5)
    tour.steps.append("scan")
    about = f"way of {width:g} m width round a block of {2 * corners} corners"
    return Place(about, [without, within], tour, [], width < 1.7)


def _hall(dice: Dice) -> Place | None:
    """A way into a hall with pillars, a look to one side, and a way out."""
    width = dice.between(2.0, 3.2)
    into, hall, out = dice.between(3.0, 5.0), dice.between(6.0, 9.0), dice.between(2.5, 5.0)
    left, right = dice.between(2.2, 4.5), dice.between(2.2, 4.5)
    legs = [Leg(into, width / 2, width / 2), Leg(hall, left, right), Leg(out, width / 2, width / 2)]
    if dice.chance(0.5):
        bend = dice.side() * dice.whole(20, 100)
        legs = [*legs[:2], replace(legs[2], turn=bend), Leg(dice.between(3.0, 5.0), width / 2, width / 2)]
    side = dice.side()
    deep = round((left if side > 0 else right) - dice.between(0.9, 1.4), 2)
    look = Visit(round(hall * dice.between(0.35, 0.65), 2), side, deep)
    stretches = laid(legs, _CAP_M)
    about = f"hall of {hall:g} × {left + right:g} m with pillars, ways of {width:g} m width"
    place = _place(about, stretches, [(), (look,), *(() for _ in legs[2:])], wide=1)
    if place is not None:
        pillars(dice, place, stretches[1])
    return place


_KINDS: tuple[Callable[[Dice], Place | None], ...] = (_rooms, _ways, _loop, _hall, _ways)


def _place(
    about: str, stretches: Sequence[Stretch], visits: Sequence[tuple[Visit, ...]], wide: int | None = None
) -> Place | None:
    """The strip along the stretches and the tour through it; None where it meets itself. `wide`: the hall's number."""
    outline = strip(stretches, "plaster")
    if not is_simple(outline, WALL_M):
        return None
    tour = Tour()
    for i, stretch in enumerate(stretches):
        end = stretch.leg.length - (1.0 if stretch is stretches[-1] else 0.0)
        tour.along(stretch, _CAP_M if i == 0 else 0.0, end, visits[i], hall=i == wide)
        if stretch.leg.turn:
            tour.turn(stretch.leg.turn)
    tour.steps.append("scan")
    narrow = any(stretch.leg.left + stretch.leg.right < 1.7 for stretch in stretches)
    return Place(about, [outline], tour, [], narrow)


def _add_room(dice: Dice, outline: Outline, stretch: Stretch, along: float, side: int) -> Visit | None:
    """Let a room into the wall beside that place of a way; None where there is no wall, or no space behind it."""
    door, jamb = dice.between(1.0, 1.3), dice.between(0.1, 0.2)
    size = (dice.between(0.3, 1.6), dice.between(0.3, 1.6), dice.between(1.6, 2.5))
    half = stretch.leg.left if side > 0 else stretch.leg.right
    middle = stretch.at(along, side * half)
    for n, edge in enumerate(outline):
        ux, uy = (edge.end[0] - edge.start[0]) / edge.length, (edge.end[1] - edge.start[1]) / edge.length
        parallel = abs(ux * stretch.uy - uy * stretch.ux) < 1e-6
        at = (middle[0] - edge.start[0]) * ux + (middle[1] - edge.start[1]) * uy - door / 2
        if parallel and from_edge(middle, edge) < 1e-6 and at >= 0.2 and at + door <= edge.length - 0.2:
            if replaced(outline, [outline], n, room(edge, at, door, jamb, size)):
                return Visit(round(along, 2), side, round(half + jamb + size[2] - dice.between(0.8, 1.2), 2))
            return None
    return None


def _mirrored(place: Place) -> Place:
    outlines = [[Edge((e.start[0], -e.start[1]), (e.end[0], -e.end[1]), e.material) for e in o] for o in place.outlines]
    return Place(place.about, outlines, place.tour.mirrored(), [(x, -y, radius) for x, y, radius in place.poles])


def _width(dice: Dice) -> float:
    """Of a way: narrow ones as often as wide ones."""
    return dice.between(1.2, 2.0) if dice.chance(0.5) else dice.between(2.0, 4.0)


def _angles(legs: Sequence[Leg]) -> str:
    return ", ".join(f"{abs(leg.turn):g}°" for leg in legs if leg.turn) or "no angle"
