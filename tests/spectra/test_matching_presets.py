from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import get_window

from pdtui.core.errors import PdtuiError
from pdtui.spectra.matching_presets import (
    PRESETS,
    allowed_preset_values,
    find_matching_preset,
    list_preset_values,
)


def test_presets_are_those_of_the_paper_and_of_its_code() -> None:
    paper, authors = PRESETS["paper"], PRESETS["authors"]
    assert (paper.window, paper.length, paper.hop, paper.spectrogram) == ("blackman", 64, 16, "power")
    assert (authors.window, authors.length, authors.hop, authors.spectrogram) == ("hann", 32, 8, "magnitude")


def test_unknown_preset_lists_those_there_are() -> None:
    with pytest.raises(PdtuiError, match=r"unknown preset 'welch'; available: paper, authors"):
        find_matching_preset("welch")


def test_every_choice_can_be_set_and_is_kept() -> None:
    for name, values in allowed_preset_values().items():
        for value in values:
            text = [f"{name}={value}"] if name != "length" else [f"length={value}", "hop=1"]
            preset = find_matching_preset("paper", text if name != "hop" else ["hop=1"])
            assert list_preset_values(preset).keys() == allowed_preset_values().keys()
            if name != "hop":
                assert list_preset_values(preset)[name] == value


def test_what_differs_from_the_preset_is_named() -> None:
    preset = find_matching_preset("paper", ["length=32", "window=blackman", "hop=8"])
    assert (preset.name, preset.length, preset.hop, preset.spectrogram) == ("paper", 32, 8, "power")
    assert str(preset) == "paper length=32 hop=8"
    assert str(find_matching_preset("authors")) == "authors"


@pytest.mark.parametrize("length", [30, 63, 128, 1000])
@pytest.mark.parametrize("name", allowed_preset_values()["window"])
def test_windows_are_those_of_scipy_to_the_last_bit(name: str, length: int) -> None:
    preset = find_matching_preset("authors", [f"window={name}", f"length={length}"])
    expected = get_window({"rectangular": "boxcar"}.get(name, name), length)
    assert np.array_equal(preset.weights, expected / expected.sum())


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("window", r"setting 'window': expected NAME=VALUE, one of window=blackman\|hann"),
        ("color=red", r"unknown setting 'color'; available: window=.*; length=4…65536 samples"),
        ("window=kaiser", r"setting 'window': expected blackman\|hann\|hamming\|rectangular, got 'kaiser'"),
        ("length=3", r"setting 'length': expected 4…65536 samples, got '3'"),
        ("hop=-1", r"setting 'hop': expected 1…65536 samples, got '-1'"),
        ("hop=65", r"setting 'hop': expected at most the window's length, 64, .* got 65"),
        ("name=x", "unknown setting 'name'"),
    ],
)
def test_a_wrong_setting_lists_what_there_is(setting: str, message: str) -> None:
    with pytest.raises(PdtuiError, match=message):
        find_matching_preset("paper", [setting])
