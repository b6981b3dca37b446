"""Agreement of ribbon and shell in a test-suite of one's own: the names for it (`compare.studies.agreement`).

from compare.check import assert_agreement
"""

from __future__ import annotations

from compare.studies.agreement.pins import Pin, read_pins
from compare.studies.agreement.verdict import (
    Claim,
    Outcome,
    Verdict,
    assert_agreement,
    assert_pin,
    cache_folder,
    check,
)

__all__ = [
    "Claim", "Outcome", "Pin", "Verdict", "assert_agreement", "assert_pin", "cache_folder", "check", "read_pins",
]  # fmt: skip
