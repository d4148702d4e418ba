"""JSON of the commands: what JSON has no number for is null."""

from __future__ import annotations

import json

import numpy as np

from pdtui.core.printable_text import to_json


def test_numbers_that_json_does_not_know_are_null() -> None:
    data = {"low": float("-inf"), "rows": [(1.5, np.float64("nan")), {"high": float("inf")}], 3: "text"}
    text = to_json(data)
    assert json.loads(text) == {"low": None, "rows": [[1.5, None], {"high": None}], "3": "text"}
    assert not {"NaN", "Infinity"} & set(text.replace(",", " ").split())
