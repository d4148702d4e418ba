from __future__ import annotations

import threading
import time
from pathlib import Path

import numpy as np
import pytest

from pdtui.core.processes.shared_ring import SharedRing


def test_messages_of_any_size_come_out_as_they_went_in() -> None:
    rng = np.random.default_rng(0)
    sent = [rng.bytes(int(size)) for size in rng.integers(0, 300, 2000)]
    received: list[bytes] = []
    with SharedRing.create(1024) as ring, SharedRing(ring.path) as other:
        ring.unlink()

        def read() -> None:
            while len(received) < len(sent):
                message = other.read()
                if message is None:
                    time.sleep(0)
                else:
                    received.append(message)

        reader = threading.Thread(target=read)
        reader.start()
        for message in sent:
            while not ring.write(message):
                time.sleep(0)
        reader.join()
        assert other.read() is None
    assert received == sent


def test_a_full_ring_takes_nothing_until_it_is_read() -> None:
    with SharedRing.create(256) as ring:
        ring.unlink()
        written = 0
        while ring.write(bytes([written]) * 20):
            written += 1
        assert 4 <= written <= 8
        assert ring.read() == bytes([0]) * 20
        assert ring.write(b"more")
        assert [ring.read() for _ in range(written)] == [
            *(bytes([number]) * 20 for number in range(1, written)),
            b"more",
        ]
        assert ring.read() is None
        assert not ring.write(bytes(300))


@pytest.mark.parametrize("before", [0, 96, 120, 200, 248])
def test_the_largest_message_fits_wherever_the_ring_stands(before: int) -> None:
    with SharedRing.create(256) as ring:
        ring.unlink()
        ring.write(bytes(max(0, min(before, ring.largest_message) - 8)))
        ring.read()
        assert ring.write(b"x" * ring.largest_message)
        assert ring.read() == b"x" * ring.largest_message


def test_nothing_is_left_of_a_ring_without_its_name() -> None:
    with SharedRing.create(64) as ring:
        assert Path(ring.path).stat().st_mode & 0o077 == 0
        ring.unlink()
        assert not ring.path.exists()
        ring.reader_value = 7
        ring.increment_notice_count()
        assert (ring.reader_value, ring.notice_count) == (7, 1)
