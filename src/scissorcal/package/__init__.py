"""From fits to a package that a 1 kHz loop can trust: tables with a bound, checked and hashed."""

from scissorcal.package.build import (
    PackageSummary,
    build_package,
    package_inputs_hash,
    put_review,
)
from scissorcal.package.check import REVIEW_CHECK, check_package
from scissorcal.package.manifest import Manifest, manifest_schema_text
from scissorcal.package.model_package import (
    ModelPackage,
    OutsideCoverageWarning,
    open_package,
)
from scissorcal.package.review import REVIEW_FORMAT, Review, stamp

__all__ = [
    "REVIEW_CHECK",
    "REVIEW_FORMAT",
    "Manifest",
    "ModelPackage",
    "OutsideCoverageWarning",
    "PackageSummary",
    "Review",
    "build_package",
    "check_package",
    "manifest_schema_text",
    "open_package",
    "package_inputs_hash",
    "put_review",
    "stamp",
]
