"""Registering two clouds."""

from __future__ import annotations

import os
from typing import Any, Literal, TypedDict, Union

import numpy as np
from numpy.typing import NDArray

from . import _srrf
from ._arrays import Cloud, cloud_of, pose_of
from ._errors import OptionError
from ._options import real, seed_of, text, threads_of, truth
from ._result import Result

Method = Literal["auto", "srrf", "fpfh-ransac", "icp", "given"]
Rotation = Literal["so3", "180", "45", 180, 45]
Scale = Union[float, Literal["auto"], None]


class Options(TypedDict):
    """The options of a :class:`Registrar`."""

    method: str
    rotation: str
    refine: bool
    weights: str | None
    device: str
    seed: int
    abstain_below: float
    vertices: bool
    scale: float | str | None
    num_threads: int | None


class Registrar:
    """Registers pairs with one set of options; the network is loaded once.

    Share it between threads. It pickles by its options, and goes on in forked and spawned processes.

    Args:
        method: how starts are found: ``"auto"`` (all of them), ``"srrf"`` (the network), ``"fpfh-ransac"``, ``"icp"``,
            ``"given"`` (only the first guess).
        rotation: how far one cloud may be turned against the other: ``"so3"`` (any rotation) or ``"45"`` (less than that
            many degrees about each axis).
        refine: whether the best start is refined.
        weights: weights of the network: a file, or a name that ``python -m srrf weights`` lists.
        device: where the network runs: ``"flex"`` (CPU).
        seed: seed of the random samples. The same seed gives the same answer, on any number of threads.
        abstain_below: the verdict is to abstain where the probability is below this.
        vertices: whether the vertices of a mesh are its cloud. Without it points are drawn from its surface, as dense as the other
            cloud, as the program does.
        scale: what the source is multiplied by before it is moved, such as ``srrf.unit_factor("mm", "m")``; ``"auto"`` estimates
            it; None refuses clouds that seem to be in different units.
        num_threads: worker threads; None for all cores.

    Raises:
        OptionError: for options that make no sense, and weights or a device that cannot be used.
    """

    __slots__ = ("_inner", "_options")

    def __init__(
        self,
        *,
        method: Method = "auto",
        rotation: Rotation = "so3",
        refine: bool = True,
        weights: str | os.PathLike[str] | None = None,
        device: str = "flex",
        seed: int = 0,
        abstain_below: float = 0.5,
        vertices: bool = False,
        scale: Scale = None,
        num_threads: int | None = None,
    ) -> None:
        self._options = checked_options(
            method=method,
            rotation=rotation,
            refine=refine,
            weights=weights,
            device=device,
            seed=seed,
            abstain_below=abstain_below,
            vertices=vertices,
            scale=scale,
            num_threads=num_threads,
        )
        self._inner = _srrf.Registrar(**self._options)

    @property
    def options(self) -> Options:
        """A copy of the options."""
        return self._options.copy()

    def prepare(self, target: Cloud, *, name: str | None = None) -> Target:
        """Makes a target ready for many sources.

        Args:
            target: a file, or points of shape (N, >= 3).
            name: what messages call it; its path, or ``"target"``.

        Raises:
            InputError: for a cloud that determines no rotation, and for a mesh without ``vertices=True``: how densely its surface is
                drawn depends on the source.
        """
        return Target(self, self._inner.prepare(cloud_of(target, name, "target")))

    def register(
        self,
        source: Cloud,
        target: Cloud | Target,
        *,
        initial: NDArray[Any] | Result | None = None,
        names: tuple[str | None, str | None] = (None, None),
    ) -> Result:
        """Finds the pose that lays ``source`` on ``target``: ``target ~ R source + t``.

        Points with NaN or infinity are left out, and ``Result.warnings`` says so, as the program does.

        Args:
            source: the cloud to move: a file, or points of shape (N, >= 3), in any unit.
            target: the cloud to lay it on, in the same unit; or one made ready by :meth:`prepare`.
            initial: a first guess of the pose, shape (4, 4).
            names: what messages call the two.

        Raises:
            InputError: for clouds that determine no rotation, and other shapes.
            NoPoseError: where no pose is found.
        """
        laid = cloud_of(source, names[0], "source")
        guess = None if initial is None else pose_of(initial, "initial")
        if isinstance(target, Target):
            text, *clouds = self._inner.register(laid, target._inner, guess)
        else:
            text, *clouds = self._inner.register(laid, cloud_of(target, names[1], "target"), guess)
        return Result(text, (clouds[0], clouds[1]))

    def __repr__(self) -> str:
        return f"srrf.Registrar({', '.join(f'{k}={v!r}' for k, v in self._options.items())})"

    def __reduce__(self) -> tuple[Any, tuple[Options]]:
        return _registrar, (self._options,)


