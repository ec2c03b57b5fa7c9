"""TQC of sb3-contrib: SAC with distributional critics whose largest quantiles are dropped (Kuznetsov et al. 2020, arXiv:2005.04269)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sb3_contrib import TQC

from lean_yaw_env.validation import require_count

from .sac import EvenlyStarted, SACLearner, SACSettings


@dataclass(frozen=True)
class TQCSettings(SACSettings):
    """Settings of TQC, with those of ``SACSettings``.

    Attributes
    ----------
    critics : number of them
    quantiles : of each critic
    dropped : of each critic's quantiles, the largest
    """

    critics: int = 2
    quantiles: int = 25
    dropped: int = 2

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require_counts("critics", "quantiles")
        require_count("dropped", self.dropped, 0, self.quantiles - 1)


class EvenlyStartedTQC(EvenlyStarted, TQC):
    """sb3-contrib's TQC, resumable."""


class TQCLearner(SACLearner):
    """TQC with a discount in time; see ``learner.Learner``."""

    algorithm = EvenlyStartedTQC

    def make_model(self, settings: TQCSettings, **common: Any) -> Any:
        return super().make_model(
            settings, top_quantiles_to_drop_per_net=settings.dropped, **common
        )

    def network_arguments(self, settings: TQCSettings) -> dict[str, Any]:
        """With the critics' quantiles."""
        critics = {"n_critics": settings.critics, "n_quantiles": settings.quantiles}
        return super().network_arguments(settings) | critics
