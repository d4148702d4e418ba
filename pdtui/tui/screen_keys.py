"""Keys of the drive's screen, declared apart from what they do. Each has an id, so users can remap it."""

from __future__ import annotations

from textual.binding import Binding

from pdtui.stimulation.stimulation_map import StimulationMap

# A key that changes the run goes to the drive under its original name, whatever key the user gave it.
RUN_KEYS: dict[str, tuple[str, str]] = {
    "target_up": ("up", "raises the target"),
    "target_down": ("down", "lowers the target"),
    "target_left": ("left", "turns the target left"),
    "target_right": ("right", "turns the target right"),
    "stronger": ("plus", "strengthens the latched behavior"),
    "weaker": ("minus", "weakens the latched behavior"),
    "reset": ("r", "starts the next episode"),
    "rewind": ("backspace", "rewinds a few seconds"),
}
PACE_KEYS: dict[str, tuple[str, str, str]] = {
    "pause": ("p", "pause", "pauses, and goes on"),
    "step": ("n", "step", "runs a single control step"),
    "slower": ("comma", "slower", "halves the speed"),
    "faster": ("full_stop", "faster", "doubles the speed"),
}
SCREEN_KEYS: dict[str, tuple[str, str, str]] = {
    "view": ("v", "toggle_view", "looks from the side or from above"),
    "help": ("question_mark", "help", "shows all keys"),
    "quit": ("q", "leave", "ends the drive and quits"),
}
SHORT: dict[str, str] = {
    "help": "help",
    "quit": "quit",
    "pause": "pause",
    "view": "view",
    "reset": "reset",
    "rewind": "rewind",
    "stronger": "stronger",
    "weaker": "weaker",
    "step": "step",
    "slower": "slower",
    "faster": "faster",
}
BINDINGS: list[Binding] = [
    *(Binding(key, f"run_key('{key}')", says, id=name) for name, (key, says) in RUN_KEYS.items()),
    *(Binding(key, f"pace('{pace}')", says, id=name) for name, (key, pace, says) in PACE_KEYS.items()),
    *(Binding(key, action, says, id=name) for name, (key, action, says) in SCREEN_KEYS.items()),
    Binding("ctrl+c", "leave", "ends the drive and quits, always", id="quit_always", priority=True),
]


def drive_keys(stimulation_map: StimulationMap) -> frozenset[str]:
    """The keys that belong to the map, before any of the application's own."""
    behaviors = {behavior.key for behavior in stimulation_map.behaviors.values()}
    return frozenset(behaviors | {stimulation_map.default_key})
