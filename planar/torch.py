"""A linkage as a layer of PyTorch: numbers of its file in, positions of its points out, differentiable and batched."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from planar.batch.linkage_layer import LinkageLayer
from planar.batch.prepared import RangeArguments
from planar.foundation.errors import BadInput

try:
    import torch
except ImportError:
    raise BadInput("torch", 'planar.torch needs PyTorch: pip install "planar-linkages[torch]"') from None

__all__ = ["Linkage"]


class Linkage(torch.nn.Module):
    """A linkage of any structure as a differentiable function, in double precision.

    `free`: the numbers of the file that are given, by name, in the order of the values' last axis; `points`, `steps`,
    `rates`, `start`, `stop` and `pair` as `planar.prepared` has them. Called with values (..., free) in SI it gives
    positions (..., steps + 1, 2), of several points (..., steps + 1, points, 2); with `rates` velocities and
    accelerations of the same shape after them; and a mask (..., steps + 1) of the positions that are solved. What is
    not solved is 0, and has no derivative but 0.

    `file_values` (free,) are those of the file, from which one may begin. `torch.func.vmap` and `grad` go over it, jobs
    on other devices come to the processor and back; there are no second derivatives.

    Raises BadInput for what is not there, cannot change alone, or has no derivatives, and for single precision.
    """

    def __init__(  # many: as `planar.prepared`
        self,
        mechanism: Any,
        free: Sequence[str] | str,
        points: Sequence[str] | str | None = None,
        steps: int = 360,
        *,
        rates: bool = False,
        start: float | None = None,
        stop: float | None = None,
        pair: str | None = None,
    ):
        super().__init__()
        self.layer = LinkageLayer(
            mechanism, free, points, steps, rates, RangeArguments(start=start, stop=stop, pair=pair)
        )
        self.register_buffer("file_values", torch.from_numpy(self.layer.file_values.copy()), persistent=False)

    def forward(self, values: torch.Tensor) -> tuple[torch.Tensor, ...]:
        """Positions, rates where there are any, and the mask."""
        self.layer.check_shape(values.shape)
        if values.dtype != torch.float64:
            raise BadInput("values", f"double precision is wanted here, not {values.dtype}; write values.double()")
        found: tuple[torch.Tensor, ...] = _Run.apply(self.layer, values)
        return found

    def extra_repr(self) -> str:
        """What stands in the module's text."""
        return repr(self.layer)


class _Run(torch.autograd.Function):
    """Runs of designs (..., free)."""

    @staticmethod
    def forward(layer: LinkageLayer, values: torch.Tensor) -> tuple[torch.Tensor, ...]:
        told, solved = layer.run(values.detach().cpu().numpy())
        return tuple(torch.from_numpy(each).to(values.device) for each in (*told, solved))

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: tuple[torch.Tensor, ...]) -> None:
        ctx.layer, values = inputs
        ctx.save_for_backward(values)
        ctx.mark_non_differentiable(output[-1])

    @staticmethod
    def backward(ctx: Any, *weights: torch.Tensor) -> tuple[None, torch.Tensor]:
        return None, _PullBack.apply(ctx.layer, *ctx.saved_tensors, *weights[:-1])

    @staticmethod
    def vmap(info: Any, in_dims: tuple[Any, ...], layer: LinkageLayer, values: torch.Tensor) -> tuple[Any, ...]:
        found = _Run.apply(layer, _batch_first(values, in_dims[1], info.batch_size))
        return found, (0,) * len(found)


class _PullBack(torch.autograd.Function):
    """The derivatives of weighed sums of runs."""

    @staticmethod
    def forward(layer: LinkageLayer, values: torch.Tensor, *weights: torch.Tensor) -> torch.Tensor:
        given = [each.detach().cpu().numpy() for each in weights]
        return torch.from_numpy(layer.pull_back(values.detach().cpu().numpy(), given)).to(values.device)

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: torch.Tensor) -> None:
        pass

    @staticmethod
    def backward(_ctx: Any, *_: torch.Tensor) -> None:
        raise BadInput("values", "a linkage's layer has first derivatives alone, and no second ones")

    @staticmethod
    def vmap(
        info: Any, in_dims: tuple[Any, ...], layer: LinkageLayer, *tensors: torch.Tensor
    ) -> tuple[torch.Tensor, int]:
        every = zip(tensors, in_dims[1:], strict=True)
        return _PullBack.apply(layer, *(_batch_first(each, at, info.batch_size) for each, at in every)), 0


def _batch_first(values: torch.Tensor, at: int | None, count: int) -> torch.Tensor:
    """Values with the axis of a batch before all others; where they have none, the same for all."""
    return values.expand(count, *values.shape) if at is None else values.movedim(at, 0)
