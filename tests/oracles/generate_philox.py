"""Oracle: known answers of the counter-based generator Philox4x32-10.

Program: plain Python integers, nothing to install.
Run:     python tests/oracles/generate_philox.py
Writes:  philox.json, always the same numbers.

The published vectors are the three `philox4x32 10` lines of tests/kat_vectors of Random123
(https://github.com/DEShawResearch/random123, commit 9545ff6413f258be2f04c1d319d99aaef7521150).
The implementation below follows the paper (Salmon, Moraes, Dror, Shaw: Parallel random numbers:
as easy as 1, 2, 3; SC 2011), must give these, and then adds further cases. Words are 32 bit, in
hexadecimal, word 0 first.
"""

import platform
import random

from _store import store

WORD = 2**32
MULTIPLIERS = (0xD2511F53, 0xCD9E8D57)
KEY_STEPS = (0x9E3779B9, 0xBB67AE85)  # the golden ratio and sqrt(3) - 1, as fractions of 2**32

PUBLISHED = """
00000000 00000000 00000000 00000000 00000000 00000000   6627e8d5 e169c58d bc57ac4c 9b00dbd8
ffffffff ffffffff ffffffff ffffffff ffffffff ffffffff   408f276d 41c83b0e a20bc7c6 6d5451fd
243f6a88 85a308d3 13198a2e 03707344 a4093822 299f31d0   d16cfe09 94fdcceb 5001e420 24126ea1
"""


def philox(counter, key, rounds=10):
    """Ten rounds: two full products, their halves crossed over and mixed with the key."""
    (c0, c1, c2, c3), (k0, k1) = counter, key
    for _ in range(rounds):
        high0, low0 = divmod(MULTIPLIERS[0] * c0, WORD)
        high1, low1 = divmod(MULTIPLIERS[1] * c2, WORD)
        c0, c1, c2, c3 = high1 ^ c1 ^ k0, low1, high0 ^ c3 ^ k1, low0
        k0, k1 = (k0 + KEY_STEPS[0]) % WORD, (k1 + KEY_STEPS[1]) % WORD
    return [c0, c1, c2, c3]


def published_cases():
    """The vectors of Random123, each checked against `philox`."""
    for line in PUBLISHED.strip().splitlines():
        words = [int(word, 16) for word in line.split()]
        counter, key, output = words[:4], words[4:6], words[6:]
        if philox(counter, key) != output:
            raise SystemExit(f"the published vector does not come out: {line}")
        yield case(counter, key, output)


def further_cases(number=12):
    """Random counters and keys, with the outputs of `philox`."""
    source = random.Random(6)
    for _ in range(number):
        counter = [source.getrandbits(32) for _ in range(4)]
        key = [source.getrandbits(32) for _ in range(2)]
        yield case(counter, key, philox(counter, key))


def case(counter, key, output):
    """The words as hexadecimal text."""
    named = {"counter": counter, "key": key, "output": output}
    return {name: [f"{word:08x}" for word in words] for name, words in named.items()}


if __name__ == "__main__":
    document = {
        "made_by": f"big integers of Python {platform.python_version()}",
        "source": "Random123 tests/kat_vectors, lines philox4x32 10, commit 9545ff6413f2",
        "about": "Philox4x32-10; 32-bit words in hexadecimal, word 0 first",
        "published": list(published_cases()),
        "further": list(further_cases()),
    }
    store("philox.json", document)
