"""Results as pandas data frames; pandas itself is the user's to install."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from pdtui.core.errors import PdtuiError

if TYPE_CHECKING:
    import pandas as pd


def make_data_frame(columns: Mapping[str, Sequence[Any] | Any], index_name: str) -> pd.DataFrame:
    """Return a data frame with a numbered index of this name.

    Raises:
        PdtuiError: pandas is not installed.
    """
    try:
        import pandas as pd
    except ModuleNotFoundError as error:
        raise PdtuiError("expected pandas to be installed; pip install pandas brings it") from error
    frame = pd.DataFrame(dict(columns))
    frame.index.name = index_name
    return frame
