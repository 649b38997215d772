from .camera.fit import fit_camera as fit_camera
from .camera.result import CameraFit as CameraFit
from .camera.result import CrossValidation as CrossValidation
from .camera.result import PixelMap as PixelMap
from .camera.result import ViewError as ViewError
from .caveats import NEXT_RECORDING as NEXT_RECORDING
from .caveats import ON_RECORD as ON_RECORD
from .checks import HOLD_OUT as HOLD_OUT
from .checks import K_HAT as K_HAT
from .cut.curves import EdgePlace as EdgePlace
from .cut.curves import force_along_edge as force_along_edge
from .cut.curves import fracture_work as fracture_work
from .cut.curves import response_curve as response_curve
from .cut.fit import cut_experiment as cut_experiment
from .cut.fit import fit_cut as fit_cut
from .cut.model import CutExperiment as CutExperiment
from .cut.structure import allowed_laws as allowed_laws
from .cut.structure import cutting_from as cutting_from
from .cut.unknowns import SceneMean as SceneMean
from .design.band import expected_band as expected_band
from .design.choice import CaptureList as CaptureList
from .design.choice import choose_captures as choose_captures
from .design.choice import first_captures as first_captures
from .design.state import expected_cut as expected_cut
from .design.state import expected_friction as expected_friction
from .edge.fit import Blade as Blade
from .edge.fit import fit_blade as fit_blade
from .edge.result import Band as Band
from .edge.result import BladeFit as BladeFit
from .edge.result import BladeResult as BladeResult
from .edge.result import EdgeCandidate as EdgeCandidate
from .edge.result import FoundNick as FoundNick
from .edge.result import PhotographRow as PhotographRow
from .edge.result import SeenPair as SeenPair
from .fit_model import CutRun as CutRun
from .fit_model import Experiment as Experiment
from .fit_model import FrictionRun as FrictionRun
from .fit_plots import FitPlots as FitPlots
from .fit_predict import TorqueBand as TorqueBand
from .fit_predict import predict_torque as predict_torque
from .fit_table import FitSummary as FitSummary
from .fit_table import SummaryRow as SummaryRow
from .fit_table import summary_of as summary_of
from .fit_views import check_effort as check_effort
from .friction.curve import FrictionCurve as FrictionCurve
from .friction.curve import friction_curve as friction_curve
from .friction.curve import friction_map as friction_map
from .friction.fit import fit_friction as fit_friction
from .friction.fit import friction_experiment as friction_experiment
from .friction.layout import at_typical as at_typical
from .friction.model import FrictionExperiment as FrictionExperiment
from .parameters import FittedParameter as FittedParameter
from .plate.checks import HALVES as HALVES
from .plate.checks import RESIDUALS as RESIDUALS
from .plate.fit import fit_plate as fit_plate
from .plate.fit import plate_target as plate_target
from .plate.result import PlateFit as PlateFit
from .plate.result import PoseHalves as PoseHalves
from .plate.result import PoseView as PoseView
from .plate.track_lines import TrackHead as TrackHead
from .plate.track_lines import TrackPose as TrackPose
from .plate.track_lines import TrackRow as TrackRow
from .plate.track_lines import read_track_lines as read_track_lines
from .result import FitResult as FitResult
from .result import FitSeries as FitSeries
from .result import Proposal as Proposal
from .result import ReplayComparison as ReplayComparison
from .result import ReplayRow as ReplayRow
from .result import StrokeError as StrokeError
from .signals.sensors import channels_of as channels_of
from .signals.soundness import steadiness as steadiness
from .signals.survey import survey as survey
from .store import load as load
from .store import load_fit as load_fit
from .store import read_header as read_header
from .store import save as save
from .verify.result import FORMAT as FORMAT
from .verify.result import Calibration as Calibration
from .verify.result import Coverage as Coverage
from .verify.result import Halves as Halves
from .verify.result import HalvesRow as HalvesRow
from .verify.result import RankBand as RankBand
from .verify.result import RankedQuantity as RankedQuantity
from .verify.result import Sensitivity as Sensitivity
from .verify.result import SensitivityRow as SensitivityRow
from .verify.result import VerifyResult as VerifyResult
from .verify.simulated_recordings import Sheet as Sheet
from .verify.simulated_recordings import Unevenness as Unevenness
from .verify.simulated_recordings import crack_law as crack_law
from .verify.simulated_recordings import material_torque as material_torque

__all__ = [
    "Blade",
    "BladeFit",
    "CameraFit",
    "CutExperiment",
    "CutRun",
    "Experiment",
    "FitPlots",
    "FitResult",
    "FitSeries",
    "FitSummary",
    "FittedParameter",
    "FrictionExperiment",
    "FrictionRun",
    "PlateFit",
    "StrokeError",
    "SummaryRow",
    "TorqueBand",
    "cut_experiment",
    "cutting_from",
    "fit_blade",
    "fit_camera",
    "fit_cut",
    "fit_friction",
    "fit_plate",
    "friction_experiment",
    "load",
    "load_fit",
    "plate_target",
    "read_header",
    "save",
]