class Target:
    """A target made ready for many sources, by :meth:`Registrar.prepare`. It pickles by its points."""

    __slots__ = ("_inner", "_registrar")

    def __init__(self, registrar: Registrar, inner: _srrf.Target) -> None:
        self._registrar = registrar
        self._inner = inner

    @property
    def points(self) -> NDArray[np.float64]:
        """A copy of its finite points, shape (N, 3)."""
        return self._inner.cloud.points()

    def __len__(self) -> int:
        return len(self._inner.cloud)

    def __repr__(self) -> str:
        return f"<srrf.Target {self._inner.cloud.name}: {len(self)} points>"

    def __reduce__(self) -> tuple[Any, tuple[Registrar, NDArray[np.float64], str]]:
        cloud = self._inner.cloud
        left_out = np.full((cloud.dropped, 3), np.nan)  # so that they are counted again
        return _target, (self._registrar, np.concatenate([self.points, left_out]), cloud.name)


def register(
    source: Cloud,
    target: Cloud,
    *,
    initial: NDArray[Any] | Result | None = None,
    method: Method = "auto",
    rotation: Rotation = "so3",
    refine: bool = True,
    weights: str | os.PathLike[str] | None = None,
    device: str = "flex",
    seed: int = 0,
    abstain_below: float = 0.5,
    vertices: bool = False,
    scale: Scale = None,
    num_threads: int | None = None,
) -> Result:
    """Finds the pose that lays ``source`` on ``target``, and says whether to rely on it.

    The network is loaded on the first call with these options, and kept. Ctrl-C ends a long call.

    Args:
        source: the cloud to move: a file, points of shape (N, >= 3) in any unit, an Open3D cloud, a trimesh mesh, a tensor.
        target: the cloud to lay it on, in the same unit.
        initial: a first guess of the pose, shape (4, 4), or a :class:`Result`.
        method: as for :class:`Registrar`, and so are all that follow.

    Returns:
        The :class:`Result`; its ``target_from_source`` is the pose, shape (4, 4), float64.

    Raises:
        InputError: for clouds that determine no rotation, and other shapes.
        OptionError: for options that make no sense.
        NoPoseError: where no pose is found.
    """
    options = checked_options(
        method=method,
        rotation=rotation,
        refine=refine,
        weights=weights,
        device=device,
        seed=seed,
        abstain_below=abstain_below,
        vertices=vertices,
        scale=scale,
        num_threads=num_threads,
    )
    return _registrar(options).register(source, target, initial=initial)


def checked_options(
    *,
    method: str,
    rotation: str | int,
    refine: bool,
    weights: str | os.PathLike[str] | None,
    device: str,
    seed: int,
    abstain_below: float,
    vertices: bool,
    scale: float | str | None,
    num_threads: int | None,
) -> Options:
    """The options as the library takes them, each checked by its name."""
    if scale is not None and not isinstance(scale, str):
        if isinstance(scale, bool) or not isinstance(scale, (int, float, np.integer, np.floating)):
            raise OptionError(f'scale is {scale!r}: expected a number above 0, "auto", or None')
        scale = float(scale)
    if not isinstance(rotation, str) and rotation in (45, 180):
        rotation = int(rotation)
    try:
        named = None if weights is None else os.fsdecode(weights)
    except TypeError:
        raise OptionError(f"weights is {weights!r}: expected a file, a name, or None") from None
    return Options(
        method=text("method", method),
        rotation=str(rotation),
        refine=truth("refine", refine),
        weights=named,
        device=text("device", device),
        seed=seed_of(seed),
        abstain_below=real("abstain_below", abstain_below),
        vertices=truth("vertices", vertices),
        scale=scale,
        num_threads=threads_of(num_threads),
    )


#: Registrars that were used, the last one last: a network of 7 MB each.
_used: dict[tuple[Any, ...], Registrar] = {}
_KEPT = 4


def _registrar(options: Options) -> Registrar:
    """One with these options, kept for the next call."""
    weights = options["weights"]
    key: tuple[Any, ...] = tuple(options.values())
    if weights is not None and os.path.isfile(weights):  # which may have changed
        stat = os.stat(weights)
        key += (stat.st_mtime_ns, stat.st_size)
    registrar = _used.get(key)
    if registrar is None:
        registrar = Registrar(**options)  # type: ignore[arg-type]
        _used[key] = registrar
        for old in list(_used)[:-_KEPT]:
            _used.pop(old, None)
    return registrar


def _target(registrar: Registrar, points: NDArray[np.float64], name: str) -> Target:
    return registrar.prepare(points, name=name)
