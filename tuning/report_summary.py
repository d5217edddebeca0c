"""What a tuning job came to, in words and tables for people who did not run it."""

from collections.abc import Collection, Iterator, Mapping
from typing import Any

import numpy as np

from adwa_jax.episode import Outcome
from tuning.evaluations import Evaluations
from tuning.figures import SENTENCES
from tuning.findings import Choice, Comparison, Findings, Interval, Judgement, Member
from tuning.objectives import RATES, Statistic
from tuning.plans_only import known_of_plans
from tuning.report_figures import in_units, measure_name, name_and_unit, recommended, unit_of
from tuning.report_html import table

SUCCESS = Statistic("success", "max")
NONE = "–"
SEEN = (" Who chose them by these values has seen them: other scenarios tell how good the choice is "
        "(adwa evaluate --weights, another seed).")  # fmt: skip


def verdict(findings: Findings) -> str:
    """Is it better? In one paragraph, by the paired differences on held-out scenarios."""
    best, compared = recommended(findings), findings.compared
    if np.array_equal(best.values, findings.default.values):
        return "The default constants are recommended: by the rule of this job, no candidate was better."
    if compared is None or best.held_out is None:
        return "Not known: nothing was driven on held-out scenarios, and values on training scenarios flatter."
    kinds: dict[str, list[str]] = {"better": [], "worse": [], "not told apart": []}
    for statistic, difference in _differences(findings, compared):
        kinds[reading(statistic, difference)].append(measure_name(statistic))
    better, worse = (" and ".join(kinds[kind]) for kind in ("better", "worse"))
    on, these = f"on {best.held_out.scenarios} scenarios that the search never saw", f"the {findings.picked} constants"
    but = _fewer_successes(best, findings.default, compared.success) + SEEN * (findings.picked == "chosen")
    if better and not worse:
        return f"Yes: {on}, {these} are better in {better}; in nothing are they worse beyond chance.{but}"
    if better:
        return f"In part: {on}, {these} are better in {better} and worse in {worse}.{but}"
    if worse:
        return f"No: {on}, {these} are worse in {worse} and better in nothing beyond chance.{but}"
    return f"Not shown: {on}, no objective differs beyond chance from that of the default constants.{but}"


def _fewer_successes(best: Member, default: Member, difference: Interval) -> str:
    """Where success is less than before, but may be so by chance: how much less it may be. Else empty."""
    if best.held_out is None or default.held_out is None or not difference.value < 0.0 <= difference.high:
        return ""
    before, after = (100 * judged.success.value for judged in (default.held_out, best.held_out))
    return (f" Success is {after:.1f} % in the place of {before:.1f} %: that may be chance, but these scenarios do not "
            f"rule out a loss of {-100 * difference.low:.1f} points.")  # fmt: skip


def reading(statistic: Statistic, difference: Interval) -> str:
    """Of a difference, recommended − default: `better`, `worse` or `not told apart`, by its interval."""
    if not np.all(np.isfinite(difference)) or difference.low <= 0.0 <= difference.high:
        return "not told apart"
    return "better" if statistic.sign * difference.value < 0.0 else "worse"


def honest_reading(findings: Findings) -> str:
    """How far the figures can be trusted: optimism gap, stability, and whether anything beats the default in all."""
    best, choice = recommended(findings), findings.choices[findings.recommended]
    sentences = [
        f"The {findings.picked} constants were picked by the rule “{choice.rule}”: {choice.reason}",
        f"Had other scenarios of the kind been drawn, the rule would have picked the same in {_stable(choice)} of "
        f"cases, and no candidate would have been better in everything in {best.non_dominated:.0%}.",
    ]
    if best.held_out is not None:
        sentences.append(_gap_sentence(best.training, best.held_out))
    if findings.compared is not None:
        sentences.append("Some member of the front beats the default constants in every objective on the held-out "
                         "scenarios that both solve, by its point estimates." if findings.compared.better_on_all
                         else f"No member of the front beats the default constants in every objective on the held-out "
                         f"scenarios. {findings.compared.why_not}".rstrip())  # fmt: skip
    if not best.training.feasible:
        sentences.append(f"On the training scenarios the {findings.picked} constants violate a constraint of the job.")
    return " ".join(sentences)


