"""librosa, with which only the benchmark of matching compares."""

from __future__ import annotations

from typing import Any

from pdtui.core.errors import PdtuiError


def load_librosa() -> Any:
    """Import librosa, which only this comparison needs.

    Raises:
        PdtuiError: librosa is not installed.
    """
    try:
        import librosa
    except ImportError as error:
        raise PdtuiError(
            "librosa is not installed, and the benchmark compares with it: pip install 'pdtui[bench]'"
        ) from error
    return librosa
