"""The layout of NetCDF-4 in HDF5: dimension scales, variables and attributes.

Every dimension is a dimension scale with a number, and a variable is attached to the scales of its
dimensions. A dimension without a coordinate variable is a scale without values. Source: Unidata,
NetCDF-4 format specification. The h5netcdf package writes the same in five times the time, because
it opens the objects of the file again for each attribute.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

EMPTY_SCALE = "This is a netCDF dimension but not a netCDF variable. {:>10}"
OTHER = "_nc4_non_coord_"  # begins the name of a variable that is named as another's dimension


def write_variables(run: xr.Dataset, file: Any) -> dict[str, Any]:
    """Write a Dataset to an open HDF5 file; return the stored variables, datasets of h5py, by name.

    Values and attributes follow the conventions of xarray.
    """
    encoded = xr.conventions.encode_dataset_coordinates(run.drop_encoding())
    variables, attributes = xr.conventions.cf_encoder(*encoded)
    sizes = {dim: size for each in variables.values() for dim, size in each.sizes.items()}
    numbers = {dim: i for i, dim in enumerate(sizes)}
    scales, stored = {}, {}
    for dim, size in sizes.items():
        if dim not in variables or variables[dim].dims[:1] != (dim,):
            scales[dim] = file.create_dataset(dim, (size,), ">f4", track_order=True)
            _make_scale(scales[dim], EMPTY_SCALE.format(size), numbers[dim])
    for name, variable in variables.items():
        if str(name).startswith(OTHER):
            raise ValueError(f"{name}: names of NetCDF-4 begin so")
        stored[name] = _write_variable(file, OTHER * (name in scales) + name, variable)
        if name in sizes and name not in scales:
            scales[name] = stored[name]
            _make_scale(stored[name], name, numbers[name])
    for name, variable in variables.items():
        _attach_scales(stored[name], [scales[dim] for dim in variable.dims])
        if variable.dims:
            _write_numbers(stored[name], [numbers[dim] for dim in variable.dims])
    _write_attributes(file, attributes)
    return stored


def _write_variable(file: Any, name: str, variable: xr.Variable) -> Any:
    """Return the dataset of a variable, with its values and attributes."""
    import h5py

    values = np.asarray(variable.data)
    is_text = values.dtype.kind in "OUT"
    fill = variable.attrs.get("_FillValue")
    dataset = file.create_dataset(
        name,
        values.shape,
        h5py.string_dtype() if is_text else values.dtype,
        fillvalue=fill,
        track_order=True,
    )
    if values.size:
        dataset[...] = values.astype(object) if is_text else values
    _write_attributes(dataset, variable.attrs)
    return dataset


def _make_scale(dataset: Any, label: str, number: int) -> None:
    """Make a dataset the scale of the dimension with a number."""
    import h5py

    dataset.attrs.create("_Netcdf4Dimid", number, dtype="i4")
    h5py.h5ds.set_scale(dataset.id, label.encode())


def _attach_scales(dataset: Any, scales: list[Any]) -> None:
    """Attach the scales of its dimensions to a dataset that is no scale itself."""
    import h5py

    if not h5py.h5ds.is_scale(dataset.id):
        for i, scale in enumerate(scales):
            h5py.h5ds.attach_scale(dataset.id, scale.id, i)


def _write_numbers(dataset: Any, dimensions: list[int]) -> None:
    """Write the numbers of the dimensions of a variable."""
    dataset.attrs.create("_Netcdf4Coordinates", dimensions, dtype="i4")
    if "_Netcdf4Dimid" not in dataset.attrs:
        dataset.attrs.create("_Netcdf4Dimid", dimensions[0], dtype="i4")


def _write_attributes(to: Any, attributes: Mapping[Any, Any]) -> None:
    """Write attributes to a file or a dataset: texts, and arrays of numbers or texts."""
    import h5py

    for key, value in attributes.items():
        if isinstance(value, str):
            to.attrs.create(key, value, dtype=h5py.string_dtype())
            continue
        values = np.atleast_1d(value)
        if values.dtype.kind in "OUT":
            if not all(isinstance(each, str) for each in np.ravel(np.asarray(value, dtype=object))):
                raise TypeError(f"attribute {key}: expected numbers or texts, got {value!r}")
            to.attrs.create(key, values.astype(object), dtype=h5py.string_dtype())
        else:
            to.attrs.create(key, values)