def what_was_tuned(fields: Mapping[str, Any], findings: Findings, training: Evaluations) -> str:
    """The job in a few sentences. fields: of the job file."""
    planner, method = fields.get("planner") or {}, fields.get("method") or {}
    robot = f" on the robot {planner['robot']}" if planner.get("robot") else ""
    held_out = fields.get("held_out")
    unseen = f"held out: {suites_sentence(held_out)}" if held_out else "nothing was held out"
    dropped = int((~training.complete).sum())
    racing = f", of which {dropped} were clearly worse and dropped early" if method.get("racing") and dropped else ""
    driven = "; nothing was driven, as all that matters here is known of a plan" * known_of_plans(findings.goals)
    tuned = f"{counted(len(findings.parameters), 'constant')} of the {planner.get('preset', '')} planner{robot}"
    return (f"{tuned} {'was' if len(findings.parameters) == 1 else 'were'} tuned: {', '.join(findings.parameters)}. "
            f"The method {method.get('name', '')} tried {len(training.values) - 1} sets of constants in "
            f"{int(training.done.sum())} episodes{racing}{driven}. Training: "
            f"{suites_sentence(fields.get('training') or {})}; {unseen}.")  # fmt: skip


def counted(count: int, noun: str) -> str:
    """A number of things."""
    return f"{count} {noun}{'s' * (count != 1)}"


def suites_sentence(part: Mapping[str, Any]) -> str:
    """The suites of `training` or `held_out`."""
    suites = []
    for entry in part.get("suites") or ():
        name = next((str(entry[key]) for key in ("suite", "suite_file", "map") if entry.get(key)), "suite")
        count = f"{entry['count']} scenarios, " if entry.get("count") else ""
        suites.append(f"{name} ({count}seed {entry.get('seed', 0)})")
    return ", ".join(suites)


def success_table(findings: Findings) -> str:
    """Before and after tuning, on both suites."""
    best, default, compared = recommended(findings), findings.default, findings.compared
    rows = [("training", str(default.training.scenarios), shown(SUCCESS, default.training.success),
             shown(SUCCESS, best.training.success), NONE)]  # fmt: skip
    if best.held_out is not None and default.held_out is not None:
        told = compared if best.row != default.row else None
        change = NONE if told is None else shown_difference(SUCCESS, told.success)
        rows.append(("held out", str(best.held_out.scenarios), shown(SUCCESS, default.held_out.success),
                     shown(SUCCESS, best.held_out.success), change))  # fmt: skip
    title = "Paths found; nothing was driven" if known_of_plans(findings.goals) else "Success"
    return table(f"{title}, with 95 % Wilson intervals; the change is paired, in percentage points",
                 ("suite", "scenarios", "before: default", f"after: {findings.picked}", "change"), rows)  # fmt: skip


def constants_table(findings: Findings) -> str:
    """Default and recommended constants."""
    best = recommended(findings)
    rows = [(name, f"{before:.4g}", f"{after:.4g}") for name, before, after in
            zip(findings.parameters, findings.default.values, best.values, strict=True)]  # fmt: skip
    return table("Constants (all others keep their defaults)", ("constant", "default", findings.picked), rows)


def objectives_table(findings: Findings) -> str:
    """Every objective on both suites, and what its paired difference on the held-out one tells."""
    best, default, compared = recommended(findings), findings.default, findings.compared
    rows = []
    for index, statistic in enumerate(findings.goals.objectives):
        judgements = (default.training, best.training, default.held_out, best.held_out)
        cells = [NONE if judged is None else shown(statistic, judged.objectives[index]) for judged in judgements]
        if compared is None or best.row == default.row:
            cells += [NONE, NONE]
        else:
            difference = compared.objectives[index]
            cells += [shown_difference(statistic, difference), reading(statistic, difference)]
        better = "less" if statistic.direction == "min" else "more"
        rows.append((f"{measure_name(statistic)} ({better} is better)", *cells))
    return table("Objectives, with 95 % intervals, each by itself; the change is paired, on held-out scenarios (where "
                 "a figure is of solved ones, on those that both solve)",
                 ("objective", "training: default", f"training: {findings.picked}", "held out: default",
                  f"held out: {findings.picked}", "change", "reading"), rows)  # fmt: skip


def choices_table(findings: Findings) -> str:
    """What each rule picks."""
    rows = []
    for index, choice in enumerate(findings.choices):
        member = findings.front[choice.member]
        unseen = NONE if member.held_out is None else shown(SUCCESS, member.held_out.success)
        mark = f" ({findings.picked})" if index == findings.recommended else ""
        rows.append((f"{choice.rule.replace('_', ' ')}{mark}", f"{choice.member + 1}",
                     shown(SUCCESS, member.training.success), unseen, _stable(choice), choice.reason))
    return table("What each rule of choice picks; stable: how often it picks the same when scenarios are resampled",
                 ("rule", "member", "success, training", "success, held out", "stable", "reason"), rows)  # fmt: skip


