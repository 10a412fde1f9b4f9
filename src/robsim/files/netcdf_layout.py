"""The layout of NetCDF-4 in HDF5: dimension scales, variables and attributes.

Every dimension is a dimension scale with a number, and a variable is attached to the scales of its
dimensions. A dimension without a coordinate variable is a scale without values. Source: Unidata,
NetCDF-4 format specification. The h5netcdf package writes the same in ten times the time, because
it opens the objects of the file again for each attribute, and the high-level functions of h5py in
twice the time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

EMPTY_SCALE = "This is a netCDF dimension but not a netCDF variable. {:>10}"
OTHER = "_nc4_non_coord_"  # begins the name of a variable that is named as another's dimension


def write_variables(run: xr.Dataset, file: Any) -> dict[str, Any]:
    """Write a Dataset to an open HDF5 file; return the h5py.h5d.DatasetID of each variable by name.

    Values and attributes follow the conventions of xarray.
    """
    encoded = xr.conventions.encode_dataset_coordinates(run.drop_encoding())
    variables, attributes = xr.conventions.cf_encoder(*encoded)
    sizes = {dim: size for each in variables.values() for dim, size in each.sizes.items()}
    numbers = {dim: i for i, dim in enumerate(sizes)}
    scales, stored = {}, {}
    for dim, size in sizes.items():
        if dim not in variables or variables[dim].dims[:1] != (dim,):
            scales[dim] = _create_dataset(file, dim, (size,), np.dtype(">f4"))
            _make_scale(scales[dim], EMPTY_SCALE.format(size), numbers[dim])
    for name, variable in variables.items():
        if str(name).startswith(OTHER):
            raise ValueError(f"{name}: names of NetCDF-4 begin so")
        stored[name] = _write_variable(file, OTHER * (name in scales) + name, variable)
        if name in sizes and name not in scales:
            scales[name] = stored[name]
            _make_scale(stored[name], name, numbers[name])
    for name, variable in variables.items():
        _attach_scales(stored[name], variable.dims, scales, numbers)
    _write_attributes(file.id, attributes)
    return stored


def _write_variable(file: Any, name: str, variable: xr.Variable) -> Any:
    """Return the dataset of a variable, with its values and attributes."""
    from h5py import h5s

    values = np.asarray(variable.data, order="C")
    if values.dtype.kind in "OUT":
        values = values.astype(object)
    fill = variable.attrs.get("_FillValue")
    dataset = _create_dataset(file, name, values.shape, values.dtype, fill)
    if values.size:
        dataset.write(h5s.ALL, h5s.ALL, values, _make_types(values.dtype)[1])
    _write_attributes(dataset, variable.attrs)
    return dataset


def _create_dataset(
    file: Any, name: str, shape: tuple[int, ...], dtype: np.dtype[Any], fill: Any = None
) -> Any:
    """Return a new dataset without values, and without the time of its creation."""
    from h5py import h5d, h5p, h5s, h5t

    link, layout = h5p.create(h5p.LINK_CREATE), h5p.create(h5p.DATASET_CREATE)
    link.set_char_encoding(h5t.CSET_UTF8)
    layout.set_obj_track_times(False)
    layout.set_attr_creation_order(h5p.CRT_ORDER_TRACKED | h5p.CRT_ORDER_INDEXED)
    if fill is not None:
        layout.set_fill_value(np.asarray(fill))
    kind, space = _make_types(dtype)[0], h5s.create_simple(shape)
    return h5d.create(file.id, name.encode(), kind, space, layout, link)


def _make_scale(dataset: Any, label: str, number: int) -> None:
    """Make a dataset the scale of the dimension with a number."""
    from h5py import h5ds

    _write_attribute(dataset, "_Netcdf4Dimid", np.int32(number))
    h5ds.set_scale(dataset, label.encode())


def _attach_scales(
    dataset: Any, dims: Sequence[str], scales: Mapping[str, Any], numbers: Mapping[str, int]
) -> None:
    """Write the numbers of the dimensions of a dataset; attach their scales to it if it is none."""
    from h5py import h5ds

    if dims:
        places = np.array([numbers[dim] for dim in dims], "i4")
        _write_attribute(dataset, "_Netcdf4Coordinates", places)
        if not h5ds.is_scale(dataset):
            _write_attribute(dataset, "_Netcdf4Dimid", places[0])
            for i, dim in enumerate(dims):
                h5ds.attach_scale(dataset, scales[dim], i)


def _write_attributes(to: Any, attributes: Mapping[Any, Any]) -> None:
    """Write attributes to a file or a dataset: texts, and arrays of numbers or texts."""
    for key, value in attributes.items():
        values = np.atleast_1d(value)
        if values.dtype.kind in "OUT":
            values = np.asarray(value, object)
            if not all(isinstance(each, str) for each in values.flat):
                raise TypeError(f"attribute {key}: expected numbers or texts, got {value!r}")
        _write_attribute(to, key, values)


def _write_attribute(to: Any, name: str, value: ArrayLike) -> None:
    """Write one attribute: a number or an array of numbers, or of texts as objects."""
    from h5py import h5a, h5s

    values = np.asarray(value, order="C")
    stored, memory = _make_types(values.dtype)
    h5a.create(to, name.encode(), stored, h5s.create_simple(values.shape)).write(values, memory)


@cache
def _make_types(dtype: np.dtype[Any]) -> tuple[Any, Any]:
    """Return the types of HDF5 for numbers, or for texts as objects, in a file and in memory."""
    from h5py import h5t, string_dtype

    kind = string_dtype() if dtype.kind == "O" else dtype
    return h5t.py_create(kind, logical=True), h5t.py_create(kind)
