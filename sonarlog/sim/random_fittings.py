"""What stands in random places and what their walls are made of: pillars, niches, doors, glass.

Must not know: what kinds of places there are.
"""

from sonarlog.sim.outline import Stretch, box, niche, pane
from sonarlog.sim.random_place import Dice, Place, clear, replaced
from sonarlog.sim.world import Material


def pillars(dice: Dice, place: Place, hall: Stretch) -> None:
    """Round and square ones, wherever they leave the tour room."""
    placed: list[tuple[float, float]] = []
    for _ in range(dice.whole(14, 30)):
        x, y = hall.at(
            dice.between(0.8, hall.leg.length - 0.8), dice.between(0.8 - hall.leg.right, hall.leg.left - 0.8)
        )
        size, turned, is_round = dice.between(0.2, 0.6), dice.whole(0, 89), dice.chance(0.5)
        if any((x - px) * (x - px) + (y - py) * (y - py) < 1.4 for px, py in placed):
            continue
        pillar = [] if is_round else [box(x, y, (size, dice.between(0.2, 0.6)), turned, "plaster")]
        poles = [(x, y, size / 2)] if is_round else []
        if clear(place, [edge for outline in pillar for edge in outline], poles):
            place.outlines += pillar
            place.poles += poles
            placed.append((x, y))


def let_in(dice: Dice, place: Place) -> None:
    """Niches, doors set back, and piers, into a share of the long walls; into those of narrow ways none."""
    share = 0.0 if place.narrow else dice.between(0.1, 0.7)
    for outline in place.outlines[:2]:
        for edge in list(outline):
            if edge.length < 2.4 or not dice.chance(share):
                continue
            width, along = dice.between(0.8, 1.4), dice.between(0.3, edge.length - 1.8)
            depth = dice.between(0.08, 0.2) if dice.chance(0.6) else dice.between(0.25, 0.6)
            if dice.chance(0.2):
                depth, width = -dice.between(0.08, 0.2), dice.between(0.25, 0.6)
            pieces = niche(edge, along, width, depth, "door" if 0 < depth < 0.25 else "plaster")
            if depth > 0 or clear(place, pieces):
                n = next(k for k, other in enumerate(outline) if other is edge)
                replaced(outline, place.outlines, n, pieces)


def glaze(dice: Dice, place: Place) -> None:
    """Glass in some walls: of each place one or two sorts. What never answers is short, for robots run into it."""
    share = dice.between(0.0, 0.6)
    sorts = [place.glass[dice.whole(0, len(place.glass) - 1)] for _ in range(dice.whole(1, 2))]
    for outline in place.outlines[:2]:
        for edge in list(outline):
            if edge.length < 1.6 or edge.material != "plaster" or not dice.chance(share):
                continue
            sort = sorts[dice.whole(0, len(sorts) - 1)]
            width = dice.between(0.8, min(edge.length - 0.3, 1.4 if sort == "silent" else 5.0))
            along = dice.between(0.1, edge.length - width - 0.1)
            n = next(k for k, other in enumerate(outline) if other is edge)
            outline[n : n + 1] = pane(edge, along, width, sort)


def materials(dice: Dice) -> dict[str, Material]:
    """What the place is made of, by name; each sort of glass as poor as the dice say."""
    return {
        "plaster": Material(dice.between(12.5, 15.0)),
        "door": Material(15.0),
        "post": Material(dice.between(7.0, 14.0), dice.between(0.7, 1.0)),
        "silent": Material(12.5, 0.0),
        "seldom": Material(12.5, dice.between(0.1, 0.5)),
        "narrow": Material(dice.between(3.0, 6.0)),
    }
