"""Frames: `FA FB N body checksum` cut out of a byte stream that may hold anything, every byte accounted for.

Must not know: what a body means, ports, clocks.
"""

from collections import deque
from dataclasses import dataclass

from sonarlog.errors import SonarlogError

HEADER = b"\xfa\xfb"
LENGTHS = range(3, 250)  # N counts body and checksum; more than 249 the controllers never send
LONGEST_BODY = LENGTHS[-1] - 2
STALE_NS = 2_000_000_000
"""A head this old whose end has still not come was none: the longest frame takes 0.3 s at 9600 baud."""


class BadBody(SonarlogError):
    """A body that no frame can carry."""

    def __init__(self, length: int) -> None:
        super().__init__(f"a packet of {length} bytes fits no frame: 1 to {LONGEST_BODY} bytes do")


@dataclass(frozen=True)
class Frame:
    """A body whose checksum is right; `t_ns` is when the chunk with its first header byte came."""

    t_ns: int
    body: bytes

    @property
    def wire_length(self) -> int:
        """Bytes it took on the line: header, length, body, checksum."""
        return len(self.body) + 5


@dataclass(frozen=True)
class BadFrame:
    """What had a frame's head but not its checksum: the bytes from that head up to the next possible one."""

    t_ns: int
    data: bytes


@dataclass(frozen=True)
class Junk:
    """Bytes between frames."""

    t_ns: int
    data: bytes


Piece = Frame | BadFrame | Junk


def checksum(body: bytes) -> int:
    """Sum of big-endian 16-bit words mod 2^16; a byte left over is XORed into the low byte."""
    even = len(body) & ~1
    total = ((sum(body[0:even:2]) << 8) + sum(body[1:even:2])) & 0xFFFF
    return total ^ body[-1] if len(body) > even else total


def frame(body: bytes) -> bytes:
    """The body as it goes over the line. Raises BadBody if it is empty or longer than 253 bytes."""
    if not 1 <= len(body) <= LONGEST_BODY:
        raise BadBody(len(body))
    return HEADER + bytes((len(body) + 2,)) + body + checksum(body).to_bytes(2, "big")


class Framer:
    """Bytes in, pieces out. There is no byte stuffing, so only length and checksum tell a head from a body's bytes:

    after a wrong checksum the head is given up and what follows it is looked at again. The bytes of all pieces, in
    order and with those of `finish`, are exactly the bytes fed.
    """

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._start = 0  # stream offset of the buffer's first byte
        self._chunks: deque[tuple[int, int]] = deque()  # (stream offset of the chunk's end, t_ns)

    def feed(self, data: bytes, t_ns: int) -> list[Piece]:
        """All pieces that these bytes complete; `t_ns` is when they came."""
        pieces: list[Piece] = []
        if not self._buffer:  # as nearly always: whole frames and nothing else
            frames, taken = _whole_frames(data, t_ns)
            pieces += frames
            self._start += taken
            data = data[taken:]
        if not data:
            return pieces
        self._buffer += data
        self._chunks.append((self._start + len(self._buffer), t_ns))
        while (piece := self._next(t_ns)) is not None:
            pieces.append(piece)
        return pieces

    def finish(self) -> list[Piece]:
        """No more bytes will come: what is left has no end, but a frame that a false head has swallowed is found."""
        pieces: list[Piece] = []
        while self._buffer:
            pieces.append(Junk(*self._take(_next_head(self._buffer, len(self._buffer)))))
            while (piece := self._next(self._chunks[-1][1])) is not None:
                pieces.append(piece)
        return pieces

    def _next(self, now_ns: int) -> Piece | None:
        buffer = self._buffer
        if not buffer:
            return None
        if not HEADER.startswith(buffer[:2]) or (len(buffer) > 2 and buffer[2] not in LENGTHS):
            return Junk(*self._take(_next_head(buffer, len(buffer))))
        if len(buffer) < 3 or len(buffer) < buffer[2] + 3:
            if now_ns - self._time_of_first() <= STALE_NS:
                return None  # the rest is still to come
            return BadFrame(*self._take(_next_head(buffer, len(buffer))))
        end = buffer[2] + 3
        body = bytes(buffer[3 : end - 2])
        if checksum(body) == int.from_bytes(buffer[end - 2 : end], "big"):
            return Frame(self._take(end)[0], body)
        return BadFrame(*self._take(_next_head(buffer, end)))

    def _time_of_first(self) -> int:
        """When the chunk came that brought the buffer's first byte."""
        while self._chunks[0][0] <= self._start:
            self._chunks.popleft()
        return self._chunks[0][1]

    def _take(self, count: int) -> tuple[int, bytes]:
        t_ns = self._time_of_first()
        data = bytes(self._buffer[:count])
        del self._buffer[:count]
        self._start += count
        return t_ns, data


def _whole_frames(data: bytes, t_ns: int) -> tuple[list[Frame], int]:
    """The frames that the bytes begin with, and where they end."""
    frames, at = [], 0
    while data.startswith(HEADER, at) and len(data) > at + 2 and data[at + 2] in LENGTHS:
        end = at + data[at + 2] + 3
        body = data[at + 3 : end - 2]
        if end > len(data) or checksum(body) != data[end - 2] << 8 | data[end - 1]:
            break
        frames.append(Frame(t_ns, body))
        at = end
    return frames, at


def _next_head(buffer: bytearray, end: int) -> int:
    """Where in buffer[1:end] the next head may begin (its second byte may lie beyond, or not be here yet)."""
    at = buffer.find(HEADER, 1, end + 1)
    if at >= 0:
        return at
    return end - 1 if end > 1 and end == len(buffer) and buffer[end - 1] == HEADER[0] else end
