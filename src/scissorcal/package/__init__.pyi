from .archive import MANIFEST_FILE as MANIFEST_FILE
from .archive import read_manifest as read_manifest
from .build import PackageOptions as PackageOptions
from .build import PackageSummary as PackageSummary
from .build import build_package as build_package
from .build import put_review as put_review
from .check import check_package as check_package
from .compile import TOLERANCE as TOLERANCE
from .compile import compile_model as compile_model
from .compile import table_file as table_file
from .exact import ExactModel as ExactModel
from .exact import FitDraws as FitDraws
from .exact import central_model as central_model
from .exact import pick_draws as pick_draws
from .image import image_of as image_of
from .keys import holds as holds
from .keys import read_public_keys as read_public_keys
from .keys import signer as signer
from .layer_slopes import LayerSlopes as LayerSlopes
from .layer_slopes import Tangent as Tangent
from .manifest import Manifest as Manifest
from .manifest import PoseRecord as PoseRecord
from .manifest import RigRecord as RigRecord
from .manifest import canonical as canonical
from .manifest import content_hash as content_hash
from .manifest import manifest_schema_text as manifest_schema_text
from .model_package import FailedFitsWarning as FailedFitsWarning
from .model_package import ModelPackage as ModelPackage
from .model_package import OutsideCoverageWarning as OutsideCoverageWarning
from .model_package import open_package as open_package
from .reach import scene_depth as scene_depth
from .records import STATED_SOURCE as STATED_SOURCE
from .review import REPORT_PAGE as REPORT_PAGE
from .review import REPORT_TWIN as REPORT_TWIN
from .review import REVIEW_FORMAT as REVIEW_FORMAT
from .review import Review as Review
from .review import stamp as stamp
from .review import stated_digest as stated_digest
from .scene_slopes import torque_knowledge as torque_knowledge
from .simplest.law import fitted_candidate as fitted_candidate
from .table_cost import cost_and_error as cost_and_error
from .table_cost import table_bytes as table_bytes
from .tables import hermite as hermite
from .variations import Variations as Variations
from .variations import central_values as central_values

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
    "image_of",
    "manifest_schema_text",
    "open_package",
    "put_review",
    "read_manifest",
    "stamp",
]
