"""From fits to a package for a 1 kHz loop: tables with an error bound, checked and hashed."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scissorcal.package.archive import read_manifest
    from scissorcal.package.build import PackageOptions, PackageSummary, build_package, put_review
    from scissorcal.package.check import check_package
    from scissorcal.package.manifest import Manifest, manifest_schema_text
    from scissorcal.package.model_package import (
        FailedFitsWarning,
        ModelPackage,
        OutsideCoverageWarning,
        open_package,
    )
    from scissorcal.package.review import REVIEW_FORMAT, Review, stamp

__all__ = [
    "REVIEW_FORMAT",
    "FailedFitsWarning",
    "Manifest",
    "ModelPackage",
    "OutsideCoverageWarning",
    "PackageOptions",
    "PackageSummary",
    "Review",
    "build_package",
    "check_package",
    "manifest_schema_text",
    "open_package",
    "put_review",
    "read_manifest",
    "stamp",
]

_HOMES = {
    "archive": ("read_manifest",),
    "build": ("PackageOptions", "PackageSummary", "build_package", "put_review"),
    "check": ("check_package",),
    "manifest": ("Manifest", "manifest_schema_text"),
    "model_package": (
        "FailedFitsWarning",
        "ModelPackage",
        "OutsideCoverageWarning",
        "open_package",
    ),
    "review": ("REVIEW_FORMAT", "Review", "stamp"),
}


def __getattr__(name: str) -> Any:
    for home, names in _HOMES.items():
        if name in names:
            return getattr(importlib.import_module(f"{__name__}.{home}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
