"""The rules beyond the paper, each a static switch that can be turned on or off alone."""

from dataclasses import dataclass, fields, replace

import jax

from adwa_jax.checks import require


@jax.tree_util.register_static
@dataclass(frozen=True)
class Rules:
    """Which rules hold. All off is the paper's method; `presets.preset` has constants for any mix."""

    # Candidates are targets over the whole range of velocities, approached within the acceleration limits as they are
    # predicted (trajectory rollout: Gerkey and Konolige 2008). Off: constant velocities of the window (eq. 6).
    ramp: bool = False
    # Candidates may change their mind once: stop, go on at full speed, straighten, turn the other way. A coarse grid so
    # sees evasive manoeuvres. Off: one velocity over the whole horizon.
    second_phase: bool = False
    # One candidate backs up, at a cost. Off: v ≥ 0.
    reverse: bool = False
    # Admissible: after one step of the command the robot can brake to a halt clear of everything (Fraichard and Asama
    # 2004, inevitable collision states). Predictions end where they touch a static obstacle. Off: clear over the whole
    # horizon, which blocks a robot in clutter.
    stopping: bool = False
    # Predicted movers are watched for longer than the statics. Off: the same horizon for both.
    long_watch: bool = False
    # Movers have terms of their own: time to contact, and clearance to them. Off: one clearance to all.
    mover_terms: bool = False
    # Movers keep a margin that grows with the time they are predicted for. Off: none.
    mover_margin: bool = False
    # Movers are predicted to turn back at the map's border, beyond which all is occupied. Off: they pass through it.
    border: bool = False
    # The local target is a point of the route some way ahead, the farthest that is in sight (pure pursuit: Coulter
    # 1992). Off: the next key point.
    carrot: bool = False
    # Progress along the route, and nearness to it, are terms in the place of speed and of the heading to the goal. Off:
    # eq. 9's terms.
    progress: bool = False
    # Terms are divided by fixed scales. Off: by their sums over the candidates, so that a weight means something else
    # at every step.
    fixed_scale: bool = False
    # Without an admissible candidate the one with the latest contact is taken. Off: brake and turn.
    least_bad: bool = False
    # The route is planned anew where it is blocked by what was sensed, lost from sight, or leads nowhere. Off: one plan
    # for all.
    replan: bool = False
    # The distance field's lattice is 0.1 m or finer. Off: a quarter of a cell.
    fine_field: bool = False

    def only(self, name: str) -> "Rules":
        """No rule but one."""
        return replace(Rules(), **{checked(name): True})

    def without(self, name: str) -> "Rules":
        """These rules but one."""
        return replace(self, **{checked(name): False})


RULE_NAMES = tuple(field.name for field in fields(Rules))
EVERY_RULE = Rules(**dict.fromkeys(RULE_NAMES, True))


def checked(name: str) -> str:
    """The name itself; ValueError if it is no rule's."""
    require(name in RULE_NAMES, "rule", name, f"must be one of {', '.join(RULE_NAMES)}", "choose one of them")
    return name
