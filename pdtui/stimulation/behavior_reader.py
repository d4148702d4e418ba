"""Reads primitives and behaviors from their tables in a map."""

from __future__ import annotations

from typing import cast, get_args

from pdtui.core.attributes import AimDirection, BehaviorAim
from pdtui.core.units import ADDRESS
from pdtui.stimulation.interventions.intervention import LayerVectors
from pdtui.stimulation.interventions.intervention_reader import read_interventions, read_onset
from pdtui.stimulation.map_table_reader import MapTableReader
from pdtui.stimulation.stimulation_map import Behavior, BehaviorMode, MeasuredEffect, MotorPrimitive, PidGains

MAX_PERIOD = 1e6
"""Longest activation period, s: eleven days."""
MAX_FADE = 60.0
"""Longest time over which interventions fade, s."""


def read_primitive(table: MapTableReader) -> MotorPrimitive:
    """Read a primitive of a map."""
    unit = table.text("unit")
    if not ADDRESS.fullmatch(unit):
        raise table.error("unit", f"expected layer:index, such as 0:12, found '{unit}'")
    name, attribute, rho = table.text("name"), table.text("attribute"), table.number("rho")
    discrepancy, value = table.number("discrepancy", None), table.number("value", None)
    if not -1.0 <= rho <= 1.0:
        raise table.error("rho", f"expected a number from −1 to 1, found {rho}")
    primitive = MotorPrimitive(name, attribute, unit, rho, discrepancy, value, _read_effect(table))
    table.done()
    return primitive


def _read_effect(parent: MapTableReader) -> MeasuredEffect | None:
    table = parent.table("measured", None)
    if table is None:
        return None
    effect, low, high = map(table.number, ("effect", "low", "high"))
    measured = MeasuredEffect(effect, low, high, table.take("falls", int, None), table.take("of", int, None))
    table.done()
    return measured


def read_behavior(
    table: MapTableReader, primitives: dict[str, MotorPrimitive], vectors: dict[str, LayerVectors]
) -> Behavior:
    """Read a behavior of a map, given the primitives and vectors that it may name."""
    name = table.text("name")
    magnitudes = table.numbers("magnitudes", {})
    for key in magnitudes:
        if key not in primitives and not ADDRESS.fullmatch(key):
            known = ", ".join(primitives) or "none"
            raise table.error(
                "magnitudes", f"'{key}' is neither a layer:index nor a primitive; available: {known}"
            )
    commands = table.numbers("commands", {})
    interventions, onset = read_interventions(table, vectors), read_onset(table)
    if not magnitudes and not commands and not interventions:
        raise table.error("magnitudes", "expected at least one unit")
    period = table.number("period", None)
    if period is not None and not 0 < period <= MAX_PERIOD:
        raise table.error("period", f"expected more than 0 and at most {MAX_PERIOD:g} s, found {period}")
    together = table.take("together", list, [])
    if not all(isinstance(other, str) for other in together):
        raise table.error("together", "expected names of behaviors")
    mode = cast(BehaviorMode, table.choice("mode", ("fixed", "pid"), "fixed"))
    aim_table, aim = table.table("aim", None), None
    if aim_table is not None:
        direction = cast(AimDirection, aim_table.choice("direction", get_args(AimDirection)))
        aim = BehaviorAim(aim_table.text("attribute"), direction)
        aim_table.done()
    pid_table, pid = table.table("pid", None), None
    if (pid_table is not None) != (mode == "pid"):
        raise table.error("pid", 'expected with mode = "pid", and only there')
    base = table.numbers("base", {})
    if base and mode != "pid":
        raise table.error("base", 'expected only with mode = "pid"')
    for key in base:
        if not ADDRESS.fullmatch(key):
            raise table.error("base", f"'{key}': expected layer:index, such as 0:12")
    if pid_table is not None:
        gains = {name: pid_table.number(name) for name in ("kp", "ki", "kd", "limit", "step")}
        pid = PidGains(attribute=pid_table.text("attribute"), **gains)
        if pid.limit <= 0:
            raise pid_table.error("limit", f"expected more than 0, found {pid.limit}")
        pid_table.done()
    behavior = Behavior(
        name=name,
        key=table.text("key"),
        says=table.text("says", ""),
        magnitudes=magnitudes,
        base=base,
        period=period,
        together=tuple(together),
        mode=mode,
        aim=aim,
        measured=_read_effect(table),
        pid=pid,
        task=table.text("task", ""),
        commands=commands,
        interventions=interventions,
        onset=onset,
        fade=_read_fade(table, bool(interventions)),
    )
    table.done()
    return behavior


def _read_fade(table: MapTableReader, fades: bool) -> float:
    fade: float = table.number("fade", 0.0)
    if not 0.0 <= fade <= MAX_FADE or (fade and not fades):
        raise table.error(
            "fade", f"expected 0 to {MAX_FADE:g} s, and interventions that can fade, found {fade:g}"
        )
    return fade
