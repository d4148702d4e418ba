"""The command: every kind of fault, and the table."""

from __future__ import annotations

import argparse
import random
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from tests.faults.damaged_files import cut_ends, flip_bits, flip_bits_without_checksums
from tests.faults.fault_bench import ROOT, FaultBench
from tests.faults.fault_tally import MEANINGS, FaultTally, format_heading, format_verdict
from tests.faults.full_disks import fill_disks, fill_small_file_systems
from tests.faults.hostile_commands import read_hostile_files
from tests.faults.killed_headless_drives import kill_headless_drives, kill_starting_headless_drives
from tests.faults.killed_screens import kill_screens, kill_starting_screens
from tests.faults.killed_simulations import kill_simulations
from tests.faults.moved_files import move_files
from tests.faults.rival_drives import drive_into_one_file
from tests.small_map import write_small_map

Faults = Callable[[FaultBench, int], list[FaultTally]]

KINDS: dict[str, tuple[Faults, int]] = {
    "flips": (flip_bits, 1000),
    "old-flips": (flip_bits_without_checksums, 100),
    "cuts": (cut_ends, 1000),
    "kills": (kill_simulations, 90),
    "screens": (kill_screens, 45),
    "starts": (kill_starting_screens, 18),
    "headless": (kill_headless_drives, 30),
    "headless-starts": (kill_starting_headless_drives, 17),
    "pairs": (drive_into_one_file, 100),
    "disks": (fill_disks, 20),
    "small-disks": (fill_small_file_systems, 4),
    "moves": (move_files, 20),
    "hostile": (read_hostile_files, 1000),
}
"""Of each kind of fault: the function, and how many the full run tries."""


def main() -> int:
    """Run the kinds that are asked for and print the table; 1 if anything was lost, or pdtui lied."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.faults",
        description=__doc__,
        epilog=MEANINGS,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=f"{', '.join(KINDS)}; default: all")
    parser.add_argument("--seed", type=int, default=0)
    for kind, (_, number) in KINDS.items():
        parser.add_argument(f"--{kind}", type=int, default=number, metavar="N", help=f"default: {number}")
    asked = parser.parse_args()
    if unknown := set(asked.kinds) - KINDS.keys():
        parser.error(f"unknown: {', '.join(sorted(unknown))}; available: {', '.join(KINDS)}")
    print(f"commit {_describe_commit()}, seed {asked.seed}\n{format_heading()}", flush=True)
    tallies: list[FaultTally] = []
    with tempfile.TemporaryDirectory(prefix="faults-") as name:
        map_path = write_small_map(Path(name))
        for kind in asked.kinds or KINDS:
            faults, _ = KINDS[kind]
            begin = time.monotonic()
            folder = Path(name) / kind
            folder.mkdir()
            # Each kind draws for itself, so that it finds the same when it is run alone.
            bench = FaultBench(folder, map_path, random.Random(f"{asked.seed} {kind}").randrange(1 << 30))
            found = faults(bench, getattr(asked, kind.replace("-", "_")))
            for tally in found:
                print(tally.format_row(), flush=True)
            print(f"  ({time.monotonic() - begin:.0f} s)", flush=True)
            tallies += found
    print(format_verdict(tallies))
    return int(any(tally.bad for tally in tallies))


def _describe_commit() -> str:
    command = ["git", "describe", "--always", "--dirty"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    return done.stdout.strip() or "unknown"


if __name__ == "__main__":
    raise SystemExit(main())
