"""Random numbers that are looked up, not drawn: the n-th number of a named stream, from integer arithmetic alone.

Whoever asks for number n gets the same one whatever was asked before, so a robot that is driven differently still
meets the same noise, reading for reading. Must not know what the numbers are for.
"""

_MASK = (1 << 64) - 1
_STEP = 0x9E3779B97F4A7C15  # 2^64 over the golden ratio: the increment of splitmix64
_LOW = 0xFFFF


def _mix(z: int) -> int:
    """The output function of splitmix64 (Steele, Lea, Flood 2014)."""
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & _MASK
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & _MASK
    return z ^ (z >> 31)


class Noise:
    """The stream of that name under that seed; n ≥ 0 counts its numbers, each kind of number from n on its own."""

    def __init__(self, seed: int, stream: str) -> None:
        key = _mix(seed & _MASK)
        for byte in stream.encode():
            key = _mix((key + byte + _STEP) & _MASK)
        self._key = key

    def bits(self, n: int) -> int:
        """64 bits."""
        return _mix((self._key + (n + 1) * _STEP) & _MASK)

    def chances(self, n: int) -> tuple[float, float, float, float]:
        """Four independent numbers in [0, 1) in steps of 2^-16."""
        bits = self.bits(n)
        return (bits & _LOW) / 65536, (bits >> 16 & _LOW) / 65536, (bits >> 32 & _LOW) / 65536, (bits >> 48) / 65536

    def uniform(self, n: int) -> float:
        """In [0, 1), in steps of 2^-53."""
        return (self.bits(n) >> 11) / (1 << 53)

    def normal(self, n: int) -> float:
        """Mean 0, standard deviation 1, within ±6: the sum of twelve uniforms (Irwin and Hall), in integers."""
        total = 0
        for bits in (self.bits(3 * n), self.bits(3 * n + 1), self.bits(3 * n + 2)):
            total += (bits & _LOW) + (bits >> 16 & _LOW) + (bits >> 32 & _LOW) + (bits >> 48)
        return (2 * total - 12 * _LOW) / 131072
