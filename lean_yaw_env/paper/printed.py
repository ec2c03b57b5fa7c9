"""What a publication prints: a number with the room it leaves, or a statement with what it takes to hold."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PaperNumber:
    """A number as printed.

    Attributes
    ----------
    name : str
    printed : str
        The digits; their last place says how far it was rounded.
    where : str
        The place where it stands, and the source, if that is not this paper.
    meaning : str
    tolerance : float or None
        Greatest difference that agrees; None for half of the last printed digit.
    reason : str
        Why the tolerance is another one.
    """

    name: str
    printed: str
    where: str
    meaning: str
    tolerance: float | None = None
    reason: str = ""

    def __post_init__(self) -> None:
        if (self.tolerance is None) != (not self.reason):
            raise ValueError(f"number {self.name!r} needs a reason for its tolerance, and no other")

    @property
    def value(self) -> float:
        return float(self.printed)

    @property
    def decimals(self) -> int:
        """Digits behind the point."""
        return len(self.printed.partition(".")[2])

    @property
    def room(self) -> float:
        """Greatest difference that agrees."""
        return 0.5 * 10.0**-self.decimals if self.tolerance is None else self.tolerance

    @property
    def allowed(self) -> str:
        """The room with its reason."""
        return f"± {self.room:.2g}: {self.reason or 'half of the last printed digit'}"


@dataclass(frozen=True)
class Statement:
    """What the paper says without one number.

    Attributes
    ----------
    name : str
    printed : str
        The paper's words, shortened.
    where : str
    meaning : str
    criterion : str
        What has to hold for it to agree, where the words leave room.
    """

    name: str
    printed: str
    where: str
    meaning: str
    criterion: str = ""
