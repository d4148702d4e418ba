"""The data of the matching study: one row for each policy, attribute and unit, in a Parquet file."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from pdtui.core.atomic_file import replace_file
from pdtui.core.attributes import Floats
from pdtui.core.errors import StudyError
from pdtui.study.matching.matching_study_plan import MatchingStudyPlan, parse_matching_study_plan

SHIPPED_STUDY_DATA = Path(__file__).with_name("matching_study.parquet")
"""The data of the page in the guide."""
_KEY = b"pdtui-matching-study"
NO_RANK = 65535
"""Rank of a unit that a variant leaves out."""
ROLES = ("reference", "random", "matched")
"""Why a unit was probed: for the threshold of a hit, to be compared with it, or only as a match."""
CHOOSING, FIRST_HALF, SECOND_HALF = "choosing", "first half", "second half"
START_GROUPS = (CHOOSING, FIRST_HALF, SECOND_HALF)
"""Groups of starts over which effects are averaged: those that choose, and both halves of those held out."""
_DIGITS = 3


@dataclass(frozen=True)
class PolicyFacts:
    """What was found out about one policy besides its units.

    Attributes:
        name, setting: Those of the plan.
        command: Command line that trains it.
        kind: How it came about.
        sha256: Hash of its weights.
        mean_return, net_speed: Means over the episodes of the walking rule; m/s.
        failures: Share of these episodes that ended in a failure.
        walks: Whether it walks by the rule of the plan.
        units: Number of its hidden units.
        rollouts: Roll-outs that measured it.
    """

    name: str
    setting: str
    command: str
    kind: str
    sha256: str
    mean_return: float
    net_speed: float
    failures: float
    walks: bool
    units: int = 0
    rollouts: int = 0


@dataclass(frozen=True)
class MeasuredUnits:
    """N probed units and one attribute of one policy.

    Attributes:
        policy, attribute: Their names.
        units: Flat indices, shape (N,).
        roles: Indices into `ROLES`, shape (N,).
        effects: Mean change of the attribute in standard deviations of its monitored walk, for each group of
            starts and value at which the unit was held, shape (groups, values, N). A fall counts as none.
        ranks: Rank of each unit among all units of the policy by discrepancy, from 0, for each variant, shape
            (variants, N); `NO_RANK` for none.
        correlations: Correlation ρ of phases for each variant, shape (variants, N); NaN for none.
    """

    policy: str
    attribute: str
    units: NDArray[np.uint16]
    roles: NDArray[np.uint8]
    effects: Floats
    ranks: NDArray[np.uint16]
    correlations: Floats


@dataclass(frozen=True)
class MatchingStudyData:
    """All that was measured.

    Attributes:
        plan: The plan by which it was.
        policies: All policies that were measured, also those that do not walk.
        measured: One entry for each policy that walks and each of its attributes.
    """

    plan: MatchingStudyPlan
    policies: tuple[PolicyFacts, ...]
    measured: tuple[MeasuredUnits, ...]


def merge_study_data(parts: Sequence[MatchingStudyData]) -> MatchingStudyData:
    """Return the data of several policies, measured by the same plan, as one."""
    return MatchingStudyData(
        parts[0].plan,
        tuple(one for part in parts for one in part.policies),
        tuple(one for part in parts for one in part.measured),
    )


def write_study_data(path: Path, data: MatchingStudyData) -> None:
    """Write a Parquet file. Effects are rounded to three digits, and ρ to two decimals.

    Raises:
        StudyError: The file cannot be written.
    """
    note = json.dumps({"plan": data.plan.text, "policies": [asdict(one) for one in data.policies]})
    table = pa.concat_tables(
        [*(_to_table(one, data.plan) for one in data.measured), _schema(data.plan).empty_table()]
    ).replace_schema_metadata({_KEY: note.encode()})
    with replace_file(path, StudyError) as partial:
        pq.write_table(table, partial, compression="zstd", compression_level=19)


def read_study_data(path: Path) -> MatchingStudyData:
    """Read a file that `write_study_data` wrote.

    Raises:
        StudyError: The file cannot be read, or is another one.
    """
    try:
        table = pq.read_table(path)
        note = json.loads((table.schema.metadata or {})[_KEY])
        plan = parse_matching_study_plan(note["plan"], f"{path}: plan")
        policies = tuple(PolicyFacts(**one) for one in note["policies"])
        return MatchingStudyData(plan, policies, tuple(_from_table(table, plan)))
    except FileNotFoundError:
        raise StudyError(f"{path}: expected the data of a matching study, found no file") from None
    except (OSError, pa.ArrowException, KeyError, TypeError, ValueError) as error:
        raise StudyError(f"{path}: expected the data of a matching study: {error}") from error


def _effect_columns(plan: MatchingStudyPlan) -> list[str]:
    return [f"effect at {value:g}, {group}" for group in START_GROUPS for value in plan.settings.values]


def _schema(plan: MatchingStudyPlan) -> pa.Schema:
    text = pa.dictionary(pa.int16(), pa.string())
    return pa.schema(
        [
            *(("policy", text), ("attribute", text), ("unit", pa.uint16()), ("role", pa.uint8())),
            *((name, pa.float32()) for name in _effect_columns(plan)),
            *((f"rank, {name}", pa.uint16()) for name in plan.variants),
            *((f"rho, {name}", pa.float32()) for name in plan.variants),
        ]
    )


def _to_table(one: MeasuredUnits, plan: MatchingStudyPlan) -> pa.Table:
    count, schema = len(one.units), _schema(plan)
    columns = [
        *([one.policy] * count, [one.attribute] * count, one.units, one.roles),
        *_round_to_digits(one.effects).reshape(-1, count).astype(np.float32),
        *one.ranks,
        *one.correlations.round(2).astype(np.float32),
    ]
    arrays = [pa.array(column, field.type) for column, field in zip(columns, schema, strict=True)]
    return pa.table(arrays, schema=schema)


def _round_to_digits(values: Floats) -> Floats:
    size = np.floor(np.log10(np.maximum(np.abs(values), 1e-6)))
    scale = 10.0 ** (_DIGITS - 1 - size)
    return np.asarray(np.round(values * scale) / scale)


def _from_table(table: pa.Table, plan: MatchingStudyPlan) -> Iterable[MeasuredUnits]:
    names = {name: table[name].cast(pa.string()).to_numpy() for name in ("policy", "attribute")}
    arrays = {name: table[name].to_numpy() for name in table.column_names[2:]}
    if not len(table):
        return
    changes = np.flatnonzero(
        (names["policy"][1:] != names["policy"][:-1]) | (names["attribute"][1:] != names["attribute"][:-1])
    )
    bounds = [0, *(changes + 1).tolist(), len(table)]
    for low, high in pairwise(bounds):
        effects = np.array([arrays[name][low:high] for name in _effect_columns(plan)], np.float64)
        yield MeasuredUnits(
            str(names["policy"][low]),
            str(names["attribute"][low]),
            arrays["unit"][low:high],
            arrays["role"][low:high],
            effects.reshape(len(START_GROUPS), len(plan.settings.values), -1),
            np.array([arrays[f"rank, {name}"][low:high] for name in plan.variants]),
            np.array([arrays[f"rho, {name}"][low:high] for name in plan.variants], np.float64),
        )
