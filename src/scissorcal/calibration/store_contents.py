"""What the netCDF data of a stored result hold, read in a child process."""

from typing import Any

_NUMERIC = "fiub"


def load_contents(data: bytes, with_variables: bool) -> dict[str, Any]:
    """Attributes of the root that are text, and numeric variables by their path without "/".

    The HDF5 library loops for minutes on some files that were changed and sealed again, so that it
    runs in a child process, as for any other file of others.
    """
    import h5py

    variables: dict[str, Any] = {}

    def take(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and item.dtype.kind in _NUMERIC:
            variables[name] = item[...]

    with h5py.File(h5py.h5f.open_file_image(data), "r") as file:
        if with_variables:
            file.visititems(take)
        texts = {name: value for name, value in file.attrs.items() if isinstance(value, str)}
    return {"attributes": texts, "variables": variables}