def front_table(findings: Findings, members: Collection[int] | None = None) -> str:
    """Every member, or those of some numbers, its constants and objectives on training, and how surely nothing
    dominates it; last the default.
    """
    objectives = findings.goals.objectives
    rows = [_front_row(str(index), member, objectives) for index, member in enumerate(findings.front, start=1)
            if members is None or index in members]  # fmt: skip
    rows.append(_front_row("default", findings.default, objectives))
    return table("Members of the front; surely: share of the resamples in which none dominates it",
                 ("member", *map(name_and_unit, objectives), "surely", *findings.parameters), rows)  # fmt: skip


def outcomes_table(findings: Findings, held_out: Evaluations, held_out_rows: np.ndarray) -> str:
    """How the held-out scenarios ended, before and after."""
    members = {"before: default": findings.default, f"after: {findings.picked}": recommended(findings)}
    ended = [held_out.columns["outcome"][np.flatnonzero(held_out_rows == member.row)[0]] for member in members.values()
             if member.row in held_out_rows]  # fmt: skip
    if len(ended) < len(members):
        return ""
    sentences = {**SENTENCES, Outcome.REACHED: "a path was found"} if known_of_plans(findings.goals) else SENTENCES
    rows = [(sentences[outcome], *(str(int((found == outcome).sum())) for found in ended)) for outcome in Outcome
            if any((found == outcome).any() for found in ended)]  # fmt: skip
    return table("How the held-out scenarios ended", ("outcome", *members), rows)


def shown(statistic: Statistic, interval: Interval) -> str:
    """An estimate with its interval and unit, each to the same number of decimals."""
    value, low, high = (float(part) for part in in_units(statistic, interval))
    if not np.isfinite(value):
        return NONE
    digits, unit = _decimals(statistic, value), unit_of(statistic)
    return f"{value:.{digits}f}{f' {unit}' * bool(unit)} [{low:.{digits}f},\N{NO-BREAK SPACE}{high:.{digits}f}]"


def shown_difference(statistic: Statistic, interval: Interval) -> str:
    """With signs and the unit; of rates in percentage points, of which nothing is said."""
    value, low, high = (float(part) for part in in_units(statistic, interval))
    if not np.isfinite(value):
        return NONE
    digits = _decimals(statistic, max(abs(low), abs(high)))
    unit = "" if statistic.measure in RATES else unit_of(statistic)
    return f"{value:+.{digits}f}{f' {unit}' * bool(unit)} [{low:+.{digits}f},\N{NO-BREAK SPACE}{high:+.{digits}f}]"


def _stable(choice: Choice) -> str:
    """A share, unknown where no rule picked."""
    return NONE if np.isnan(choice.stability) else f"{choice.stability:.0%}"


def _decimals(statistic: Statistic, value: float) -> int:
    """One of a percentage; else such that there are three figures or so."""
    if statistic.measure in RATES:
        return 1
    return int(np.clip(2 - np.floor(np.log10(abs(value) + 1e-9)), 0, 4))


def _front_row(name: str, member: Member, objectives: tuple[Statistic, ...]) -> tuple[str, ...]:
    values = [f"{float(in_units(statistic, part.value)):.4g}"
              for statistic, part in zip(objectives, member.training.objectives, strict=True)]  # fmt: skip
    return name, *values, f"{member.non_dominated:.0%}", *(f"{value:.4g}" for value in member.values)


def _differences(findings: Findings, compared: Comparison) -> Iterator[tuple[Statistic, Interval]]:
    """Success first, also where it is no objective."""
    if SUCCESS not in findings.goals.objectives:
        yield SUCCESS, compared.success
    yield from zip(findings.goals.objectives, compared.objectives, strict=True)


def _gap_sentence(training: Judgement, held_out: Judgement) -> str:
    gap = 100.0 * (training.success.value - held_out.success.value)
    way = f"{abs(gap):.1f} points {'higher' if gap > 0 else 'lower'} than"
    return (f"Its success on the {training.scenarios} training scenarios, on which it was picked, is "
            f"{'the same as' if abs(gap) < 0.05 else way} on the {held_out.scenarios} held-out ones (the optimism "
            "gap); the held-out value is the one to expect.")  # fmt: skip
