from .blade_point import BladePoint as BladePoint
from .course_terms import LIBRARY as LIBRARY
from .curvature import edge_breaks as edge_breaks
from .curvature import edge_curvature as edge_curvature
from .curvature import level_curvature as level_curvature
from .curvature import response_breaks as response_breaks
from .curvature import response_curvature as response_curvature
from .cutting import Cutting as Cutting
from .cutting import cut_torque_along as cut_torque_along
from .cutting import damped as damped
from .cutting import mean_share as mean_share
from .cutting import settled_contact as settled_contact
from .cutting import torque_at as torque_at
from .cutting import within_thickness as within_thickness
from .edge import Edge as Edge
from .edge import EdgeDistribution as EdgeDistribution
from .edge import EdgeView as EdgeView
from .edge import draw_edges as draw_edges
from .edge import edge_height as edge_height
from .edge_points import edge_through as edge_through
from .friction import AxisLaw as AxisLaw
from .friction import FrictionLaw as FrictionLaw
from .friction import angle_factor as angle_factor
from .friction import friction_level as friction_level
from .friction import friction_torque as friction_torque
from .friction import presliding_state as presliding_state
from .friction_terms import CANDIDATES as CANDIDATES
from .friction_terms import TERMS as TERMS
from .friction_terms import law_names as law_names
from .friction_terms import terms_of as terms_of
from .own_law import ResponseLaw as ResponseLaw
from .own_law import fit_knots as fit_knots
from .own_law import law_parameters as law_parameters
from .own_law import refuse_falling as refuse_falling
from .own_law import response_of as response_of
from .own_law import spline_of as spline_of
from .plate_pieces import Layer as Layer
from .plate_pieces import Outline as Outline
from .plate_pieces import spans_on_line as spans_on_line
from .response import Response as Response
from .stated_numbers import as_pair as as_pair
from .stated_numbers import as_share as as_share
from .stated_numbers import draw_columns as draw_columns
from .stated_numbers import draw_share as draw_share
from .stated_numbers import log_normal as log_normal
from .surface.height_field import HeightField as HeightField
from .surface.protocol import Cylinder as Cylinder
from .surface.protocol import Plane as Plane
from .surface.protocol import Sphere as Sphere
from .surface.protocol import Surface as Surface
from .terms import IDENTITY as IDENTITY
from .terms import LOG as LOG
from .terms import LOGIT as LOGIT

__all__ = [
    "AxisLaw",
    "BladePoint",
    "Cutting",
    "Edge",
    "EdgeDistribution",
    "EdgeView",
    "FrictionLaw",
    "Response",
    "ResponseLaw",
    "cut_torque_along",
    "damped",
    "draw_edges",
    "edge_height",
    "friction_torque",
    "mean_share",
    "presliding_state",
    "settled_contact",
]
