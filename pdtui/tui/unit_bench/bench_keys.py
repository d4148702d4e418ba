"""The keys of the unit bench, for the help."""

BENCH_KEYS = (
    ("up", "marks the row above; down, the row below"),
    ("left", "less of the marked row; right, more; with shift, five times as much"),
    ("enter", "holds a unit, or lets it go; mutes a behavior, or adds one; begins a search or a tuning"),
    ("equals_sign", "types a value, or the address of a unit; so does a digit"),
    ("delete", "takes a unit off the bench, or ends a behavior"),
    ("tab", "shows the next page: units, layers, pid, search; shift+tab, the one before"),
    ("ctrl+s", "saves the held units as a behavior of the map, with a key; on the page pid, the gains"),
    ("escape", "leaves the line that is typed, or closes the bench"),
)
"""Key and description; shift with an arrow moves a behavior in the stack, too."""
