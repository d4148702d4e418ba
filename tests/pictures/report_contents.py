"""Reads back what a report holds, with no code of pdtui."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pyarrow as pa
from rerun.chunk import RrdReader


def read_entities(path: Path) -> dict[str, dict[str, list[Any]]]:
    """Every component's list of values by entity and name; rows of a batch follow one another."""
    entities: dict[str, dict[str, list[Any]]] = {}
    for chunk in RrdReader(path).stream():
        batch = chunk.to_record_batch()
        columns = entities.setdefault(chunk.entity_path, {})
        for name in batch.schema.names:
            kind = batch.schema.field(name).type
            if pa.types.is_list(kind):
                # Files come as one array each: as lists, their millions of bytes would take minutes.
                rows = batch.column(name).flatten()
                is_file = pa.types.is_list(kind.value_type) and pa.types.is_uint8(kind.value_type.value_type)
                values = [row.values.to_numpy() for row in rows] if is_file else rows.to_pylist()
                columns.setdefault(name, []).extend(values)
    return entities


def read_origins(path: Path) -> set[str]:
    """Entities that the views of the embedded layout start from."""
    reader = RrdReader(path)
    (layout,) = reader.blueprints()
    origins: set[str] = set()
    for chunk in reader.stream(store=layout):
        batch = chunk.to_record_batch()
        if "ViewBlueprint:space_origin" in batch.schema.names:
            origins.update(
                text for row in batch.column("ViewBlueprint:space_origin").to_pylist() for text in row
            )
    return origins
