"""The one table of keys and of the events that they cause; a new key is a new row here.

The screen's bindings, key line and help, the keys that maps may not use, the keys that keystroke files may
name, and the wording of events in sessions are all derived from it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

EventKind = Literal[
    "behavior",
    "default",
    "target",
    "factor",
    "takeover",
    "control",
    "hand back",
    "reset",
    "rewind",
    "unit",
    "free",
    "beside",
    "release",
    "mute",
    "unmute",
    "order",
    "kp",
    "ki",
    "kd",
    "limit",
]


EVENT_WORDINGS: dict[EventKind, str] = {
    "behavior": "behavior '{name}' latched",
    "default": "everything cleared; the policy acts alone",
    "target": "target of '{name}' set to {value:.4g}",
    "factor": "magnitudes of '{name}' set to {value:.4g} times the map's",
    "takeover": "the operator took over",
    "control": "{name} set to {value:.4g} by the operator",
    "hand back": "handed back to the policy",
    "reset": "next episode started",
    "rewind": "rewound to step {value:.0f}",
    "unit": "unit {name} held at {value:.4g}",
    "free": "unit {name} let go",
    "beside": "behavior '{name}' latched beside the others",
    "release": "behavior '{name}' let go",
    "mute": "behavior '{name}' muted",
    "unmute": "behavior '{name}' acts again",
    "order": "behavior '{name}' moved to place {value:.0f} of the stack",
    "kp": "gain kp of '{name}' set to {value:.4g}",
    "ki": "gain ki of '{name}' set to {value:.4g}",
    "kd": "gain kd of '{name}' set to {value:.4g}",
    "limit": "magnitude of '{name}' limited to ±{value:.4g}",
}
"""What each kind of event does, in words that may contain ``{name}`` and ``{value}`` of the event."""
JUMPS = ("reset", "rewind")
"""Events that put the robot into another state, so that paths end there and the screen says so."""


@dataclass(frozen=True)
class ReservedKey:
    """A key with the same meaning for every map, which therefore no map may use.

    Attributes:
        id: name of its binding, under which users can choose another key.
        key: Textual's name of the key.
        says: what it does, as the end of a sentence that starts with "it".
        event: kind of the event by which it changes the run; None if it affects only the screen.
        direction: 1 for up, left and more; −1 for down, right and less.
        action: Textual's name of the action of a key that affects only the screen.
        hint: label in the key line; empty if the key is not shown there.
        hint_rank: position in the key line, which is cut short on a narrow terminal.
    """

    id: str
    key: str
    says: str
    event: EventKind | None = None
    direction: int = 0
    action: str = ""
    hint: str = ""
    hint_rank: int = 0


KEY_TABLE = (
    ReservedKey("target_up", "up", "raises the target", "target", 1),
    ReservedKey("target_down", "down", "lowers the target", "target", -1),
    ReservedKey("target_left", "left", "turns the target left", "target", 1),
    ReservedKey("target_right", "right", "turns the target right", "target", -1),
    # Not a letter: maps that `pdtui dissect` has drafted may use any that was free then.
    ReservedKey(
        "takeover",
        "enter",
        "takes over from the policy, or hands back",
        "takeover",
        hint="take over",
        hint_rank=2,
    ),
    ReservedKey(
        "stronger", "plus", "strengthens the latched behavior", "factor", 1, hint="stronger", hint_rank=8
    ),
    ReservedKey("weaker", "minus", "weakens the latched behavior", "factor", -1, hint="weaker", hint_rank=9),
    ReservedKey("reset", "r", "starts the next episode", "reset", hint="reset", hint_rank=6),
    ReservedKey("rewind", "backspace", "rewinds by three seconds", "rewind", hint="rewind", hint_rank=7),
    ReservedKey("pause", "p", "pauses or resumes", action="pace('pause')", hint="pause", hint_rank=3),
    ReservedKey("step", "n", "runs a single control step", action="pace('step')", hint="step", hint_rank=10),
    ReservedKey("slower", "comma", "halves the speed", action="pace('slower')", hint="slower", hint_rank=11),
    ReservedKey(
        "faster", "full_stop", "doubles the speed", action="pace('faster')", hint="faster", hint_rank=12
    ),
    ReservedKey(
        "view", "v", "switches between side view and top view", action="toggle_view", hint="view", hint_rank=4
    ),
    # A control key, as maps that `pdtui dissect` has drafted may use any letter.
    ReservedKey(
        "ghost",
        "ctrl+g",
        "turns the ghost on or off, the twin without the behavior",
        action="toggle_ghost",
        hint="ghost",
        hint_rank=5,
    ),
    ReservedKey(
        "bench",
        "ctrl+e",
        "opens or closes the unit bench, to edit hidden units",
        action="bench('toggle')",
        hint="bench",
        hint_rank=5,
    ),
    ReservedKey(
        "layer_before", "pageup", "shows the layers before in the strip", action="bench('layer before')"
    ),
    ReservedKey("next_layer", "pagedown", "shows the next layers in the strip", action="bench('next layer')"),
    ReservedKey(
        "attributes_before",
        "ctrl+up",
        "shows the attributes before in the table",
        action="pane('attributes', 'before')",
    ),
    ReservedKey(
        "next_attributes",
        "ctrl+down",
        "shows the next attributes in the table",
        action="pane('attributes', 'next')",
    ),
    ReservedKey("zoom_in", "right_square_bracket", "shows less of the path", action="zoom_path(-1)"),
    ReservedKey("zoom_out", "left_square_bracket", "shows more of the path", action="zoom_path(1)"),
    ReservedKey(
        "seek_back",
        "less_than_sign",
        "shows the run a second earlier",
        action="pane('timeline', 'back')",
        hint="earlier",
        hint_rank=13,
    ),
    ReservedKey(
        "seek_forward",
        "greater_than_sign",
        "shows the run a second later",
        action="pane('timeline', 'forward')",
        hint="later",
        hint_rank=14,
    ),
    ReservedKey(
        "mark_back",
        "left_curly_bracket",
        "shows the run at the key or the ending before",
        action="pane('timeline', 'earlier mark')",
    ),
    ReservedKey(
        "mark_forward",
        "right_curly_bracket",
        "shows the run at the next key or ending",
        action="pane('timeline', 'later mark')",
    ),
    ReservedKey(
        "seek_oldest", "home", "shows the oldest step that is kept", action="pane('timeline', 'oldest')"
    ),
    ReservedKey(
        "seek_last",
        "end",
        "returns to the present, or to the end of a recording",
        action="pane('timeline', 'last')",
    ),
    # Not ctrl+b, which many who work in tmux could not press.
    ReservedKey(
        "branch",
        "ctrl+n",
        "begins a new session from the step that is shown",
        action="pane('timeline', 'branch')",
        hint="branch",
        hint_rank=15,
    ),
    ReservedKey(
        "spectra",
        "ctrl+f",
        "opens or closes the spectrograms of an attribute and a unit",
        action="pane('spectra', 'open')",
        hint="spectra",
        hint_rank=16,
    ),
    ReservedKey(
        "spectra_attribute",
        "f3",
        "shows the spectrogram of the next attribute",
        action="pane('spectra', 'attribute')",
    ),
    ReservedKey(
        "spectra_unit",
        "f4",
        "shows the spectrogram of the next of the nearest units",
        action="pane('spectra', 'unit')",
    ),
    ReservedKey(
        "palette",
        "ctrl+p",
        "finds behaviors, keys and themes by name",
        action="command_palette",
        hint="commands",
        hint_rank=18,
    ),
    ReservedKey(
        "back",
        "escape",
        "closes what is open, or returns to the present",
        action="go_back",
        hint="back",
        hint_rank=-1,  # it is shown only while there is something to go back from
    ),
    ReservedKey("help", "question_mark", "shows all keys", action="help", hint="help", hint_rank=0),
    ReservedKey("quit", "q", "ends the drive and quits", action="leave", hint="quit", hint_rank=1),
)
RUN_KEYS = {row.key: row for row in KEY_TABLE if row.event is not None}
"""Keys that change a run, by Textual's name."""
RESERVED_KEYS = {row.key: row.says for row in KEY_TABLE}
"""What each key that no map may use does, by Textual's name."""
