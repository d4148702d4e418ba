"""Whole sessions in which a bit is flipped, or whose end is cut off."""

from __future__ import annotations

from pathlib import Path

from pdtui.core.errors import SessionError
from pdtui.sessions.rrd.message_checksum import SEAL_BYTES
from pdtui.sessions.rrd.message_framing import HEADER_BYTES, START_BYTES, TRAILER_BYTES
from pdtui.sessions.session_integrity import examine_session
from pdtui.sessions.session_reader import read_activations, read_session
from pdtui.sessions.session_repair import repair_session
from tests.faults.fault_bench import ROOT, FaultBench
from tests.faults.fault_tally import FalseReport, FaultTally, StepsLost
from tests.faults.original_session import OriginalSession, list_differences, record_original, require_all_but

SAMPLE = ROOT / "sessions" / "samples" / "bipedal_walker.rrd"
"""A session from before there were checksums."""

_PER_SESSION = 250
"""Faults in one session, before another is recorded."""

_REPLAYED = 10
"""One of so many repaired sessions is replayed."""


def flip_bits(bench: FaultBench, number: int) -> list[FaultTally]:
    """Flip single bits in sessions of small and of large batches."""
    paced = FaultTally("a flipped bit, batches of 4 steps, with keys")
    headless = FaultTally("a flipped bit, batches of 128 steps")
    for tally, rows, steps in ((paced, 4, 60), (headless, 128, 300)):
        for first in range(0, number // 2, _PER_SESSION):
            original = record_original(bench, f"flips{rows}-{first}", steps=steps, rows_per_write=rows)
            for one in range(first, min(number // 2, first + _PER_SESSION)):
                place = draw_byte(bench, original)
                data = bytearray(original.data)
                bit = bench.drawn.randrange(8)
                data[place] ^= 1 << bit
                with tally.try_fault(f"{original.path.name}, byte {place}, bit {bit}"):
                    damaged = [original.find_message(place)]
                    replay = one % _REPLAYED == 0
                    tally.mend(_judge_damage(bench, original, data, damaged, replay=replay, cut=False))
    return [paced, headless]


def draw_byte(bench: FaultBench, original: OriginalSession) -> int:
    """Draw a byte of the file: half of them anywhere, half where the format itself is."""
    drawn = bench.drawn
    if drawn.random() < 0.5:
        return drawn.randrange(len(original.data))
    if drawn.random() < 0.1:
        return drawn.randrange(START_BYTES)
    if drawn.random() < 0.1:
        return len(original.data) - 1 - drawn.randrange(TRAILER_BYTES)
    span = drawn.choice(original.spans)
    if drawn.random() < 0.5:
        return span.begin + drawn.randrange(HEADER_BYTES)
    return span.end - 1 - drawn.randrange(min(SEAL_BYTES, span.length))


def cut_ends(bench: FaultBench, number: int) -> list[FaultTally]:
    """Cut sessions off at random bytes behind their first step."""
    tally = FaultTally("a file that is cut off behind its first step")
    for first in range(0, number, _PER_SESSION):
        rows = 4 if first // _PER_SESSION % 2 == 0 else 128
        original = record_original(bench, f"cuts{first}", steps=60 if rows == 4 else 400, rows_per_write=rows)
        for one in range(first, min(number, first + _PER_SESSION)):
            place = bench.drawn.randrange(original.begin, len(original.data))
            with tally.try_fault(f"{original.path.name}, cut at byte {place}"):
                damaged = [n for n, span in enumerate(original.spans) if span.end > place]
                data = original.data[:place]
                replay = one % _REPLAYED == 0
                _judge_damage(bench, original, data, damaged, replay=replay, cut=True)
                # What is behind the message that was cut was not recorded yet when, say, the power failed.
                tally.mend(original.session.steps - len(original.rows_without(damaged[:1])[0]))
    return [tally]


def _judge_damage(
    bench: FaultBench,
    original: OriginalSession,
    data: bytes | bytearray,
    damaged: list[int],
    *,
    replay: bool,
    cut: bool,
) -> int:
    path = bench.folder / "damaged.rrd"
    output = bench.folder / "damaged.repaired.rrd"
    path.write_bytes(data)
    if examine_session(path).whole:
        raise FalseReport("is reported as whole")
    if not cut and _is_readable(path):
        raise FalseReport("is read as if it were whole")
    repair_session(path, output)
    if not examine_session(output).whole:
        raise StepsLost("is not whole after its repair")
    missing = require_all_but(output, original, damaged, cut=cut)
    if replay:
        bench.require_replay(output)
    return missing


def _is_readable(path: Path) -> bool:
    try:
        read_session(path)
    except SessionError:
        return False
    return True


def flip_bits_without_checksums(bench: FaultBench, number: int) -> list[FaultTally]:
    """Flip single bits in an old session: what is accepted although its data differ is counted apart."""
    tally = FaultTally("a flipped bit in an old session without checksums")
    unseen = FaultTally("  of these, not seen without checksums")
    original = OriginalSession(SAMPLE)
    for _ in range(number):
        place, bit = bench.drawn.randrange(len(original.data)), bench.drawn.randrange(8)
        data = bytearray(original.data)
        data[place] ^= 1 << bit
        with tally.try_fault(f"{SAMPLE.name}, byte {place}, bit {bit}"):
            seen, missing, differ = _judge_unsealed(bench, original, data, original.find_message(place))
            if differ:
                unseen.tried += 1
                unseen.missing = max(unseen.missing, missing)
            if seen:
                tally.mend(missing)
            else:
                tally.whole += 1
    return [tally, unseen]


def _judge_unsealed(
    bench: FaultBench, original: OriginalSession, data: bytearray, damaged: int
) -> tuple[bool, int, str]:
    path = bench.folder / "unsealed.rrd"
    output = bench.folder / "unsealed.repaired.rrd"
    path.write_bytes(data)
    seen = not examine_session(path).whole
    if seen:
        repair_session(path, output)
        if not examine_session(output).whole:
            raise StepsLost("is not whole after its repair")
        path = output
    session = read_session(path)
    differ = list_differences(session, read_activations(path), original)
    left = len(session.digests)
    if left < len(original.rows_without([damaged])[0]):
        raise StepsLost(f"{original.session.steps - left} steps are missing")
    return seen, original.session.steps - left, differ
