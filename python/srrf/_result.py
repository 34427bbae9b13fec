"""What a registration answers."""

from __future__ import annotations

import html
import json
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _srrf
from ._arrays import Cloud, cloud_of
from ._errors import InputError


@dataclass(frozen=True, eq=False)
class Pose:
    """One pose that fits."""

    target_from_source: NDArray[np.float64]
    """Shape (4, 4): ``target ~ target_from_source @ source``, in the unit and the frame of the input."""
    probability: float | None
    """Probability that it is right, in [0, 1], where it is known."""


class Result:
    """A registration, and what speaks for it.

    Results pickle with all figures and without the clouds: :meth:`to_html` takes them again.
    """

    __slots__ = ("_text", "_figures", "_clouds")

    def __init__(self, text: str, clouds: tuple[_srrf.Cloud, _srrf.Cloud] | None = None) -> None:
        """From the JSON that :meth:`to_json` and ``srrf register --json`` write."""
        figures = json.loads(text)
        if not isinstance(figures, dict) or "target_from_source" not in figures:
            raise InputError("not an answer in JSON; pass what Result.to_json() or `srrf register --json` wrote")
        self._text = text
        self._figures: dict[str, Any] = figures
        self._clouds = clouds

    @property
    def target_from_source(self) -> NDArray[np.float64]:
        """The pose, shape (4, 4), float64: ``target ~ R source + t``, in the unit and the frame of the input."""
        return np.array(self._figures["target_from_source"], dtype=np.float64)

    @property
    def rotation(self) -> NDArray[np.float64]:
        """The rotation R, shape (3, 3)."""
        return self.target_from_source[:3, :3]

    @property
    def translation(self) -> NDArray[np.float64]:
        """The translation t, shape (3,), in the unit of the input."""
        return self.target_from_source[:3, 3]

    @property
    def quaternion_wxyz(self) -> NDArray[np.float64]:
        """The rotation as a unit quaternion, shape (4,), scalar first and not negative."""
        return np.array(self._figures["quaternion_wxyz"], dtype=np.float64)

    @property
    def quaternion_xyzw(self) -> NDArray[np.float64]:
        """The same with the scalar last, as SciPy and ROS have it."""
        return np.roll(self.quaternion_wxyz, -1)

    @property
    def probability(self) -> float:
        """Calibrated probability that the pose is right: within 5 degrees and a tenth of the target's radius."""
        return float(self._figures["probability"])

    @property
    def abstain(self) -> bool:
        """Whether the probability is too small to rely on the pose."""
        return bool(self._figures["abstain"])

    @property
    def scale(self) -> float:
        """What the source was multiplied by before it was moved: 1 where no scale was asked for."""
        applied = self._figures.get("scale")
        return 1.0 if applied is None else float(applied["factor"])

    @property
    def poses(self) -> list[Pose]:
        """All poses that fit, the answer first. More than one where the clouds do not tell them apart."""
        others = self._figures.get("poses") or [
            {"target_from_source": self._figures["target_from_source"], "probability": self.probability}
        ]
        return [Pose(np.array(p["target_from_source"], dtype=np.float64), p.get("probability")) for p in others]

    @property
    def undetermined(self) -> Any:
        """Motions that the clouds leave open, as in :meth:`to_dict`; empty or None where there are none."""
        return self._figures.get("undetermined")

    @property
    def evidence(self) -> dict[str, Any]:
        """What speaks for the pose: ``fitness``, ``inlier_rmse``, ``overlap_target``, ``information`` (6 x 6), and more."""
        return dict(self._figures["evidence"])

    @property
    def warnings(self) -> list[str]:
        """What a user should know, in sentences; also which points were left out because they are NaN or infinite."""
        return [str(warning) for warning in self._figures["warnings"]]

    @property
    def seconds(self) -> dict[str, float]:
        """Wall time of each stage."""
        return dict(self._figures["seconds"])

    def to_dict(self) -> dict[str, Any]:
        """All figures. The keys are those of ``srrf register --json``."""
        figures: dict[str, Any] = json.loads(self._text)
        return figures

    def to_json(self) -> str:
        """All figures in one line of JSON, every number in full."""
        return self._text

    def transform(self, points: Cloud) -> NDArray[np.float64]:
        """Points of the source, scaled where a scale was asked for and moved onto the target: shape (N, 3), float64."""
        from ._arrays import points_of

        scaled = points_of(points, "points").astype(np.float64) * self.scale
        moved: NDArray[np.float64] = scaled @ self.rotation.T + self.translation
        return moved

    def to_html(
        self, source: Cloud | None = None, target: Cloud | None = None, *, unit: str = "", up: str | None = None
    ) -> str:
        """A page with a picture that turns, for any browser.

        Args:
            source: the source again, for results that were pickled.
            target: the target again.
            unit: unit of the coordinates, such as ``"m"``.
            up: the axis that points up, such as ``"z"`` or ``"-y"``; None guesses it from the target.

        Raises:
            InputError: where the clouds are not known any more.
        """
        if source is not None and target is not None:
            clouds = (cloud_of(source, None, "source"), cloud_of(target, None, "target"))
        elif self._clouds is not None:
            clouds = self._clouds
        else:
            raise InputError("a result from a pickle holds no clouds; call to_html(source, target)")
        return _srrf.page(self._text, clouds[0], clouds[1], unit, up)

    def _repr_html_(self) -> str:
        """The page in a notebook; a table of figures where the clouds are not known any more."""
        if self._clouds is not None:
            page = html.escape(self.to_html(), quote=True)
            return f'<iframe srcdoc="{page}" width="100%" height="560" style="border:0"></iframe>'
        rows = {
            "verdict": f"{'abstain' if self.abstain else 'probably right'} ({100 * self.probability:.0f} %)",
            "target_from_source": np.array2string(self.target_from_source, precision=6),
            "picture": "to_html(source, target)",
        }
        cells = "".join(f"<tr><th>{k}</th><td><pre>{html.escape(v)}</pre></td></tr>" for k, v in rows.items())
        return f"<table>{cells}</table>"

    def __repr__(self) -> str:
        verdict = "abstain" if self.abstain else "probably right"
        pose = np.array2string(self.target_from_source, precision=4, suppress_small=True)
        return f"<srrf.Result {verdict} ({100 * self.probability:.0f} %)\n{pose}>"

    def __eq__(self, other: object) -> bool:
        """Whether all figures but the times are equal."""
        if not isinstance(other, Result):
            return NotImplemented
        return {**self._figures, "seconds": None} == {**other._figures, "seconds": None}

    __hash__ = None  # type: ignore[assignment]

    def __reduce__(self) -> tuple[type[Result], tuple[str]]:
        return Result, (self._text,)
