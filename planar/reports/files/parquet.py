"""A run of positions as the content of a Parquet file."""

from __future__ import annotations

from collections.abc import Iterable

from planar.foundation.errors import BadInput
from planar.reports.columns import ReportedSeries, run_columns, run_header
from planar.results.motion import Motion


def require_pyarrow() -> None:
    """Make sure that pyarrow is there before a long run. Raises BadInput."""
    try:
        import pyarrow.parquet as _  # noqa: F401
    except ImportError:
        raise BadInput("pyarrow", 'Parquet files need pyarrow: pip install "planar-linkages[parquet]"') from None


def encode_parquet(motion: Motion, more: Iterable[ReportedSeries] = ()) -> bytes:
    """The columns of a CSV file, with the same heads, as doubles. Raises BadInput where pyarrow is not installed.

    Every field has "unit" and "quantity" in its metadata, the schema has "mechanism", "outcome" and "reason". What is
    not determined is null, a missing value, as it is blank in CSV: queries pass over nulls, but one NaN spoils a mean.
    """
    require_pyarrow()
    import pyarrow as pa
    from pyarrow import parquet

    fields, arrays = [], []
    for column in run_columns(motion, more):
        arrays.append(pa.array(column.values, pa.float64(), from_pandas=True))  # that is: NaN is null
        told = {"unit": column.unit, "quantity": column.kind}
        fields.append(pa.field(column.head, pa.float64(), metadata=told))
    content = pa.BufferOutputStream()
    # numbers that hardly ever come twice need no dictionary
    table = pa.table(arrays, schema=pa.schema(fields, metadata=run_header(motion)))
    parquet.write_table(table, content, use_dictionary=False)
    return content.getvalue().to_pybytes()
